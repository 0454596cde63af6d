/* The families of bodies by kind: how a body is drawn for a number of points, to whose spacing it has its
 * proportions. */
#ifndef GNP_CORE_SOLID_KINDS_H
#define GNP_CORE_SOLID_KINDS_H

#include <math.h>

#include "core/solids/solid_body.h"

/* Draws a body of enum gnp_solid_kind for so many points, in coordinates of its own, of size about 1. Boolean
 * operations may leave little or nothing of it: then another draw is due. */
void gnp_solid_kinds_build(int kind, struct gnp_solid_body *body, struct gnp_random *random, double count);

/* The families; every one starts from an empty body. */
typedef void gnp_solid_build(struct gnp_solid_body *body, struct gnp_random *random, double count);
gnp_solid_build gnp_solid_build_rounded, gnp_solid_build_fold, gnp_solid_build_tube, gnp_solid_build_cone;
gnp_solid_build gnp_solid_build_plate, gnp_solid_build_nested, gnp_solid_build_patch, gnp_solid_build_wave;
gnp_solid_build gnp_solid_build_rough, gnp_solid_build_facets;

/* A box about the frame's origin as a primitive with a piece for every side. */
void gnp_solid_build_block(struct gnp_solid_body *body, int operation, const struct gnp_solid_frame *frame,
                           const double half[3]);

/* A height field with its rims and the rims of its holes, as one piece. */
void gnp_solid_build_graph(struct gnp_solid_body *body, const struct gnp_solid_graph *graph);

static inline double gnp_solid_between(struct gnp_random *random, double low, double high)
{
	return low + (high - low) * gnp_random_uniform(random);
}

/* Uniform in the logarithm. */
static inline double gnp_solid_scale(struct gnp_random *random, double low, double high)
{
	return low * pow(high / low, gnp_random_uniform(random));
}

static inline bool gnp_solid_chance(struct gnp_random *random, double share)
{
	return gnp_random_uniform(random) < share;
}

#endif
