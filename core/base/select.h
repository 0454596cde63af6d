/* Order statistics of small arrays, in place: O(count) on average. */
#ifndef GNP_CORE_SELECT_H
#define GNP_CORE_SELECT_H

#include <stddef.h>

/* The k-th smallest (k from 0) of count > k values, which are reordered. */
double gnp_select(double *values, size_t count, size_t k);

/* The median (the lower one of an even count), reordering the values; 0 for none. */
double gnp_median(double *values, size_t count);

/* The standard deviation of the normal distribution whose sizes have this median: robust against half of them. 0 for
 * none; reorders the sizes, which are absolute values. */
double gnp_median_deviation(double *sizes, size_t count);

#endif
