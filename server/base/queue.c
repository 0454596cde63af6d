#include "server/base/queue.h"

#include <pthread.h>
#include <stdlib.h>

struct gnpd_queue {
	pthread_mutex_t lock;
	pthread_cond_t work;
	struct gnpd_queued *first, *last;
	size_t waiting, running, bytes;
	size_t count_max, bytes_max;
	bool closed, stopping;
	void (*released)(void *context);
	void *context;
	size_t runners;
	pthread_t threads[];
};

/* Lock held. */
static void unlink_job(struct gnpd_queue *queue, struct gnpd_queued *job)
{
	if (job->previous)
		job->previous->next = job->next;
	else
		queue->first = job->next;
	if (job->next)
		job->next->previous = job->previous;
	else
		queue->last = job->previous;
	job->previous = job->next = NULL;
	job->waiting = false;
	queue->waiting--;
}

static void *runner_main(void *argument)
{
	struct gnpd_queue *queue = argument;
	pthread_mutex_lock(&queue->lock);
	for (;;) {
		while (!queue->first && !queue->stopping)
			pthread_cond_wait(&queue->work, &queue->lock);
		if (!queue->first)
			break;
		struct gnpd_queued *job = queue->first;
		unlink_job(queue, job);
		queue->running++;
		pthread_mutex_unlock(&queue->lock);
		job->run(job);
		pthread_mutex_lock(&queue->lock);
		queue->running--;
	}
	pthread_mutex_unlock(&queue->lock);
	return NULL;
}

gnp_status gnpd_queue_create(size_t runners, size_t count_max, size_t bytes_max, struct gnpd_queue **out,
                             struct gnp_error *error)
{
	struct gnpd_queue *queue = calloc(1, sizeof *queue + runners * sizeof queue->threads[0]);
	if (!queue)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "queue: no memory for %zu runners", runners);
	pthread_mutex_init(&queue->lock, NULL);
	pthread_cond_init(&queue->work, NULL);
	queue->count_max = count_max;
	queue->bytes_max = bytes_max;
	for (; queue->runners < runners; queue->runners++) {
		if (pthread_create(&queue->threads[queue->runners], NULL, runner_main, queue) == 0)
			continue;
		gnp_error_set(error, GNP_OUT_OF_MEMORY, "queue: cannot start runner %zu of %zu", queue->runners + 1, runners);
		gnpd_queue_free(queue);
		return GNP_OUT_OF_MEMORY;
	}
	*out = queue;
	return GNP_OK;
}

void gnpd_queue_free(struct gnpd_queue *queue)
{
	if (!queue)
		return;
	pthread_mutex_lock(&queue->lock);
	queue->stopping = true;
	pthread_cond_broadcast(&queue->work);
	pthread_mutex_unlock(&queue->lock);
	for (size_t i = 0; i < queue->runners; i++)
		pthread_join(queue->threads[i], NULL);
	pthread_cond_destroy(&queue->work);
	pthread_mutex_destroy(&queue->lock);
	free(queue);
}

void gnpd_queue_close(struct gnpd_queue *queue)
{
	pthread_mutex_lock(&queue->lock);
	queue->closed = true;
	pthread_mutex_unlock(&queue->lock);
}

/* Lock held. */
static gnp_status check_room(const struct gnpd_queue *queue, struct gnp_error *error)
{
	if (queue->closed)
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	if (queue->waiting < queue->count_max)
		return GNP_OK;
	return gnp_error_set(error, GNP_OVERLOADED, "queue: %zu requests wait, at most %zu may (queue-count)",
	                     queue->waiting, queue->count_max);
}

gnp_status gnpd_queue_check(struct gnpd_queue *queue, struct gnp_error *error)
{
	pthread_mutex_lock(&queue->lock);
	gnp_status status = check_room(queue, error);
	pthread_mutex_unlock(&queue->lock);
	return status;
}

gnp_status gnpd_queue_submit(struct gnpd_queue *queue, struct gnpd_queued *job, struct gnp_error *error)
{
	pthread_mutex_lock(&queue->lock);
	gnp_status status = check_room(queue, error);
	if (status == GNP_OK) {
		job->previous = queue->last;
		job->next = NULL;
		job->waiting = true;
		if (queue->last)
			queue->last->next = job;
		else
			queue->first = job;
		queue->last = job;
		queue->waiting++;
		pthread_cond_signal(&queue->work);
	}
	pthread_mutex_unlock(&queue->lock);
	return status;
}

bool gnpd_queue_remove(struct gnpd_queue *queue, struct gnpd_queued *job)
{
	pthread_mutex_lock(&queue->lock);
	bool waiting = job->waiting;
	if (waiting)
		unlink_job(queue, job);
	pthread_mutex_unlock(&queue->lock);
	return waiting;
}

gnp_status gnpd_queue_reserve(struct gnpd_queue *queue, size_t held, size_t bytes, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	pthread_mutex_lock(&queue->lock);
	if (bytes > queue->bytes_max - held)
		status = gnp_error_set(error, GNP_TOO_LARGE,
		                       "memory: the request holds %zu bytes and needs %zu more, need at most %zu in all (queue-bytes)", held,
		                       bytes, queue->bytes_max);
	else if (bytes > queue->bytes_max - queue->bytes)
		status = gnp_error_set(error, GNP_OVERLOADED,
		                       "queue: requests hold %zu bytes and %zu more are needed, at most %zu may be held (queue-bytes)",
		                       queue->bytes, bytes, queue->bytes_max);
	else
		queue->bytes += bytes;
	pthread_mutex_unlock(&queue->lock);
	return status;
}

void gnpd_queue_release(struct gnpd_queue *queue, size_t bytes)
{
	pthread_mutex_lock(&queue->lock);
	queue->bytes -= bytes;
	if (queue->released)
		queue->released(queue->context);
	pthread_mutex_unlock(&queue->lock);
}

void gnpd_queue_tell(struct gnpd_queue *queue, void (*released)(void *context), void *context)
{
	pthread_mutex_lock(&queue->lock);
	queue->released = released;
	queue->context = context;
	pthread_mutex_unlock(&queue->lock);
}

struct gnpd_queue_state gnpd_queue_state(struct gnpd_queue *queue)
{
	pthread_mutex_lock(&queue->lock);
	struct gnpd_queue_state state = {queue->waiting, queue->running, queue->bytes};
	pthread_mutex_unlock(&queue->lock);
	return state;
}
