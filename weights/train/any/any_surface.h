/* Surfaces that the model for every cloud is trained on, as points with exact geometry: the paper's radial family, and
 * bodies with creases, rims, thin sheets and rough sheets (solid.h). */
#ifndef GNP_WEIGHTS_ANY_SURFACE_H
#define GNP_WEIGHTS_ANY_SURFACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/random.h"
#include "core/base/status.h"

/* What a surface is drawn from. solid: bodies and open pieces; rough: height fields as scanned detail is, smooth or as
 * triangles. mixed: 20 % radial, 38 % solid, 42 % rough. */
enum gnp_any_group { GNP_ANY_RADIAL, GNP_ANY_SOLID, GNP_ANY_ROUGH, GNP_ANY_GROUPS, GNP_ANY_MIXED = GNP_ANY_GROUPS };

/* Owned; freed by gnp_any_surface_clear. */
struct gnp_any_surface {
	char name[48]; /* kind and sampling, for people */
	size_t count;
	double *points;      /* (count, 3) exactly on the surface */
	double *normals;     /* (count, 3) unit */
	double *second_form; /* (count, 3, 3) II as an ambient symmetric tensor, as in struct gnp_sample */
	uint32_t *piece;     /* (count) number of the smooth piece */
	double *edge;        /* (count) distance to the nearest crease, rim or tip [spacing]; INFINITY: there is none */
	double spacing;      /* root of area / count [length] */
	bool faceted;        /* triangles that stand for a smooth surface: their curvature and creases are no truth */
};

/* count points, 16 at least, of a surface of the group that random chooses; its seeds are below 2^30, which are
 * training's (protocol.h). Deterministic for any worker count. On failure *out is unchanged. */
gnp_status gnp_any_surface_draw(enum gnp_any_group group, size_t count, struct gnp_random *random,
                                struct gnp_pool *pool, struct gnp_any_surface *out, struct gnp_error *error);
void gnp_any_surface_clear(struct gnp_any_surface *surface);

#endif
