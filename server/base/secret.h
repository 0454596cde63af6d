/* Reads files that hold secrets, and refuses those that others may read. */
#ifndef GNPD_SECRET_H
#define GNPD_SECRET_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

/* Reads a regular file of at most limit bytes into *data (the caller's, for free), a NUL after the last. With private it must belong
 * to this user or root and its mode may let the group read, and nobody else read or write. what: the configuration's key, which
 * messages begin with. On failure outputs are unchanged. */
gnp_status gnpd_secret_read(const char *what, const char *path, bool private, size_t limit, char **data, size_t *size,
                            struct gnp_error *error);

#endif
