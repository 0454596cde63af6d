#include "edges.h"

#include <string.h>

#include "simd.h"

GNP_INLINE void fill(size_t targets, size_t n, const float *restrict a, const float *restrict b, float *restrict h)
{
	for (size_t i = 0; i < targets; i++)
		for (size_t p = 0; p < n; p++) {
			float sum = a[i * n + p] + b[p];
			h[i * n + p] = sum > 0 ? sum : 0;
		}
}
GNP_SIMD_DISPATCH(, gnp_edges_fill, fill, (size_t targets, size_t n, const float *a, const float *b, float *h),
                  (targets, n, a, b, h))

GNP_INLINE void fill_backward(size_t targets, size_t n, const float *restrict h, const float *restrict dh, float *restrict da,
                              float *restrict db)
{
	for (size_t i = 0; i < targets; i++)
		for (size_t p = 0; p < n; p++) {
			float d = h[i * n + p] > 0 ? dh[i * n + p] : 0;
			da[i * n + p] += d;
			db[p] += d;
		}
}
GNP_SIMD_DISPATCH(, gnp_edges_fill_backward, fill_backward,
                  (size_t targets, size_t n, const float *h, const float *dh, float *da, float *db), (targets, n, h, dh, da, db))

/* Neurons at a time that stay in registers while sums run over nodes, and terms of moments. */
enum { LANES = 16, TERMS = 2 };

/* At most TERMS terms, from `term` on, and at most LANES neurons, from p on. */
GNP_INLINE void moments_tile(size_t sources, size_t n, size_t terms, size_t term, size_t count, size_t p, size_t lanes,
                             const float *restrict a, const float *restrict b, const float *restrict x, float *restrict moments)
{
	float sum[TERMS][LANES] = {{0}};
	for (size_t j = 0; j < sources; j++)
		for (size_t f = 0; f < count; f++) {
			float factor = x[j * terms + term + f];
			for (size_t l = 0; l < lanes; l++) {
				float h = a[p + l] + b[j * n + p + l];
				sum[f][l] += factor * (h > 0 ? h : 0);
			}
		}
	for (size_t f = 0; f < count; f++)
		memcpy(moments + (term + f) * n + p, sum[f], lanes * sizeof **sum);
}

GNP_INLINE void all_moments(size_t targets, size_t sources, size_t n, size_t terms, const float *restrict a, const float *restrict b,
                        const float *restrict x, float *restrict out)
{
	for (size_t i = 0; i < targets; i++)
		for (size_t term = 0; term < terms; term += TERMS)
			for (size_t p = 0; p < n; p += LANES) {
				size_t lanes = n - p, count = terms - term;
				float *row = out + i * terms * n;
				if (lanes >= LANES && count >= TERMS)
					moments_tile(sources, n, terms, term, TERMS, p, LANES, a + i * n, b, x, row);
				else
					moments_tile(sources, n, terms, term, count < TERMS ? count : TERMS, p, lanes < LANES ? lanes : LANES,
					             a + i * n, b, x, row);
			}
}
GNP_SIMD_DISPATCH(, gnp_edges_moments, all_moments,
                  (size_t targets, size_t sources, size_t n, size_t terms, const float *a, const float *b, const float *x,
                   float *moments),
                  (targets, sources, n, terms, a, b, x, moments))

GNP_INLINE void moments_backward(size_t targets, size_t sources, size_t n, size_t terms, const float *restrict a,
                                 const float *restrict b, const float *restrict x, const float *restrict dmoments,
                                 float *restrict da, float *restrict db)
{
	float d[LANES];
	for (size_t i = 0; i < targets; i++)
		for (size_t p = 0; p < n; p += LANES) {
			size_t lanes = n - p < LANES ? n - p : LANES;
			for (size_t j = 0; j < sources; j++) {
				memset(d, 0, sizeof d);
				for (size_t f = 0; f < terms; f++)
					for (size_t l = 0; l < lanes; l++)
						d[l] += x[j * terms + f] * dmoments[(i * terms + f) * n + p + l];
				for (size_t l = 0; l < lanes; l++) {
					float masked = a[i * n + p + l] + b[j * n + p + l] > 0 ? d[l] : 0;
					da[i * n + p + l] += masked;
					db[j * n + p + l] += masked;
				}
			}
		}
}
GNP_SIMD_DISPATCH(, gnp_edges_moments_backward, moments_backward,
                  (size_t targets, size_t sources, size_t n, size_t terms, const float *a, const float *b, const float *x,
                   const float *dmoments, float *da, float *db),
                  (targets, sources, n, terms, a, b, x, dmoments, da, db))

GNP_INLINE void all_means(size_t targets, size_t sources, size_t n, const float *restrict share, const float *restrict a,
                     const float *restrict b, float *restrict out)
{
	memset(out, 0, sources * n * sizeof *out);
	for (size_t i = 0; i < targets; i++)
		for (size_t j = 0; share[i] > 0 && j < sources; j++)
			for (size_t p = 0; p < n; p++) {
				float h = a[i * n + p] + b[j * n + p];
				out[j * n + p] += share[i] * (h > 0 ? h : 0);
			}
}
GNP_SIMD_DISPATCH(, gnp_edges_mean, all_means,
                  (size_t targets, size_t sources, size_t n, const float *share, const float *a, const float *b, float *mean),
                  (targets, sources, n, share, a, b, mean))

GNP_INLINE void mean_backward(size_t targets, size_t sources, size_t n, const float *restrict share, const float *restrict a,
                              const float *restrict b, const float *restrict dmean, float *restrict da, float *restrict db)
{
	for (size_t i = 0; i < targets; i++)
		for (size_t j = 0; share[i] > 0 && j < sources; j++)
			for (size_t p = 0; p < n; p++) {
				float d = a[i * n + p] + b[j * n + p] > 0 ? share[i] * dmean[j * n + p] : 0;
				da[i * n + p] += d;
				db[j * n + p] += d;
			}
}
GNP_SIMD_DISPATCH(, gnp_edges_mean_backward, mean_backward,
                  (size_t targets, size_t sources, size_t n, const float *share, const float *a, const float *b, const float *dmean,
                   float *da, float *db),
                  (targets, sources, n, share, a, b, dmean, da, db))
