#include "heat.h"

#include <math.h>
#include <stdlib.h>

#include "memory.h"

gnp_status gnp_heat_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, double dt, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_poisson **out, struct gnp_error *error)
{
	struct gnp_poisson_options screened = *options;
	if (!(dt > 0) || isinf(dt))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "dt: got %g, need a finite number > 0", dt);
	screened.screening = 1 / dt;
	return gnp_poisson_prepare(cloud, &screened, pool, task, out, error);
}

gnp_status gnp_heat_step(const struct gnp_poisson *poisson, double dt, size_t steps, const double *source, const double *values,
                         size_t count, struct gnp_pool *pool, struct gnp_task *task, double *u, struct gnp_error *error)
{
	size_t entries = gnp_poisson_info(poisson).points * count;
	double *f = gnp_array_new(entries, sizeof *f);
	gnp_status status = f ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "heat: no memory for %zu values", entries);
	for (size_t s = 0; s < steps && status == GNP_OK; s++) {
		for (size_t i = 0; i < entries; i++)
			f[i] = u[i] / dt + (source ? source[i] : 0);
		status = gnp_poisson_solve(poisson, f, values, count, pool, task, u, NULL, error);
	}
	free(f);
	return status;
}
