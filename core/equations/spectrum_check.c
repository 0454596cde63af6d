#include "core/equations/spectrum_check.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/operators/energy.h"

static const double below_zero_most = 1e-3, imaginary_most = 0.1; /* of the value and the shift */
static const double quotient_least = 0.7, quotient_most = 1.4;    /* 0.94 to 1.05 where resolved, also of waves a few points long */

/* Of the second discretisation: vector's energy over its square. spare: (domain's points). */
static double rayleigh(const struct gnp_poisson *poisson, const double *vector, double *spare)
{
	const struct gnp_domain *domain = gnp_poisson_domain(poisson);
	double square = 0;
	for (size_t i = 0; i < domain->prepared.count; i++) {
		spare[i] = vector[domain->prepared.order[i]];
		square += domain->area[i] * spare[i] * spare[i];
	}
	return square > 0 ? gnp_energy_stored(gnp_poisson_volumes(poisson), spare) / square : 0;
}

static void check_pair(const struct gnp_spectrum *spectrum, size_t k, double second, double shift,
                       struct gnp_warnings *warnings)
{
	double value = spectrum->value[k], size = fmax(value, 0) + shift, quotient = (second + shift) / (value + shift);
	if (value < -below_zero_most * shift)
		gnp_warnings_add(warnings, GNP_WARNING_EIGENVALUES,
		                 "%zu is %.4g, -Delta has none below 0: the points are too uneven or at a boundary", k, value);
	else if (spectrum->imaginary[k] > imaginary_most * size)
		gnp_warnings_add(warnings, GNP_WARNING_EIGENVALUES,
		                 "%zu is complex, %.4g with an imaginary part of %.3g, more than %g of it: -Delta has real ones, "
		                 "the points are too uneven or at a boundary", k, value, spectrum->imaginary[k], imaginary_most);
	else if (!(quotient >= quotient_least && quotient <= quotient_most))
		gnp_warnings_add(warnings, GNP_WARNING_EIGENVALUES,
		                 "%zu is %.4g, to a second discretisation its vector is one of %.4g, need %g to %g of it: the surface "
		                 "has no such eigenvalue, or the points do not resolve it", k, value, second, quotient_least, quotient_most);
}

gnp_status gnp_spectrum_believe(const struct gnp_spectrum *spectrum, const struct gnp_poisson *poisson, double shift,
                                struct gnp_warnings *warnings, struct gnp_error *error)
{
	size_t count = gnp_poisson_domain(poisson)->prepared.count;
	double *spare = gnp_array_new(count, sizeof *spare);
	gnp_status status = spare ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "spectrum: no memory for %zu points", count);
	for (size_t k = 0; k < spectrum->count && status == GNP_OK; k++)
		if (isfinite(spectrum->value[k]))
			check_pair(spectrum, k, rayleigh(poisson, spectrum->vector + k * spectrum->points, spare), shift, warnings);
		else
			status = gnp_error_set(error, GNP_NO_CONVERGENCE,
			                       "spectrum: found %zu of the %zu lowest, others are far below 0, where -Delta has none: the points "
			                       "are too uneven or at a boundary", k, spectrum->count);
	free(spare);
	return status;
}
