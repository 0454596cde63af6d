#include "core/operators/domain.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/area.h"
#include "core/operators/star_normals.h"

void gnp_domain_clear(struct gnp_domain *domain)
{
	gnp_prepared_clear(&domain->prepared);
	free(domain->area);
	free(domain->dropped_index);
	free(domain->dropped_points);
	gnp_copies_clear(&domain->copies);
	*domain = (struct gnp_domain){.cloud_count = 0};
}

struct gnp_domain_facts gnp_domain_facts(const struct gnp_domain *domain)
{
	return (struct gnp_domain_facts){domain->normals_estimated, domain->components, domain->patches, domain->degenerate, domain->outliers,
	                                 domain->model};
}

size_t gnp_domain_bytes(const struct gnp_domain *domain)
{
	/* order, points, normals twice, area, and the search tree with about 100 bytes a point */
	return domain->prepared.count * (sizeof(uint32_t) + 10 * sizeof(double) + 100) +
	       domain->dropped * (sizeof(uint32_t) + 3 * sizeof(double)) + domain->copies.count * sizeof(struct gnp_copy);
}

/* Rows of the estimate are in the cloud's order, those of prepared along the curve. */
static void take_rows(const struct gnp_prepared *prepared, const double *from, double *to)
{
	for (size_t i = 0; i < prepared->count; i++)
		memcpy(to + 3 * i, from + 3 * (size_t)prepared->order[i], 3 * sizeof(double));
}

/* Those from before stay beside them. */
static gnp_status take_normals(struct gnp_prepared *prepared, const double *fitted, struct gnp_error *error)
{
	double *normals = gnp_array_new(prepared->count, 3 * sizeof *normals);
	if (!normals)
		return gnp_no_memory("normals", prepared->count, "points", error);
	prepared->unfitted = prepared->normals;
	prepared->normals = normals;
	take_rows(prepared, fitted, normals);
	return GNP_OK;
}

static gnp_status settle(const struct gnp_domain_options *options, struct gnp_pool *pool, struct gnp_task *task,
                         struct gnp_domain *domain, struct gnp_error *error)
{
	struct gnp_estimate_options wanted = options->estimate;
	struct gnp_estimate estimate = {.count = 0};
	wanted.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | (options->project ? GNP_QUANTITY_BIT(GNP_POINTS) : 0);
	gnp_status status = gnp_estimate_prepared(&domain->prepared, &wanted, pool, task, &estimate, error);
	if (status != GNP_OK)
		return status;
	status = take_normals(&domain->prepared, estimate.values[GNP_NORMALS], error);
	if (status == GNP_OK && options->project) {
		take_rows(&domain->prepared, estimate.values[GNP_POINTS], domain->prepared.points);
		status = gnp_prepared_index(&domain->prepared, error);
	}
	domain->patches = estimate.patches;
	domain->degenerate = estimate.degenerate;
	domain->outliers = estimate.outliers;
	domain->model = estimate.model;
	gnp_estimate_clear(&estimate);
	return status == GNP_OK ? gnp_star_normals_choose(&domain->prepared, pool, task, error) : status;
}

static gnp_status measure(struct gnp_pool *pool, struct gnp_task *task, struct gnp_domain *domain,
                          struct gnp_error *error)
{
	domain->area = gnp_array_new(domain->prepared.count, sizeof *domain->area);
	if (!domain->area)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "area: no memory for %zu points", domain->prepared.count);
	return gnp_area_measure(&domain->prepared, pool, task, domain->area, &domain->open, error);
}

static gnp_status take_dropped(const struct gnp_cloud *cloud, const struct gnp_filter *filter,
                               struct gnp_domain *domain, struct gnp_error *error)
{
	size_t dropped = filter->count - filter->kept;
	domain->dropped_index = gnp_array_new(dropped, sizeof *domain->dropped_index);
	domain->dropped_points = gnp_array_new(dropped, 3 * sizeof *domain->dropped_points);
	if (!domain->dropped_index || !domain->dropped_points)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "filter: no memory for %zu dropped points", dropped);
	for (size_t i = 0; i < filter->count; i++) {
		if (filter->keep[i])
			continue;
		domain->dropped_index[domain->dropped] = (uint32_t)i;
		memcpy(domain->dropped_points + 3 * domain->dropped++, cloud->points + 3 * i, 3 * sizeof(double));
	}
	return GNP_OK;
}

/* The cloud as the filter leaves it; the order becomes that of the whole cloud. */
static gnp_status settle_filtered(const struct gnp_cloud *cloud, const struct gnp_domain_options *options,
                                  struct gnp_pool *pool, struct gnp_task *task, struct gnp_domain *domain,
                                  struct gnp_error *error)
{
	struct gnp_filter filter;
	gnp_status status = gnp_filter_run(cloud, options->filter, pool, task, &filter, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_cloud kept = {filter.kept, filter.points, filter.normals};
	status = take_dropped(cloud, &filter, domain, error);
	if (status == GNP_OK)
		status = gnp_prepare_fitted(&kept, pool, task, &domain->prepared, error);
	if (status == GNP_OK)
		status = settle(options, pool, task, domain, error);
	for (size_t i = 0; i < domain->prepared.count && status == GNP_OK; i++)
		domain->prepared.order[i] = filter.index[domain->prepared.order[i]];
	domain->normals_estimated = filter.normals_estimated;
	domain->components = filter.components;
	gnp_filter_clear(&filter);
	return status;
}

static gnp_status settle_whole(const struct gnp_cloud *cloud, const struct gnp_domain_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_domain *domain,
                               struct gnp_error *error)
{
	gnp_status status = gnp_prepare(cloud, pool, task, &domain->prepared, error);
	if (status != GNP_OK)
		return status;
	domain->components = domain->prepared.components;
	return settle(options, pool, task, domain, error);
}

/* Entries of operators are inverse squares of lengths, and their squares and products have to be numbers, too. */
static gnp_status check_extent(const struct gnp_cloud *cloud, struct gnp_error *error)
{
	static const double least = 1e-25, most = 1e25;
	double extent = 0;
	for (size_t i = 3; i < 3 * cloud->count; i++)
		extent = fmax(extent, fabs(cloud->points[i] - cloud->points[i % 3]));
	if (extent >= least && extent <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "points: lie within %g of the first one, equations need %g..%g: take another unit of length",
	                     extent, least, most);
}

/* Indices among places become indices in the cloud. */
static void name_places(const struct gnp_places *places, struct gnp_domain *domain)
{
	for (size_t i = 0; i < domain->prepared.count; i++)
		domain->prepared.order[i] = places->index[domain->prepared.order[i]];
	for (size_t i = 0; i < domain->dropped; i++)
		domain->dropped_index[i] = places->index[domain->dropped_index[i]];
}

static void warn_of_copies(const struct gnp_copies *copies, struct gnp_warnings *warnings)
{
	if (copies->count)
		gnp_warnings_add(warnings, GNP_WARNING_COPIES,
		                 "%zu points lie where another one does, point %u where point %u is: they were merged, and "
		                 "have the same values", copies->count, copies->copy[0].index, copies->copy[0].original);
}

/* The places of the cloud, settled. */
static gnp_status settle_places(const struct gnp_cloud *cloud, const struct gnp_domain_options *options, size_t fewest,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_domain *domain,
                                struct gnp_error *error)
{
	struct gnp_places places = {.count = 0};
	gnp_status status = gnp_copies_part(cloud, task, &places, &domain->copies, error);
	if (status != GNP_OK)
		return status;
	warn_of_copies(&domain->copies, gnp_task_warnings(task));
	struct gnp_cloud apart = {places.count, places.points, places.normals};
	const struct gnp_cloud *alone = places.points ? &apart : cloud;
	if (places.points)
		status = gnp_cloud_check(alone, fewest, error);
	if (status == GNP_OK)
		status = options->filter ? settle_filtered(alone, options, pool, task, domain, error)
		                         : settle_whole(alone, options, pool, task, domain, error);
	if (status == GNP_OK && places.points)
		name_places(&places, domain);
	gnp_places_clear(&places);
	return status == GNP_OK ? gnp_copies_find_rows(&domain->copies, domain->prepared.order, domain->prepared.count,
	                                               domain->cloud_count, error) : status;
}

gnp_status gnp_domain_make(const struct gnp_cloud *cloud, const struct gnp_domain_options *options,
                           struct gnp_pool *pool, struct gnp_task *task, struct gnp_domain *out,
                           struct gnp_error *error)
{
	enum { FEWEST = 12 };
	size_t fewest = options->estimate.k > FEWEST ? (size_t)options->estimate.k : FEWEST;
	struct gnp_domain domain = {.cloud_count = cloud->count, .normals_estimated = !cloud->normals};
	gnp_status status = gnp_cloud_check(cloud, fewest, error);
	if (status == GNP_OK)
		status = check_extent(cloud, error);
	if (status == GNP_OK)
		status = settle_places(cloud, options, fewest, pool, task, &domain, error);
	if (status == GNP_OK)
		status = measure(pool, task, &domain, error);
	if (status == GNP_OK)
		*out = domain;
	else
		gnp_domain_clear(&domain);
	return status;
}

bool gnp_domain_is_closed(const struct gnp_domain *domain)
{
	return (double)domain->open <= sqrt((double)domain->prepared.count);
}
