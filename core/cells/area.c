#include "core/cells/area.h"

#include <math.h>
#include <stdatomic.h>

#include "core/base/vector.h"
#include "core/cells/star.h"

enum { POINTS_A_CHUNK = 512 };

struct work {
	const struct gnp_prepared *prepared;
	double *area;
	atomic_size_t open;
};

/* By how much the normal turns on the way e, squared. */
static double turned(const double n[3], const double m[3], const double e[3])
{
	double turn = 0, square = 0;
	for (int c = 0; c < 3; c++) {
		turn += (m[c] - n[c]) * e[c];
		square += e[c] * e[c];
	}
	return square > 0 ? turn * turn / square : 0;
}

/* What the surface over a triangle has more than it, over its area. The surface is longer than an edge on whose way the
 * normal turns by t, by t^2 / 24, and curved within: the normals' own triangle is K times as large. */
static double bulge(const struct gnp_prepared *prepared, const size_t corner[3])
{
	static const double SHARP = 0.36; /* turns, squared, beyond which there is a crease */
	const double *p[3], *n[3];
	double edge[3][3], square[3], across[3], spread[3], u[3], v[3], more = 0;
	for (int c = 0; c < 3; c++) {
		p[c] = prepared->points + 3 * corner[c];
		n[c] = prepared->normals + 3 * corner[c];
	}
	for (int c = 0; c < 3; c++) {
		for (int x = 0; x < 3; x++)
			edge[c][x] = p[(c + 2) % 3][x] - p[(c + 1) % 3][x]; /* across from corner c */
		square[c] = gnp_dot(edge[c], edge[c]);
		u[c] = n[1][c] - n[0][c];
		v[c] = n[2][c] - n[0][c];
	}
	gnp_cross(edge[2], edge[0], across);
	gnp_cross(u, v, spread);
	double twice = sqrt(gnp_dot(across, across));
	for (int c = 0; c < 3; c++) {
		double turn = turned(n[(c + 1) % 3], n[(c + 2) % 3], edge[c]);
		if (turn > SHARP || !(twice > 1e-6 * square[c]))
			return 0;
		more += -gnp_dot(edge[(c + 1) % 3], edge[(c + 2) % 3]) / twice * square[c] * turn / (24 * twice);
	}
	double curvature = gnp_dot(across, spread) / (twice * twice);
	return more + curvature * (square[0] + square[1] + square[2]) / 24;
}

/* The mean of a star's triangles. */
static double bulge_of(const struct gnp_prepared *prepared, size_t point, const struct gnp_star *star,
                       const uint32_t *row)
{
	double sum = 0;
	for (size_t t = 0; t < star->triangles; t++) {
		const uint8_t *edge = star->corner[t];
		const size_t corner[3] = {point, row[star->neighbor[edge[0]]], row[star->neighbor[edge[1]]]};
		sum += bulge(prepared, corner);
	}
	return star->triangles ? sum / (double)star->triangles : 0;
}

static void measure(void *context, size_t point, const struct gnp_star *star, const uint32_t *row, double farthest)
{
	struct work *work = context;
	double area = star->area * (1 + bulge_of(work->prepared, point, star, row));
	work->area[point] = area > 0 ? area : fmax(farthest * farthest, 1e-300);
	if (star->open)
		atomic_fetch_add_explicit(&work->open, 1, memory_order_relaxed);
}

static gnp_status measure_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	const struct work *work = context;
	return gnp_stars_visit(work->prepared, begin, end, measure, context, scratch, error);
}

gnp_status gnp_area_measure(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task, double *area, size_t *open,
                            struct gnp_error *error)
{
	struct work work = {.prepared = prepared, .area = area};
	gnp_status status = gnp_pool_run(pool, task, prepared->count, POINTS_A_CHUNK, measure_chunk, &work, error);
	if (status == GNP_OK && open)
		*open = work.open;
	return status;
}
