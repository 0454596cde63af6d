#include "core/equations/heat.h"

#include <math.h>
#include <stdlib.h>

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

/* f = u / dt + source */
static gnp_status begin_step(const double *u, const double *source, double dt, size_t entries, size_t step, double *f,
                             struct gnp_error *error)
{
	for (size_t i = 0; i < entries; i++) {
		f[i] = u[i] / dt + (source ? source[i] : 0);
		if (isinf(f[i]) && step > 0)
			return gnp_error_set(error, GNP_NO_CONVERGENCE,
			                     "heat: u is %g after %zu steps, too large to go on: the cloud does not resolve its surface, or "
			                     "has a boundary", u[i], step);
	}
	return GNP_OK;
}

gnp_status gnp_heat_step(const struct gnp_poisson *poisson, double dt, size_t steps, const double *source,
                         const double *values, size_t count, struct gnp_pool *pool, struct gnp_task *task, double *u,
                         struct gnp_error *error)
{
	size_t entries = gnp_poisson_info(poisson).points * count;
	const struct gnp_domain *domain = gnp_poisson_domain(poisson);
	double *f = gnp_array_new(entries, sizeof *f);
	struct gnp_heat_range *ranges = gnp_array_new(count, sizeof *ranges);
	gnp_status status = f && ranges ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "heat: no memory for %zu values", entries);
	for (size_t c = 0; c < count && status == GNP_OK; c++)
		ranges[c] = gnp_heat_expect(domain, u, source, count, c, dt * (double)steps);
	for (size_t s = 0; s < steps && status == GNP_OK; s++) {
		status = begin_step(u, source, dt, entries, s, f, error);
		if (status == GNP_OK)
			status = gnp_poisson_solve(poisson, f, values, count, pool, task, u, NULL, error);
	}
	if (status == GNP_OK && !values)
		gnp_heat_check(domain, u, count, ranges, gnp_task_warnings(task));
	free(f);
	free(ranges);
	return status;
}
