/* Inside of the analytic surfaces: what a family of shapes provides, and the tools families share.
 *
 * Every family maps parameters, three numbers a point, onto its surface: a direction for surfaces over the sphere, (u, v, 0)
 * for charts, a nearby point in space for implicit surfaces. A triangle mesh of the parameters covers the surface once;
 * it serves to draw candidates in proportion to area and is never part of the exact geometry. */
#ifndef GNP_CORE_SHAPE_FAMILY_H
#define GNP_CORE_SHAPE_FAMILY_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

/* Exact geometry at one point of a surface; signs and meaning as in struct gnp_sample. */
struct gnp_geometry {
	double point[3], normal[3];
	double second_form[9];
	double mean, gaussian;
	double principal[2];
};

struct gnp_shape_mesh {
	size_t triangles;
	double *corners; /* (triangles, 3, 3) parameters of each triangle's corners */
	double *area;    /* (triangles + 1) running sum of the areas, starting with 0 */
};

struct gnp_shape {
	const struct gnp_shape_family *family;
	struct gnp_shape_mesh mesh;
	void *data; /* the family's own: one block, freed by free() */
};

struct gnp_shape_family {
	const char *name;
	/* Fills data and mesh.corners. On failure whatever it has set is freed by gnp_shape_free. */
	gnp_status (*create)(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error);
	/* points (count, 3) on the surface for parameters (count, 3). */
	void (*place)(const struct gnp_shape *shape, size_t count, const double *parameters, double *points);
	/* The same points with their geometry. */
	void (*evaluate)(const struct gnp_shape *shape, size_t count, const double *parameters, struct gnp_geometry *out);
};

/* One array per file of families, ending with a NULL name. */
extern const struct gnp_shape_family gnp_shapes_parametric[], gnp_shapes_radial[], gnp_shapes_implicit[];

/* A block of data for the shape; NULL with the error set when memory is exhausted. */
void *gnp_shape_data_new(struct gnp_shape *shape, size_t size, struct gnp_error *error);

/* Geometry of x on a chart from its derivatives (5, 3): u, v, uu, uv, vv. The normal is along u x v. */
void gnp_geometry_from_chart(const double x[3], double derivative[5][3], struct gnp_geometry *out);

/* Geometry of x on a level set F = 0 from the gradient (outward) and the Hessian xx, xy, xz, yy, yz, zz of F. */
void gnp_geometry_from_level(const double x[3], const double gradient[3], const double hessian[6],
                             struct gnp_geometry *out);

/* Unit vectors t1, t2 that with the unit vector n make a right-handed frame (t1, t2, n). */
void gnp_geometry_tangents(const double n[3], double t1[3], double t2[3]);

/* Triangles of the unit sphere: an octahedron of 8 divisions^2, projected. */
gnp_status gnp_shape_mesh_sphere(struct gnp_shape *shape, size_t divisions, struct gnp_error *error);

/* Triangles of [low[0], high[0]] x [low[1], high[1]] cut into nu x nv rectangles. */
gnp_status gnp_shape_mesh_rectangle(struct gnp_shape *shape, const double low[2], const double high[2], size_t nu,
                                    size_t nv, struct gnp_error *error);

/* Fills mesh.area from the places of the corners. */
gnp_status gnp_shape_mesh_measure(struct gnp_shape *shape, struct gnp_error *error);

/* The parameters a fraction t in [0, 1) of the area into the mesh, at the barycentric draw (a, b) in [0, 1)^2. */
void gnp_shape_mesh_pick(const struct gnp_shape_mesh *mesh, double t, double a, double b, double parameters[3]);

#endif
