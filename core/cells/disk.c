#include "core/cells/disk.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/cells/cell.h"
#include "core/cells/polygon.h"
#include "core/search/neighborhoods.h"

enum { PROBES = 512, PROBES_A_CHUNK = 32 };

/* The point's cell in the plane, corners of which are centres of empty disks. */
static void cut(const double *points, size_t centre, const double normal[3], const struct gnp_disk_row *row,
                struct gnp_polygon *polygon)
{
	static const double UPRIGHT = 1e-6, COINCIDENT = 1e-18; /* squares: of the distance, of the way to the farthest */
	const double *o = points + 3 * centre, least = COINCIDENT * row->farthest * row->farthest;
	double tangents[2][3];
	size_t corner;
	gnp_tangents_of(normal, tangents);
	gnp_polygon_square(row->farthest, polygon);
	double reach = gnp_polygon_reach(polygon, &corner);
	for (size_t j = 0; j < row->count && polygon->count; j++) {
		const double *p = points + 3 * (size_t)row->index[j], d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		double x = gnp_dot(d, tangents[0]), y = gnp_dot(d, tangents[1]), flat = x * x + y * y, square = gnp_dot(d, d);
		if (!(flat > UPRIGHT * square) || square <= least || flat > 4 * reach)
			continue;
		gnp_polygon_cut(polygon, x, y, flat / 2, row->index[j]);
		reach = gnp_polygon_reach(polygon, &corner);
	}
}

/* From a corner on while corners are farther away than `wide`, a step of 1 or count - 1 at a time. */
static size_t roll(const struct gnp_polygon *polygon, size_t corner, size_t step, double wide)
{
	for (size_t i = 1; i < polygon->count; i++) {
		size_t next = (corner + step) % polygon->count;
		if (hypot(polygon->x[next], polygon->y[next]) <= wide)
			break;
		corner = next;
	}
	return corner;
}

void gnp_disk_find(const double *points, size_t centre, const double normal[3], const struct gnp_disk_row *row,
                   double wide, struct gnp_disk *out)
{
	struct gnp_polygon polygon;
	size_t corner = 0;
	*out = (struct gnp_disk){0, {GNP_DISK_NOBODY, GNP_DISK_NOBODY}, {GNP_DISK_NOBODY, GNP_DISK_NOBODY}};
	cut(points, centre, normal, row, &polygon);
	if (!polygon.count)
		return;
	size_t back = polygon.count - 1;
	out->radius = sqrt(gnp_polygon_reach(&polygon, &corner));
	out->across[0] = polygon.cutter[(corner + back) % polygon.count];
	out->across[1] = polygon.cutter[corner];
	out->along[0] = polygon.cutter[(roll(&polygon, corner, back, wide) + back) % polygon.count];
	out->along[1] = polygon.cutter[roll(&polygon, corner, 1, wide)];
}

/* ---- What is usual ---- */

struct probes {
	const struct gnp_prepared *prepared;
	size_t stride, last; /* position of the last neighbour */
	double *radius;
};

static gnp_status probe_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	const struct probes *probes = context;
	const struct gnp_prepared *prepared = probes->prepared;
	uint32_t centre[PROBES_A_CHUNK] = {0};
	struct gnp_neighborhoods found;
	for (size_t p = begin; p < end; p++)
		centre[p - begin] = (uint32_t)(p * probes->stride);
	gnp_status status = gnp_neighborhoods_find(prepared->neighbors, centre, end - begin, probes->last + 1, 1,
	                                           probes->last + 1, scratch, &found, error);
	for (size_t p = begin; p < end && status == GNP_OK; p++) {
		size_t at = found.start[p - begin];
		const struct gnp_disk_row row = {probes->last + 1, found.index + at, found.distance[at + probes->last]};
		const double *normal = prepared->normals + 3 * (size_t)centre[p - begin];
		struct gnp_disk disk;
		gnp_disk_find(prepared->points, centre[p - begin], normal, &row, 0, &disk);
		probes->radius[p] = row.farthest > 0 ? disk.radius / row.farthest : 0;
	}
	return status;
}

/* So many times the difference between the median and the upper quartile, which rims do not reach, over the median;
 * wider than any of a lattice, and no wider than what points at random have. */
static double usual_of(double *radius, size_t count, double most)
{
	static const double SPREAD = 6, LEAST = 1.6;
	double upper = gnp_select(radius, count, 3 * count / 4), middle = gnp_select(radius, count, count / 2);
	return fmin(fmax(middle + SPREAD * (upper - middle), LEAST * middle), most);
}

gnp_status gnp_disk_usual(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                          double *usual, struct gnp_error *error)
{
	static const double MOST = 0.45;
	size_t count = prepared->count, last = GNP_DISK_NEIGHBORS < count - 1 ? GNP_DISK_NEIGHBORS : count - 1;
	struct probes probes = {.prepared = prepared, .stride = count / PROBES + 1, .last = last};
	size_t number = (count + probes.stride - 1) / probes.stride;
	probes.radius = gnp_array_new(number, sizeof *probes.radius);
	if (!probes.radius)
		return gnp_no_memory("boundary", number, "probes", error);
	gnp_status status = gnp_pool_run(pool, task, number, PROBES_A_CHUNK, probe_chunk, &probes, error);
	if (status == GNP_OK)
		*usual = usual_of(probes.radius, number, last ? MOST * sqrt(GNP_DISK_NEIGHBORS / (double)last) : MOST);
	free(probes.radius);
	return status;
}

/* ---- A quick look ---- */

/* The distance within which the plane has so many points as are looked for, squared: of a disk's points the mean square
 * of the distance from their centre is half its radius'. */
static double reach_of(const double *x, const double *y, size_t count, double u, double v)
{
	double sum[2] = {0}, square = 0, m = (double)count;
	for (size_t i = 0; i < count; i++) {
		sum[0] += x[i] - u;
		sum[1] += y[i] - v;
		square += (x[i] - u) * (x[i] - u) + (y[i] - v) * (y[i] - v);
	}
	return 2 * (square / m - (sum[0] * sum[0] + sum[1] * sum[1]) / (m * m)) * GNP_DISK_NEIGHBORS / m;
}

/* A disk whose centre lies in direction e is free of a point at d when its diameter is less than d^2 / (d . e). */
bool gnp_disk_may_exceed(const double *x, const double *y, size_t count, double u, double v, double usual)
{
	enum { WAYS = 24 };
	static const double SLACK = 0.75, NEAR = 1e-12;
	static const double along[WAYS] = {1, 0.966, 0.866, 0.707, 0.5, 0.259, 0, -0.259, -0.5, -0.707, -0.866, -0.966,
	                                   -1, -0.966, -0.866, -0.707, -0.5, -0.259, 0, 0.259, 0.5, 0.707, 0.866, 0.966};
	static const double across[WAYS] = {0, 0.259, 0.5, 0.707, 0.866, 0.966, 1, 0.966, 0.866, 0.707, 0.5, 0.259,
	                                 0, -0.259, -0.5, -0.707, -0.866, -0.966, -1, -0.966, -0.866, -0.707, -0.5, -0.259};
	double inverse[WAYS] = {0}, reach = reach_of(x, y, count, u, v), least = INFINITY;
	double wide = 4 * SLACK * SLACK * usual * usual * reach; /* squared diameter: what is farther away is not in it */
	for (size_t i = 0; i < count; i++) {
		double dx = x[i] - u, dy = y[i] - v, square = dx * dx + dy * dy;
		if (square <= NEAR * reach || square > wide)
			continue;
		dx /= square;
		dy /= square;
		for (int w = 0; w < WAYS; w++) {
			double one = dx * along[w] + dy * across[w];
			inverse[w] = inverse[w] > one ? inverse[w] : one;
		}
	}
	for (int w = 0; w < WAYS; w++)
		least = fmin(least, inverse[w]);
	return !(least * least * wide > 1);
}
