/* The truth at a support's centre in the support's frame and units: what a fit should have found. */
#ifndef GNP_WEIGHTS_ANY_TRUTH_H
#define GNP_WEIGHTS_ANY_TRUTH_H

#include "weights/train/any/any_cloud.h"

struct gnp_any_truth {
	double normal[3];  /* in the frame, to the side of its third axis */
	bool curved;       /* the surface is a graph over the frame (normal[2] above 0.2), and its curvature is known */
	double hessian[3]; /* where it is curved: second derivatives uu, uv, vv of the height over (u, v), in units of R */
};

/* Of the surface point that the centre came from. */
void gnp_any_truth_find(const struct gnp_any_cloud *cloud, const struct gnp_support *support,
                        struct gnp_any_truth *out);

/* The normal, in the frame and to the centre's side, of the surface point that a single node (below GNP_SUPPORT_SINGLES) came
 * from. False where the centre's surface need not hold there: it is an outlier, of another piece, or too steep. */
bool gnp_any_truth_near(const struct gnp_any_cloud *cloud, const struct gnp_support *support, size_t node,
                        double normal[3]);

/* strange (nodes): of each node's points the share that are outliers or of another smooth piece than the centre. */
void gnp_any_truth_label(const struct gnp_any_cloud *cloud, const struct gnp_support *support, double *strange);

#endif
