/* Compact surfaces of higher genus: the double of a disc with holes,
 * F = z^2/h^2 + (x^2/a^2 + y^2/b^2)^3 + sum_i w^2 / |(x, y) - c_i|^2 - 1 = 0.
 * The cube rounds the rim, the poles at c_i open the holes, and |grad F| stays within 3.8 and 11 on the surface. */
#include "core/shapes/shape_family.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

struct handles {
	double height, rim[2], hole;
	int holes;
	double center[3][2];
};

static double level(const struct handles *s, const double x[3])
{
	double e = x[0] * x[0] / (s->rim[0] * s->rim[0]) + x[1] * x[1] / (s->rim[1] * s->rim[1]);
	double f = x[2] * x[2] / (s->height * s->height) + e * e * e - 1;
	for (int i = 0; i < s->holes; i++) {
		double dx = x[0] - s->center[i][0], dy = x[1] - s->center[i][1];
		f += s->hole * s->hole / fmax(dx * dx + dy * dy, 1e-12); /* finite on the axes, far outside the surface */
	}
	return f;
}

static void level_jet(const struct handles *s, const double x[3], double gradient[3], double hessian[6])
{
	double a = 1 / (s->rim[0] * s->rim[0]), b = 1 / (s->rim[1] * s->rim[1]), c = 1 / (s->height * s->height);
	double e = a * x[0] * x[0] + b * x[1] * x[1], ex = 2 * a * x[0], ey = 2 * b * x[1];
	gradient[0] = 3 * e * e * ex;
	gradient[1] = 3 * e * e * ey;
	gradient[2] = 2 * c * x[2];
	memset(hessian, 0, 6 * sizeof *hessian);
	hessian[0] = 6 * e * (e * a + ex * ex);
	hessian[1] = 6 * e * ex * ey;
	hessian[3] = 6 * e * (e * b + ey * ey);
	hessian[5] = 2 * c;
	for (int i = 0; i < s->holes; i++) {
		double dx = x[0] - s->center[i][0], dy = x[1] - s->center[i][1], d2 = dx * dx + dy * dy;
		double k = 2 * s->hole * s->hole / (d2 * d2);
		gradient[0] -= k * dx;
		gradient[1] -= k * dy;
		hessian[0] += k * (4 * dx * dx / d2 - 1);
		hessian[1] += k * 4 * dx * dy / d2;
		hessian[3] += k * (4 * dy * dy / d2 - 1);
	}
}

/* Newton along the gradient; from the mesh, at most a few hundredths off, it converges in three or four steps. */
static void project(const struct handles *s, double x[3])
{
	enum { STEPS = 8 };
	for (int step = 0; step < STEPS; step++) {
		double gradient[3], hessian[6], f = level(s, x);
		if (fabs(f) < 1e-15)
			return;
		level_jet(s, x, gradient, hessian);
		double move = f / (gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2]);
		for (int c = 0; c < 3; c++)
			x[c] -= move * gradient[c];
	}
}

static void implicit_place(const struct gnp_shape *shape, size_t count, const double *parameters, double *points)
{
	memmove(points, parameters, 3 * count * sizeof *points);
	for (size_t i = 0; i < count; i++)
		project(shape->data, points + 3 * i);
}

static void implicit_evaluate(const struct gnp_shape *shape, size_t count, const double *parameters,
                              struct gnp_geometry *out)
{
	for (size_t i = 0; i < count; i++) {
		double x[3], gradient[3], hessian[6];
		implicit_place(shape, 1, parameters + 3 * i, x);
		level_jet(shape->data, x, gradient, hessian);
		gnp_geometry_from_level(x, gradient, hessian, out + i);
	}
}

/* ---- Mesh: marching tetrahedra over a grid of cubes, six tetrahedra around each cube's diagonal ---- */

/* A corner of the grid and the level there. */
struct node {
	double x[3], f;
};

/* Triangles as they come: room for capacity of them. */
struct soup {
	double *corners;
	size_t triangles, capacity;
};

static gnp_status soup_reserve(struct soup *soup, size_t more, struct gnp_error *error)
{
	if (soup->capacity - soup->triangles >= more)
		return GNP_OK;
	size_t capacity = 2 * soup->capacity + more, bytes;
	double *corners = gnp_size_multiply(capacity, 9 * sizeof *corners, &bytes) ? realloc(soup->corners, bytes) : NULL;
	if (!corners)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "shape: no memory for a mesh of %zu triangles", capacity);
	soup->corners = corners;
	soup->capacity = capacity;
	return GNP_OK;
}

/* Where the level vanishes between a node inside and one outside. */
static void edge_cut(const struct node *a, const struct node *b, double out[3])
{
	double t = a->f / (a->f - b->f);
	for (int c = 0; c < 3; c++)
		out[c] = a->x[c] + t * (b->x[c] - a->x[c]);
}

static void soup_add(struct soup *soup, double cut[4][3], int i, int j, int k)
{
	double *at = soup->corners + 9 * soup->triangles++;
	memcpy(at, cut[i], sizeof cut[i]);
	memcpy(at + 3, cut[j], sizeof cut[j]);
	memcpy(at + 6, cut[k], sizeof cut[k]);
}

/* One corner alone on its side gives a triangle, two and two a quadrangle. Room for two triangles is there. */
static void tetrahedron_cut(struct soup *soup, const struct node *const corner[4])
{
	const struct node *inside[4], *outside[4];
	int in = 0, out = 0;
	for (int i = 0; i < 4; i++)
		if (corner[i]->f < 0)
			inside[in++] = corner[i];
		else
			outside[out++] = corner[i];
	if (in == 0 || out == 0)
		return;
	double cut[4][3];
	int cuts = 0;
	for (int i = 0; i < in; i++)
		for (int j = 0; j < out; j++)
			edge_cut(inside[i], outside[j], cut[cuts++]);
	soup_add(soup, cut, 0, 1, 2);
	if (cuts == 4)
		soup_add(soup, cut, 1, 2, 3);
}

/* The cube's eight corners, bit c of the index along axis c. */
static void cube_cut(struct soup *soup, const struct node cube[8])
{
	static const unsigned char path[6][2] = {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}};
	for (int t = 0; t < 6; t++)
		tetrahedron_cut(soup, (const struct node *const[]){&cube[0], &cube[path[t][0]], &cube[path[t][1]], &cube[7]});
}

static gnp_status implicit_mesh(struct gnp_shape *shape, const double reach[3], double step, struct gnp_error *error)
{
	struct soup soup = {NULL, 0, 0};
	int cells[3];
	for (int c = 0; c < 3; c++)
		cells[c] = (int)ceil(2 * reach[c] / step);
	for (int n = 0; n < cells[0] * cells[1] * cells[2]; n++) {
		int cell[3] = {n % cells[0], n / cells[0] % cells[1], n / cells[0] / cells[1]};
		struct node cube[8];
		for (int i = 0; i < 8; i++) {
			for (int c = 0; c < 3; c++)
				cube[i].x[c] = -reach[c] + step * (cell[c] + (i >> c & 1));
			cube[i].f = level(shape->data, cube[i].x);
		}
		gnp_status status = soup_reserve(&soup, 12, error);
		if (status != GNP_OK) {
			free(soup.corners);
			return status;
		}
		cube_cut(&soup, cube);
	}
	shape->mesh.corners = soup.corners;
	shape->mesh.triangles = soup.triangles;
	return GNP_OK;
}

static gnp_status handles_create(struct gnp_shape *shape, const struct handles *handles, struct gnp_error *error)
{
	static const double STEP = 1.0 / 32;
	struct handles *own = gnp_shape_data_new(shape, sizeof *own, error);
	if (!own)
		return GNP_OUT_OF_MEMORY;
	*own = *handles;
	double reach[3] = {handles->rim[0] + STEP, handles->rim[1] + STEP, handles->height + STEP};
	return implicit_mesh(shape, reach, STEP, error);
}

static gnp_status genus2_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	return handles_create(shape, &(struct handles){0.3, {1, 0.65}, 0.18, 2, {{-0.47, 0}, {0.47, 0}}}, error);
}

static gnp_status genus3_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	struct handles handles = {.height = 0.3, .rim = {1, 1}, .hole = 0.18, .holes = 3};
	for (int i = 0; i < 3; i++) {
		double angle = M_PI / 2 + 2 * M_PI / 3 * i;
		handles.center[i][0] = 0.5 * cos(angle);
		handles.center[i][1] = 0.5 * sin(angle);
	}
	return handles_create(shape, &handles, error);
}

const struct gnp_shape_family gnp_shapes_implicit[] = {
	{"genus2", genus2_create, implicit_place, implicit_evaluate},
	{"genus3", genus3_create, implicit_place, implicit_evaluate},
	{NULL, NULL, NULL, NULL},
};
