#include "core/equations/heat.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/equations/heat_check.h"
#include "core/equations/pieces.h"

/* Of TR-BDF2 with gamma = 2 - sqrt 2, for which both stages have one matrix: gamma / 2, and what of the first stage's
 * change the second takes along, (1 - gamma)^2 / (gamma (2 - gamma)). */
static const double stage_share = 0.29289321881345254, carried = 0.20710678118654752;

double gnp_heat_screening(double dt, int scheme)
{
	if (!(dt > 0) || isinf(dt) || scheme < GNP_HEAT_BACKWARD_EULER || scheme > GNP_HEAT_TR_BDF2)
		return NAN;
	return scheme == GNP_HEAT_TR_BDF2 ? 1 / (stage_share * dt) : 1 / dt;
}

size_t gnp_heat_snapshots(size_t steps, size_t every)
{
	return every ? 1 + (steps + every - 1) / every : 0;
}

gnp_status gnp_heat_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                            const struct gnp_heat_options *heat, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_poisson **out, struct gnp_error *error)
{
	struct gnp_poisson_options screened = *options;
	screened.screening = gnp_heat_screening(heat->dt, heat->scheme);
	if (heat->scheme < GNP_HEAT_BACKWARD_EULER || heat->scheme > GNP_HEAT_TR_BDF2)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "scheme: got %d, need 0..%d", heat->scheme, GNP_HEAT_TR_BDF2);
	if (isnan(screened.screening))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "dt: got %g, need a finite number > 0", heat->dt);
	return gnp_poisson_prepare(cloud, &screened, pool, task, out, error);
}

/* Heat on its way. All arrays (n, count) in the cloud's order. */
struct flow {
	const struct gnp_poisson *poisson;
	const struct gnp_heat_options *options;
	struct gnp_heat_field field;
	bool by_change; /* of the symmetric operator */
	double alpha;   /* the screening */
	double *f;      /* a right-hand side */
	double *w;      /* a solution: of changes, or of two stages */
	double *values; /* changes where u is fixed; NULL: nowhere */
	double *source; /* of points that coincide the mean; NULL: the caller's is as good */
	struct gnp_pieces pieces; /* whose heat is known at every step; none where u is fixed, or a filter dropped points */
	double *mean;   /* (pieces, count) of the source over each */
	size_t entries, step;
	struct gnp_pool *pool;
	struct gnp_task *task;
};

/* Too large to go on: the numbers end, or the operator has modes of its own. */
static gnp_status check_size(double f, double u, size_t step, struct gnp_error *error)
{
	if (!isinf(f) || step == 0)
		return GNP_OK;
	return gnp_error_set(error, GNP_NO_CONVERGENCE,
	                     "heat: u is %g after %zu steps, too large to go on: the cloud does not resolve its surface, "
	                     "or has a boundary", u, step);
}

/* ---- Steps for the change of u: what is constant stays so to the last digit, however large the step ---- */

/* f = Delta u + source, by differences of u. */
static gnp_status see_change(const struct flow *flow, struct gnp_error *error)
{
	const struct gnp_domain *domain = gnp_poisson_domain(flow->poisson);
	const struct gnp_stiffness *s = gnp_poisson_volumes(flow->poisson);
	const uint32_t *order = domain->prepared.order;
	const double *u = flow->field.u, *source = flow->source ? flow->source : flow->field.source;
	size_t count = flow->field.count;
	gnp_status status = GNP_OK;
	memset(flow->f, 0, flow->entries * sizeof *flow->f);
	for (size_t i = 0; i < s->count && status == GNP_OK; i++)
		for (size_t c = 0; c < count && status == GNP_OK; c++) {
			size_t at = order[i] * count + c;
			double sum = 0;
			for (size_t e = s->start[i]; e < s->start[i + 1]; e++)
				sum += s->value[e] * (u[order[s->column[e]] * count + c] - u[at]);
			flow->f[at] = sum / domain->area[i] + (source ? source[at] : 0);
			status = check_size(flow->f[at], u[at], flow->step, error);
		}
	for (size_t c = 0; c < count; c++)
		gnp_copies_spread(&domain->copies, flow->f, count, c);
	return status;
}

/* The mean of a column of values (n, count) over a piece, by area. */
static double mean_over(const struct flow *flow, size_t piece, size_t c, const double *values)
{
	const struct gnp_domain *domain = gnp_poisson_domain(flow->poisson);
	double sum = 0, area = 0;
	for (size_t k = 0; k < gnp_pieces_size(&flow->pieces, piece); k++) {
		size_t i = gnp_pieces_point(&flow->pieces, piece, k);
		sum += domain->area[i] * values[domain->prepared.order[i] * flow->field.count + c];
		area += domain->area[i];
	}
	return sum / area;
}

/* In all a piece's heat changes by what its sources add: w's mean is set right, which alone the system hardly
 * determines where a step is long. times: the source's, over alpha. */
static void keep_total(const struct flow *flow, double times)
{
	const struct gnp_domain *domain = gnp_poisson_domain(flow->poisson);
	size_t count = flow->field.count;
	for (size_t p = 0; p < flow->pieces.count; p++)
		for (size_t c = 0; c < count; c++) {
			double more = flow->mean[p * count + c] * times / flow->alpha - mean_over(flow, p, c, flow->w);
			for (size_t k = 0; k < gnp_pieces_size(&flow->pieces, p); k++)
				flow->w[domain->prepared.order[gnp_pieces_point(&flow->pieces, p, k)] * count + c] += more;
		}
	for (size_t c = 0; c < count && flow->pieces.count; c++)
		gnp_copies_spread(&domain->copies, flow->w, count, c);
}

/* w: the change that f brings, whose mean is so many times the source's. */
static gnp_status solve_change(const struct flow *flow, double times, struct gnp_error *error)
{
	for (size_t i = 0; flow->values && i < flow->entries; i++)
		flow->values[i] = flow->field.values[i] - flow->field.u[i];
	gnp_status status = gnp_poisson_solve(flow->poisson, flow->f, flow->values, flow->field.count, flow->pool,
	                                      flow->task, flow->w, NULL, error);
	if (status == GNP_OK)
		keep_total(flow, times);
	return status;
}

/* u += factor w. */
static void add_change(const struct flow *flow, double factor)
{
	for (size_t i = 0; i < flow->entries; i++)
		flow->field.u[i] += factor * flow->w[i];
}

/* Backward Euler, or the way of TR-BDF2's first stage to its middle. */
static gnp_status step_change(const struct flow *flow, double factor, struct gnp_error *error)
{
	gnp_status status = see_change(flow, error);
	if (status == GNP_OK)
		status = solve_change(flow, 1, error);
	if (status == GNP_OK)
		add_change(flow, factor);
	return status;
}

/* (alpha - Delta) (u' - u*) = alpha c (u* - u) + Delta u* + source; the first stage's change, u* - u, is twice w. */
static gnp_status finish_change(const struct flow *flow, struct gnp_error *error)
{
	gnp_status status = see_change(flow, error);
	for (size_t i = 0; i < flow->entries && status == GNP_OK; i++)
		flow->f[i] += flow->alpha * carried * 2 * flow->w[i];
	if (status == GNP_OK)
		status = solve_change(flow, 1 + 2 * carried, error);
	if (status == GNP_OK)
		add_change(flow, 1);
	return status;
}

/* ---- Steps for u itself, of operators that are known by their solutions alone ---- */

/* w: the solution for alpha (u + more (u - before)) + source. before may be NULL. */
static gnp_status solve_whole(const struct flow *flow, const double *before, double more, struct gnp_error *error)
{
	const double *u = flow->field.u, *source = flow->source ? flow->source : flow->field.source;
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < flow->entries && status == GNP_OK; i++) {
		flow->f[i] = flow->alpha * (before ? u[i] + more * (u[i] - before[i]) : u[i]) + (source ? source[i] : 0);
		status = check_size(flow->f[i], u[i], flow->step, error);
	}
	if (status != GNP_OK)
		return status;
	return gnp_poisson_solve(flow->poisson, flow->f, flow->field.values, flow->field.count, flow->pool, flow->task,
	                         flow->w, NULL, error);
}

static gnp_status step_whole(const struct flow *flow, struct gnp_error *error)
{
	gnp_status status = solve_whole(flow, NULL, 0, error);
	if (status == GNP_OK)
		memcpy(flow->field.u, flow->w, flow->entries * sizeof *flow->w);
	return status;
}

/* To the middle of the first stage, past it to its end, and from there. before (n, count): spare. */
static gnp_status step_whole_twice(const struct flow *flow, double *before, struct gnp_error *error)
{
	double *u = flow->field.u;
	gnp_status status = solve_whole(flow, NULL, 0, error);
	for (size_t i = 0; i < flow->entries && status == GNP_OK; i++) {
		before[i] = u[i];
		u[i] = 2 * flow->w[i] - u[i];
	}
	if (status == GNP_OK)
		status = solve_whole(flow, before, carried, error);
	if (status == GNP_OK)
		memcpy(u, flow->w, flow->entries * sizeof *u);
	return status;
}

/* ---- The run ---- */

static gnp_status step_once(const struct flow *flow, struct gnp_error *error)
{
	bool twice = flow->options->scheme == GNP_HEAT_TR_BDF2;
	if (!flow->by_change)
		return twice ? step_whole_twice(flow, flow->values, error) : step_whole(flow, error);
	gnp_status status = step_change(flow, twice ? 2 : 1, error);
	return status == GNP_OK && twice ? finish_change(flow, error) : status;
}

/* What the sources of each piece add. */
static gnp_status find_pieces(struct flow *flow, struct gnp_error *error)
{
	const struct gnp_domain *domain = gnp_poisson_domain(flow->poisson);
	const double *source = flow->source ? flow->source : flow->field.source;
	size_t count = flow->field.count;
	if (!flow->by_change || flow->field.values || domain->dropped)
		return GNP_OK;
	gnp_status status = gnp_pieces_find(domain, gnp_poisson_volumes(flow->poisson), NULL, &flow->pieces, error);
	if (status != GNP_OK)
		return status;
	flow->mean = gnp_array_zero(flow->pieces.count, count * sizeof *flow->mean);
	if (!flow->mean)
		return gnp_no_memory("heat", flow->pieces.count, "pieces", error);
	for (size_t p = 0; source && p < flow->pieces.count; p++)
		for (size_t c = 0; c < count; c++)
			flow->mean[p * count + c] = mean_over(flow, p, c, source);
	return GNP_OK;
}

/* Points that coincide begin with one value, and fixed ones with theirs. */
static gnp_status begin(struct flow *flow, struct gnp_error *error)
{
	const struct gnp_copies *copies = &gnp_poisson_domain(flow->poisson)->copies;
	struct gnp_heat_field *field = &flow->field;
	if (field->source && copies->count) {
		flow->source = gnp_array_new(flow->entries, sizeof *flow->source);
		if (!flow->source)
			return gnp_no_memory("heat", flow->entries, "values", error);
		memcpy(flow->source, field->source, flow->entries * sizeof *flow->source);
	}
	for (size_t c = 0; c < field->count; c++) {
		gnp_copies_merge(copies, field->u, field->count, c);
		if (flow->source)
			gnp_copies_merge(copies, flow->source, field->count, c);
	}
	if (field->values)
		gnp_poisson_put_given(flow->poisson, field->values, field->count, field->u);
	return find_pieces(flow, error);
}

static void keep_snapshot(const struct flow *flow, size_t step, size_t *kept)
{
	const struct gnp_heat_options *o = flow->options;
	if (!flow->field.snapshots || (step % o->snapshot_every && step != o->steps))
		return;
	memcpy(flow->field.snapshots + *kept * flow->entries, flow->field.u, flow->entries * sizeof *flow->field.u);
	flow->field.times[(*kept)++] = (double)step * o->dt;
}

static gnp_status run(struct flow *flow, struct gnp_heat_range *ranges, struct gnp_error *error)
{
	const struct gnp_heat_options *o = flow->options;
	struct gnp_heat_field *field = &flow->field;
	const struct gnp_domain *domain = gnp_poisson_domain(flow->poisson);
	const double *source = flow->source ? flow->source : field->source;
	size_t kept = 0;
	for (size_t c = 0; c < field->count; c++)
		ranges[c] = gnp_heat_expect(domain, field->u, source, field->count, c, o->dt * (double)o->steps);
	keep_snapshot(flow, 0, &kept);
	gnp_status status = GNP_OK;
	for (flow->step = 0; flow->step < o->steps && status == GNP_OK; flow->step++) {
		status = step_once(flow, error);
		if (status == GNP_OK)
			keep_snapshot(flow, flow->step + 1, &kept);
	}
	const char *advice = o->scheme == GNP_HEAT_TR_BDF2
	                         ? "tr_bdf2 overshoots where steps are long: take smaller ones, or backward_euler" : NULL;
	if (status == GNP_OK)
		gnp_heat_check(domain, field->u, field->count, ranges, field->values != NULL, advice,
		               gnp_task_warnings(flow->task));
	return status;
}

gnp_status gnp_heat_run(const struct gnp_poisson *poisson, const struct gnp_heat_options *options,
                        const struct gnp_heat_field *field, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_error *error)
{
	const struct gnp_poisson_info info = gnp_poisson_info(poisson);
	size_t entries = info.points * field->count;
	bool symmetric = info.system == GNP_SYSTEM_SYMMETRIC;
	bool third = symmetric ? field->values != NULL : options->scheme == GNP_HEAT_TR_BDF2;
	struct flow flow = {.poisson = poisson, .options = options, .field = *field, .by_change = symmetric,
	                    .alpha = gnp_heat_screening(options->dt, options->scheme), .entries = entries, .pool = pool,
	                    .task = task};
	double *block = gnp_array_new(entries, (third ? 3 : 2) * sizeof *block);
	struct gnp_heat_range *ranges = gnp_array_new(field->count, sizeof *ranges);
	gnp_status status = block && ranges ? GNP_OK : gnp_no_memory("heat", entries, "values", error);
	if (status == GNP_OK) {
		flow.f = block;
		flow.w = block + entries;
		flow.values = third ? block + 2 * entries : NULL;
		status = begin(&flow, error);
	}
	if (status == GNP_OK)
		status = run(&flow, ranges, error);
	gnp_pieces_clear(&flow.pieces);
	free(flow.mean);
	free(flow.source);
	free(block);
	free(ranges);
	return status;
}
