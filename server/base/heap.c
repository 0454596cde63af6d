#include "server/base/heap.h"

#include <malloc.h>

/* One arena, because the free pieces of many do not fit together. */
void gnpd_heap_keep(void)
{
	mallopt(M_ARENA_MAX, 1);
	mallopt(M_MMAP_THRESHOLD, 32 << 20);
	mallopt(M_TRIM_THRESHOLD, 256 << 20);
}

/* The threshold alone bounds only what is free at the end of the heap: below a piece in use any amount may stay. */
void gnpd_heap_rest(struct gnpd_heap *heap, uint64_t work, bool busy, double now)
{
	if (busy || work != heap->work) {
		*heap = (struct gnpd_heap){.work = work, .since = now};
		return;
	}
	if (heap->given_back || now - heap->since < GNPD_HEAP_REST)
		return;
	malloc_trim(0);
	heap->given_back = true;
}
