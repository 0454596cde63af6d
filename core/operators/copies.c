#include "core/operators/copies.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cloud/distinct.h"

void gnp_copies_clear(struct gnp_copies *copies)
{
	free(copies->copy);
	*copies = (struct gnp_copies){.count = 0};
}

void gnp_places_clear(struct gnp_places *places)
{
	free(places->points);
	free(places->normals);
	free(places->index);
	*places = (struct gnp_places){.count = 0};
}

/* first (places): where each was met first. */
static gnp_status take_places(const struct gnp_cloud *cloud, const uint32_t *first, size_t count,
                              struct gnp_places *out, struct gnp_error *error)
{
	struct gnp_places places = {.count = count, .points = gnp_array_new(count, 3 * sizeof(double)),
	                            .normals = cloud->normals ? gnp_array_new(count, 3 * sizeof(double)) : NULL,
	                            .index = gnp_array_new(count, sizeof *places.index)};
	if (!places.points || !places.index || (cloud->normals && !places.normals)) {
		gnp_places_clear(&places);
		return gnp_no_memory("points", count, "places", error);
	}
	for (size_t i = 0; i < count; i++) {
		size_t from = places.index[i] = first[i];
		memcpy(places.points + 3 * i, cloud->points + 3 * from, 3 * sizeof(double));
		if (cloud->normals)
			memcpy(places.normals + 3 * i, cloud->normals + 3 * from, 3 * sizeof(double));
	}
	*out = places;
	return GNP_OK;
}

static gnp_status take_copies(size_t points, const uint32_t *which, const uint32_t *first, size_t places,
                              struct gnp_copies *out, struct gnp_error *error)
{
	struct gnp_copies copies = {.copy = gnp_array_new(points - places, sizeof *copies.copy)};
	uint32_t *there = gnp_array_zero(places, sizeof *there);
	if (!copies.copy || !there) {
		gnp_copies_clear(&copies);
		free(there);
		return gnp_no_memory("points", points - places, "copies", error);
	}
	for (size_t i = 0; i < points; i++) {
		there[which[i]]++;
		if (first[which[i]] != i)
			copies.copy[copies.count++] = (struct gnp_copy){(uint32_t)i, first[which[i]], GNP_COPY_OUTSIDE, 0, 0, 0};
	}
	for (size_t k = 0; k < copies.count; k++)
		copies.copy[k].points = there[which[copies.copy[k].index]];
	free(there);
	*out = copies;
	return GNP_OK;
}

gnp_status gnp_copies_part(const struct gnp_cloud *cloud, struct gnp_task *task, struct gnp_places *places,
                           struct gnp_copies *copies, struct gnp_error *error)
{
	size_t count = cloud->count;
	uint32_t *which = gnp_array_new(count, sizeof *which), *first = gnp_array_new(count, sizeof *first);
	struct gnp_places made = {.count = count};
	gnp_status status = which && first ? gnp_distinct_find(cloud->points, count, task, which, first, &made.count, error)
	                                   : gnp_no_memory("points", count, "places", error);
	bool alone = made.count == count;
	if (status == GNP_OK && !alone)
		status = take_places(cloud, first, made.count, &made, error);
	if (status == GNP_OK && !alone)
		status = take_copies(count, which, first, made.count, copies, error);
	free(which);
	free(first);
	if (status == GNP_OK)
		*places = made;
	else
		gnp_places_clear(&made);
	return status;
}

gnp_status gnp_copies_find_rows(struct gnp_copies *copies, const uint32_t *order, size_t count, size_t cloud_count,
                                struct gnp_error *error)
{
	if (copies->count == 0)
		return GNP_OK;
	uint32_t *row = gnp_array_new(cloud_count, sizeof *row);
	if (!row)
		return gnp_no_memory("points", cloud_count, "rows", error);
	for (size_t i = 0; i < cloud_count; i++)
		row[i] = GNP_COPY_OUTSIDE;
	for (size_t i = 0; i < count; i++)
		row[order[i]] = (uint32_t)i;
	for (size_t k = 0; k < copies->count; k++)
		copies->copy[k].row = row[copies->copy[k].original];
	free(row);
	return GNP_OK;
}

void gnp_copies_spread(const struct gnp_copies *copies, double *values, size_t width, size_t column)
{
	for (size_t k = 0; k < copies->count; k++)
		values[width * copies->copy[k].index + column] = values[width * copies->copy[k].original + column];
}

void gnp_copies_merge(const struct gnp_copies *copies, double *values, size_t width, size_t column)
{
	const struct gnp_copy *copy = copies->copy;
	for (size_t k = 0; k < copies->count; k++) /* of all copies while no original has changed */
		values[width * copy[k].index + column] -= values[width * copy[k].original + column];
	for (size_t k = 0; k < copies->count; k++)
		values[width * copy[k].original + column] += values[width * copy[k].index + column] / copy[k].points;
	gnp_copies_spread(copies, values, width, column);
}

void gnp_copies_average(const struct gnp_copies *copies, const double *values, size_t width, size_t column,
                        double *rows)
{
	for (size_t k = 0; k < copies->count; k++) {
		const struct gnp_copy *copy = &copies->copy[k];
		double more = values[width * copy->index + column] - values[width * copy->original + column];
		if (copy->row != GNP_COPY_OUTSIDE)
			rows[copy->row] += more / copy->points;
	}
}
