#include "core/search/order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"

enum { BITS = 21, RADIX_BITS = 11, RADIX = 1 << RADIX_BITS, SAMPLE_MAX = 4096 };

struct keyed {
	uint64_t key;
	uint32_t index;
};

/* Position along the Hilbert curve of integer coordinates (Skilling 2004, "Programming the Hilbert curve"):
 * undo the excess work of the transposed form, Gray-encode, interleave. */
static uint64_t hilbert_key(uint32_t x, uint32_t y, uint32_t z)
{
	uint32_t a[3] = {x, y, z};
	for (uint32_t q = 1u << (BITS - 1); q > 1; q >>= 1) {
		uint32_t p = q - 1;
		for (int i = 0; i < 3; i++) {
			uint32_t swap = (a[0] ^ a[i]) & p;
			uint32_t set = -(uint32_t)((a[i] & q) != 0);
			a[0] ^= (set & p) | (~set & swap);
			a[i] ^= ~set & swap;
		}
	}
	a[1] ^= a[0];
	a[2] ^= a[1];
	uint32_t t = 0;
	for (uint32_t q = 1u << (BITS - 1); q > 1; q >>= 1)
		t ^= -(uint32_t)((a[2] & q) != 0) & (q - 1);
	uint64_t key = 0;
	for (int b = BITS - 1; b >= 0; b--)
		for (int i = 0; i < 3; i++)
			key = key << 1 | ((a[i] ^ t) >> b & 1);
	return key;
}

/* Stable least-significant-digit radix sort by the 63-bit key. The result is in `from` or `to`; returns which. */
static struct keyed *radix_sort(struct keyed *from, struct keyed *to, size_t count)
{
	static const int passes = (3 * BITS + RADIX_BITS - 1) / RADIX_BITS;
	for (int pass = 0; pass < passes; pass++) {
		int shift = pass * RADIX_BITS;
		size_t start[RADIX] = {0};
		for (size_t i = 0; i < count; i++)
			start[from[i].key >> shift & (RADIX - 1)]++;
		size_t sum = 0;
		for (int d = 0; d < RADIX; d++) {
			size_t here = start[d];
			start[d] = sum;
			sum += here;
		}
		for (size_t i = 0; i < count; i++)
			to[start[from[i].key >> shift & (RADIX - 1)]++] = from[i];
		struct keyed *swap = from;
		from = to;
		to = swap;
	}
	return from;
}

/* Least and largest coordinate along one axis, and those of the bulk: between the fifth and the ninety-fifth hundredth of
 * points taken at a fixed stride. */
static void axis_bounds(const double *points, size_t count, int axis, double all[2], double bulk[2])
{
	double sample[SAMPLE_MAX];
	size_t stride = (count + SAMPLE_MAX - 1) / SAMPLE_MAX, taken = 0;
	all[0] = all[1] = points[axis];
	for (size_t i = 0; i < count; i++) {
		double x = points[3 * i + (size_t)axis];
		all[0] = x < all[0] ? x : all[0];
		all[1] = x > all[1] ? x : all[1];
	}
	for (size_t i = 0; i < count; i += stride)
		sample[taken++] = points[3 * i + (size_t)axis];
	qsort(sample, taken, sizeof *sample, gnp_double_compare);
	bulk[0] = sample[taken / 20];
	bulk[1] = sample[taken - 1 - taken / 20];
}

/* The box the curve fills: the bounding box, but no further than a width of the bulk from the bulk. A few far outliers would
 * otherwise press all the other points into a handful of cells. Points outside count as on its faces. */
static void bounds(const double *points, size_t count, double low[3], double high[3], double *edge)
{
	double bulk[3][2], width = 0;
	*edge = 0;
	for (int c = 0; c < 3; c++) {
		double all[2];
		axis_bounds(points, count, c, all, bulk[c]);
		low[c] = all[0];
		high[c] = all[1];
		width = fmax(width, bulk[c][1] - bulk[c][0]);
	}
	for (int c = 0; c < 3; c++) {
		if (width > 0) {
			low[c] = fmax(low[c], bulk[c][0] - width);
			high[c] = fmin(high[c], bulk[c][1] + width);
		}
		*edge = fmax(*edge, high[c] - low[c]);
	}
}

/* Divided first: the reciprocal of a subnormal edge is infinite. */
static uint32_t cell(double x, double low, double high, double edge)
{
	return (uint32_t)((fmin(fmax(x, low), high) - low) / edge * ((1 << BITS) - 1));
}

gnp_status gnp_order_compute(const double *points, size_t count, uint32_t *order, struct gnp_error *error)
{
	if (!count)
		return GNP_OK;
	struct keyed *items = gnp_array_new(count, 2 * sizeof *items);
	if (!items)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "order: no memory for %zu points", count);
	double low[3], high[3], edge;
	bounds(points, count, low, high, &edge);
	edge = edge > 0 ? edge : 1;
	for (size_t i = 0; i < count; i++) {
		const double *p = points + 3 * i;
		items[i].key = hilbert_key(cell(p[0], low[0], high[0], edge), cell(p[1], low[1], high[1], edge),
		                           cell(p[2], low[2], high[2], edge));
		items[i].index = (uint32_t)i;
	}
	const struct keyed *sorted = radix_sort(items, items + count, count);
	for (size_t i = 0; i < count; i++)
		order[i] = sorted[i].index;
	free(items);
	return GNP_OK;
}
