/* Per-worker scratch memory: a bump allocator that keeps its blocks between chunks, so that nothing is
 * allocated per point. Not thread-safe: each worker owns one. */
#ifndef GNP_CORE_SCRATCH_H
#define GNP_CORE_SCRATCH_H

#include <stddef.h>

struct gnp_scratch;

struct gnp_scratch *gnp_scratch_create(void); /* NULL when memory is exhausted */
void gnp_scratch_free(struct gnp_scratch *scratch);

/* count items of size bytes, 64-byte aligned, uninitialised; valid until the mark below it is released.
 * NULL when memory is exhausted or the product overflows. */
void *gnp_scratch_take(struct gnp_scratch *scratch, size_t count, size_t size);

/* Everything taken after a mark is given back by releasing it. The pool resets before every chunk. */
struct gnp_scratch_mark {
	size_t block, used;
};
struct gnp_scratch_mark gnp_scratch_mark(const struct gnp_scratch *scratch);
void gnp_scratch_release(struct gnp_scratch *scratch, struct gnp_scratch_mark mark);

#endif
