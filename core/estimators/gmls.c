#include "core/estimators/gmls.h"

#include <math.h>
#include <string.h>

#include "core/base/simd.h"
#include "core/fit/least_squares.h"

struct work {
	double *phi;    /* (points, stride) */
	double *weight; /* (points) */
	double *gram;   /* (stride, stride) */
	double *moment, *solution; /* (stride) */
};

static void point_weights(enum gnp_weight_kind kind, const struct gnp_patch *patch, double *weight)
{
	for (size_t i = 0; i < patch->count; i++) {
		double r = sqrt(patch->u[i] * patch->u[i] + patch->v[i] * patch->v[i]), t = fmax(0, 1 - r);
		weight[i] = kind == GNP_WEIGHT_QUARTIC ? t * t * t * t : kind == GNP_WEIGHT_LINEAR ? 1.2 - r : 1;
	}
}

/* Fits one basis; false when the points do not determine it. */
static bool fit_basis(struct gnp_basis basis, const struct gnp_patch *patch, struct work *work)
{
	size_t size = gnp_basis_size(basis), stride = GNP_SIMD_PAD(size);
	if (patch->count < size)
		return false;
	gnp_basis_rows(basis, patch->u, patch->v, patch->count, stride, work->phi);
	gnp_normal_equations(work->phi, work->weight, patch->w, patch->count, stride, work->gram, work->moment);
	if (!gnp_cholesky_factor(work->gram, size, stride, GNP_SMALLEST_PIVOT))
		return false;
	gnp_cholesky_forward(work->gram, size, stride, work->moment, work->moment);
	gnp_cholesky_backward(work->gram, size, stride, work->moment, work->solution);
	return true;
}

/* Of the fit in work, whose rows phi are those of the basis that was solved. */
static double weighted_residual(const struct gnp_patch *patch, const struct work *work, size_t size)
{
	size_t stride = GNP_SIMD_PAD(size);
	double sum = 0, total = 0;
	for (size_t i = 0; i < patch->count; i++) {
		double misfit = patch->w[i];
		for (size_t j = 0; j < size; j++)
			misfit -= work->phi[i * stride + j] * work->solution[j];
		sum += work->weight[i] * misfit * misfit;
		total += work->weight[i];
	}
	return total > 0 ? sqrt(sum / total) : 0;
}

static void fit_patch(const struct gnp_fit_options *options, const struct gnp_patch *patch, double *coefficients,
                      struct gnp_fit *fit, struct work *work)
{
	struct gnp_basis basis = options->basis;
	point_weights(options->weight, patch, work->weight);
	bool solved = fit_basis(basis, patch, work);
	for (; !solved && basis.degree > 0; solved = fit_basis(basis, patch, work))
		basis.degree--;
	size_t size = gnp_basis_size(basis), index[GNP_BASIS_MAX];
	if (!solved) /* no point has weight: the height of the origin */
		work->solution[0] = 0;
	gnp_basis_embed(basis, options->basis, index);
	memset(coefficients, 0, gnp_basis_size(options->basis) * sizeof *coefficients);
	for (size_t i = 0; i < size; i++)
		coefficients[index[i]] = work->solution[i];
	*fit = (struct gnp_fit){.surface = {.basis = options->basis, .coefficients = coefficients,
	                                    .scale_xy = patch->scale_xy, .scale_w = patch->scale_w},
	                        .reduced = basis.degree < options->basis.degree,
	                        .residual = weighted_residual(patch, work, size) * patch->scale_w};
	memcpy(fit->surface.origin, patch->origin, sizeof patch->origin);
	memcpy(fit->surface.frame, patch->frame, sizeof patch->frame);
}

gnp_status gnp_gmls_fit(const struct gnp_fit_options *options, const void *state, const struct gnp_patch *patches,
                        size_t count, struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t size = gnp_basis_size(options->basis), stride = GNP_SIMD_PAD(size), points = 0;
	(void)state;
	for (size_t i = 0; i < count; i++)
		points = patches[i].count > points ? patches[i].count : points;
	double *coefficients = gnp_scratch_take(scratch, count * size, sizeof *coefficients);
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct work work = {.phi = gnp_scratch_take(scratch, points * stride, sizeof(double)),
	                    .weight = gnp_scratch_take(scratch, points, sizeof(double)),
	                    .gram = gnp_scratch_take(scratch, stride * stride, sizeof(double)),
	                    .moment = gnp_scratch_take(scratch, stride, sizeof(double)),
	                    .solution = gnp_scratch_take(scratch, stride, sizeof(double))};
	if (!coefficients || !work.phi || !work.weight || !work.gram || !work.moment || !work.solution)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gmls: no memory for a patch of %zu points", points);
	for (size_t i = 0; i < count; i++)
		fit_patch(options, &patches[i], coefficients + i * size, &fits[i], &work);
	gnp_scratch_release(scratch, mark);
	return GNP_OK;
}
