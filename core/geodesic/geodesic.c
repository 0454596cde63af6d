#include "core/geodesic/geodesic.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/cell.h"
#include "core/cells/front.h"
#include "core/cells/volume.h"
#include "core/geodesic/geodesic_check.h"
#include "core/geodesic/geodesic_parts.h"
#include "core/operators/operator_check.h"

void gnp_geodesic_free(struct gnp_geodesic *geodesic)
{
	if (!geodesic)
		return;
	free(geodesic->place);
	gnp_fans_clear(&geodesic->shared);
	gnp_domain_clear(&geodesic->domain);
	free(geodesic);
}

size_t gnp_geodesic_bytes(const struct gnp_geodesic *geodesic)
{
	return sizeof *geodesic + gnp_domain_bytes(&geodesic->domain) + gnp_fans_bytes(&geodesic->shared) +
	       geodesic->domain.cloud_count * sizeof *geodesic->place;
}

const struct gnp_domain *gnp_geodesic_domain(const struct gnp_geodesic *geodesic)
{
	return &geodesic->domain;
}

/* ---- What is prepared ---- */

static gnp_status check_crossings(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_error *error)
{
	struct gnp_stiffness volumes;
	if (!task)
		return GNP_OK;
	gnp_status status = gnp_volume_stiffness(prepared, pool, task, &volumes, error);
	if (status != GNP_OK)
		return status;
	gnp_operator_check_crossings(prepared, &volumes, gnp_task_warnings(task));
	gnp_stiffness_clear(&volumes);
	return GNP_OK;
}

static gnp_status make_triangles(struct gnp_geodesic *geodesic, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_error *error)
{
	const struct gnp_prepared *prepared = &geodesic->domain.prepared;
	struct gnp_fans fans;
	gnp_status status = gnp_fans_make(prepared, pool, task, &fans, error);
	if (status != GNP_OK)
		return status;
	status = gnp_fans_share(&fans, prepared, &geodesic->shared, error);
	gnp_fans_clear(&fans);
	if (status == GNP_OK)
		geodesic->longest = gnp_fans_longest_edge(&geodesic->shared, prepared);
	return status;
}

static gnp_status make_places(struct gnp_geodesic *geodesic, struct gnp_error *error)
{
	const struct gnp_domain *domain = &geodesic->domain;
	geodesic->place = gnp_array_new(domain->cloud_count, sizeof *geodesic->place);
	if (!geodesic->place)
		return gnp_no_memory("geodesic", domain->cloud_count, "points", error);
	for (size_t i = 0; i < domain->cloud_count; i++)
		geodesic->place[i] = GNP_GEODESIC_DROPPED;
	for (size_t i = 0; i < domain->prepared.count; i++)
		geodesic->place[domain->prepared.order[i]] = (uint32_t)i;
	for (size_t k = 0; k < domain->copies.count; k++)
		geodesic->place[domain->copies.copy[k].index] = geodesic->place[domain->copies.copy[k].original];
	return GNP_OK;
}

static gnp_status make(const struct gnp_cloud *cloud, const struct gnp_domain_options *options, struct gnp_pool *pool,
                       struct gnp_task *task, struct gnp_geodesic *geodesic, struct gnp_error *error)
{
	gnp_status status = gnp_domain_make(cloud, options, pool, task, &geodesic->domain, error);
	gnp_task_stage(task, GNP_STAGE_ASSEMBLE, 0);
	if (status == GNP_OK)
		status = make_places(geodesic, error);
	if (status == GNP_OK)
		status = check_crossings(&geodesic->domain.prepared, pool, task, error);
	if (status == GNP_OK)
		status = make_triangles(geodesic, pool, task, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	return status;
}

gnp_status gnp_geodesic_create(const struct gnp_cloud *cloud, const struct gnp_domain_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_geodesic **out,
                               struct gnp_error *error)
{
	struct gnp_geodesic *geodesic = gnp_array_zero(1, sizeof *geodesic);
	if (!geodesic)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "geodesic: no memory");
	gnp_status status = make(cloud, options, pool, task, geodesic, error);
	if (status == GNP_OK)
		*out = geodesic;
	else
		gnp_geodesic_free(geodesic);
	return status;
}

/* ---- Fronts from sources ---- */

/* The sources in curve order, freed by the caller. */
static gnp_status place_sources(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                uint32_t **placed, struct gnp_error *error)
{
	size_t n = geodesic->domain.cloud_count, lost = 0;
	if (count == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "sources: got none, need at least 1");
	for (size_t s = 0; s < count; s++)
		if (sources[s] >= n)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "sources[%zu]: got point %u, the cloud has %zu", s,
			                     sources[s], n);
	for (size_t s = 0; s < count; s++)
		lost += geodesic->place[sources[s]] == GNP_GEODESIC_DROPPED;
	if (lost)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "sources: the filter dropped %zu of %zu", lost, count);
	*placed = gnp_array_new(count, sizeof **placed);
	if (!*placed)
		return gnp_no_memory("sources", count, "points", error);
	for (size_t s = 0; s < count; s++)
		(*placed)[s] = geodesic->place[sources[s]];
	return GNP_OK;
}

/* Rows of width numbers from curve order to the cloud's; where a point was dropped, `other`. */
static void restore(const struct gnp_geodesic *geodesic, const double *rows, size_t width, double other, double *out)
{
	for (size_t i = 0; i < geodesic->domain.cloud_count; i++) {
		const double *row = geodesic->place[i] == GNP_GEODESIC_DROPPED ? NULL : rows + width * geodesic->place[i];
		for (size_t c = 0; c < width; c++)
			out[width * i + c] = row ? row[c] : other;
	}
}

gnp_status gnp_geodesic_distance(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                 struct gnp_pool *pool, struct gnp_task *task, double *distance,
                                 struct gnp_error *error)
{
	const struct gnp_prepared *prepared = &geodesic->domain.prepared;
	uint32_t *placed = NULL;
	gnp_status status = place_sources(geodesic, sources, count, &placed, error);
	if (status != GNP_OK)
		return status;
	double *found = gnp_array_new(prepared->count, sizeof *found);
	gnp_task_stage(task, GNP_STAGE_SOLVE, 0);
	status = found ? gnp_front_find(prepared, &geodesic->shared, placed, count, NULL, NULL, task, found, error)
	               : gnp_no_memory("geodesic", prepared->count, "points", error);
	if (status == GNP_OK)
		status = gnp_geodesic_check(prepared, placed, count, pool, task, found, error);
	if (status == GNP_OK)
		restore(geodesic, found, 1, INFINITY, distance);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	free(found);
	free(placed);
	return status;
}

/* ---- Vectors ---- */

/* *largest: of all coordinates at the sources, which the tangential parts are divided by so that their squares stay in
 * range; 1 where all are zero. */
static gnp_status take_tangential(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                  const double *vectors, double *out, double *largest, struct gnp_error *error)
{
	*largest = 0;
	for (size_t s = 0; s < count; s++)
		for (size_t c = 0; c < 3; c++) {
			double part = vectors[3 * (size_t)sources[s] + c];
			if (!isfinite(part))
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "vectors: got %g at point %u, need finite numbers",
				                     part, sources[s]);
			*largest = fmax(*largest, fabs(part));
		}
	*largest = *largest > 0 ? *largest : 1;
	for (size_t s = 0; s < count; s++) {
		size_t place = geodesic->place[sources[s]];
		const double *v = vectors + 3 * (size_t)sources[s], *n = geodesic->domain.prepared.normals + 3 * place;
		double height = gnp_dot((double[]){v[0] / *largest, v[1] / *largest, v[2] / *largest}, n);
		for (size_t c = 0; c < 3; c++)
			out[3 * place + c] = v[c] / *largest - height * n[c];
	}
	return GNP_OK;
}

gnp_status gnp_geodesic_parallel(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                 const double *vectors, struct gnp_task *task, double *parallel,
                                 struct gnp_error *error)
{
	size_t n = geodesic->domain.prepared.count;
	uint32_t *placed = NULL;
	gnp_status status = place_sources(geodesic, sources, count, &placed, error);
	if (status != GNP_OK)
		return status;
	double *block = gnp_array_zero(n, 4 * sizeof *block), largest = 1;
	const struct gnp_carried carried = {.vector = block};
	gnp_task_stage(task, GNP_STAGE_SOLVE, 0);
	status = block ? take_tangential(geodesic, sources, count, vectors, block, &largest, error)
	               : gnp_no_memory("parallel", n, "points", error);
	if (status == GNP_OK)
		status = gnp_front_find(&geodesic->domain.prepared, &geodesic->shared, placed, count, &carried, NULL, task,
		                        block + 3 * n, error);
	for (size_t i = 0; i < 3 * n && status == GNP_OK; i++)
		block[i] *= largest;
	if (status == GNP_OK)
		restore(geodesic, block, 3, 0, parallel);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	free(block);
	free(placed);
	return status;
}

/* ---- The log map ---- */

static void write_log(const struct gnp_geodesic *geodesic, const double *start, const double *distance,
                      double basis[2][3], double *log)
{
	for (size_t i = 0; i < geodesic->domain.cloud_count; i++) {
		uint32_t place = geodesic->place[i];
		bool there = place != GNP_GEODESIC_DROPPED && isfinite(distance[place]);
		for (size_t c = 0; c < 2; c++)
			log[2 * i + c] = there ? distance[place] * gnp_dot(start + 3 * (size_t)place, basis[c]) : 0;
	}
}

gnp_status gnp_geodesic_log(const struct gnp_geodesic *geodesic, uint32_t source, struct gnp_pool *pool,
                            struct gnp_task *task, double *log, double basis[2][3], struct gnp_error *error)
{
	const struct gnp_prepared *prepared = &geodesic->domain.prepared;
	size_t n = prepared->count;
	uint32_t *placed = NULL;
	gnp_status status = place_sources(geodesic, &source, 1, &placed, error);
	if (status != GNP_OK)
		return status;
	double *start = gnp_array_zero(n, 4 * sizeof *start), *distance = start ? start + 3 * n : NULL;
	const struct gnp_carried carried = {.start = start};
	gnp_task_stage(task, GNP_STAGE_SOLVE, 0);
	status = start ? gnp_front_find(prepared, &geodesic->shared, placed, 1, &carried, NULL, task, distance, error)
	               : gnp_no_memory("log", n, "points", error);
	if (status == GNP_OK)
		status = gnp_geodesic_check(prepared, placed, 1, pool, task, distance, error);
	if (status == GNP_OK) {
		gnp_tangents_of(prepared->normals + 3 * (size_t)*placed, basis);
		write_log(geodesic, start, distance, basis, log);
	}
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	free(start);
	free(placed);
	return status;
}
