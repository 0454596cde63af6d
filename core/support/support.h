/* The support of a surface at a point: its nearest points in a frame, gathered to at most 144 nodes, with what a
 * network sees of them. Which of the nodes belong to the point's smooth piece is the network's to say
 * (weighted_projection.h).
 *
 * The frame is that of a step of the ladder, psi3 to the side of the centre's normal and psi1 to that of most points;
 * the step says how far the support reaches: 144, 432 or 1296 points, of which the farthest is at distance R. Where
 * normals are given and contradict the step's plane, the frame goes by them. The nearest 48 points are nodes of their
 * own; farther ones are gathered by 3, 9 and 27, neighbours along the curve in each ring. A node's row of the Taylor
 * basis and its height are means over its points, so what is fitted to nodes is the same functional of the points,
 * without the error of moving them. Origin: the centre. u, v and heights are in units of R.
 *
 * Features of a node: u, v, 2 y, residual of the fit of the nearest 48 nodes over twice its misfit (within 4), asinh of
 * the height over that of the nearest 16, the mean normal in the frame (3), asinh of the residual of the nearest 16's
 * fit, half the logarithm of the distance. Summary: of the first fits of the nearest 16, 48, 80 and all nodes the
 * logarithms of misfit and of coefficients by order (as projection.h), the ladder's looks, logarithms of the step's
 * points and of the support's, whether normals were given, and of each first fit asinh of the centre's residual over
 * the deviation of its nearest nodes' (their median's, so that an outlier at the centre does not hide itself). All
 * without units: scaling, moving or turning a cloud changes nothing. */
#ifndef GNP_CORE_SUPPORT_H
#define GNP_CORE_SUPPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fit/taylor.h"
#include "core/search/neighborhoods.h"
#include "core/support/ladder.h"

enum {
	GNP_SUPPORT_POINTS = 1296,
	GNP_SUPPORT_NODES = 144,
	GNP_SUPPORT_SINGLES = 48,
	GNP_SUPPORT_FEATURES = 10,
	GNP_SUPPORT_FITS = 4,
	GNP_SUPPORT_SUMMARY = GNP_SUPPORT_FITS * (1 + GNP_TAYLOR_DEGREE) + GNP_LADDER_LOOKS + 3 + GNP_SUPPORT_FITS
};

/* A cloud in curve order, borrowed. */
struct gnp_support_cloud {
	const double *points;  /* (n, 3) */
	const double *normals; /* (n, 3) unit */
	bool given;            /* normals are the caller's, not estimated */
	const struct gnp_neighbors *neighbors;
	const struct gnp_roughness *roughness;
};

struct gnp_support {
	uint32_t centre;
	unsigned step;    /* of the ladder */
	size_t points;    /* that it reaches for: those of the search, at most GNP_SUPPORT_POINTS */
	size_t nodes;
	double radius;    /* R [length] */
	double frame[3][3];
	uint16_t start[GNP_SUPPORT_NODES + 1];  /* node n has the points member[start[n]] .. member[start[n + 1] - 1] */
	uint32_t member[GNP_SUPPORT_POINTS];
	/* Of nodes: means over their points; weight: how many they are. */
	double u[GNP_SUPPORT_NODES], v[GNP_SUPPORT_NODES], y[GNP_SUPPORT_NODES], weight[GNP_SUPPORT_NODES];
	double distance[GNP_SUPPORT_NODES]; /* from the centre, in units of R */
	_Alignas(64) double rows[GNP_SUPPORT_NODES * GNP_TAYLOR_STRIDE];
	float features[GNP_SUPPORT_NODES * GNP_SUPPORT_FEATURES];
	float summary[GNP_SUPPORT_SUMMARY];
};

/* The nodes that are one point each: the first. */
static inline size_t gnp_support_singles(const struct gnp_support *support)
{
	return support->nodes < GNP_SUPPORT_SINGLES ? support->nodes : (size_t)GNP_SUPPORT_SINGLES;
}

/* Looks at a point: its nearest points (GNP_LADDER_REACH or all) by row of a search, the centre put first where the
 * row has it, and their ladder. */
void gnp_support_look(const struct gnp_support_cloud *cloud, uint32_t centre, uint32_t *index, size_t count,
                      struct gnp_ladder *ladder);

/* Points that a support of the ladder's step reaches for. */
size_t gnp_support_reach(unsigned step);

/* Builds the support by a step of the ladder from a row of a search (index, distance: count) that reaches as far as
 * the step wants, or as the cloud goes; the centre becomes the first member where the row has it. turn: the frame is
 * turned by this angle about its third axis. False when all points it reaches coincide. O(count), no memory of its
 * own. */
bool gnp_support_build(const struct gnp_support_cloud *cloud, uint32_t centre, const struct gnp_ladder *ladder,
                       unsigned step, const uint32_t *index, const double *distance, size_t count, double turn,
                       struct gnp_support *out);

#endif
