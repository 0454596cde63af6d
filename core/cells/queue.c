#include "core/cells/queue.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"

static const uint32_t nowhere = UINT32_MAX;

gnp_status gnp_queue_init(struct gnp_queue *queue, double *key, size_t count, const char *what,
                          struct gnp_error *error)
{
	*queue = (struct gnp_queue){.key = key, .heap = gnp_array_new(count, 2 * sizeof *queue->heap)};
	if (!queue->heap)
		return gnp_no_memory(what, count, "points", error);
	queue->place = queue->heap + count;
	for (size_t i = 0; i < count; i++) {
		queue->place[i] = nowhere;
		key[i] = INFINITY;
	}
	return GNP_OK;
}

void gnp_queue_clear(struct gnp_queue *queue)
{
	free(queue->heap);
	*queue = (struct gnp_queue){.key = NULL};
}

static void put(struct gnp_queue *queue, size_t at, uint32_t point)
{
	queue->heap[at] = point;
	queue->place[point] = (uint32_t)at;
}

bool gnp_queue_offer(struct gnp_queue *queue, uint32_t point, double offered)
{
	if (!(offered < queue->key[point]))
		return false;
	queue->key[point] = offered;
	size_t at = queue->place[point] == nowhere ? queue->used++ : queue->place[point];
	for (; at > 0 && offered < queue->key[queue->heap[(at - 1) / 2]]; at = (at - 1) / 2)
		put(queue, at, queue->heap[(at - 1) / 2]);
	put(queue, at, point);
	return true;
}

uint32_t gnp_queue_take(struct gnp_queue *queue)
{
	uint32_t nearest = queue->heap[0], moved = queue->heap[--queue->used];
	size_t at = 0;
	queue->place[nearest] = nowhere;
	for (size_t child = 1; child < queue->used; child = 2 * at + 1) {
		if (child + 1 < queue->used && queue->key[queue->heap[child + 1]] < queue->key[queue->heap[child]])
			child++;
		if (!(queue->key[queue->heap[child]] < queue->key[moved]))
			break;
		put(queue, at, queue->heap[child]);
		at = child;
	}
	if (queue->used > 0)
		put(queue, at, moved);
	return nearest;
}
