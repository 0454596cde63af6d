#include "weights/validate/pde/pde_condition.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/equations/spectrum.h"

enum { STEPS = 60 };

static double norm(const double *x, size_t count)
{
	double sum = 0;
	for (size_t i = 0; i < count; i++)
		sum += x[i] * x[i];
	return sqrt(sum);
}

static gnp_status largest(const struct gnp_csr *matrix, struct gnp_pool *pool, struct gnp_task *task, double *value,
                          struct gnp_error *error)
{
	size_t n = matrix->rows;
	double *x = gnp_array_new(n, sizeof *x), *y = gnp_array_new(n, sizeof *y);
	gnp_status status = x && y ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "condition: no memory for %zu points", n);
	for (size_t i = 0; i < n && status == GNP_OK; i++)
		x[i] = i % 2 ? 1 : -1; /* rough, as the vector sought */
	*value = 0;
	for (int step = 0; step < STEPS && status == GNP_OK; step++) {
		double length = norm(x, n);
		for (size_t i = 0; i < n; i++)
			x[i] /= length;
		status = gnp_csr_multiply(matrix, x, y, pool, task, error);
		*value = norm(y, n);
		memcpy(x, y, n * sizeof *x);
	}
	free(x);
	free(y);
	return status;
}

gnp_status gnp_pde_condition(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                             struct gnp_pool *pool, struct gnp_task *task, double *condition, struct gnp_error *error)
{
	struct gnp_laplacian_options laplacian = options->laplacian;
	struct gnp_collocation made;
	struct gnp_spectrum spectrum;
	double high = 0;
	laplacian.which = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN);
	gnp_status status = gnp_laplacian_run(cloud, &laplacian, pool, task, &made, NULL, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_csr matrix = gnp_collocation_view(&made, GNP_DERIVATIVE_LAPLACIAN);
	status = largest(&matrix, pool, task, &high, error);
	gnp_collocation_clear(&made);
	if (status == GNP_OK)
		status = gnp_spectrum_run(cloud, options, &(struct gnp_spectrum_wanted){2, 0, 1e-6}, pool, task, &spectrum,
		                          error);
	if (status != GNP_OK)
		return status;
	*condition = high / spectrum.value[1];
	gnp_spectrum_clear(&spectrum);
	return GNP_OK;
}
