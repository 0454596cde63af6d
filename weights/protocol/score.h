/* Measures how far estimates are from the truth: the columns of the paper's Table 1. */
#ifndef GNP_WEIGHTS_SCORE_H
#define GNP_WEIGHTS_SCORE_H

#include "core/estimate/estimate.h"
#include "core/shapes/shapes.h"

/* enumerator, name in files, heading, the quantity it needs beside the frame. */
#define GNP_SCORE_TABLE(X)                                                                               \
	X(GNP_SCORE_NORMAL, "normal", "normal", GNP_NORMALS)                                                 \
	X(GNP_SCORE_INVERSE_METRIC, "inverse_metric", "metric inverse", GNP_INVERSE_METRIC)                  \
	X(GNP_SCORE_SECOND_FORM, "second_fundamental_form", "shape", GNP_SECOND_FUNDAMENTAL_FORM)            \
	X(GNP_SCORE_GAUSSIAN, "gaussian_curvature", "gaussian", GNP_GAUSSIAN_CURVATURE)                      \
	X(GNP_SCORE_MEAN, "mean_curvature", "mean", GNP_MEAN_CURVATURE)

enum gnp_score {
#define GNP_SCORE_ENUM(id, name, heading, quantity) id,
	GNP_SCORE_TABLE(GNP_SCORE_ENUM)
#undef GNP_SCORE_ENUM
	GNP_SCORES
};

const char *gnp_score_name(enum gnp_score score);
const char *gnp_score_heading(enum gnp_score score);

/* Mask of the quantities an estimate must hold to be scored. */
uint64_t gnp_score_quantities(void);

/* errors (GNP_SCORES) of an estimate whose row i is the point at[i] of the sample. Normals: the mean of 1 - n.n'. Others: the
 * L2 norm of the difference over all rows relative to that of the truth, tensors by the Frobenius norm of their components
 * in the frame of the estimator's patch: with the exact normal (n_1, n_2, n_3) there, h_u = -n_1 / n_3, h_v = -n_2 / n_3, the
 * tangents are (1, 0, h_u) and (0, 1, h_v). The truth is the geometry at sample->exact. NaN where an estimate is not finite. */
void gnp_score_estimate(const struct gnp_sample *sample, const uint32_t *at, const struct gnp_estimate *estimate,
                        double errors[GNP_SCORES]);

#endif
