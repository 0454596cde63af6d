#include "core/cells/paths.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"

enum { POLL = 8192 };
static const uint32_t nowhere = UINT32_MAX;

/* Points by length, the nearest first: a binary heap that knows where each one is. */
struct queue {
	const double *length;
	uint32_t *heap, *place; /* (count) */
	size_t used;
};

static void put(struct queue *queue, size_t at, uint32_t point)
{
	queue->heap[at] = point;
	queue->place[point] = (uint32_t)at;
}

static void rise(struct queue *queue, uint32_t point)
{
	size_t at = queue->place[point];
	for (; at > 0 && queue->length[point] < queue->length[queue->heap[(at - 1) / 2]]; at = (at - 1) / 2)
		put(queue, at, queue->heap[(at - 1) / 2]);
	put(queue, at, point);
}

static uint32_t take_nearest(struct queue *queue)
{
	uint32_t nearest = queue->heap[0], moved = queue->heap[--queue->used];
	size_t at = 0;
	for (size_t child = 1; child < queue->used; child = 2 * at + 1) {
		if (child + 1 < queue->used && queue->length[queue->heap[child + 1]] < queue->length[queue->heap[child]])
			child++;
		if (!(queue->length[queue->heap[child]] < queue->length[moved]))
			break;
		put(queue, at, queue->heap[child]);
		at = child;
	}
	put(queue, at, moved);
	queue->place[nearest] = nowhere;
	return nearest;
}

static void offer(struct queue *queue, double *length, uint32_t point, double offered)
{
	if (!(offered < length[point]))
		return;
	if (isinf(length[point]))
		queue->place[point] = (uint32_t)queue->used++;
	length[point] = offered;
	rise(queue, point);
}

static double straight(const double *a, const double *b)
{
	double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	return sqrt(x * x + y * y + z * z);
}

gnp_status gnp_paths_find(const struct gnp_stiffness *graph, const double *points, const unsigned char *source, struct gnp_task *task,
                          double *length, struct gnp_error *error)
{
	size_t count = graph->count, taken = 0;
	struct queue queue = {length, gnp_array_new(count, 2 * sizeof *queue.heap), NULL, 0};
	gnp_status status = queue.heap ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "paths: no memory for %zu points", count);
	queue.place = queue.heap ? queue.heap + count : NULL;
	for (size_t i = 0; i < count; i++)
		length[i] = INFINITY;
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		if (source[i])
			offer(&queue, length, (uint32_t)i, 0);
	while (queue.used > 0 && status == GNP_OK) {
		uint32_t i = take_nearest(&queue);
		for (size_t e = graph->start[i]; e < graph->start[i + 1]; e++)
			offer(&queue, length, graph->column[e], length[i] + straight(points + 3 * (size_t)i, points + 3 * (size_t)graph->column[e]));
		if (++taken % POLL == 0)
			status = gnp_task_check(task, error);
	}
	free(queue.heap);
	return status;
}
