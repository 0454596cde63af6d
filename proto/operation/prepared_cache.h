/* Keeps prepared operators from one request to the next: what is costly to make and the same for many right-hand
 * sides.
 *
 * An object is known by a digest of everything it is made of. The cache holds at most so many bytes and lets go of the
 * least recently used; what is in use stays alive until its user is done. Of requests for one object at the same time
 * one makes it, the others wait. Safe from many threads. */
#ifndef GNP_PROTO_PREPARED_CACHE_H
#define GNP_PROTO_PREPARED_CACHE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/sha256.h"
#include "core/base/status.h"
#include "core/base/task.h"

struct gnp_prepared_cache; /* opaque */
struct gnp_prepared_entry; /* opaque: a hold on an object */

/* bytes: most to keep; 0: nothing is kept, but requests at the same time still share. On failure *out is unchanged. */
gnp_status gnp_prepared_cache_create(size_t bytes, struct gnp_prepared_cache **out, struct gnp_error *error);
void gnp_prepared_cache_free(struct gnp_prepared_cache *cache); /* no entry is held any more; NULL is allowed */

/* How an object is made and unmade. */
struct gnp_prepared_kind {
	/* On failure *object is unchanged. bytes: what it holds. */
	gnp_status (*make)(void *context, struct gnp_task *task, void **object, size_t *bytes, struct gnp_error *error);
	void (*destroy)(void *object);
};

/* A hold on the object of that key, made by kind->make(context) unless it is there; *found: it was, or another
 * request made it. cache may be NULL: it is made for this hold alone. The task gets the warnings that the making
 * left. A task that is cancelled stops waiting within 50 ms. On failure *out is unchanged. */
gnp_status gnp_prepared_get(struct gnp_prepared_cache *cache, const char key[GNP_SHA256_TEXT],
                            const struct gnp_prepared_kind *kind,
                            void *context, struct gnp_task *task, struct gnp_prepared_entry **out, bool *found,
                            	struct gnp_error *error);
void *gnp_prepared_object(const struct gnp_prepared_entry *entry);
void gnp_prepared_release(struct gnp_prepared_entry *entry); /* NULL is allowed */

struct gnp_prepared_cache_state {
	size_t entries, bytes, limit;    /* kept now */
	uint64_t hits, misses, evictions;
};
struct gnp_prepared_cache_state gnp_prepared_cache_state(struct gnp_prepared_cache *cache);

#endif
