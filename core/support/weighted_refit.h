/* Fits a support again without what is plainly off the surface: points that the network's weights did not leave out
 * although the others show that they are not of the piece.
 *
 * Where some of the nearest 48 points is off by more than 8 deviations of theirs, by their median, and by more than
 * 0.02 spacings, every node's share is multiplied by Tukey's biweight of its residual (cut at 4.685 deviations; of a
 * node of m points the residual has 1 / m of their variance), and the projection is solved anew, up to four times. A
 * support without such a point is left as it is, to the bit. Compare iteratively reweighted least squares (Beaton &
 * Tukey 1974). */
#ifndef GNP_CORE_WEIGHTED_REFIT_H
#define GNP_CORE_WEIGHTED_REFIT_H

#include "core/support/weighted_projection.h"

/* The deviation of the nearest 48 points from a surface by the median of their residuals (nodes), which a few that
 * are far off do not move; of a normal distribution its standard deviation. */
double gnp_weighted_deviation(const struct gnp_support *support, const double *residual);

/* outputs (GNP_WEIGHTED_OUTPUTS) and fit as of gnp_weighted_solve. Returns how often it was solved anew. */
int gnp_weighted_refit(const struct gnp_support *support, const float *outputs, struct gnp_weighted_fit *fit);

#endif
