#include "core/cells/star.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/polygon.h"
#include "core/cloud/patch.h"
#include "core/search/neighborhoods.h"

/* Neighbours of one sheet, and not at the centre. */
struct fan {
	size_t count;
	double x[GNP_STAR_NEIGHBORS], y[GNP_STAR_NEIGHBORS];
	double away[GNP_STAR_NEIGHBORS][3]; /* from the centre */
	uint32_t position[GNP_STAR_NEIGHBORS];
	double lift[GNP_STAR_NEIGHBORS]; /* in [0, 1), of the point alone: breaks ties */
	double nearest, farthest;
};

/* As good as random (Steele, Lea & Flood 2014), and the same from wherever the point is seen. */
static double lift_of(uint32_t point)
{
	uint64_t z = point + UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
	return (double)(z >> 40) / (1 << 24);
}

static void unroll(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                   double steep, struct fan *fan)
{
	static const double COINCIDENT = 1e-9, UPRIGHT = 1e-3; /* of the way to the farthest; of the distance */
	const double *o = points + 3 * centre, *n = normals + 3 * centre;
	const double *last = points + 3 * (size_t)index[count - 1];
	const double to[3] = {last[0] - o[0], last[1] - o[1], last[2] - o[2]};
	double tangents[2][3], least = COINCIDENT * sqrt(gnp_dot(to, to));
	gnp_tangents_of(n, tangents);
	fan->count = 0;
	fan->nearest = fan->farthest = 0;
	for (size_t j = 0; j < count && fan->count < GNP_STAR_NEIGHBORS; j++) {
		const double *p = points + 3 * (size_t)index[j], d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		double x = gnp_dot(d, tangents[0]), y = gnp_dot(d, tangents[1]), flat = hypot(x, y), far = sqrt(gnp_dot(d, d));
		if (index[j] == centre || !gnp_same_sheet(n, normals + 3 * (size_t)index[j]) || !(flat > UPRIGHT * far) ||
		    far <= least || fabs(gnp_dot(d, n)) > steep * flat)
			continue;
		size_t k = fan->count++;
		fan->x[k] = x * far / flat;
		fan->y[k] = y * far / flat;
		memcpy(fan->away[k], d, sizeof d);
		fan->position[k] = (uint32_t)j;
		fan->lift[k] = lift_of(index[j]);
		fan->nearest = k ? fan->nearest : far;
		fan->farthest = fmax(fan->farthest, far);
	}
}

static void cut_all(const struct fan *fan, double own, struct gnp_polygon *polygon)
{
	static const double TIE = 1e-7; /* of squared distances */
	double scale = TIE * fan->nearest * fan->nearest;
	size_t corner;
	gnp_polygon_square(fan->farthest / 2, polygon);
	double reach = gnp_polygon_reach(polygon, &corner);
	for (size_t j = 0; j < fan->count && polygon->count; j++) {
		double square = fan->x[j] * fan->x[j] + fan->y[j] * fan->y[j];
		if (square > 4.1 * reach)
			continue;
		gnp_polygon_cut(polygon, fan->x[j], fan->y[j], (square + scale * (own - fan->lift[j])) / 2, (uint32_t)j);
		reach = gnp_polygon_reach(polygon, &corner);
	}
}

/* Cotangent of the angle at p between the ways to the centre and to q. */
static double cotangent(const double p[3], const double q[3], double cross)
{
	const double to_q[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
	return -gnp_dot(p, to_q) / cross;
}

/* The edge to fan member k: where it is, or a new one. */
static size_t edge_of(const struct fan *fan, size_t k, struct gnp_star *out)
{
	for (size_t e = 0; e < out->edges; e++)
		if (out->neighbor[e] == fan->position[k])
			return e;
	out->neighbor[out->edges] = fan->position[k];
	out->weight[out->edges] = 0;
	return out->edges++;
}

/* Of the triangle's area, that which is nearest to the centre; half or a quarter of it where an angle is obtuse. */
static double share_of(const double a[3], const double b[3], double at_a, double at_b, double cross)
{
	if (gnp_dot(a, b) < 0)
		return cross / 4;
	if (at_a < 0 || at_b < 0)
		return cross / 8;
	return (gnp_dot(a, a) * at_b + gnp_dot(b, b) * at_a) / 8;
}

static void add_triangle(const struct fan *fan, size_t k, size_t l, struct gnp_star *out)
{
	static const double SLIVER = 1e-6;
	const double *a = fan->away[k], *b = fan->away[l];
	double normal[3];
	gnp_cross(a, b, normal);
	double cross = sqrt(gnp_dot(normal, normal)), least = SLIVER * sqrt(gnp_dot(a, a) * gnp_dot(b, b));
	cross = fmax(cross, least);
	size_t to_a = edge_of(fan, k, out), to_b = edge_of(fan, l, out);
	out->corner[out->triangles][0] = (uint8_t)to_a;
	out->corner[out->triangles++][1] = (uint8_t)to_b;
	double at_a = cotangent(a, b, cross), at_b = cotangent(b, a, cross);
	out->weight[to_a] += at_b / 2;
	out->weight[to_b] += at_a / 2;
	out->area += share_of(a, b, at_a, at_b, cross);
}

static bool is_corner(const double before[3], const double after[3])
{
	static const double STRAIGHT = -0.5; /* cosine */
	return gnp_dot(before, after) > STRAIGHT * sqrt(gnp_dot(before, before) * gnp_dot(after, after));
}

/* Half of the way along the rim between the neighbours there: straight past the point, which is off the rim by as much
 * as that is ragged, but at corners by way of it. */
static double rim_of(const double before[3], const double after[3])
{
	const double d[3] = {after[0] - before[0], after[1] - before[1], after[2] - before[2]};
	if (is_corner(before, after))
		return (sqrt(gnp_dot(before, before)) + sqrt(gnp_dot(after, after))) / 2;
	return sqrt(gnp_dot(d, d)) / 2;
}

/* The strip between the outermost points and the rim, if they lie within it at random: then the rim is ragged, and
 * as far away as it is ragged, 1.75 times the distance of a point from the line through its two neighbours along it
 * (measured on random points). Points on the rim itself lie in line. At corners there is no saying. */
static double strip_of(const double before[3], const double after[3])
{
	static const double AWAY = 1.75;
	const double d[3] = {after[0] - before[0], after[1] - before[1], after[2] - before[2]};
	double a = sqrt(gnp_dot(before, before)), b = sqrt(gnp_dot(after, after)), across[3];
	if (is_corner(before, after))
		return 0;
	gnp_cross(before, d, across);
	return AWAY * sqrt(gnp_dot(across, across) / gnp_dot(d, d)) * (a + b) / 2;
}

/* The only gap of an open star lies between two members. */
static void add_rim(const struct fan *fan, const struct gnp_polygon *polygon, struct gnp_star *out)
{
	const double *before = NULL, *after = NULL;
	size_t gaps = 0;
	for (size_t i = 0; i < polygon->count; i++) {
		uint32_t k = polygon->cutter[i], l = polygon->cutter[i + 1 < polygon->count ? i + 1 : 0];
		if (k != GNP_POLYGON_OUTER && l == GNP_POLYGON_OUTER) {
			before = fan->away[k];
			gaps++;
		}
		if (k == GNP_POLYGON_OUTER && l != GNP_POLYGON_OUTER)
			after = fan->away[l];
	}
	if (gaps != 1 || before == after)
		return;
	out->area += strip_of(before, after);
	out->rim = rim_of(before, after);
}

/* steep: neighbours higher over the tangent plane, by the distance within it, are none. */
static void make(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                 double steep, struct gnp_star *out)
{
	struct fan fan;
	struct gnp_polygon polygon;
	*out = (struct gnp_star){.open = true};
	if (count == 0)
		return;
	unroll(points, normals, centre, index, count, steep, &fan);
	if (fan.count == 0)
		return;
	cut_all(&fan, lift_of((uint32_t)centre), &polygon);
	out->open = polygon.count == 0;
	for (size_t i = 0; i < polygon.count; i++) {
		size_t next = i + 1 < polygon.count ? i + 1 : 0;
		uint32_t k = polygon.cutter[i], l = polygon.cutter[next];
		if (k == GNP_POLYGON_OUTER || l == GNP_POLYGON_OUTER)
			out->open = true;
		else if (k != l)
			add_triangle(&fan, k, l, out);
	}
	add_rim(&fan, &polygon, out);
	if (!(out->area > 0)) /* as much as a point that far from six others has */
		out->area = sqrt(3) / 2 * fan.nearest * fan.nearest;
}

/* Where a star stays open there is nobody between its point and another sheet that faces the same way: what is steep is
 * not of this one, unless everything is, as at a tip. */
void gnp_star_make(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                   struct gnp_star *out)
{
	static const double STEEP = 0.4;
	struct gnp_star flat;
	make(points, normals, centre, index, count, INFINITY, out);
	if (!out->open)
		return;
	make(points, normals, centre, index, count, STEEP, &flat);
	if (flat.triangles > 0)
		*out = flat;
}

/* Whether the nearest are of one row: they lie along the way to the farthest of them. A few, as the next row is
 * farther. */
static bool is_in_a_row(const struct gnp_prepared *prepared, size_t centre, const uint32_t *index, size_t count)
{
	enum { NEAREST = 16 };
	static const double ACROSS = 0.05; /* of squares; a quarter along a rim */
	count = count < NEAREST ? count : NEAREST;
	const double *o = prepared->points + 3 * centre, *far = prepared->points + 3 * (size_t)index[count - 1];
	const double along[3] = {far[0] - o[0], far[1] - o[1], far[2] - o[2]};
	double length = gnp_dot(along, along), all = 0, within = 0;
	for (size_t j = 0; j < count; j++) {
		const double *p = prepared->points + 3 * (size_t)index[j], d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		double part = gnp_dot(d, along);
		all += gnp_dot(d, d);
		within += length > 0 ? part * part / length : 0;
	}
	return all - within < ACROSS * all;
}

/* Of the row of the nearest; *row: what out's positions are in, that or a longer one in scratch. */
static gnp_status find(const struct gnp_prepared *prepared, size_t centre, const uint32_t *index, size_t count,
                       struct gnp_scratch *scratch, const uint32_t **row, struct gnp_star *out, struct gnp_error *error)
{
	uint32_t self = (uint32_t)centre;
	struct gnp_neighborhoods found;
	size_t wide = GNP_STAR_NEIGHBORS + 1 < prepared->count ? GNP_STAR_NEIGHBORS + 1 : prepared->count;
	*row = index;
	const double *normals = prepared->unfitted ? prepared->unfitted : prepared->normals;
	gnp_star_make(prepared->points, normals, centre, index, count, out);
	if (!out->open || wide <= count || !is_in_a_row(prepared, centre, index, count))
		return GNP_OK;
	gnp_status status = gnp_neighborhoods_find(prepared->neighbors, &self, 1, wide, 1, wide, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	*row = found.index;
	gnp_star_make(prepared->points, normals, centre, found.index, found.start[1], out);
	return GNP_OK;
}

gnp_status gnp_stars_visit(const struct gnp_prepared *prepared, size_t begin, size_t end, gnp_star_visit visit,
                           void *context, struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t ring = GNP_CELL_NEIGHBORS + 1 < prepared->count ? GNP_CELL_NEIGHBORS + 1 : prepared->count;
	uint32_t *centres = gnp_scratch_take(scratch, end - begin, sizeof *centres);
	struct gnp_neighborhoods found;
	if (!centres)
		return gnp_no_memory("stars", end - begin, "points", error);
	for (size_t i = begin; i < end; i++)
		centres[i - begin] = (uint32_t)i;
	gnp_status status = gnp_neighborhoods_find(prepared->neighbors, centres, end - begin, ring, 1, ring, scratch, &found,
	                                           error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		size_t at = found.start[i - begin], count = found.start[i - begin + 1] - at;
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		struct gnp_star star;
		const uint32_t *row;
		status = find(prepared, i, found.index + at, count, scratch, &row, &star, error);
		if (status == GNP_OK)
			visit(context, i, &star, row, found.distance[at + count - 1]);
		gnp_scratch_release(scratch, mark);
	}
	return status;
}
