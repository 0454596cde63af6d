#include "core/linear/pca.h"

#include <math.h>

#include "core/linear/eigen.h"

void gnp_pca_fit(const double *points, const uint32_t *index, size_t count, struct gnp_pca *out)
{
	/* Relative to the first point, and divided by the largest deviation: no square over- or underflows. */
	const double *origin = points + 3 * (size_t)index[0];
	double sum[3] = {0}, widest = 0;
	for (size_t j = 1; j < count; j++)
		for (int c = 0; c < 3; c++) {
			double d = points[3 * (size_t)index[j] + c] - origin[c];
			sum[c] += d;
			widest = fmax(widest, fabs(d));
		}
	double scale = widest > 1e-300 ? 1 / widest : 0, mean[3], upper[6] = {0};
	for (int c = 0; c < 3; c++)
		mean[c] = sum[c] / (double)count;
	for (size_t j = 0; j < count; j++) {
		const double *p = points + 3 * (size_t)index[j];
		double x = (p[0] - origin[0] - mean[0]) * scale, y = (p[1] - origin[1] - mean[1]) * scale,
		       z = (p[2] - origin[2] - mean[2]) * scale;
		upper[0] += x * x;
		upper[1] += x * y;
		upper[2] += x * z;
		upper[3] += y * y;
		upper[4] += y * z;
		upper[5] += z * z;
	}
	for (int e = 0; e < 6; e++)
		upper[e] /= (double)count;
	gnp_eigen_symmetric3(upper, out->values, out->axes);
}
