#include "core/estimators/weighted_fit.h"

#include <math.h>
#include <string.h>

#include "core/fit/least_squares.h"
#include "core/fit/regression.h"
#include "core/network/frame_choice.h"
#include "core/network/weighted_head.h"
#include "core/support/votes.h"
#include "core/support/weighted_members.h"
#include "core/support/weighted_refit.h"

enum { SIZE = GNP_TAYLOR_SIZE,
	   STRIDE = GNP_TAYLOR_STRIDE,
	   BATCH = GNP_WEIGHTED_BATCH };

static const double LEAST_MISFIT = 1e-200; /* of an exact fit, so that its factors of doubt are numbers */

/* ---- Supports ---- */

/* Rows of searches: of the ladder's reach for all centres, and of the widest support's for those that want it. */
struct rows {
	struct gnp_neighborhoods near, wide;
	uint32_t wide_centre[BATCH];
	size_t wide_row[BATCH], wide_count; /* of a centre in wide; */
	struct gnp_ladder ladder[BATCH];
	unsigned step[BATCH];
};

static size_t smaller(size_t a, size_t b)
{
	return a < b ? a : b;
}

/* Whether a step's support reaches for more points than the ladder did, and there are more. */
static bool is_wide(const struct gnp_weighted_cloud *cloud, unsigned step)
{
	return gnp_support_reach(step) > GNP_LADDER_REACH && cloud->count > GNP_LADDER_REACH;
}

static gnp_status find_rows(const struct gnp_weighted_cloud *cloud, const uint32_t *centres, size_t count,
                            struct rows *rows, struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t near = smaller(GNP_LADDER_REACH, cloud->count), wide = smaller(GNP_SUPPORT_POINTS, cloud->count);
	gnp_status status = gnp_neighborhoods_find(cloud->points.neighbors, centres, count, near, 1, near, scratch,
	                                           &rows->near, error);
	rows->wide_count = 0;
	for (size_t p = 0; p < count && status == GNP_OK; p++) {
		size_t start = rows->near.start[p];
		gnp_support_look(&cloud->points, centres[p], rows->near.index + start, rows->near.start[p + 1] - start,
		                 &rows->ladder[p]);
		rows->step[p] = gnp_frame_choose(cloud->network, &rows->ladder[p]);
		if (is_wide(cloud, rows->step[p])) {
			rows->wide_row[p] = rows->wide_count;
			rows->wide_centre[rows->wide_count++] = centres[p];
		}
	}
	if (status == GNP_OK && rows->wide_count > 0)
		status = gnp_neighborhoods_find(cloud->points.neighbors, rows->wide_centre, rows->wide_count, wide, 1, wide,
		                                scratch, &rows->wide, error);
	return status;
}

static gnp_status build(const struct gnp_weighted_cloud *cloud, const uint32_t *centres, size_t count,
                        struct rows *rows, struct gnp_support *const *supports, struct gnp_error *error)
{
	for (size_t p = 0; p < count; p++) {
		bool wide = is_wide(cloud, rows->step[p]);
		struct gnp_neighborhoods *from = wide ? &rows->wide : &rows->near;
		size_t row = wide ? rows->wide_row[p] : p, start = from->start[row], found = from->start[row + 1] - start;
		const double *place = cloud->points.points + 3 * (size_t)centres[p];
		if (!gnp_support_build(&cloud->points, centres[p], &rows->ladder[p], rows->step[p], from->index + start,
		                       from->distance + start, found, 0, supports[p]))
			return gnp_error_set(error, GNP_DEGENERATE,
			                     "points: more points coincide at (%g, %g, %g) than a neighbourhood has, remove duplicates",
			                     place[0], place[1], place[2]);
	}
	return GNP_OK;
}

/* ---- Surfaces ---- */

/* The radius of a disk whose points would be as far from its centre, in the mean, as the piece's weighted nodes are. */
static double scale_of(const struct gnp_support *support, const struct gnp_weighted_fit *fit)
{
	double square = 0;
	for (size_t i = 0; i < support->nodes; i++)
		square += fit->weight[i] * support->distance[i] * support->distance[i];
	return fmax(sqrt(2 * square / fit->total), 1e-6);
}

/* Root mean square of heights over the surface [length], as the fit weighs its points, but for those that are
 * plainly off: the least weight of others is little, but they may be far. A node of m points has 1 / m of their
 * variance. */
static double residual_of(const struct gnp_support *support, const struct gnp_weighted_fit *fit, const double *residual)
{
	static const double CUT = 5; /* deviations */
	double limit = CUT * gnp_weighted_deviation(support, residual), sum = 0, count = 1e-300;
	for (size_t i = 0; i < support->nodes; i++) {
		if (fabs(residual[i]) * sqrt(support->weight[i]) > limit)
			continue;
		sum += fit->weight[i] * residual[i] * residual[i];
		count += fit->weight[i] / support->weight[i];
	}
	return sqrt(sum / count) * support->radius;
}

/* Coefficients and factor, whose diagonal holds inverses, in units of scale instead of R. */
static void restate(const struct gnp_weighted_fit *fit, double scale, double *coefficients, double *factor)
{
	double factorial[SIZE], power[GNP_TAYLOR_DEGREE + 1] = {1};
	unsigned order[SIZE];
	gnp_taylor_indices(factorial, order);
	for (int j = 1; j <= GNP_TAYLOR_DEGREE; j++)
		power[j] = power[j - 1] * scale;
	memset(coefficients, 0, STRIDE * sizeof *coefficients);
	memset(factor, 0, SIZE * STRIDE * sizeof *factor);
	for (size_t i = 0; i < SIZE; i++) {
		coefficients[i] = fit->coefficients[i] * power[order[i]] / scale;
		factor[i * STRIDE + i] = fit->factor[i * STRIDE + i] * power[order[i]];
		for (size_t j = i + 1; j < SIZE; j++)
			factor[i * STRIDE + j] = fit->factor[i * STRIDE + j] / power[order[j]];
	}
}

/* Factors of the posterior's variances at the centre, so that they become those of the covariance under noise with the
 * network's scale and bias. */
static void set_doubt(const struct gnp_weighted_fit *fit, struct gnp_weighted_variance error,
                      struct gnp_surface *surface)
{
	surface->doubt[0] = surface->doubt[1] = surface->doubt[2] = 1;
	if (!fit->solved)
		return;
	double posterior[6];
	for (size_t c = 1; c < 6; c++)
		posterior[c] = fmax(fit->misfit, LEAST_MISFIT) * gnp_regression_variance(fit->factor, c);
	double slope = (posterior[1] + posterior[2]) / 2;
	double second = (4 * posterior[3] + 2 * posterior[4] + 4 * posterior[5]) / 3;
	surface->doubt[0] = surface->doubt[1] = error.slope / slope;
	surface->doubt[2] = error.second / second;
}

static gnp_status set_surface(const struct gnp_weighted_cloud *cloud, const struct gnp_support *support,
                              const struct gnp_weighted_fit *fit, const double *residual, struct gnp_fit *out,
                              struct gnp_scratch *scratch, struct gnp_error *error)
{
	double *coefficients = gnp_scratch_take(scratch, STRIDE, sizeof *coefficients);
	double *factor = gnp_scratch_take(scratch, SIZE * STRIDE, sizeof *factor), share = scale_of(support, fit);
	if (!coefficients || !factor)
		return gnp_no_memory("gnp", 1, "surface", error);
	restate(fit, share, coefficients, factor);
	for (size_t i = 0; i < SIZE && !fit->solved; i++)
		factor[i * STRIDE + i] = 1; /* nothing to go by: the plane of the frame, with no knowledge of anything */
	double scale = share * support->radius;
	*out = (struct gnp_fit){.reduced = !fit->solved, .residual = residual_of(support, fit, residual)};
	out->surface = (struct gnp_surface){.basis = {GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE}, .coefficients = coefficients,
	                                    .scale_xy = scale, .scale_w = scale, .factor = factor,
	                                    .variance = fmax(fit->misfit, LEAST_MISFIT) / (share * share)};
	memcpy(out->surface.origin, cloud->points.points + 3 * (size_t)support->centre, sizeof out->surface.origin);
	memcpy(out->surface.frame, support->frame, sizeof out->surface.frame);
	return GNP_OK;
}

static gnp_status set_piece(const struct gnp_weighted_cloud *cloud, const struct gnp_support *support,
                            const struct gnp_weighted_fit *fit, const float *outputs, bool errors,
                            struct gnp_weighted_piece *piece, struct gnp_scratch *scratch, struct gnp_error *error)
{
	double residual[GNP_SUPPORT_NODES];
	gnp_residuals(support->rows, support->y, support->nodes, STRIDE, fit->coefficients, residual);
	gnp_status status = set_surface(cloud, support, fit, residual, &piece->fit, scratch, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_weighted_near near = {support, fit, outputs, residual, piece->fit.residual / support->radius,
	                                       piece->fit.surface.scale_xy,
	                                       gnp_weighted_variance(outputs, gnp_weighted_error(support, fit))};
	status = gnp_weighted_near_patch(&near, cloud->points.points, &piece->patch, scratch, error);
	if (status != GNP_OK)
		return status;
	piece->support = support;
	piece->weights = fit;
	if (errors)
		set_doubt(fit, near.error, &piece->fit.surface);
	piece->crease = outputs[GNP_WEIGHTED_CREASE] > 0 && gnp_weighted_near_ends(&near, &piece->patch);
	piece->outlier = outputs[GNP_WEIGHTED_OUTLIER] > 0 && support->points < cloud->count;
	if (cloud->votes && support->points < cloud->count)
		gnp_votes_cast(cloud->votes, &near, cloud->points.points);
	return gnp_weighted_near_members(&near, cloud->points.points, &piece->member, &piece->trusted, scratch, error);
}

gnp_status gnp_weighted_fit_at(const struct gnp_weighted_cloud *cloud, const uint32_t *centres, size_t count,
                               bool errors, struct gnp_weighted_piece *pieces, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	struct rows *rows = gnp_scratch_take(scratch, 1, sizeof *rows);
	struct gnp_support *supports[BATCH];
	struct gnp_weighted_pass pass;
	for (size_t p = 0; p < count; p++)
		supports[p] = gnp_scratch_take(scratch, 1, sizeof *supports[p]);
	if (!rows || !supports[count - 1])
		return gnp_no_memory("gnp", count, "supports", error);
	gnp_status status = find_rows(cloud, centres, count, rows, scratch, error);
	if (status == GNP_OK)
		status = build(cloud, centres, count, rows, supports, error);
	if (status == GNP_OK)
		status = gnp_weighted_infer(cloud->network, (const struct gnp_support *const *)supports, count, &pass, scratch,
		                            error);
	for (size_t p = 0; p < count && status == GNP_OK; p++) {
		const float *outputs = pass.outputs + p * GNP_WEIGHTED_OUTPUTS;
		gnp_weighted_refit(supports[p], outputs, &pass.fits[p]);
		status = set_piece(cloud, supports[p], &pass.fits[p], outputs, errors, &pieces[p], scratch, error);
	}
	return status;
}
