/* Dot and cross products of three-vectors, the largest coordinate, and the order of numbers for qsort: what many files need. */
#ifndef GNP_CORE_VECTOR_H
#define GNP_CORE_VECTOR_H

/* The largest coordinate of a cloud: squares of distances stay finite. */
#define GNP_COORDINATE_MAX 1e100

static inline double gnp_dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out must be neither a nor b. */
static inline void gnp_cross(const double a[3], const double b[3], double out[3])
{
	out[0] = a[1] * b[2] - a[2] * b[1];
	out[1] = a[2] * b[0] - a[0] * b[2];
	out[2] = a[0] * b[1] - a[1] * b[0];
}

/* For qsort: ascending doubles, none of them NaN. */
static inline int gnp_double_compare(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

#endif
