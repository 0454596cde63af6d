/* The scopes of keys: what a caller must be allowed to do. */
#ifndef GNPD_SCOPE_H
#define GNPD_SCOPE_H

/* NONE: anybody may. The others by the names in a file of keys. */
enum gnpd_scope { GNPD_SCOPE_NONE, GNPD_SCOPE_INFER, GNPD_SCOPE_JOBS, GNPD_SCOPE_ADMIN, GNPD_SCOPES };

#endif
