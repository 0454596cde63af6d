#include "core/equations/geodesic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/fans.h"
#include "core/cells/volume.h"
#include "core/equations/geodesic_check.h"
#include "core/linear/components.h"
#include "core/linear/factor_solve.h"
#include "core/operators/operator_check.h"

/* Heat must not underflow across the cloud: exp(-700) is the last double of full precision. */
static const double longest_way = 500; /* in units of sqrt t */

enum { POINTS_A_CHUNK = 1024 };

struct gnp_geodesic {
	struct gnp_domain domain;
	struct gnp_stiffness stiffness;
	struct gnp_components components;
	struct gnp_fans fans;
	struct gnp_factor *heat, *poisson;
	double time; /* t [length^2] */
};

void gnp_geodesic_free(struct gnp_geodesic *geodesic)
{
	if (!geodesic)
		return;
	gnp_factor_free(geodesic->heat);
	gnp_factor_free(geodesic->poisson);
	gnp_fans_clear(&geodesic->fans);
	gnp_components_clear(&geodesic->components);
	gnp_stiffness_clear(&geodesic->stiffness);
	gnp_domain_clear(&geodesic->domain);
	free(geodesic);
}

size_t gnp_geodesic_bytes(const struct gnp_geodesic *geodesic)
{
	size_t edges = geodesic->stiffness.start[geodesic->stiffness.count];
	return sizeof *geodesic + gnp_domain_bytes(&geodesic->domain) + gnp_factor_bytes(geodesic->heat) + gnp_factor_bytes(geodesic->poisson) +
	       gnp_fans_bytes(&geodesic->fans) + edges * 12 + geodesic->domain.prepared.count * 40;
}

const struct gnp_domain *gnp_geodesic_domain(const struct gnp_geodesic *geodesic)
{
	return &geodesic->domain;
}

/* The square of the mean spacing, or more where heat would not get across. */
static double flow_time(const struct gnp_domain *domain)
{
	double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, area = 0, across = 0;
	for (size_t i = 0; i < domain->prepared.count; i++) {
		area += domain->area[i];
		for (int c = 0; c < 3; c++) {
			low[c] = fmin(low[c], domain->prepared.points[3 * i + c]);
			high[c] = fmax(high[c], domain->prepared.points[3 * i + c]);
		}
	}
	for (int c = 0; c < 3; c++)
		across += (high[c] - low[c]) * (high[c] - low[c]);
	return fmax(area / (double)domain->prepared.count, 4 * across / (longest_way * longest_way));
}

/* S + diag(added), factored. */
static gnp_status factor(const struct gnp_geodesic *geodesic, const double *added, struct gnp_pool *pool,
                         struct gnp_task *task, struct gnp_factor **out, struct gnp_error *error)
{
	struct gnp_csr matrix = {.rows = 0};
	struct gnp_factor_plan plan;
	gnp_status status = gnp_volume_matrix(&geodesic->stiffness, added, NULL, &matrix, error);
	if (status == GNP_OK)
		status = gnp_factor_plan_make(&matrix, true, geodesic->domain.prepared.points, pool, task, &plan, error);
	if (status == GNP_OK)
		status = gnp_factor_make_take(&matrix, &plan, pool, task, out, error);
	gnp_csr_clear(&matrix);
	return status;
}

static gnp_status find_components(struct gnp_geodesic *geodesic, double *added, struct gnp_error *error)
{
	struct gnp_csr matrix = {.rows = 0};
	memset(added, 0, geodesic->stiffness.count * sizeof *added);
	gnp_status status = gnp_volume_matrix(&geodesic->stiffness, added, NULL, &matrix, error);
	if (status == GNP_OK)
		status = gnp_components_find(&matrix, NULL, &geodesic->components, error);
	gnp_csr_clear(&matrix);
	return status;
}

static gnp_status make_factors(struct gnp_geodesic *geodesic, struct gnp_pool *pool, struct gnp_task *task,
                               struct gnp_error *error)
{
	const struct gnp_stiffness *stiffness = &geodesic->stiffness;
	double *added = gnp_array_new(stiffness->count, sizeof *added);
	gnp_status status = added ? find_components(geodesic, added, error)
	                          : gnp_error_set(error, GNP_OUT_OF_MEMORY, "geodesic: no memory for %zu points", stiffness->count);
	gnp_task_stage(task, GNP_STAGE_FACTOR, 0);
	for (size_t k = 0; k < geodesic->components.count && status == GNP_OK; k++) {
		uint32_t anchor = geodesic->components.anchor[k];
		added[anchor] = stiffness->diagonal[anchor] > 0 ? stiffness->diagonal[anchor] : 1;
	}
	if (status == GNP_OK)
		status = factor(geodesic, added, pool, task, &geodesic->poisson, error);
	for (size_t i = 0; i < stiffness->count && status == GNP_OK; i++)
		added[i] = geodesic->domain.area[i] / geodesic->time;
	if (status == GNP_OK)
		status = factor(geodesic, added, pool, task, &geodesic->heat, error);
	free(added);
	return status;
}

static gnp_status make(const struct gnp_cloud *cloud, const struct gnp_domain_options *options, struct gnp_pool *pool,
                       struct gnp_task *task, struct gnp_geodesic *geodesic, struct gnp_error *error)
{
	gnp_status status = gnp_domain_make(cloud, options, pool, task, &geodesic->domain, error);
	gnp_task_stage(task, GNP_STAGE_ASSEMBLE, 0);
	if (status == GNP_OK)
		status = gnp_volume_stiffness(&geodesic->domain.prepared, pool, task, &geodesic->stiffness, error);
	if (status == GNP_OK)
		status = gnp_fans_make(&geodesic->domain.prepared, pool, task, &geodesic->fans, error);
	if (status == GNP_OK) {
		gnp_operator_check_crossings(&geodesic->domain.prepared, &geodesic->stiffness, gnp_task_warnings(task));
		geodesic->time = flow_time(&geodesic->domain);
		status = make_factors(geodesic, pool, task, error);
	}
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

/* A distance on its way, in curve order. */
struct flow {
	const struct gnp_geodesic *geodesic;
	unsigned char *source; /* (points) */
	unsigned char *reached; /* (components) 1: holds a source */
	double *u;             /* (points) heat, then -sqrt(t) log of it, then the distance */
	double *field;         /* (3, points) unit directions */
	double *flux;          /* (points) */
	double *least;         /* (components) */
};

/* A source at the place of another point is one there. Returns how many there are less of them by that. */
static size_t move_to_originals(const struct gnp_copies *copies, unsigned char *wanted)
{
	size_t less = 0;
	for (size_t k = 0; k < copies->count; k++) {
		const struct gnp_copy *copy = &copies->copy[k];
		if (!wanted[copy->index])
			continue;
		less += wanted[copy->original];
		wanted[copy->index] = 0;
		wanted[copy->original] = 1;
	}
	return less;
}

static gnp_status mark_sources(const uint32_t *sources, size_t count, struct flow *flow, struct gnp_error *error)
{
	const struct gnp_geodesic *geodesic = flow->geodesic;
	const struct gnp_prepared *prepared = &geodesic->domain.prepared;
	size_t n = geodesic->domain.cloud_count, found = 0;
	unsigned char *wanted = gnp_array_zero(n, 1);
	if (!wanted)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "geodesic: no memory for %zu points", n);
	size_t distinct = 0;
	for (size_t s = 0; s < count; s++) {
		distinct += !wanted[sources[s]];
		wanted[sources[s]] = 1;
	}
	distinct -= move_to_originals(&geodesic->domain.copies, wanted);
	for (size_t i = 0; i < prepared->count; i++) {
		flow->source[i] = wanted[prepared->order[i]];
		found += flow->source[i];
		if (flow->source[i] && geodesic->components.label[i] != GNP_COMPONENT_NONE)
			flow->reached[geodesic->components.label[i]] = 1;
	}
	free(wanted);
	if (found == distinct)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "sources: the filter dropped %zu of %zu", distinct - found, distinct);
}

static bool is_reached(const struct flow *flow, size_t i)
{
	uint32_t label = flow->geodesic->components.label[i];
	return label != GNP_COMPONENT_NONE && flow->reached[label];
}

static gnp_status let_heat_flow(struct flow *flow, struct gnp_pool *pool, struct gnp_task *task,
                                struct gnp_error *error)
{
	const struct gnp_geodesic *geodesic = flow->geodesic;
	size_t n = geodesic->domain.prepared.count;
	for (size_t i = 0; i < n; i++)
		flow->u[i] = flow->source[i];
	gnp_status status = gnp_factor_solve(geodesic->heat, flow->u, 1, pool, task, error);
	for (size_t i = 0; i < n && status == GNP_OK; i++)
		flow->u[i] = is_reached(flow, i) ? -sqrt(geodesic->time) * log(fmax(flow->u[i], 1e-300)) : 0;
	return status;
}

/* 2 area grad u of a triangle, by its corners' values. */
static void add_gradient(const struct flow *flow, const uint32_t corner[3], double sum[3])
{
	const double *points = flow->geodesic->domain.prepared.points, *o = points + 3 * (size_t)corner[0];
	double p[3], q[3], normal[3];
	for (int k = 0; k < 3; k++) {
		p[k] = points[3 * (size_t)corner[1] + (size_t)k] - o[k];
		q[k] = points[3 * (size_t)corner[2] + (size_t)k] - o[k];
	}
	gnp_cross(p, q, normal);
	double pp = gnp_dot(p, p), pq = gnp_dot(p, q), qq = gnp_dot(q, q), cross = sqrt(gnp_dot(normal, normal));
	double du = flow->u[corner[1]] - flow->u[corner[0]], dv = flow->u[corner[2]] - flow->u[corner[0]];
	if (!(cross > 1e-3 * sqrt(pp * qq)))
		return;
	for (int k = 0; k < 3; k++)
		sum[k] += ((du * qq - dv * pq) * p[k] + (dv * pp - du * pq) * q[k]) / cross;
}

/* Unit directions of steepest ascent, means over each point's triangles; at a source all directions lead away. */
static gnp_status directions_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                   struct gnp_error *error)
{
	struct flow *flow = context;
	const struct gnp_fans *fans = &flow->geodesic->fans;
	size_t n = fans->count;
	(void)scratch, (void)error;
	for (size_t i = begin; i < end; i++) {
		double sum[3] = {0};
		for (size_t t = fans->start[i]; t < fans->start[i + 1] && is_reached(flow, i) && !flow->source[i]; t++)
			add_gradient(flow, (uint32_t[3]){(uint32_t)i, fans->corner[t][0], fans->corner[t][1]}, sum);
		double length = sqrt(gnp_dot(sum, sum));
		for (size_t c = 0; c < 3; c++)
			flow->field[c * n + i] = length > 0 ? sum[c] / length : 0;
	}
	return GNP_OK;
}

static bool is_one_of_several(const struct flow *flow, size_t source)
{
	const struct gnp_stiffness *stiffness = &flow->geodesic->stiffness;
	for (size_t e = stiffness->start[source]; e < stiffness->start[source + 1]; e++)
		if (flow->source[stiffness->column[e]])
			return true;
	return false;
}

/* Along the edge from i to j, one of which is a source, without a direction of its own: that of the other end counts,
 * along being its part; but a source alone is a point, from which the edge's own length leads away. */
static double way_from(const struct flow *flow, size_t i, size_t j, double along, double length)
{
	if (is_one_of_several(flow, flow->source[i] ? i : j))
		return along;
	return flow->source[i] ? length : -length;
}

/* -div X over each cell: what flows in across the edges. */
static void sum_flux(struct flow *flow)
{
	const struct gnp_stiffness *stiffness = &flow->geodesic->stiffness;
	const double *points = flow->geodesic->domain.prepared.points;
	size_t n = stiffness->count;
	for (size_t i = 0; i < n; i++) {
		flow->flux[i] = 0;
		for (size_t e = stiffness->start[i]; e < stiffness->start[i + 1]; e++) {
			size_t j = stiffness->column[e];
			double along = 0, square = 0;
			for (size_t c = 0; c < 3; c++) {
				double d = points[3 * j + c] - points[3 * i + c];
				along += d * (flow->field[c * n + i] + flow->field[c * n + j]) / 2;
				square += d * d;
			}
			if (flow->source[i] != flow->source[j])
				along = way_from(flow, i, j, 2 * along, sqrt(square));
			flow->flux[i] -= stiffness->value[e] * along;
		}
	}
}

/* ---- Several sources ---- */

/* Rows of sources are those of the identity, as gnp_volume_matrix made them; leaves their columns out of other rows. */
static void drop_columns(const unsigned char *source, struct gnp_csr *matrix)
{
	size_t made = 0, begin = 0;
	for (size_t i = 0; i < matrix->rows; i++) {
		size_t end = matrix->row_offsets[i + 1];
		for (size_t e = begin; e < end; e++) {
			if (source[matrix->column[e]] && matrix->column[e] != i)
				continue;
			matrix->column[made] = matrix->column[e];
			matrix->value[made++] = matrix->value[e];
		}
		begin = end;
		matrix->row_offsets[i + 1] = made;
	}
}

/* Distances are zero at every source: one factor for all requests has a constant to choose, and of several sources it
 * can be right for one. So these have a factor of their own. */
static gnp_status solve_pinned(struct flow *flow, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_geodesic *geodesic = flow->geodesic;
	const struct gnp_stiffness *stiffness = &geodesic->stiffness;
	struct gnp_csr matrix = {.rows = 0};
	struct gnp_factor_plan plan;
	struct gnp_factor *factor = NULL;
	double *added = gnp_array_zero(stiffness->count, sizeof *added);
	if (!added)
		return gnp_no_memory("geodesic", stiffness->count, "points", error);
	for (size_t k = 0; k < geodesic->components.count; k++) {
		uint32_t anchor = geodesic->components.anchor[k];
		if (!flow->reached[k])
			added[anchor] = stiffness->diagonal[anchor] > 0 ? stiffness->diagonal[anchor] : 1;
	}
	gnp_status status = gnp_volume_matrix(stiffness, added, flow->source, &matrix, error);
	free(added);
	if (status != GNP_OK)
		return status;
	drop_columns(flow->source, &matrix);
	for (size_t i = 0; i < stiffness->count; i++)
		flow->flux[i] = flow->source[i] ? 0 : flow->flux[i];
	status = gnp_factor_plan_make(&matrix, true, geodesic->domain.prepared.points, pool, task, &plan, error);
	if (status == GNP_OK)
		status = gnp_factor_make_take(&matrix, &plan, pool, task, &factor, error);
	if (status == GNP_OK)
		status = gnp_factor_solve(factor, flow->flux, 1, pool, task, error);
	gnp_factor_free(factor);
	gnp_csr_clear(&matrix);
	return status;
}

/* Each part's distances are zero at its sources, and nowhere less. Leaves them in flow->u, too. */
static void write_distances(const struct flow *flow, double *distance)
{
	const struct gnp_geodesic *geodesic = flow->geodesic;
	double *least = flow->least;
	size_t n = geodesic->domain.prepared.count;
	for (size_t k = 0; k < geodesic->components.count; k++)
		least[k] = INFINITY;
	for (size_t i = 0; i < n; i++)
		if (flow->source[i] && is_reached(flow, i))
			least[geodesic->components.label[i]] = fmin(least[geodesic->components.label[i]], flow->flux[i]);
	for (size_t i = 0; i < geodesic->domain.cloud_count; i++)
		distance[i] = INFINITY;
	for (size_t i = 0; i < n; i++) {
		flow->u[i] = INFINITY;
		if (is_reached(flow, i))
			flow->u[i] = flow->source[i] ? 0 : fmax(0, flow->flux[i] - least[geodesic->components.label[i]]);
		distance[geodesic->domain.prepared.order[i]] = flow->u[i];
	}
}

/* No way along a surface is shorter than the straight one to the nearest source. */
static gnp_status lengthen(const struct flow *flow, double *distance, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = &flow->geodesic->domain.prepared;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_neighbors *tree = NULL;
	double *sources = gnp_array_new(prepared->count, 3 * sizeof *sources), straight;
	size_t count = 0;
	uint32_t nearest;
	for (size_t i = 0; sources && i < prepared->count; i++)
		if (flow->source[i])
			memcpy(sources + 3 * count++, prepared->points + 3 * i, 3 * sizeof *sources);
	gnp_status status = scratch && sources ? gnp_neighbors_build(sources, count, &tree, error)
	                                       : gnp_no_memory("geodesic", prepared->count, "points", error);
	for (size_t i = 0; i < prepared->count && status == GNP_OK; i++) {
		double *d = distance + prepared->order[i];
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		status = gnp_neighbors_knn(tree, prepared->points + 3 * i, 1, 1, &nearest, &straight, scratch, error);
		gnp_scratch_release(scratch, mark);
		if (status == GNP_OK && isfinite(*d))
			*d = fmax(*d, straight);
	}
	gnp_neighbors_free(tree);
	gnp_scratch_free(scratch);
	free(sources);
	return status;
}

static gnp_status check_sources(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                struct gnp_error *error)
{
	if (count == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "sources: got none, need at least 1");
	for (size_t s = 0; s < count; s++)
		if (sources[s] >= geodesic->domain.cloud_count)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "sources[%zu]: got point %u, the cloud has %zu", s, sources[s],
			                     geodesic->domain.cloud_count);
	return GNP_OK;
}

gnp_status gnp_geodesic_distance(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                 struct gnp_pool *pool, struct gnp_task *task, double *distance,
                                 struct gnp_error *error)
{
	size_t n = geodesic->domain.prepared.count;
	gnp_status status = check_sources(geodesic, sources, count, error);
	if (status != GNP_OK)
		return status;
	double *block = gnp_array_new(5 * n + geodesic->components.count, sizeof *block);
	unsigned char *marks = gnp_array_zero(n + geodesic->components.count, 1);
	struct flow flow = {.geodesic = geodesic};
	if (block && marks)
		flow = (struct flow){geodesic, marks, marks + n, block, block + n, block + 4 * n, block + 5 * n};
	else
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "geodesic: no memory for %zu points", n);
	gnp_task_stage(task, GNP_STAGE_SOLVE, 0);
	if (status == GNP_OK)
		status = mark_sources(sources, count, &flow, error);
	if (status == GNP_OK)
		status = let_heat_flow(&flow, pool, task, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, NULL, n, POINTS_A_CHUNK, directions_chunk, &flow, error);
	if (status == GNP_OK) {
		sum_flux(&flow);
		status = count > 1 ? solve_pinned(&flow, pool, task, error)
		                   : gnp_factor_solve(geodesic->poisson, flow.flux, 1, pool, task, error);
	}
	if (status == GNP_OK) {
		write_distances(&flow, distance);
		status = gnp_geodesic_check(&geodesic->domain.prepared, &geodesic->stiffness, flow.source, flow.u, pool, task,
		                            error);
		if (status == GNP_OK)
			status = lengthen(&flow, distance, error);
		gnp_copies_spread(&geodesic->domain.copies, distance, 1, 0);
	}
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	free(block);
	free(marks);
	return status;
}
