#include "core/equations/load.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/operators/rim.h"

/* load (rows, count): of each place. Points that coincide have the mean of their right-hand sides: each gets all of
 * it. */
static void give(const struct gnp_domain *domain, const double *load, size_t count, double *source)
{
	for (size_t i = 0; i < domain->prepared.count; i++)
		for (size_t c = 0; c < count; c++)
			source[domain->prepared.order[i] * count + c] += load[i * count + c];
	for (size_t k = 0; k < domain->copies.count; k++) {
		const struct gnp_copy *copy = &domain->copies.copy[k];
		for (size_t c = 0; copy->row != GNP_COPY_OUTSIDE && c < count; c++)
			source[copy->index * count + c] += load[copy->row * count + c];
	}
}

/* (rows, count) zeros, freed by the caller. */
static double *loads_new(const struct gnp_domain *domain, size_t count)
{
	size_t entries;
	return gnp_size_multiply(domain->prepared.count, count, &entries) ? gnp_array_zero(entries, sizeof(double)) : NULL;
}

/* What the edge of each point lets in. length (rows). */
static gnp_status add_flux(const struct gnp_domain *domain, const double *length, const double *flux, size_t count,
                           double *load, struct gnp_error *error)
{
	for (size_t i = 0; i < domain->prepared.count; i++)
		for (size_t c = 0; length[i] > 0 && c < count; c++) {
			size_t point = domain->prepared.order[i];
			double value = flux[point * count + c];
			if (!isfinite(value))
				return gnp_error_set(error, GNP_INVALID_ARGUMENT,
				                     "flux: value %zu of point %zu is %g", c, point, value);
			load[i * count + c] = value * length[i] / domain->area[i];
		}
	return GNP_OK;
}

gnp_status gnp_load_flux(const struct gnp_poisson *poisson, const double *flux, size_t count, struct gnp_pool *pool,
                         struct gnp_task *task, double *source, double *rim, struct gnp_error *error)
{
	const struct gnp_domain *domain = gnp_poisson_domain(poisson);
	size_t n = domain->prepared.count;
	double sum = 0;
	if (gnp_poisson_info(poisson).system != GNP_SYSTEM_SYMMETRIC)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "flux: the operator is collocation, which has no open edges: need system=symmetric "
		                     "(auto takes it unless the surface is closed)");
	double *length = gnp_array_new(n, sizeof *length), *load = loads_new(domain, count);
	gnp_status status = length && load ? gnp_rim_measure(&domain->prepared, pool, task, length, error)
	                                   : gnp_no_memory("flux", n, "points", error);
	for (size_t i = 0; i < n && status == GNP_OK; i++)
		sum += length[i];
	if (status == GNP_OK && !(sum > 0))
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "flux: the surface has no open edge");
	if (status == GNP_OK)
		status = add_flux(domain, length, flux, count, load, error);
	if (status == GNP_OK)
		give(domain, load, count, source);
	free(length);
	free(load);
	if (status == GNP_OK && rim)
		*rim = sum;
	return status;
}

/* Rows of all points of the cloud, GNP_COPY_OUTSIDE where the filter dropped one; freed by the caller. */
static uint32_t *rows_of(const struct gnp_domain *domain)
{
	uint32_t *row = gnp_array_new(domain->cloud_count, sizeof *row);
	for (size_t i = 0; row && i < domain->cloud_count; i++)
		row[i] = GNP_COPY_OUTSIDE;
	for (size_t i = 0; row && i < domain->prepared.count; i++)
		row[domain->prepared.order[i]] = (uint32_t)i;
	for (size_t k = 0; row && k < domain->copies.count; k++)
		row[domain->copies.copy[k].index] = domain->copies.copy[k].row;
	return row;
}

static gnp_status check_point(const struct gnp_domain *domain, const uint32_t *row, size_t s, uint32_t point,
                              struct gnp_error *error)
{
	if (point >= domain->cloud_count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "source_points[%zu]: got point %u, the cloud has %zu", s, point, domain->cloud_count);
	if (row[point] == GNP_COPY_OUTSIDE)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "source_points[%zu]: the filter dropped point %u", s, point);
	return GNP_OK;
}

gnp_status gnp_load_points(const struct gnp_poisson *poisson, const uint32_t *index, const double *strength,
                           size_t points, size_t count, double *source, struct gnp_error *error)
{
	const struct gnp_domain *domain = gnp_poisson_domain(poisson);
	uint32_t *row = rows_of(domain);
	double *load = loads_new(domain, count);
	gnp_status status = row && load ? GNP_OK : gnp_no_memory("source_points", domain->cloud_count, "points", error);
	for (size_t s = 0; s < points && status == GNP_OK; s++) {
		status = check_point(domain, row, s, index[s], error);
		for (size_t c = 0; c < count && status == GNP_OK; c++)
			load[row[index[s]] * count + c] += strength[s * count + c] / domain->area[row[index[s]]];
	}
	if (status == GNP_OK)
		give(domain, load, count, source);
	free(row);
	free(load);
	return status;
}
