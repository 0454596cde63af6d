/* A queue of points by a number, the least first: a binary heap that knows where each point is (Williams 1964). */
#ifndef GNP_CORE_QUEUE_H
#define GNP_CORE_QUEUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

/* Freed by gnp_queue_clear. */
struct gnp_queue {
	double *key;            /* (count) borrowed: the least that was offered, INFINITY at first */
	uint32_t *heap, *place; /* (count) */
	size_t used;
};

/* An empty queue over key (count), which becomes INFINITY. GNP_OUT_OF_MEMORY, which names what it is for. */
gnp_status gnp_queue_init(struct gnp_queue *queue, double *key, size_t count, const char *what,
                          struct gnp_error *error);
void gnp_queue_clear(struct gnp_queue *queue);

/* Lowers the point's key to `offered` where that is less, and queues the point; whether it was. */
bool gnp_queue_offer(struct gnp_queue *queue, uint32_t point, double offered);
uint32_t gnp_queue_take(struct gnp_queue *queue); /* the point of the least key, no more in the queue; there is one */

#endif
