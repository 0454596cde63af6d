#include "core/equations/spectrum.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/cells/volume.h"
#include "core/equations/spectrum_check.h"
#include "core/equations/spectrum_parts.h"
#include "core/operators/operator_check.h"

enum { COUNT_MAX = 500 };
static const double beside_shift = 1 + 1e-4; /* users ask about eigenvalues, where there is no inverse */

void gnp_spectrum_clear(struct gnp_spectrum *spectrum)
{
	free(spectrum->value);
	free(spectrum->imaginary);
	free(spectrum->vector);
	free(spectrum->residual);
	*spectrum = (struct gnp_spectrum){.count = 0};
}

static gnp_status allocate(size_t points, size_t count, struct gnp_spectrum *out, struct gnp_error *error)
{
	size_t entries;
	bool fits = gnp_size_multiply(points, count, &entries);
	*out = (struct gnp_spectrum){.points = points, .count = count, .value = gnp_array_new(count, sizeof(double)),
	                             .imaginary = gnp_array_new(count, sizeof(double)), .residual = gnp_array_new(count, sizeof(double)),
	                             .vector = fits ? gnp_array_new(entries, sizeof(double)) : NULL};
	if (out->value && out->imaginary && out->residual && out->vector)
		return GNP_OK;
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "spectrum: no memory for %zu eigenvectors of %zu", count, points);
}

/* Of the size of the first eigenvalue: that of a sphere of the cloud's extent, which scales as the spectrum does. */
static gnp_status guess_first(const struct gnp_cloud *cloud, double *first, struct gnp_error *error)
{
	double mean[3] = {0}, square = 0;
	for (size_t i = 0; i < 3 * cloud->count; i++)
		mean[i % 3] += cloud->points[i] / (double)cloud->count;
	for (size_t i = 0; i < 3 * cloud->count; i++)
		square += (cloud->points[i] - mean[i % 3]) * (cloud->points[i] - mean[i % 3]) / (double)cloud->count;
	if (isinf(1 / square))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "points: the mean square of their distance from their middle is %.3g, which has no "
		                     "inverse in double precision: scale them up", square);
	*first = 1 / square;
	return GNP_OK;
}

static size_t least_points(size_t count)
{
	return 4 * count + 96;
}

gnp_status gnp_spectrum_check(size_t count, size_t points, int system, struct gnp_error *error)
{
	bool square = system == GNP_SYSTEM_SQUARE || system == GNP_SYSTEM_LEAST_SQUARES;
	if (count < 1 || count > COUNT_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "count: got %zu, need 1..%d", count, COUNT_MAX);
	if (square && points < least_points(count))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "points: got %zu, need at least %zu, 4 count + 96 where count is %zu "
		                     "(system=symmetric needs as many as count)", points, least_points(count), count);
	if (points < count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need at least %zu, as many as count",
		                     points, count);
	return GNP_OK;
}

static gnp_status check_numbers(const struct gnp_spectrum_wanted *wanted, struct gnp_error *error)
{
	if (!(wanted->tolerance >= 1e-12 && wanted->tolerance <= 0.1))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tolerance: got %g, need 1e-12..0.1", wanted->tolerance);
	if (!(wanted->shift >= 0) || isinf(wanted->shift))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "shift: got %g, need a finite number >= 0", wanted->shift);
	return GNP_OK;
}

/* ---- Which operator ---- */

/* Pairs of the symmetric operator: why it was chosen, or NULL. */
static gnp_status run_symmetric(const struct gnp_spectrum_task *asked, const struct gnp_domain *domain, const char *why,
                                struct gnp_spectrum *spectrum, struct gnp_error *error)
{
	struct gnp_stiffness volumes = {.count = 0};
	gnp_status status = gnp_volume_stiffness(&domain->prepared, asked->pool, asked->task, &volumes, error);
	if (status == GNP_OK) {
		gnp_operator_check_crossings(&domain->prepared, &volumes, gnp_task_warnings(asked->task));
		status = gnp_spectrum_symmetric(asked, domain, &volumes, spectrum, error);
	}
	gnp_stiffness_clear(&volumes);
	spectrum->system = GNP_SYSTEM_SYMMETRIC;
	spectrum->why = why;
	return status;
}

/* Pairs of collocation, and what is found against them. */
static gnp_status run_square(const struct gnp_spectrum_task *asked, const struct gnp_poisson *poisson,
                             struct gnp_spectrum *spectrum, struct gnp_warnings *doubts, struct gnp_error *error)
{
	gnp_status status = gnp_spectrum_square(asked, poisson, spectrum, error);
	spectrum->system = gnp_poisson_info(poisson).system;
	spectrum->why = gnp_poisson_info(poisson).why;
	return status == GNP_OK ? gnp_spectrum_believe(spectrum, poisson, asked->first, doubts, error) : status;
}

/* Where an operator that was chosen is not confirmed, or its pairs are doubted, those of the symmetric one are found
 * instead. */
static gnp_status run_prepared(const struct gnp_spectrum_task *asked, const struct gnp_poisson *poisson,
                               struct gnp_spectrum *spectrum, struct gnp_error *error)
{
	const struct gnp_poisson_info info = gnp_poisson_info(poisson);
	struct gnp_warnings doubts = {0}, *warnings = gnp_task_warnings(asked->task);
	struct gnp_error own = {0};
	if (info.system == GNP_SYSTEM_SYMMETRIC)
		return run_symmetric(asked, gnp_poisson_domain(poisson), info.why, spectrum, error);
	gnp_status status = run_square(asked, poisson, spectrum, &doubts, &own);
	bool chosen = info.why != NULL;
	bool doubted = status == GNP_NO_CONVERGENCE || (status == GNP_OK && gnp_warnings_count(&doubts) > 0);
	if (chosen && doubted)
		return run_symmetric(asked, gnp_poisson_domain(poisson), "collocation has eigenvalues that it does not confirm",
		                     spectrum, error);
	gnp_warnings_merge(warnings, &doubts);
	return status == GNP_OK ? GNP_OK : gnp_error_set(error, status, "%s", own.text);
}

/* Why the symmetric operator is taken before any other is tried; NULL: it is not. */
static const char *why_symmetric(const struct gnp_spectrum_task *asked, const struct gnp_domain *domain)
{
	if (!gnp_domain_is_closed(domain))
		return "stars are open, at a rim or where normals disagree";
	bool few = asked->free_points < least_points(asked->wanted.count);
	return few ? "collocation has too few points for so many eigenpairs" : NULL;
}

/* Beyond this all eigenvalues are equally far. */
static gnp_status check_shift(const struct gnp_domain *domain, double shift, struct gnp_error *error)
{
	static const double most = 1e12;
	double area = 0;
	for (size_t i = 0; i < domain->prepared.count; i++)
		area += domain->area[i] / (double)domain->prepared.count;
	if (shift * area <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "shift: got %g, need at most %g, %g over the area of %g that a point stands for", shift,
	                     most / area, most, area);
}

/* Takes the domain. */
static gnp_status run_on_take(const struct gnp_spectrum_task *asked, const struct gnp_poisson_options *options,
                              struct gnp_domain *domain, struct gnp_spectrum *spectrum, struct gnp_error *error)
{
	struct gnp_poisson_options inverted = *options;
	struct gnp_poisson *poisson = NULL;
	int system = options->laplacian.system;
	const char *why = system == GNP_SYSTEM_AUTO ? why_symmetric(asked, domain) : NULL;
	spectrum->surface = gnp_domain_facts(domain);
	if (system == GNP_SYSTEM_SYMMETRIC || why) {
		gnp_status status = run_symmetric(asked, domain, why, spectrum, error);
		gnp_domain_clear(domain);
		return status;
	}
	inverted.screening = -asked->sigma;
	gnp_status status = gnp_poisson_prepare_take(domain, &inverted, asked->pool, asked->task, &poisson, error);
	if (status == GNP_OK)
		status = run_prepared(asked, poisson, spectrum, error);
	gnp_poisson_release(poisson);
	return status;
}

static size_t count_free(const struct gnp_cloud *cloud, const unsigned char *fixed)
{
	size_t found = 0;
	for (size_t i = 0; i < cloud->count; i++)
		found += !fixed || !fixed[i];
	return found;
}

gnp_status gnp_spectrum_run(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                            const struct gnp_spectrum_wanted *wanted, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_spectrum *out, struct gnp_error *error)
{
	enum { FEWEST = 12 };
	struct gnp_spectrum spectrum = {.count = 0};
	struct gnp_spectrum_task asked = {.wanted = *wanted, .fixed = options->fixed, .memory_limit = options->memory_limit,
	                                  .free_points = count_free(cloud, options->fixed),
	                                  .degree = gnp_laplacian_degree(&options->laplacian), .pool = pool, .task = task};
	struct gnp_domain domain;
	gnp_status status = gnp_spectrum_check(wanted->count, asked.free_points, options->laplacian.system, error);
	if (status == GNP_OK)
		status = check_numbers(wanted, error);
	if (status == GNP_OK)
		status = gnp_cloud_check(cloud, FEWEST, error);
	if (status == GNP_OK)
		status = guess_first(cloud, &asked.first, error);
	if (status == GNP_OK)
		status = gnp_domain_make(cloud, &options->laplacian.domain, pool, task, &domain, error);
	if (status != GNP_OK)
		return status;
	asked.sigma = wanted->shift > 0 ? wanted->shift * beside_shift : -asked.first;
	status = check_shift(&domain, wanted->shift, error);
	if (status == GNP_OK)
		status = allocate(cloud->count, wanted->count, &spectrum, error);
	if (status == GNP_OK)
		status = run_on_take(&asked, options, &domain, &spectrum, error);
	else
		gnp_domain_clear(&domain);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK)
		*out = spectrum;
	else
		gnp_spectrum_clear(&spectrum);
	return status;
}

size_t gnp_spectrum_memory(size_t points, size_t count, int system)
{
	size_t symmetric = gnp_spectrum_symmetric_memory(points, count), answer;
	size_t square = gnp_spectrum_square_memory(points, count);
	bool alone = system == GNP_SYSTEM_SYMMETRIC || (system == GNP_SYSTEM_AUTO && points < least_points(count));
	size_t most = alone || symmetric > square ? symmetric : square;
	bool fits = gnp_size_multiply(points + 3, count * sizeof(double), &answer) && answer < SIZE_MAX / 4;
	return fits && most < SIZE_MAX / 4 ? most + answer : SIZE_MAX;
}
