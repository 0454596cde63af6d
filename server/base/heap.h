/* Keeps freed memory while there is work, and gives it back to the system after it. */
#ifndef GNPD_HEAP_H
#define GNPD_HEAP_H

#include <stdbool.h>
#include <stdint.h>

struct gnpd_heap {
	uint64_t work;   /* as last told */
	double since;    /* when it was last another */
	bool given_back;
};

/* Freed memory stays with the process: a request takes and frees tens of megabytes, and what goes back to the kernel comes again a
 * zeroed page at a time, which costs more than the encoding. To be called before anything is allocated by other threads. */
void gnpd_heap_keep(void);

/* To be called every second or so. work: a number that grows with the work done; now: gnp_clock(). Once it has not grown for
 * GNPD_HEAP_REST seconds, and busy is false, freed memory goes back to the system, once. */
enum { GNPD_HEAP_REST = 5 };
void gnpd_heap_rest(struct gnpd_heap *heap, uint64_t work, bool busy, double now);

#endif
