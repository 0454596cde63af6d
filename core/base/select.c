#include "core/base/select.h"

/* Hoare's selection with the middle element as pivot: linear on the average, no worse on sorted input. */
double gnp_select(double *values, size_t count, size_t k)
{
	size_t low = 0, high = count - 1;
	while (low < high) {
		double pivot = values[low + (high - low) / 2];
		size_t i = low, j = high;
		for (;;) {
			while (values[i] < pivot)
				i++;
			while (values[j] > pivot)
				j--;
			if (i >= j)
				break;
			double swap = values[i];
			values[i++] = values[j];
			values[j--] = swap;
		}
		if (k <= j)
			high = j;
		else
			low = j + 1;
	}
	return values[k];
}

double gnp_median(double *values, size_t count)
{
	return count ? gnp_select(values, count, (count - 1) / 2) : 0;
}

double gnp_median_deviation(double *sizes, size_t count)
{
	static const double DEVIATION = 1.4826; /* of the median of |x|, x normal */
	return DEVIATION * gnp_median(sizes, count);
}
