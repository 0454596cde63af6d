#include "core/cells/cell.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"
#include "core/cells/polygon.h"
#include "core/cloud/patch.h"

void gnp_tangents_of(const double n[3], double tangents[2][3])
{
	/* the axis least along n keeps the cross product long */
	int axis = fabs(n[0]) <= fabs(n[1]) && fabs(n[0]) <= fabs(n[2]) ? 0 : fabs(n[1]) <= fabs(n[2]) ? 1 : 2;
	double unit[3] = {axis == 0, axis == 1, axis == 2};
	gnp_cross(unit, n, tangents[0]);
	double length = sqrt(gnp_dot(tangents[0], tangents[0]));
	for (int c = 0; c < 3; c++)
		tangents[0][c] /= length;
	gnp_cross(n, tangents[0], tangents[1]);
}

/* Neighbours in the plane of the cell: of one sheet and not at the centre, or so near that the edge over the distance to them would
 * drown all else in a stiffness. */
struct plane {
	size_t count;
	double x[GNP_CELL_NEIGHBORS], y[GNP_CELL_NEIGHBORS];
	uint32_t position[GNP_CELL_NEIGHBORS];
	double nearest, farthest; /* in-plane distance of the nearest few on average, of the last */
};

static void project(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                    double tangents[2][3], struct plane *plane)
{
	enum { FEW = 6 };
	static const double coincident = 1e-9; /* of the way to the farthest */
	const double *o = points + 3 * centre, *normal = normals + 3 * centre;
	const double *far = points + 3 * (size_t)(count ? index[count - 1] : centre), f[3] = {far[0] - o[0], far[1] - o[1], far[2] - o[2]};
	double least = coincident * sqrt(gnp_dot(f, f));
	plane->count = 0;
	plane->nearest = plane->farthest = 0;
	for (size_t j = 0; j < count && plane->count < GNP_CELL_NEIGHBORS; j++) {
		const double *p = points + 3 * (size_t)index[j];
		double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]}, x = gnp_dot(d, tangents[0]), y = gnp_dot(d, tangents[1]);
		double r = sqrt(x * x + y * y), own = sqrt(gnp_dot(d, d));
		if (index[j] == centre || !gnp_same_sheet(normal, normals + 3 * (size_t)index[j]) || !(r > 1e-3 * own) || own <= least)
			continue;
		plane->x[plane->count] = x;
		plane->y[plane->count] = y;
		plane->position[plane->count++] = (uint32_t)j;
		if (plane->count <= FEW)
			plane->nearest += r;
		plane->farthest = fmax(plane->farthest, r);
	}
	plane->nearest /= plane->count < FEW ? fmax((double)plane->count, 1) : FEW;
}

/* Cuts a square by the bisectors of all neighbours that can still reach it. */
static void cut_all(const struct plane *plane, double half, struct gnp_polygon *polygon)
{
	size_t farthest = 0;
	gnp_polygon_square(half, polygon);
	double reach = gnp_polygon_reach(polygon, &farthest);
	for (size_t j = 0; j < plane->count && polygon->count; j++) {
		double x = plane->x[j], y = plane->y[j], r = x * x + y * y;
		if (r > 4 * reach)
			continue;
		gnp_polygon_cut(polygon, x, y, r / 2, plane->position[j]);
		reach = gnp_polygon_reach(polygon, &farthest);
	}
}

static bool touches_outer(const struct gnp_polygon *polygon)
{
	for (size_t i = 0; i < polygon->count; i++)
		if (polygon->cutter[i] == GNP_POLYGON_OUTER)
			return true;
	return false;
}

/* Area and centroid by the sum over the triangles at the origin. */
static void measure(const struct gnp_polygon *polygon, struct gnp_cell *cell)
{
	double area = 0, x = 0, y = 0;
	for (size_t i = 0; i < polygon->count; i++) {
		size_t next = i + 1 < polygon->count ? i + 1 : 0;
		double cross = (polygon->x[i] * polygon->y[next] - polygon->x[next] * polygon->y[i]) / 2;
		area += cross;
		x += cross * (polygon->x[i] + polygon->x[next]) / 3;
		y += cross * (polygon->y[i] + polygon->y[next]) / 3;
	}
	cell->area = area;
	cell->centroid[0] = area > 0 ? x / area : 0;
	cell->centroid[1] = area > 0 ? y / area : 0;
}

static void take_edges(const struct gnp_polygon *polygon, const struct plane *plane, struct gnp_cell *cell)
{
	cell->edges = 0;
	for (size_t i = 0; i < polygon->count; i++) {
		size_t next = i + 1 < polygon->count ? i + 1 : 0, j = 0;
		if (polygon->cutter[i] == GNP_POLYGON_OUTER)
			continue;
		while (plane->position[j] != polygon->cutter[i])
			j++;
		double length = hypot(polygon->x[next] - polygon->x[i], polygon->y[next] - polygon->y[i]);
		if (!(length > 0))
			continue;
		cell->neighbor[cell->edges] = polygon->cutter[i];
		cell->weight[cell->edges++] = length / hypot(plane->x[j], plane->y[j]);
	}
}

/* Whether points lie on all sides of a place, the cell's own point among them: no gap of half a turn or nearly so between directions
 * to those within half as far again as the nearest. */
static bool surrounded(const struct plane *plane, double x, double y)
{
	enum { SECTORS = 24, GAP = 9 };
	double far = 1.5 * 1.5 * (x * x + y * y);
	bool seen[SECTORS] = {false};
	for (size_t j = 0; j <= plane->count; j++) {
		double dx = (j < plane->count ? plane->x[j] : 0) - x, dy = (j < plane->count ? plane->y[j] : 0) - y;
		if (dx * dx + dy * dy <= far)
			seen[(int)((atan2(dy, dx) / (2 * acos(-1)) + 0.5) * (SECTORS - 1e-9))] = true;
	}
	int run = 0;
	for (int s = 0; s < 2 * SECTORS; s++) {
		run = seen[s % SECTORS] ? 0 : run + 1;
		if (run >= GAP)
			return false;
	}
	return true;
}

void gnp_cell_make(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                   double tangents[2][3], struct gnp_cell *out)
{
	struct plane plane;
	struct gnp_polygon polygon;
	size_t farthest = 0;
	gnp_tangents_of(normals + 3 * centre, tangents);
	project(points, normals, centre, index, count, tangents, &plane);
	/* A corner within half the distance of the last neighbour is nobody else's; beyond it, points not looked at might cut. */
	cut_all(&plane, plane.farthest / 2, &polygon);
	*out = (struct gnp_cell){.open = plane.count == 0 || touches_outer(&polygon)};
	if (plane.count == 0)
		return;
	out->gap = sqrt(gnp_polygon_reach(&polygon, &farthest));
	if (polygon.count) {
		out->corner[0] = polygon.x[farthest];
		out->corner[1] = polygon.y[farthest];
	}
	out->hole = !out->open && out->gap > plane.nearest && surrounded(&plane, out->corner[0], out->corner[1]);
	if (out->open)
		cut_all(&plane, plane.nearest / 2, &polygon);
	measure(&polygon, out);
	take_edges(&polygon, &plane, out);
}

double gnp_cell_share(const struct gnp_cell *cell, double last)
{
	return cell->area > 0 ? cell->area : fmax(last * last, 1e-300);
}
