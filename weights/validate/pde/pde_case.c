#include "weights/validate/pde/pde_case.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/equations/heat.h"
#include "core/equations/spectrum.h"
#include "core/geodesic/geodesic.h"

enum { HEAT_STEPS = 400, SPACINGS_OFF = 3, COUNT_MOST = 120 };
static const double accuracy = 1e-7, ZERO = 1e-6;

gnp_status gnp_pde_case_create(const char *name, const char *variant, size_t count, struct gnp_pde_case *out,
                               struct gnp_error *error)
{
	*out = (struct gnp_pde_case){.count = count,
	                             .pieces = 1,
	                             .points = gnp_array_zero(count, 3 * sizeof(double)),
	                             .normals = gnp_array_zero(count, 3 * sizeof(double)),
	                             .mass = gnp_array_zero(count, sizeof(double))};
	snprintf(out->name, sizeof out->name, "%s", name);
	snprintf(out->variant, sizeof out->variant, "%s", variant);
	if (out->points && out->normals && out->mass)
		return GNP_OK;
	gnp_pde_case_clear(out);
	return gnp_no_memory("case", count, "points", error);
}

void gnp_pde_case_clear(struct gnp_pde_case *known)
{
	double *const arrays[] = {known->points,           known->normals,   known->mass,           known->eigenvalue,
	                          known->source,           known->solution,  known->distance,       known->warm,
	                          known->dirichlet_source, known->dirichlet, known->dirichlet_value};
	for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
		free(arrays[i]);
	free(known->fixed);
	*known = (struct gnp_pde_case){.count = 0};
}

struct judge {
	const struct gnp_pde_case *known;
	struct gnp_cloud cloud;
	struct gnp_poisson_options options;
	struct gnp_pool *pool;
	struct gnp_task *task;
	struct gnp_pde_judged *out;
};

/* What stops the judge; other failures are noted. */
static gnp_status note(struct judge *judge, gnp_status status, const struct gnp_error *why, struct gnp_error *error)
{
	if (status == GNP_OUT_OF_MEMORY || status == GNP_CANCELLED)
		return gnp_error_set(error, status, "%s", why->text);
	if (status != GNP_OK && judge->out->failure[0] == '\0')
		snprintf(judge->out->failure, sizeof judge->out->failure, "%.150s", why->text);
	return GNP_OK;
}

/* ---- Eigenvalues ---- */

/* Of value (count) against known ones, both ascending. */
static void compare_values(const double *value, const double *known, size_t count, double *median, double *worst)
{
	double *off = gnp_array_new(count, sizeof *off);
	for (size_t k = 0; k < count && off; k++)
		off[k] = fabs(value[k] / known[k] - 1);
	if (off)
		qsort(off, count, sizeof *off, gnp_double_compare);
	*median = off ? (off[(count - 1) / 2] + off[count / 2]) / 2 : NAN;
	*worst = off ? off[count - 1] : NAN;
	free(off);
}

/* Eigenvalues that are zero but for rounding: one of each piece that the operator makes of the cloud. least: what the
 * first that is not should be. */
static size_t count_zeros(const struct gnp_spectrum *spectrum, double least)
{
	size_t zeros = 0;
	while (zeros < spectrum->count && fabs(spectrum->value[zeros]) <= ZERO * least)
		zeros++;
	return zeros;
}

/* Where there are more pieces than there should be, again with as many more. */
static gnp_status judge_values(struct judge *judge, struct gnp_pde_errors *errors, struct gnp_error *error)
{
	const struct gnp_pde_case *known = judge->known;
	struct gnp_error why = {0};
	gnp_status status = GNP_OK;
	size_t zeros = known->pieces, asked = 0;
	while (known->eigenvalue && status == GNP_OK && zeros + known->eigenvalues != asked && asked < COUNT_MOST) {
		struct gnp_spectrum spectrum;
		asked = zeros + known->eigenvalues;
		const struct gnp_spectrum_wanted wanted = {.count = asked, .tolerance = accuracy};
		status = gnp_spectrum_run(&judge->cloud, &judge->options, &wanted, judge->pool, judge->task, &spectrum, &why);
		if (status != GNP_OK)
			break;
		zeros = count_zeros(&spectrum, known->eigenvalue[known->pieces]);
		errors->pieces = zeros;
		if (zeros + known->eigenvalues <= asked)
			compare_values(spectrum.value + zeros, known->eigenvalue + known->pieces, known->eigenvalues,
			               &errors->median, &errors->worst);
		gnp_spectrum_clear(&spectrum);
		zeros = zeros < known->pieces ? known->pieces : zeros;
	}
	return note(judge, status, &why, error);
}

/* ---- Solutions ---- */

/* Relative L2 error by the masses; centred: without the means. */
static double l2(const struct gnp_pde_case *known, const double *found, const double *wanted, bool centred)
{
	double sums[3] = {0}, error = 0, size = 0;
	for (size_t i = 0; i < known->count && centred; i++) {
		sums[0] += known->mass[i];
		sums[1] += known->mass[i] * found[i];
		sums[2] += known->mass[i] * wanted[i];
	}
	for (size_t i = 0; i < known->count; i++) {
		double got = found[i] - (centred ? sums[1] / sums[0] : 0),
			   want = wanted[i] - (centred ? sums[2] / sums[0] : 0);
		error += known->mass[i] * (got - want) * (got - want);
		size += known->mass[i] * want * want;
	}
	return sqrt(error / size);
}

static double share_of_area(const struct gnp_pde_case *known, const struct gnp_domain *domain)
{
	double cells = 0, masses = 0;
	for (size_t i = 0; i < domain->prepared.count; i++)
		cells += domain->area[i];
	for (size_t i = 0; i < known->count; i++)
		masses += known->mass[i];
	return cells / masses;
}

static gnp_status judge_poisson(struct judge *judge, double *spare, struct gnp_pde_errors *errors,
                                struct gnp_error *error)
{
	struct gnp_poisson *poisson = NULL;
	struct gnp_error why = {0};
	if (!judge->known->source)
		return GNP_OK;
	gnp_status status = gnp_poisson_prepare(&judge->cloud, &judge->options, judge->pool, judge->task, &poisson, &why);
	if (status == GNP_OK) {
		errors->system = gnp_poisson_info(poisson).system;
		judge->out->area = share_of_area(judge->known, gnp_poisson_domain(poisson));
		status =
			gnp_poisson_solve(poisson, judge->known->source, NULL, 1, judge->pool, judge->task, spare, NULL, &why);
	}
	gnp_poisson_release(poisson);
	if (status == GNP_OK)
		errors->poisson = l2(judge->known, spare, judge->known->solution, true);
	return note(judge, status, &why, error);
}

static gnp_status judge_dirichlet(struct judge *judge, double *spare, struct gnp_pde_errors *errors,
                                  struct gnp_error *error)
{
	const struct gnp_pde_case *known = judge->known;
	struct gnp_poisson_options options = judge->options;
	struct gnp_poisson *poisson = NULL;
	struct gnp_error why = {0};
	if (!known->fixed)
		return GNP_OK;
	options.fixed = known->fixed;
	gnp_status status = gnp_poisson_prepare(&judge->cloud, &options, judge->pool, judge->task, &poisson, &why);
	if (status == GNP_OK)
		status = gnp_poisson_solve(poisson, known->dirichlet_source, known->dirichlet, 1, judge->pool, judge->task,
		                           spare, NULL, &why);
	gnp_poisson_release(poisson);
	if (status == GNP_OK)
		errors->dirichlet = l2(known, spare, known->dirichlet, false);
	return note(judge, status, &why, error);
}

static gnp_status judge_dirichlet_values(struct judge *judge, struct gnp_pde_errors *errors, struct gnp_error *error)
{
	const struct gnp_pde_case *known = judge->known;
	const struct gnp_spectrum_wanted wanted = {.count = known->eigenvalues, .tolerance = accuracy};
	struct gnp_poisson_options options = judge->options;
	struct gnp_spectrum spectrum;
	struct gnp_error why = {0};
	double median;
	if (!known->dirichlet_value)
		return GNP_OK;
	options.fixed = known->fixed;
	gnp_status status = gnp_spectrum_run(&judge->cloud, &options, &wanted, judge->pool, judge->task, &spectrum, &why);
	if (status != GNP_OK)
		return note(judge, status, &why, error);
	compare_values(spectrum.value, known->dirichlet_value, known->eigenvalues, &median, &errors->dirichlet_worst);
	gnp_spectrum_clear(&spectrum);
	return GNP_OK;
}

static gnp_status judge_heat(struct judge *judge, double *spare, struct gnp_pde_errors *errors,
                             struct gnp_error *error)
{
	const struct gnp_pde_case *known = judge->known;
	struct gnp_poisson *poisson = NULL;
	struct gnp_error why = {0};
	if (!known->warm)
		return GNP_OK;
	const struct gnp_heat_options heat = {
		.dt = 1 / known->rate / HEAT_STEPS, .steps = HEAT_STEPS, .scheme = GNP_HEAT_BACKWARD_EULER};
	const struct gnp_heat_field field = {.count = 1, .u = spare};
	double *after = gnp_array_new(known->count, sizeof *after);
	if (!after)
		return gnp_no_memory("heat", known->count, "points", error);
	memcpy(spare, known->warm, known->count * sizeof *spare);
	for (size_t i = 0; i < known->count; i++)
		after[i] = known->warm[i] * exp(-1);
	gnp_status status =
		gnp_heat_prepare(&judge->cloud, &judge->options, &heat, judge->pool, judge->task, &poisson, &why);
	if (status == GNP_OK)
		status = gnp_heat_run(poisson, &heat, &field, judge->pool, judge->task, &why);
	gnp_poisson_release(poisson);
	if (status == GNP_OK)
		errors->heat = l2(known, spare, after, false);
	free(after);
	return note(judge, status, &why, error);
}

static gnp_status judge_system(struct judge *judge, int system, double *spare, struct gnp_pde_errors *errors,
                               struct gnp_error *error)
{
	double begun = gnp_clock();
	judge->options.laplacian.system = system;
	gnp_status status = judge_poisson(judge, spare, errors, error);
	if (status == GNP_OK)
		status = judge_values(judge, errors, error);
	if (status == GNP_OK)
		status = judge_dirichlet(judge, spare, errors, error);
	if (status == GNP_OK)
		status = judge_dirichlet_values(judge, errors, error);
	if (status == GNP_OK)
		status = judge_heat(judge, spare, errors, error);
	errors->seconds = gnp_clock() - begun;
	return status;
}

/* ---- Distances ---- */

struct sums {
	double off, worst;
	size_t count;
};

static void compare_distances(const struct gnp_pde_case *known, const double *wanted, const double *found,
                              struct sums *sums)
{
	for (size_t i = 0; i < known->count; i++) {
		if (wanted[i] < SPACINGS_OFF * known->spacing)
			continue;
		double off = isfinite(wanted[i]) && isfinite(found[i]) ? fabs(found[i] / wanted[i] - 1)
		                                                       : isfinite(wanted[i]) != isfinite(found[i]);
		sums->off += off;
		sums->worst = fmax(sums->worst, off);
		sums->count++;
	}
}

static gnp_status judge_distances(struct judge *judge, double *spare, struct gnp_error *error)
{
	const struct gnp_pde_case *known = judge->known;
	struct gnp_geodesic *geodesic = NULL;
	struct gnp_error why = {0};
	struct sums sums = {0};
	if (!known->distance)
		return GNP_OK;
	gnp_status status = gnp_geodesic_create(&judge->cloud, &judge->options.laplacian.domain, judge->pool, judge->task,
	                                        &geodesic, &why);
	for (size_t s = 0; s < GNP_PDE_SOURCES && status == GNP_OK; s++) {
		status = gnp_geodesic_distance(geodesic, &known->at[s], 1, judge->pool, judge->task, spare, &why);
		if (status == GNP_OK)
			compare_distances(known, known->distance + s * known->count, spare, &sums);
	}
	gnp_geodesic_free(geodesic);
	if (status == GNP_OK) {
		judge->out->distance = sums.off / (double)sums.count;
		judge->out->distance_worst = sums.worst;
	}
	return note(judge, status, &why, error);
}

gnp_status gnp_pde_case_judge(const struct gnp_pde_case *known, enum gnp_pde_side side,
                              const struct gnp_models *models, struct gnp_pool *pool, struct gnp_task *task,
                              struct gnp_pde_judged *out, struct gnp_error *error)
{
	static const struct gnp_pde_errors none = {0, 0, NAN, NAN, NAN, NAN, NAN, NAN, 0};
	struct judge judge = {known,
	                      {known->count, known->points, side == GNP_PDE_GIVEN ? known->normals : NULL},
	                      gnp_poisson_defaults(),
	                      pool,
	                      task,
	                      out};
	double *spare = gnp_array_new(known->count, sizeof *spare);
	*out = (struct gnp_pde_judged){none, none, NAN, NAN, NAN, ""};
	judge.options.laplacian.domain.estimate.estimator = GNP_ESTIMATOR_GNP;
	judge.options.laplacian.domain.estimate.models = models;
	gnp_status status = spare ? GNP_OK : gnp_no_memory("case", known->count, "points", error);
	if (status == GNP_OK)
		status = judge_system(&judge, GNP_SYSTEM_AUTO, spare, &out->chosen, error);
	out->symmetric = out->chosen;
	if (status == GNP_OK && out->chosen.system != GNP_SYSTEM_SYMMETRIC)
		status = judge_system(&judge, GNP_SYSTEM_SYMMETRIC, spare, &out->symmetric, error);
	if (status == GNP_OK)
		status = judge_distances(&judge, spare, error);
	free(spare);
	return status;
}
