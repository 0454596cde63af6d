#include "core/cells/fans.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
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

/* ---- Shared triangles ---- */

struct sharing {
	const struct gnp_prepared *prepared;
	struct gnp_fans fans;  /* with gaps: made of each point's are there */
	uint32_t *made, *kept; /* (count) */
	unsigned char *stars;  /* for each triangle: how many of the three stars have it */
};

static void add_once(struct sharing *sharing, size_t i, uint32_t a, uint32_t b)
{
	size_t t = sharing->fans.start[i], end = t + sharing->made[i];
	for (; t < end; t++)
		if (sharing->fans.corner[t][0] == a && sharing->fans.corner[t][1] == b)
			break;
	sharing->made[i] += t == end;
	sharing->fans.corner[t][0] = a;
	sharing->fans.corner[t][1] = b;
	sharing->stars[t]++;
}

/* start (count + 1, zero): where each point's triangles begin, were no two the same. */
static void count_all(const struct gnp_fans *fans, size_t *start)
{
	for (size_t i = 0; i < fans->count; i++)
		for (size_t t = fans->start[i]; t < fans->start[i + 1]; t++) {
			start[i + 1]++;
			start[fans->corner[t][0] + 1]++;
			start[fans->corner[t][1] + 1]++;
		}
	for (size_t i = 0; i < fans->count; i++)
		start[i + 1] += start[i];
}

static void share_all(const struct gnp_fans *fans, struct sharing *sharing)
{
	for (uint32_t i = 0; i < fans->count; i++)
		for (size_t t = fans->start[i]; t < fans->start[i + 1]; t++) {
			uint32_t a = fans->corner[t][0], b = fans->corner[t][1];
			add_once(sharing, i, a, b);
			add_once(sharing, a, b, i);
			add_once(sharing, b, i, a);
		}
}

/* Faces away from a corner's normal by more than 60 degrees. */
static bool is_steep(const struct gnp_prepared *prepared, size_t i, const uint32_t other[2])
{
	static const double STEEP = 0.5; /* cosine */
	const size_t corner[3] = {i, other[0], other[1]};
	const double *o = prepared->points + 3 * i;
	double side[2][3], normal[3];
	for (size_t s = 0; s < 2; s++) {
		for (size_t c = 0; c < 3; c++)
			side[s][c] = prepared->points[3 * corner[s + 1] + c] - o[c];
		double length = sqrt(gnp_dot(side[s], side[s]));
		for (size_t c = 0; c < 3; c++)
			side[s][c] /= length; /* or fourth powers leave a double's range */
	}
	gnp_cross(side[0], side[1], normal);
	double least = STEEP * sqrt(gnp_dot(normal, normal));
	for (size_t k = 0; k < 3; k++)
		if (!(gnp_dot(prepared->normals + 3 * corner[k], normal) > least))
			return true;
	return false;
}

static bool is_of_all(const struct sharing *sharing, size_t i, size_t t)
{
	enum { ALL = 3 };
	return sharing->stars[t] >= ALL || !is_steep(sharing->prepared, i, sharing->fans.corner[t]);
}

/* Leaves out what is steep, and closes the gaps. */
static void keep_good(struct sharing *sharing)
{
	struct gnp_fans *fans = &sharing->fans;
	size_t all = 0;
	for (size_t i = 0; i < fans->count; i++)
		for (size_t t = fans->start[i]; t < fans->start[i] + sharing->made[i]; t++)
			sharing->kept[i] += is_of_all(sharing, i, t);
	for (size_t i = 0; i < fans->count; i++) {
		size_t begin = fans->start[i], end = begin + sharing->made[i];
		fans->start[i] = all;
		for (size_t t = begin; t < end; t++) {
			const uint32_t *other = fans->corner[t];
			bool needed = !sharing->kept[i] || !sharing->kept[other[0]] || !sharing->kept[other[1]];
			if (needed || is_of_all(sharing, i, t))
				memmove(fans->corner + all++, other, sizeof *fans->corner);
		}
	}
	fans->start[fans->count] = all;
	uint32_t(*smaller)[2] = realloc(fans->corner, (all ? all : 1) * sizeof *smaller);
	fans->corner = smaller ? smaller : fans->corner;
}

gnp_status gnp_fans_share(const struct gnp_fans *fans, const struct gnp_prepared *prepared, struct gnp_fans *out,
                          struct gnp_error *error)
{
	size_t count = fans->count, *start = gnp_array_zero(count + 1, sizeof *start);
	struct sharing sharing = {.prepared = prepared, .made = gnp_array_zero(count, 2 * sizeof *sharing.made)};
	if (start && sharing.made) {
		count_all(fans, start);
		sharing.kept = sharing.made + count;
		sharing.fans = (struct gnp_fans){count, start, gnp_array_new(start[count] + 1, sizeof *sharing.fans.corner)};
		sharing.stars = gnp_array_zero(start[count] + 1, 1);
	}
	bool made = sharing.fans.corner && sharing.stars;
	if (made) {
		share_all(fans, &sharing);
		keep_good(&sharing);
		*out = sharing.fans;
	} else {
		free(start);
		free(sharing.fans.corner);
	}
	free(sharing.made);
	free(sharing.stars);
	return made ? GNP_OK : gnp_no_memory("triangles", count, "points", error);
}

double gnp_fans_longest_edge(const struct gnp_fans *fans, const struct gnp_prepared *prepared)
{
	double longest = 0;
	for (size_t i = 0; i < fans->count; i++)
		for (size_t t = fans->start[i]; t < fans->start[i + 1]; t++)
			for (size_t k = 0; k < 2; k++) {
				const double *p = prepared->points + 3 * i, *q = prepared->points + 3 * (size_t)fans->corner[t][k];
				const double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
				longest = fmax(longest, gnp_dot(d, d));
			}
	return sqrt(longest);
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
