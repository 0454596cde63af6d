/* The bounded queue between the HTTP threads and the runners.
 *
 * A runner is a thread that coordinates one request at a time: it decodes, asks the pool to compute, and encodes. There
 * are more runners than a request needs, so a small request does not wait behind a large one.
 * The queue is bounded by the number of requests that wait and by the bytes all requests hold: bodies as they arrive
 * and the estimated memory of the work. */
#ifndef GNPD_QUEUE_H
#define GNPD_QUEUE_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

struct gnpd_queue;

/* Embedded in what is to run, which must live until run returns. Zero-initialise. */
struct gnpd_queued {
	struct gnpd_queued *previous, *next;
	bool waiting;
	void (*run)(struct gnpd_queued *job); /* called once: on a runner, or by whoever took it out with gnpd_queue_remove */
};

gnp_status gnpd_queue_create(size_t runners, size_t count_max, size_t bytes_max, struct gnpd_queue **out,
                             struct gnp_error *error);
/* Runs what waits, then joins the runners. NULL is allowed. */
void gnpd_queue_free(struct gnpd_queue *queue);

/* Every later submit fails with GNP_DRAINING; what waits still runs. */
void gnpd_queue_close(struct gnpd_queue *queue);

/* Queues a job. GNP_OVERLOADED naming the limit when as many as may wait do. */
gnp_status gnpd_queue_submit(struct gnpd_queue *queue, struct gnpd_queued *job, struct gnp_error *error);
/* What submit would say now. */
gnp_status gnpd_queue_check(struct gnpd_queue *queue, struct gnp_error *error);

/* Takes a job that still waits out of the queue, so that its place is free; its run is the caller's then. False when
 * it already runs or ran. */
bool gnpd_queue_remove(struct gnpd_queue *queue, struct gnpd_queued *job);

/* Counts bytes a request that holds `held` of them is about to hold more. GNP_TOO_LARGE when the request alone exceeds the
 * limit, GNP_OVERLOADED when it does together with the others. */
gnp_status gnpd_queue_reserve(struct gnpd_queue *queue, size_t held, size_t bytes, struct gnp_error *error);
void gnpd_queue_release(struct gnpd_queue *queue, size_t bytes);
/* Who is told of every release, by the thread that releases; NULL: nobody, and nobody is being told once this returns. What is called may
 * take locks within which the queue is not called. */
void gnpd_queue_tell(struct gnpd_queue *queue, void (*released)(void *context), void *context);

struct gnpd_queue_state {
	size_t waiting, running, bytes;
};
struct gnpd_queue_state gnpd_queue_state(struct gnpd_queue *queue);

#endif
