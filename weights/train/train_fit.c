#include "weights/train/train_fit.h"

struct gnp_jet gnp_train_fit_jet(struct gnp_basis basis, const double *coefficients, const struct gnp_patch *patch, double u,
                                 double v, double *rows)
{
	double h = patch->scale_w, slope = h / patch->scale_xy, bend = slope / patch->scale_xy, jet[6] = {0};
	const double units[6] = {h, slope, slope, bend, bend, bend};
	size_t size = gnp_basis_size(basis);
	gnp_basis_jets(basis, u, v, GNP_BASIS_MAX, rows);
	for (size_t d = 0; d < 6; d++)
		for (size_t i = 0; i < size; i++) {
			rows[d * GNP_BASIS_MAX + i] *= units[d];
			jet[d] += rows[d * GNP_BASIS_MAX + i] * coefficients[i];
		}
	return (struct gnp_jet){jet[0], jet[1], jet[2], jet[3], jet[4], jet[5]};
}

void gnp_train_fit_back(struct gnp_basis basis, const double *rows, const struct gnp_jet *djet, double *dcoefficients)
{
	const double d[6] = {djet->f, djet->u, djet->v, djet->uu, djet->uv, djet->vv};
	size_t size = gnp_basis_size(basis);
	for (size_t i = 0; i < size; i++) {
		double sum = 0;
		for (size_t c = 0; c < 6; c++)
			sum += d[c] * rows[c * GNP_BASIS_MAX + i];
		dcoefficients[i] += sum;
	}
}
