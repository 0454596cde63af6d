/* Covers a surface with triangles of its parameters, from which candidates for samples are drawn (shape_family.h). */
#include "core/shapes/shape_family.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

static gnp_status mesh_reserve(struct gnp_shape *shape, size_t triangles, struct gnp_error *error)
{
	shape->mesh.corners = gnp_array_new(triangles, 9 * sizeof(double));
	return shape->mesh.corners ? GNP_OK : gnp_no_memory(shape->family->name, triangles, "triangles", error);
}

/* Corner (i, j) of the octahedron's face in octant `face`, pushed onto the sphere. */
static void octant_corner(size_t face, size_t divisions, size_t i, size_t j, double out[3])
{
	double p[3] = {(double)i, (double)j, (double)(divisions - i - j)};
	double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
	for (int c = 0; c < 3; c++)
		out[c] = (face >> c & 1 ? -p[c] : p[c]) / length;
}

gnp_status gnp_shape_mesh_sphere(struct gnp_shape *shape, size_t divisions, struct gnp_error *error)
{
	gnp_status status = mesh_reserve(shape, 8 * divisions * divisions, error);
	if (status != GNP_OK)
		return status;
	double *at = shape->mesh.corners;
	for (size_t face = 0; face < 8; face++) {
		for (size_t i = 0; i < divisions; i++) {
			for (size_t j = 0; i + j < divisions; j++) {
				octant_corner(face, divisions, i, j, at);
				octant_corner(face, divisions, i + 1, j, at + 3);
				octant_corner(face, divisions, i, j + 1, at + 6);
				at += 9;
				if (i + j + 2 > divisions)
					continue;
				octant_corner(face, divisions, i + 1, j + 1, at);
				octant_corner(face, divisions, i, j + 1, at + 3);
				octant_corner(face, divisions, i + 1, j, at + 6);
				at += 9;
			}
		}
	}
	shape->mesh.triangles = (size_t)(at - shape->mesh.corners) / 9;
	return GNP_OK;
}

gnp_status gnp_shape_mesh_rectangle(struct gnp_shape *shape, const double low[2], const double high[2], size_t nu,
                                    size_t nv, struct gnp_error *error)
{
	/* offsets of the corners of a rectangle's two triangles */
	static const unsigned char corner[6][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0, 1}, {1, 0}};
	gnp_status status = mesh_reserve(shape, 2 * nu * nv, error);
	if (status != GNP_OK)
		return status;
	double *at = shape->mesh.corners;
	for (size_t i = 0; i < nu; i++) {
		for (size_t j = 0; j < nv; j++) {
			for (int c = 0; c < 6; c++) {
				*at++ = low[0] + (high[0] - low[0]) * (double)(i + corner[c][0]) / (double)nu;
				*at++ = low[1] + (high[1] - low[1]) * (double)(j + corner[c][1]) / (double)nv;
				*at++ = 0;
			}
		}
	}
	shape->mesh.triangles = 2 * nu * nv;
	return GNP_OK;
}

static double triangle_area(const double p[9])
{
	double a[3], b[3];
	for (int c = 0; c < 3; c++) {
		a[c] = p[3 + c] - p[c];
		b[c] = p[6 + c] - p[c];
	}
	double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
	return sqrt(x * x + y * y + z * z) / 2;
}

gnp_status gnp_shape_mesh_measure(struct gnp_shape *shape, struct gnp_error *error)
{
	enum { BATCH = 64 }; /* triangles */
	struct gnp_shape_mesh *mesh = &shape->mesh;
	mesh->area = gnp_array_new(mesh->triangles + 1, sizeof *mesh->area);
	if (!mesh->area)
		return gnp_no_memory(shape->family->name, mesh->triangles, "triangles", error);
	mesh->area[0] = 0;
	for (size_t begin = 0; begin < mesh->triangles; begin += BATCH) {
		double points[BATCH * 9];
		size_t count = mesh->triangles - begin < BATCH ? mesh->triangles - begin : BATCH;
		shape->family->place(shape, 3 * count, mesh->corners + 9 * begin, points);
		for (size_t i = 0; i < count; i++)
			mesh->area[begin + i + 1] = mesh->area[begin + i] + triangle_area(points + 9 * i);
	}
	return GNP_OK;
}

void gnp_shape_mesh_pick(const struct gnp_shape_mesh *mesh, double t, double a, double b, double parameters[3])
{
	double target = t * mesh->area[mesh->triangles];
	size_t low = 0, high = mesh->triangles;
	while (high - low > 1) {
		size_t middle = low + (high - low) / 2;
		if (mesh->area[middle] <= target)
			low = middle;
		else
			high = middle;
	}
	const double *corner = mesh->corners + 9 * low;
	double root = sqrt(a);
	for (int c = 0; c < 3; c++)
		parameters[c] = (1 - root) * corner[c] + root * ((1 - b) * corner[3 + c] + b * corner[6 + c]);
}
