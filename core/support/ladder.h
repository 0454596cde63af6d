/* The principal axes of nested neighbourhoods of a point, and what can be told from them about which of these spans the
 * surface best: the first look at a point.
 *
 * The ladder's steps are the nearest 8, 12, 16, 24, ... 432 points. Each step gives a frame (rows psi1, psi2, psi3, the
 * third across the points) and three numbers: half the logarithms of flatness and of span (moments.h), and half the
 * logarithm of sin^2 of the angle to the step before. Then come means and standard deviations of the cloud's roughness
 * over the nearest 48 and 432. Which step is best is a network's choice (weighted_head.h). */
#ifndef GNP_CORE_LADDER_H
#define GNP_CORE_LADDER_H

#include <stddef.h>
#include <stdint.h>

#include "core/support/roughness.h"

enum {
	GNP_LADDER_STEPS = 12,
	GNP_LADDER_REACH = 432,                        /* points of the last step */
	GNP_LADDER_LOOKS = 3 * GNP_LADDER_STEPS + 4 * GNP_ROUGHNESS_SCALES
};
extern const unsigned gnp_ladder_points[GNP_LADDER_STEPS];

struct gnp_ladder {
	int steps; /* that the points suffice for; at least 1 */
	double frames[GNP_LADDER_STEPS][3][3];
	float looks[GNP_LADDER_LOOKS];
};

/* index (count): points of the cloud ascending by distance from the centre, which is index[0]; count is at least 1, and
 * the first step takes what there is of its 8.
 * normals: given ones (n, 3), which keep points that face elsewhere out of the frames; NULL: all count. O(count). */
void gnp_ladder_look(const double *points, const double *normals, const struct gnp_roughness *roughness,
                     const uint32_t *index, size_t count, struct gnp_ladder *out);

#endif
