#include "core/operators/energy.h"

double gnp_energy_stored(const struct gnp_stiffness *s, const double *u)
{
	double sum = 0;
	for (size_t i = 0; i < s->count; i++)
		for (size_t e = s->start[i]; e < s->start[i + 1]; e++) {
			double step = u[i] - u[s->column[e]];
			sum += s->value[e] * step * step / 2;
		}
	return sum;
}

double gnp_energy_quotient(const struct gnp_stiffness *stiffness, const double *area, const double *u, const double *f,
                           double alpha, bool held)
{
	double whole = 0, mean = 0, supplied = 0, energy = gnp_energy_stored(stiffness, u);
	for (size_t i = 0; i < stiffness->count; i++) {
		whole += area[i];
		mean += area[i] * u[i];
	}
	mean = held ? 0 : mean / whole;
	for (size_t i = 0; i < stiffness->count; i++)
		supplied += area[i] * (u[i] - mean) * (f[i] - alpha * u[i]);
	return energy == supplied ? 1 : energy / supplied;
}
