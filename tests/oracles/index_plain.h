/* A search tree that is none: looks at every point. What index_flann.c is held against. */
#ifndef GNP_TESTS_INDEX_PLAIN_H
#define GNP_TESTS_INDEX_PLAIN_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/search/index.h"

struct plain_entry {
	double square;
	int index;
};

struct gnp_index {
	const double *points;
	size_t count;
};

static int plain_compare(const void *a, const void *b)
{
	const struct plain_entry *x = a, *y = b;
	if (x->square != y->square)
		return x->square < y->square ? -1 : 1;
	return (x->index > y->index) - (x->index < y->index);
}

static gnp_status plain_build(const double *points, size_t count, struct gnp_index **out, struct gnp_error *error)
{
	struct gnp_index *index = malloc(sizeof *index);
	(void)error;
	*index = (struct gnp_index){points, count};
	*out = index;
	return GNP_OK;
}

/* The nearest `most` of the points whose square is at most `limit`, ascending. */
static size_t plain_search(const struct gnp_index *index, const double *centre, double limit, size_t most, int *found,
                           double *square)
{
	struct plain_entry *entries = malloc(index->count * sizeof *entries);
	size_t count = 0;
	for (size_t i = 0; i < index->count; i++) {
		double sum = 0;
		for (int c = 0; c < 3; c++)
			sum += (centre[c] - index->points[3 * i + c]) * (centre[c] - index->points[3 * i + c]);
		if (sum <= limit)
			entries[count++] = (struct plain_entry){sum, (int)i};
	}
	qsort(entries, count, sizeof *entries, plain_compare);
	count = count < most ? count : most;
	for (size_t i = 0; i < count; i++) {
		found[i] = entries[i].index;
		square[i] = entries[i].square;
	}
	free(entries);
	return count;
}

static gnp_status plain_nearest(const struct gnp_index *index, const double *points, size_t queries, size_t k,
                                int *found, double *square, struct gnp_error *error)
{
	(void)error;
	for (size_t q = 0; q < queries; q++)
		plain_search(index, points + 3 * q, INFINITY, k, found + q * k, square + q * k);
	return GNP_OK;
}

static gnp_status plain_prepare(const struct gnp_index *index, size_t most, struct gnp_error *error)
{
	(void)index, (void)most, (void)error;
	return GNP_OK;
}

static size_t plain_within(const struct gnp_index *index, const double *centre, double radius, size_t most, int *found,
                           double *square)
{
	return plain_search(index, centre, radius * radius * (1 + 1e-12), most, found, square);
}

static size_t plain_bytes(const struct gnp_index *index)
{
	(void)index;
	return sizeof *index;
}

static void plain_free(struct gnp_index *index)
{
	free(index);
}

static const struct gnp_index_kind plain_index = {plain_build,  plain_nearest, plain_prepare,
                                                  plain_within, plain_bytes,   plain_free};

#endif
