/* Decides who may do what, and how much: holds the keys in use, and for each name how many requests are under way, its
 * token bucket and counters.
 *
 * Keys are swapped as a whole: requests finish as who they began as; a name that stays keeps its counts and bucket,
 * under its new limits. A file that is no good changes nothing. All functions may be called from any thread and wait
 * for nobody. */
#ifndef GNPD_GUARD_H
#define GNPD_GUARD_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"
#include "server/access/keys.h"
#include "server/access/scope.h"

struct gnpd_guard;
struct gnpd_principal; /* the owner of a name */

/* path: of the file of keys; "": everybody may do everything. On failure nothing is left. */
gnp_status gnpd_guard_create(const char *path, struct gnpd_guard **out, struct gnp_error *error);
/* NULL is allowed. */
void gnpd_guard_free(struct gnpd_guard *guard);

/* There is a file of keys. */
bool gnpd_guard_on(const struct gnpd_guard *guard);
/* Reads the file again. On failure the keys in use stay. */
gnp_status gnpd_guard_reload(struct gnpd_guard *guard, struct gnp_error *error);
/* Names in use. */
size_t gnpd_guard_count(struct gnpd_guard *guard);

/* The principal whose key a request brings, a reference for gnpd_principal_release, and the scopes the key has (bits as in struct
 * gnpd_key). GNP_UNAUTHORIZED when there is none; *out is unchanged then. */
gnp_status gnpd_guard_identify(struct gnpd_guard *guard, const struct gnpd_credentials *credentials, struct gnpd_principal **out,
                               unsigned *scopes, struct gnp_error *error);

enum gnpd_limit { GNPD_LIMIT_NONE, GNPD_LIMIT_CONCURRENCY, GNPD_LIMIT_RATE };

/* Counts a request that begins. GNP_LIMITED naming the limit and the values: *limit says which, *retry_after in how many seconds to
 * try again (0: not known). gnpd_principal_leave ends a request that was let in. */
gnp_status gnpd_principal_enter(struct gnpd_principal *principal, double now, enum gnpd_limit *limit, double *retry_after,
                                struct gnp_error *error);
void gnpd_principal_leave(struct gnpd_principal *principal);

const char *gnpd_principal_name(const struct gnpd_principal *principal);
/* Counts a finished request: its HTTP status and, when it was computed, its points. */
void gnpd_principal_count(struct gnpd_principal *principal, int code, size_t points);
void gnpd_principal_release(struct gnpd_principal *principal);

/* Appends the metrics of the names in use. */
gnp_status gnpd_guard_write(struct gnpd_guard *guard, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
