#include "core/cells/fans.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/star.h"

enum { POINTS_A_CHUNK = 512, MOST = 20 }; /* triangles of a point */

struct work {
	const struct gnp_prepared *prepared;
	uint32_t (*corner)[2]; /* (count, MOST) */
	unsigned char *made;   /* (count) */
};

static void take_triangles(void *context, size_t point, const struct gnp_star *star, const uint32_t *row, double farthest)
{
	const struct work *work = context;
	uint32_t(*corner)[2] = work->corner + point * MOST;
	(void)farthest;
	work->made[point] = (unsigned char)(star->triangles < MOST ? star->triangles : MOST);
	for (size_t t = 0; t < work->made[point]; t++)
		for (size_t c = 0; c < 2; c++)
			corner[t][c] = row[star->neighbor[star->corner[t][c]]];
}

static gnp_status fans_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	const struct work *work = context;
	return gnp_stars_visit(work->prepared, begin, end, take_triangles, context, scratch, error);
}

/* Closes the gaps between the points' triangles. */
static gnp_status close_up(struct work *work, struct gnp_fans *out, struct gnp_error *error)
{
	size_t count = work->prepared->count, made = 0;
	struct gnp_fans fans = {.count = count, .start = gnp_array_new(count + 1, sizeof *fans.start)};
	if (!fans.start)
		return gnp_no_memory("triangles", count, "points", error);
	for (size_t i = 0; i < count; i++) {
		fans.start[i] = made;
		memmove(work->corner + made, work->corner + i * MOST, work->made[i] * sizeof *work->corner);
		made += work->made[i];
	}
	fans.start[count] = made;
	uint32_t(*smaller)[2] = realloc(work->corner, (made ? made : 1) * sizeof *smaller);
	fans.corner = smaller ? smaller : work->corner;
	work->corner = NULL;
	*out = fans;
	return GNP_OK;
}

gnp_status gnp_fans_make(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                         struct gnp_fans *out, struct gnp_error *error)
{
	size_t count = prepared->count;
	struct work work = {prepared, gnp_array_new(count, MOST * sizeof *work.corner), gnp_array_new(count, 1)};
	gnp_status status = GNP_OK;
	if (!work.corner || !work.made)
		status = gnp_no_memory("triangles", count, "points", error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, count, POINTS_A_CHUNK, fans_chunk, &work, error);
	if (status == GNP_OK)
		status = close_up(&work, out, error);
	free(work.corner);
	free(work.made);
	return status;
}

void gnp_fans_clear(struct gnp_fans *fans)
{
	free(fans->start);
	free(fans->corner);
	*fans = (struct gnp_fans){.count = 0};
}

size_t gnp_fans_bytes(const struct gnp_fans *fans)
{
	return fans->start ? (fans->count + 1) * sizeof *fans->start + fans->start[fans->count] * sizeof *fans->corner : 0;
}
