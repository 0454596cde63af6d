#include "core/equations/heat.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/equations/heat_check.h"

gnp_status gnp_heat_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, double dt,
                            struct gnp_pool *pool, struct gnp_task *task, struct gnp_poisson **out,
                            struct gnp_error *error)
{
	struct gnp_poisson_options screened = *options;
	if (!(dt > 0) || isinf(dt))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "dt: got %g, need a finite number > 0", dt);
	screened.screening = 1 / dt;
	return gnp_poisson_prepare(cloud, &screened, pool, task, out, error);
}

/* Too large to go on: the numbers end, or the operator has modes of its own. */
static gnp_status check_size(double f, double u, size_t step, struct gnp_error *error)
{
	if (!isinf(f) || step == 0)
		return GNP_OK;
	return gnp_error_set(error, GNP_NO_CONVERGENCE,
	                     "heat: u is %g after %zu steps, too large to go on: the cloud does not resolve its surface, "
	                     "or has a boundary", u, step);
}

/* f = u / dt + source: the solution is the next u. */
static gnp_status begin_whole(const double *u, const double *source, double dt, size_t entries, size_t step, double *f,
                              struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < entries && status == GNP_OK; i++) {
		f[i] = u[i] / dt + (source ? source[i] : 0);
		status = check_size(f[i], u[i], step, error);
	}
	return status;
}

/* Steps of the symmetric operator are solved for the change of u, by f = Delta u + source with differences of u: what
 * is constant stays so to the last digit, however large the step. */
struct change {
	const struct gnp_poisson *poisson;
	double *values; /* (n, count) of the change where u is fixed; NULL: nowhere */
};

static gnp_status begin_change(const struct change *change, const double *u, const double *source, const double *values,
                               size_t count, size_t step, double *f, struct gnp_error *error)
{
	const struct gnp_domain *domain = gnp_poisson_domain(change->poisson);
	const struct gnp_stiffness *s = gnp_poisson_volumes(change->poisson);
	const uint32_t *order = domain->prepared.order;
	size_t entries = domain->cloud_count * count;
	gnp_status status = GNP_OK;
	memset(f, 0, entries * sizeof *f);
	for (size_t i = 0; i < s->count && status == GNP_OK; i++)
		for (size_t c = 0; c < count && status == GNP_OK; c++) {
			size_t at = order[i] * count + c;
			double sum = 0;
			for (size_t e = s->start[i]; e < s->start[i + 1]; e++)
				sum += s->value[e] * (u[order[s->column[e]] * count + c] - u[at]);
			f[at] = sum / domain->area[i] + (source ? source[at] : 0);
			status = check_size(f[at], u[at], step, error);
		}
	for (size_t i = 0; change->values && i < entries; i++)
		change->values[i] = values[i] - u[i];
	return status;
}

static gnp_status step_once(const struct change *change, double dt, size_t step, const double *source,
                            const double *values, size_t count, struct gnp_pool *pool, struct gnp_task *task, double *f,
                            double *w, double *u, struct gnp_error *error)
{
	size_t entries = gnp_poisson_info(change->poisson).points * count;
	if (!w) {
		gnp_status status = begin_whole(u, source, dt, entries, step, f, error);
		if (status == GNP_OK)
			status = gnp_poisson_solve(change->poisson, f, values, count, pool, task, u, NULL, error);
		return status;
	}
	gnp_status status = begin_change(change, u, source, values, count, step, f, error);
	if (status == GNP_OK)
		status = gnp_poisson_solve(change->poisson, f, change->values, count, pool, task, w, NULL, error);
	for (size_t i = 0; i < entries && status == GNP_OK; i++)
		u[i] += w[i];
	return status;
}

gnp_status gnp_heat_step(const struct gnp_poisson *poisson, double dt, size_t steps, const double *source,
                         const double *values, size_t count, struct gnp_pool *pool, struct gnp_task *task, double *u,
                         struct gnp_error *error)
{
	const struct gnp_poisson_info info = gnp_poisson_info(poisson);
	size_t entries = info.points * count;
	const struct gnp_domain *domain = gnp_poisson_domain(poisson);
	bool by_change = info.system == GNP_SYSTEM_SYMMETRIC;
	double *f = gnp_array_new(entries, sizeof *f), *w = by_change ? gnp_array_new(entries, sizeof *w) : NULL;
	struct change change = {poisson, by_change && values ? gnp_array_new(entries, sizeof *change.values) : NULL};
	struct gnp_heat_range *ranges = gnp_array_new(count, sizeof *ranges);
	bool room = f && ranges && (w || !by_change) && (change.values || !values || !by_change);
	gnp_status status = room ? GNP_OK : gnp_no_memory("heat", entries, "values", error);
	for (size_t c = 0; c < count && status == GNP_OK; c++)
		ranges[c] = gnp_heat_expect(domain, u, source, count, c, dt * (double)steps);
	for (size_t s = 0; s < steps && status == GNP_OK; s++)
		status = step_once(&change, dt, s, source, values, count, pool, task, f, w, u, error);
	if (status == GNP_OK && !values)
		gnp_heat_check(domain, u, count, ranges, gnp_task_warnings(task));
	free(f);
	free(w);
	free(change.values);
	free(ranges);
	return status;
}
