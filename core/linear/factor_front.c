#include "core/linear/factor_front.h"

#include <math.h>

#include "core/linear/linalg.h"

/* The lower triangle: places ascend, so what is below the diagonal stays below it. */
static void add_symmetric(struct gnp_factor_front *front, const double *block, size_t border, const uint32_t *place,
                          size_t begin, size_t end)
{
	for (size_t j = begin; j < end; j++) {
		const double *from = block + j * border;
		size_t before = place[j] < front->width ? 0 : front->width; /* rows that are not in this column's block */
		double *to = before ? front->border_block + (place[j] - before) * front->border
		                    : front->panel + place[j] * front->rows;
		for (size_t i = j; i < border; i++)
			to[place[i] - before] += from[i];
	}
}

void gnp_factor_front_add(struct gnp_factor_front *front, const double *block, size_t border, const uint32_t *place,
                          size_t begin, size_t end)
{
	size_t inner = 0; /* rows that land on pivots */
	if (front->symmetric) {
		add_symmetric(front, block, border, place, begin, end);
		return;
	}
	while (inner < border && place[inner] < front->width)
		inner++;
	for (size_t j = begin; j < end; j++) {
		const double *from = block + j * border;
		if (place[j] < front->width) {
			double *to = front->panel + place[j] * front->rows;
			for (size_t i = 0; i < border; i++)
				to[place[i]] += from[i];
			continue;
		}
		size_t column = place[j] - front->width;
		double *upper = front->over + column * front->width, *lower = front->border_block + column * front->border;
		for (size_t i = 0; i < inner; i++)
			upper[place[i]] += from[i];
		for (size_t i = inner; i < border; i++)
			lower[place[i] - front->width] += from[i];
	}
}

static void exchange_rows(double *block, size_t leading, size_t columns, size_t a, size_t b)
{
	for (size_t c = 0; c < columns && a != b; c++) {
		double kept = block[a + c * leading];
		block[a + c * leading] = block[b + c * leading];
		block[b + c * leading] = kept;
	}
}

static size_t pivot_column(double *a, size_t rows, double smallest, uint32_t *pivot)
{
	size_t best = 0;
	for (size_t i = 1; i < rows; i++)
		if (fabs(a[i]) > fabs(a[best]))
			best = i;
	*pivot = (uint32_t)best;
	if (!(fabs(a[best]) > smallest) || !isfinite(a[best]))
		return 0;
	double kept = a[best];
	a[best] = a[0];
	a[0] = kept;
	for (size_t i = 1; i < rows; i++)
		a[i] /= kept;
	return 1;
}

/* Recursive LU of a (rows, columns), rows >= columns (Toledo 1997). pivot counts from the block's first row. */
static size_t factor_tall(double *a, size_t leading, size_t rows, size_t columns, double smallest, uint32_t *pivot)
{
	if (columns == 1)
		return pivot_column(a, rows, smallest, pivot);
	size_t left = columns / 2, right = columns - left;
	double *beside = a + left * leading;
	size_t done = factor_tall(a, leading, rows, left, smallest, pivot);
	if (done < left)
		return done;
	for (size_t k = 0; k < left; k++)
		exchange_rows(beside, leading, right, k, pivot[k]);
	gnp_linalg_solve_lower(left, right, a, leading, beside, leading);
	gnp_linalg_subtract_product(rows - left, right, left, a + left, leading, beside, leading, beside + left, leading);
	done = left + factor_tall(beside + left, leading, rows - left, right, smallest, pivot + left);
	for (size_t k = left; k < done; k++) {
		pivot[k] += (uint32_t)left;
		exchange_rows(a, leading, left, k, pivot[k]);
	}
	return done;
}

size_t gnp_factor_front_pivot(struct gnp_factor_front *front, double smallest)
{
	if (front->symmetric)
		return gnp_linalg_cholesky(front->width, front->panel, front->rows, smallest);
	return factor_tall(front->panel, front->rows, front->width, front->width, smallest, front->pivot);
}

void gnp_factor_front_rows(struct gnp_factor_front *front, size_t begin, size_t end)
{
	double *rows = front->panel + front->width + begin;
	if (front->symmetric)
		gnp_linalg_solve_cholesky_right(end - begin, front->width, front->panel, front->rows, rows, front->rows);
	else
		gnp_linalg_solve_upper_right(end - begin, front->width, front->panel, front->rows, rows, front->rows);
}

static void square_columns(struct gnp_factor_front *front, size_t begin, size_t end)
{
	for (size_t next; begin < end; begin = next) {
		next = end - begin > GNP_FACTOR_FRONT_COLUMNS ? begin + GNP_FACTOR_FRONT_COLUMNS : end;
		gnp_linalg_subtract_square(front->border - begin, next - begin, front->width,
		                           front->panel + front->width + begin, front->rows,
		                           front->border_block + begin * front->border + begin, front->border);
	}
}

void gnp_factor_front_columns(struct gnp_factor_front *front, size_t begin, size_t end)
{
	if (front->symmetric) {
		square_columns(front, begin, end);
		return;
	}
	double *over = front->over + begin * front->width, *block = front->border_block + begin * front->border;
	for (size_t k = 0; k < front->width; k++)
		exchange_rows(over, front->width, end - begin, k, front->pivot[k]);
	gnp_linalg_solve_lower(front->width, end - begin, front->panel, front->rows, over, front->width);
	gnp_linalg_subtract_product(front->border, end - begin, front->width, front->panel + front->width, front->rows,
	                            over, front->width, block, front->border);
}
