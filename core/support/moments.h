/* Second moments of points about their mean, added up point by point: the principal axes of nested neighbourhoods. */
#ifndef GNP_CORE_MOMENTS_H
#define GNP_CORE_MOMENTS_H

#include <math.h>

#include "core/linear/eigen.h"

/* Begins as zeros. */
struct gnp_moments {
	double count, sum[3], square[6]; /* square: upper triangle by rows */
};

/* Adds a point; origin: the same one each time, near the points, so that no digits are lost. */
static inline void gnp_moments_add(struct gnp_moments *moments, const double origin[3], const double point[3])
{
	double x = point[0] - origin[0], y = point[1] - origin[1], z = point[2] - origin[2];
	moments->count++;
	moments->sum[0] += x;
	moments->sum[1] += y;
	moments->sum[2] += z;
	moments->square[0] += x * x;
	moments->square[1] += x * y;
	moments->square[2] += x * z;
	moments->square[3] += y * y;
	moments->square[4] += y * z;
	moments->square[5] += z * z;
}

/* Variances descending, and the axes (rows) they belong to. At least one point. */
static inline void gnp_moments_axes(const struct gnp_moments *moments, double variance[3], double axes[3][3])
{
	static const int first[6] = {0, 0, 0, 1, 1, 2}, second[6] = {0, 1, 2, 1, 2, 2};
	double upper[6], n = moments->count;
	for (int i = 0; i < 6; i++)
		upper[i] = moments->square[i] / n - moments->sum[first[i]] * moments->sum[second[i]] / n / n;
	gnp_eigen_symmetric3(upper, variance, axes);
}

/* How flat points are: lambda_3 / lambda_2, rounding aside, at most 1, which points on a line have; and how far they
 * span two directions: lambda_2 / lambda_1. Points at one place are flat and span nothing. */
static inline double gnp_moments_flatness(const double variance[3])
{
	double rounding = 1e-14 * variance[0];
	return fmax(variance[2], rounding) / fmax(fmax(variance[1], rounding), 1e-300);
}

static inline double gnp_moments_span(const double variance[3])
{
	return fmax(variance[1], 0) / fmax(variance[0], 1e-300);
}

#endif
