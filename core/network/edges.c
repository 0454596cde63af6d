#include "core/network/edges.h"

#include <string.h>

#include "core/base/simd.h"

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

GNP_INLINE void fill_slice(size_t targets, size_t sources, size_t n, size_t count, const float *restrict a, const float *restrict b,
                           float *restrict h)
{
	for (size_t i = 0; i < targets; i++)
		for (size_t p = 0; p < count; p++)
			for (size_t j = 0; j < sources; j++) {
				float sum = a[i * n + p] + b[p * sources + j];
				h[(i * count + p) * sources + j] = sum > 0 ? sum : 0;
			}
}
GNP_SIMD_DISPATCH(, gnp_edges_fill_slice, fill_slice,
                  (size_t targets, size_t sources, size_t n, size_t count, const float *a, const float *b, float *h),
                  (targets, sources, n, count, a, b, h))

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
enum { LANES = 16, TERMS = 4, HALF = LANES / 2 };

typedef float lanes8 __attribute__((vector_size(HALF * sizeof(float)), aligned(sizeof(float))));
typedef int mask8 __attribute__((vector_size(HALF * sizeof(int)), aligned(sizeof(int))));

/* `count` terms from `term` on, a constant, and LANES neurons from p on: left to itself the compiler transposes in the
 * loop. */
GNP_INLINE void moments_wide(size_t sources, size_t n, size_t terms, size_t term, size_t count, size_t p, const float *restrict a,
                             const float *restrict b, const float *restrict x, float *restrict moments)
{
	const lanes8 *at = (const lanes8 *)(a + p), zero = {0};
	lanes8 low = at[0], high = at[1], sum_low[TERMS] = {zero}, sum_high[TERMS] = {zero};
	for (size_t j = 0; j < sources; j++) {
		const lanes8 *from = (const lanes8 *)(b + j * n + p);
		lanes8 h_low = low + from[0], h_high = high + from[1];
		h_low = (lanes8)((mask8)h_low & (h_low > zero));
		h_high = (lanes8)((mask8)h_high & (h_high > zero));
		for (size_t f = 0; f < count; f++) {
			float factor = x[j * terms + term + f];
			sum_low[f] += factor * h_low;
			sum_high[f] += factor * h_high;
		}
	}
	for (size_t f = 0; f < count; f++) {
		memcpy(moments + (term + f) * n + p, &sum_low[f], sizeof *sum_low);
		memcpy(moments + (term + f) * n + p + HALF, &sum_high[f], sizeof *sum_high);
	}
}

/* At most LANES neurons. */
GNP_INLINE void moments_narrow(size_t sources, size_t n, size_t terms, size_t term, size_t p, size_t lanes, const float *restrict a,
                               const float *restrict b, const float *restrict x, float *restrict moments)
{
	float sum[LANES] = {0};
	for (size_t j = 0; j < sources; j++)
		for (size_t l = 0; l < lanes; l++) {
			float h = a[p + l] + b[j * n + p + l];
			sum[l] += x[j * terms + term] * (h > 0 ? h : 0);
		}
	memcpy(moments + term * n + p, sum, lanes * sizeof *sum);
}

GNP_INLINE void all_moments(size_t targets, size_t sources, size_t n, size_t terms, const float *restrict a, const float *restrict b,
                        const float *restrict x, float *restrict out)
{
	for (size_t i = 0; i < targets; i++) {
		const float *at = a + i * n;
		float *row = out + i * terms * n;
		size_t p = 0;
		for (; p + LANES <= n; p += LANES) {
			size_t term = 0;
			for (; term + TERMS <= terms; term += TERMS)
				moments_wide(sources, n, terms, term, TERMS, p, at, b, x, row);
			for (; term < terms; term++)
				moments_wide(sources, n, terms, term, 1, p, at, b, x, row);
		}
		for (size_t term = 0; p < n && term < terms; term++)
			moments_narrow(sources, n, terms, term, p, n - p, at, b, x, row);
	}
}
GNP_SIMD_DISPATCH(, gnp_edges_moments, all_moments,
                  (size_t targets, size_t sources, size_t n, size_t terms, const float *a, const float *b, const float *x,
                   float *moments),
                  (targets, sources, n, terms, a, b, x, moments))

GNP_INLINE void add_lanes(float *to, lanes8 what)
{
	*(lanes8 *)to += what;
}

/* As moments_wide: dmoments of the terms stay in registers. a, da, dmoments: of one target. */
GNP_INLINE void backward_wide(size_t sources, size_t n, size_t terms, size_t term, size_t count, size_t p, const float *restrict a,
                              const float *restrict b, const float *restrict x, const float *restrict dmoments,
                              float *restrict da, float *restrict db)
{
	const lanes8 *at = (const lanes8 *)(a + p), zero = {0};
	lanes8 low = at[0], high = at[1], sum_low = zero, sum_high = zero, d_low[TERMS], d_high[TERMS];
	for (size_t f = 0; f < count; f++) {
		const lanes8 *from = (const lanes8 *)(dmoments + (term + f) * n + p);
		d_low[f] = from[0];
		d_high[f] = from[1];
	}
	for (size_t j = 0; j < sources; j++) {
		const lanes8 *from = (const lanes8 *)(b + j * n + p);
		lanes8 pull_low = zero, pull_high = zero;
		for (size_t f = 0; f < count; f++) {
			float factor = x[j * terms + term + f];
			pull_low += factor * d_low[f];
			pull_high += factor * d_high[f];
		}
		pull_low = (lanes8)((mask8)pull_low & (low + from[0] > zero));
		pull_high = (lanes8)((mask8)pull_high & (high + from[1] > zero));
		sum_low += pull_low;
		sum_high += pull_high;
		add_lanes(db + j * n + p, pull_low);
		add_lanes(db + j * n + p + HALF, pull_high);
	}
	add_lanes(da + p, sum_low);
	add_lanes(da + p + HALF, sum_high);
}

GNP_INLINE void backward_narrow(size_t sources, size_t n, size_t terms, size_t term, size_t p, size_t lanes,
                                const float *restrict a, const float *restrict b, const float *restrict x,
                                const float *restrict dmoments, float *restrict da, float *restrict db)
{
	for (size_t j = 0; j < sources; j++)
		for (size_t l = p; l < p + lanes; l++) {
			float masked = a[l] + b[j * n + l] > 0 ? x[j * terms + term] * dmoments[term * n + l] : 0;
			da[l] += masked;
			db[j * n + l] += masked;
		}
}

GNP_INLINE void moments_backward(size_t targets, size_t sources, size_t n, size_t terms, const float *restrict a,
                                 const float *restrict b, const float *restrict x, const float *restrict dmoments,
                                 float *restrict da, float *restrict db)
{
	for (size_t i = 0; i < targets; i++) {
		const float *at = a + i * n, *dm = dmoments + i * terms * n;
		size_t p = 0;
		for (; p + LANES <= n; p += LANES) {
			size_t term = 0;
			for (; term + TERMS <= terms; term += TERMS)
				backward_wide(sources, n, terms, term, TERMS, p, at, b, x, dm, da + i * n, db);
			for (; term < terms; term++)
				backward_wide(sources, n, terms, term, 1, p, at, b, x, dm, da + i * n, db);
		}
		for (size_t term = 0; p < n && term < terms; term++)
			backward_narrow(sources, n, terms, term, p, n - p, at, b, x, dm, da + i * n, db);
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
