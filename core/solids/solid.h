/* Clouds of piecewise smooth bodies with exact geometry: what an estimator meets at creases, rims, thin sheets,
 * tubes and tips.
 *
 * A body is drawn from its kind's family by the seed, its proportions in terms of the spacing of the points wanted
 * (a fillet of three spacings, a gap of two), so that what is rare on real surfaces is frequent here: a good share
 * of the points is within six spacings of a crease, a rim, another sheet or a tip. The diagonal of its bounding box
 * is 1 to 2; then it is turned at random. Signs are those of shapes.h. */
#ifndef GNP_CORE_SOLID_H
#define GNP_CORE_SOLID_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

/* box: any proportions, also thin ones. prism: over a convex polygon, dihedral angles of 30 to 170 degrees. csg:
 * unions, differences and intersections of two to five boxes, cylinders, spheres, cones and tori. rounded: boxes and
 * cylinders with fillets of radius 0 to many spacings. fold: an open sheet of strips that meet in sharp or rounded
 * bends to both sides. plate: two sheets 1 to 10 spacings apart, flat or bent, with or without their narrow sides.
 * nested: concentric spheres or cylinders at gaps of 1 to 10 spacings. patch: an open piece of plane, paraboloid,
 * saddle or cylinder, maybe with round holes. tube: cylinders and rings of radius 1.5 to 10 spacings, with open,
 * flat or round ends. cone: sharp and rounded tips. wave: a height field of a few sines with radii of curvature from
 * 2 spacings up. rough: one of 20 to 64 sines, as scanned detail is, with wavelengths from 2.5 spacings to the whole
 * patch and a root mean square slope of 0.05 to 0.9; in a third of them some are ridges sqrt(sin^2 + e^2), e of 0.02
 * to 0.5: smooth however sharp, they count as no creases. facets: such a field as triangles of sides of 0.7 to 6
 * spacings, as a scanned mesh is; they are one piece, and the edges between them count as no creases. Their normals
 * are the triangles', their second form is that of planes, 0: it is not meant as that of the surface that the
 * triangles stand for, and no truth for curvature. */
#define GNP_SOLID_KINDS(X)             \
	X(GNP_SOLID_BOX, "box")             \
	X(GNP_SOLID_PRISM, "prism")         \
	X(GNP_SOLID_CSG, "csg")             \
	X(GNP_SOLID_ROUNDED, "rounded")     \
	X(GNP_SOLID_FOLD, "fold")           \
	X(GNP_SOLID_PLATE, "plate")         \
	X(GNP_SOLID_NESTED, "nested")       \
	X(GNP_SOLID_PATCH, "patch")         \
	X(GNP_SOLID_TUBE, "tube")           \
	X(GNP_SOLID_CONE, "cone")           \
	X(GNP_SOLID_WAVE, "wave")           \
	X(GNP_SOLID_ROUGH, "rough")         \
	X(GNP_SOLID_FACETS, "facets")

/* even: blue noise. random: independent, uniform by area. lines: parallel scan rows, 2 to 10 times as far from each
 * other as points in a row (by seed). gradient: density falls along a direction, down to a fourth to a twentieth.
 * stripes: between stripes the density is a tenth to a third. Those but even and lines are of independent points. */
#define GNP_SOLID_SAMPLINGS(X)           \
	X(GNP_SOLID_EVEN, "even")             \
	X(GNP_SOLID_RANDOM, "random")         \
	X(GNP_SOLID_LINES, "lines")           \
	X(GNP_SOLID_GRADIENT, "gradient")     \
	X(GNP_SOLID_STRIPES, "stripes")

#define GNP_SOLID_ENUM(id, name) id,
enum gnp_solid_kind { GNP_SOLID_KINDS(GNP_SOLID_ENUM) GNP_SOLID_KIND_COUNT };
enum gnp_solid_sampling { GNP_SOLID_SAMPLINGS(GNP_SOLID_ENUM) GNP_SOLID_SAMPLING_COUNT };
#undef GNP_SOLID_ENUM

/* NULL past the last. */
const char *gnp_solid_kind_name(int kind);
const char *gnp_solid_sampling_name(int sampling);

struct gnp_solid_options {
	uint64_t seed; /* of the body, its pose and size, and its sampling */
	int kind;      /* enum gnp_solid_kind */
	size_t count;  /* points wanted, exactly; 16 to 10^6 */
	int sampling;  /* enum gnp_solid_sampling */
};

/* Owned; freed by gnp_solid_sample_clear. */
struct gnp_solid_sample {
	size_t count;
	double *points;      /* (count, 3) exactly on the surface */
	double *normals;     /* (count, 3) outward unit; of an open sheet, the same side throughout */
	double *second_form; /* (count, 3, 3) II as an ambient symmetric tensor, as in struct gnp_sample */
	uint32_t *piece;     /* (count) number of the smooth (G1) piece: faces that join with continuous normals, as a
	                        fillet with what it rounds, have the same number, others do not. A piece that is cut
	                        in two, as a plane by a groove, keeps one number, and so do both sides of a rounded
	                        thin body: equal numbers do not say near. Fillets of less than half a spacing count
	                        as creases, with a piece for every face beside and between */
	double *edge;        /* (count) distance through space to the nearest crease (normals jump by more than 10
	                        degrees), rim or sharp tip, to a fifth of a spacing. INFINITY where there is none */
	double spacing;      /* root of area / count */
};

/* Deterministic in the options for any worker count; the body depends on seed, kind and count alone.
 * GNP_INVALID_ARGUMENT names the option. On failure *out is unchanged. */
gnp_status gnp_solid_sample_create(const struct gnp_solid_options *options, struct gnp_pool *pool,
                                   struct gnp_task *task, struct gnp_solid_sample *out, struct gnp_error *error);
void gnp_solid_sample_clear(struct gnp_solid_sample *sample);

#endif
