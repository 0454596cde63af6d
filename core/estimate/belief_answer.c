#include "core/estimate/belief_answer.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/warning.h"
#include "core/cloud/belief_sample.h"

/* Limits, the share in per cent of the points looked at; tests/unit/core/estimate/test_belief.c holds them. */
static const double BLUR = 1.7, BLUR_LEAST = 0.1; /* residuals over those of small fits; in spacings */
static const double SCATTER = 1e-4;               /* spacings: of spheres with so much noise 5 % of true H lie within one standard error */
static const double CREASE = 3, CREASE_LEAST = 0.05, CREASES_MOST = 2.5;

struct work {
	struct gnp_belief_sample sample;
	const struct gnp_belief_probe *probes; /* (sample.count) */
};

/* The wide row costs most and is looked for only where the near one spans one direction. */
static gnp_status look_at_answer(const struct gnp_belief_sample *sample, const void *context, size_t s,
                                 struct gnp_scratch *scratch, struct gnp_belief_row *row, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = sample->prepared;
	const double *normal = ((const struct gnp_belief_probe *)context)[s].normal;
	struct gnp_belief_look *look = &sample->looks[s];
	size_t i = gnp_belief_sample_point(sample->stride, prepared->count, s);
	gnp_status status = gnp_belief_find_row(prepared, i, 2 * GNP_BELIEF_NEAR, scratch, row, error);
	if (status == GNP_OK && !gnp_belief_see_plane(prepared, row, normal, look)) {
		status = gnp_belief_find_row(prepared, i, GNP_BELIEF_WIDE, scratch, row, error);
		if (status == GNP_OK)
			gnp_belief_see_plane(prepared, row, normal, look);
	}
	return status;
}

static double small_at(const void *work, size_t s)
{
	return ((const struct work *)work)->sample.looks[s].small;
}

static double residual_at(const void *context, size_t s)
{
	const struct work *work = context;
	return work->probes[s].residual / work->sample.looks[s].spacing;
}

static double spanned_at(const void *work, size_t s)
{
	return (double)((const struct work *)work)->sample.looks[s].spanned;
}

static bool tilted(const void *context, size_t s)
{
	const struct work *work = context;
	return gnp_belief_tilted(&work->sample.looks[s]) && !work->probes[s].outlier;
}

static bool creased(const void *context, size_t s)
{
	const struct work *work = context;
	double residual = residual_at(work, s), small = work->sample.looks[s].small;
	return residual > CREASE_LEAST && residual > CREASE * small && !work->probes[s].outlier;
}

static gnp_status warn_of_detail(const struct work *work, bool standard_errors, struct gnp_warnings *warnings,
                                 struct gnp_error *error)
{
	double *values = gnp_array_new(work->sample.count, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", work->sample.count);
	double residual = gnp_belief_sample_median(&work->sample, residual_at, work, values);
	double small = gnp_belief_sample_median(&work->sample, small_at, work, values);
	double creases = gnp_belief_sample_share(&work->sample, creased, work);
	free(values);
	if (standard_errors && residual > SCATTER)
		gnp_warnings_add(warnings, GNP_WARNING_STDERR,
		                 "heights scatter by %.2g spacings, from %g on curvatures are flattened by more than their "
		                 "standard errors, which hold the scatter alone: take them for weights, not for bounds",
		                 residual, SCATTER);
	if (residual > BLUR_LEAST && residual > BLUR * small)
		gnp_warnings_add(
			warnings, GNP_WARNING_DETAIL,
			"fits leave %.2g spacings of the points unexplained, quadratics of the %d nearest %.2g, the limit "
			"is %g times that: detail is taken for noise, sample more densely or take estimator=adaptive",
			residual, GNP_BELIEF_NEAR, small, BLUR);
	else if (creases > CREASES_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_DETAIL,
		                 "at %.1f %% of %zu sampled points fits leave more than %g times of what quadratics of the %d "
		                 "nearest do, the limit is %g %%: they smooth over edges or fine detail there, more points help, and "
		                 "the quantity crease (weights=auto) says where edges are",
		                 creases, work->sample.count, CREASE, GNP_BELIEF_NEAR, CREASES_MOST);
	return GNP_OK;
}

static gnp_status warn_of_normals(const struct work *work, struct gnp_warnings *warnings, struct gnp_error *error)
{
	double tilts = gnp_belief_sample_share(&work->sample, tilted, work);
	if (tilts <= GNP_BELIEF_TILTED_MOST)
		return GNP_OK;
	double *values = gnp_array_new(work->sample.count, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", work->sample.count);
	gnp_warnings_add(
		warnings, GNP_WARNING_NORMALS,
		"%.1f %% of %zu sampled points have normals more than %d degrees off the plane of their nearest points "
		"that span two directions (%.0f at the median), the limit is %d %%: take weights=auto or estimator=adaptive, "
		"or rows closer together",
		tilts, work->sample.count, GNP_BELIEF_TILT, gnp_belief_sample_median(&work->sample, spanned_at, work, values),
		GNP_BELIEF_TILTED_MOST);
	free(values);
	return GNP_OK;
}

gnp_status gnp_belief_answer_check(const struct gnp_prepared *prepared, const struct gnp_belief_probe *probes,
                                   bool standard_errors, struct gnp_pool *pool, struct gnp_task *task,
                                   struct gnp_error *error)
{
	struct gnp_warnings *warnings = gnp_task_warnings(task);
	struct work work = {.probes = probes};
	if (!warnings)
		return GNP_OK;
	gnp_status status = gnp_belief_sample_make(prepared, look_at_answer, probes, pool, task, &work.sample, error);
	if (status != GNP_OK)
		return status;
	status = warn_of_normals(&work, warnings, error);
	if (status == GNP_OK)
		status = warn_of_detail(&work, standard_errors, warnings, error);
	free(work.sample.looks);
	return status;
}
