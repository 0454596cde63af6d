/* Principal axes of a handful of points: the eigenvectors of their 3 x 3 covariance. */
#ifndef GNP_CORE_PCA_H
#define GNP_CORE_PCA_H

#include <stddef.h>
#include <stdint.h>

struct gnp_pca {
	double values[3];  /* variances along the axes, descending, in units of the largest squared deviation: no length */
	double axes[3][3]; /* row a: the unit vector of values[a]; orthonormal, right-handed, axes[2] the plane's normal */
};

/* Of points[index[0]] .. points[index[count - 1]]; any finite points at any scale, equal and collinear ones too.
 * count >= 1. Deterministic; which of its two directions an axis takes means nothing. O(count), no memory. */
void gnp_pca_fit(const double *points, const uint32_t *index, size_t count, struct gnp_pca *out);

#endif
