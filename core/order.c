#include "order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"

enum { BITS = 21, RADIX_BITS = 11, RADIX = 1 << RADIX_BITS };

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

static void bounds(const double *points, size_t count, double low[3], double *edge)
{
	double high[3];
	memcpy(low, points, 3 * sizeof *low);
	memcpy(high, points, sizeof high);
	for (size_t i = 1; i < count; i++)
		for (int c = 0; c < 3; c++) {
			low[c] = fmin(low[c], points[3 * i + c]);
			high[c] = fmax(high[c], points[3 * i + c]);
		}
	*edge = fmax(fmax(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
}

gnp_status gnp_order_compute(const double *points, size_t count, uint32_t *order, struct gnp_error *error)
{
	if (!count)
		return GNP_OK;
	struct keyed *items = gnp_array_new(count, 2 * sizeof *items);
	if (!items)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "order: no memory for %zu points", count);
	double low[3], edge;
	bounds(points, count, low, &edge);
	/* Divided first: the reciprocal of a subnormal edge is infinite. */
	const double cells = (1 << BITS) - 1;
	edge = edge > 0 ? edge : 1;
	for (size_t i = 0; i < count; i++) {
		const double *p = points + 3 * i;
		items[i].key = hilbert_key((uint32_t)((p[0] - low[0]) / edge * cells), (uint32_t)((p[1] - low[1]) / edge * cells),
		                           (uint32_t)((p[2] - low[2]) / edge * cells));
		items[i].index = (uint32_t)i;
	}
	const struct keyed *sorted = radix_sort(items, items + count, count);
	for (size_t i = 0; i < count; i++)
		order[i] = sorted[i].index;
	free(items);
	return GNP_OK;
}
