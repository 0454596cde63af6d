/* bench_poisson SHAPE POINTS [key=value...]: seconds and errors of one Poisson problem with a manufactured solution on an analytic
 * cloud. Keys: k, cover (0 or 1), estimator (0 gnp, 1 gmls, 2 adaptive), weights (name in ./weights), system (0 square, 1 least squares), solver (0 auto, 1 direct, 2
 * iterative), degree, neighbors, noise, outliers (their fraction, sigma 5e-3), filter, project, sides (right-hand sides timed), seed. */
#include <sys/resource.h>

#include "core/equations/poisson.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "tests/oracles/manufactured.h"

struct wanted {
	double k, cover, estimator, system, solver, degree, neighbors, noise, outliers, filter, project, sides, seed;
	const char *weights;
};

static int read_wanted(int argc, char **argv, struct wanted *wanted)
{
	const struct {
		const char *key;
		double *value;
	} keys[] = {{"k", &wanted->k}, {"cover", &wanted->cover}, {"estimator", &wanted->estimator}, {"system", &wanted->system},
	            {"solver", &wanted->solver}, {"degree", &wanted->degree}, {"neighbors", &wanted->neighbors}, {"noise", &wanted->noise},
	            {"outliers", &wanted->outliers}, {"filter", &wanted->filter}, {"project", &wanted->project}, {"sides", &wanted->sides}, {"seed", &wanted->seed}};
	for (int a = 3; a < argc; a++) {
		size_t i = 0, count = sizeof keys / sizeof *keys;
		const char *equals = strchr(argv[a], '=');
		while (equals && i < count && (strncmp(argv[a], keys[i].key, (size_t)(equals - argv[a])) || keys[i].key[equals - argv[a]]))
			i++;
		if (equals && i < count)
			*keys[i].value = atof(equals + 1);
		else if (equals && strncmp(argv[a], "weights=", 8) == 0)
			wanted->weights = equals + 1;
		else
			return 0;
	}
	return 1;
}

static double peak_gigabytes(void)
{
	struct rusage usage;
	getrusage(RUSAGE_SELF, &usage);
	return 1024e-9 * (double)usage.ru_maxrss;
}

static gnp_status set_options(const struct wanted *wanted, const struct gnp_models *models, struct gnp_poisson_options *options,
                              struct gnp_error *error)
{
	struct gnp_estimate_options *estimate = &options->laplacian.domain.estimate;
	estimate->k = (int)wanted->k;
	estimate->cover = (int)wanted->cover;
	estimate->estimator = (int)wanted->estimator;
	estimate->models = models;
	static struct gnp_filter_options filter;
	filter = gnp_filter_defaults();
	filter.project = true;
	options->laplacian.domain.project = wanted->project != 0;
	options->laplacian.system = (int)wanted->system;
	options->laplacian.degree = (int)wanted->degree;
	options->laplacian.neighbors = (int)wanted->neighbors;
	options->solver = (int)wanted->solver;
	gnp_status status = wanted->weights ? gnp_models_find(models, wanted->weights, &estimate->model, error) : GNP_OK;
	filter.estimate = *estimate;
	options->laplacian.domain.filter = wanted->filter != 0 ? &filter : NULL;
	return status;
}

static void print_stages(const struct gnp_task *task)
{
	for (int s = GNP_STAGE_ORDER; s < GNP_STAGE_DONE; s++)
		if (task->seconds[s] > 5e-4)
			printf(" %s %.3f", gnp_stage_name((enum gnp_stage)s), task->seconds[s]);
	printf("\n");
}

static gnp_status solve(const struct gnp_sample *sample, const struct gnp_poisson *poisson, struct gnp_pool *pool, size_t sides,
                        struct gnp_error *error)
{
	size_t n = sample->count;
	double *value = malloc(n * sizeof *value), *source = malloc(n * sides * sizeof *source), *solution = malloc(n * sides * sizeof *solution);
	struct gnp_poisson_report *reports = calloc(sides, sizeof *reports);
	for (size_t i = 0; i < n; i++) {
		struct manufactured at = manufactured_of(sample, i);
		value[i] = at.value;
		for (size_t r = 0; r < sides; r++)
			source[i * sides + r] = -at.laplacian;
	}
	double started = gnp_clock();
	gnp_status status = gnp_poisson_solve(poisson, source, NULL, sides, pool, NULL, solution, reports, error);
	double seconds = gnp_clock() - started;
	for (size_t i = 0; i < n; i++)
		solution[i] = solution[i * sides];
	if (status == GNP_OK)
		printf("  error %.3e  residual %.2e  misfit %.2e  mean %.2e%s  energy %.3f  iterations %zu  %zu sides %.4f s, %.4f s each\n",
		       relative_error_without_mean(solution, value, n), reports->residual, reports->misfit, reports->mean,
		       reports->mean_removed ? " (removed)" : "", reports->energy, reports->iterations, sides, seconds, seconds / (double)sides);
	free(value);
	free(source);
	free(solution);
	free(reports);
	return status;
}

static gnp_status run(const char *shape, size_t count, const struct wanted *wanted, struct gnp_pool *pool, struct gnp_error *error)
{
	struct gnp_models *models = NULL;
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_poisson *poisson = NULL;
	struct gnp_task task;
	struct gnp_sample sample = sample_of(shape, &(struct gnp_sample_options){.count = count, .seed = (uint64_t)wanted->seed, .noise = wanted->noise,
	                                     .outlier_fraction = wanted->outliers, .outlier_noise = 5e-3}, pool);
	const struct gnp_cloud cloud = {sample.count, sample.points, sample.normals};
	double sampled = peak_gigabytes();
	gnp_task_init(&task);
	gnp_status status = gnp_models_load("weights", &models, error);
	if (status == GNP_OK)
		status = set_options(wanted, models, &options, error);
	double started = gnp_clock();
	if (status == GNP_OK)
		status = gnp_poisson_prepare(&cloud, &options, pool, &task, &poisson, error);
	if (status == GNP_OK) {
		struct gnp_poisson_info info = gnp_poisson_info(poisson);
		printf("%s %zu: prepare %.2f s, %s, %zu unknowns, %zu components, %zu dropped, %zu reduced, holds %.2f GB, peak %.2f GB (%.2f before):", shape, count,
		       gnp_clock() - started, info.solver == GNP_SOLVER_DIRECT ? "direct" : "iterative", info.unknowns, info.components, info.dropped, info.reduced,
		       1e-9 * (double)info.bytes, peak_gigabytes(), sampled);
		print_stages(&task);
		for (size_t sides = 1; sides <= (size_t)wanted->sides && status == GNP_OK; sides *= 2)
			status = solve(&sample, poisson, pool, sides, error);
	}
	gnp_poisson_release(poisson);
	gnp_models_release(models);
	gnp_sample_clear(&sample);
	return status;
}

int main(int argc, char **argv)
{
	struct wanted wanted = {.k = 50, .cover = GNP_COVER_ALL, .estimator = GNP_ESTIMATOR_GMLS, .sides = 1, .seed = 7};
	struct gnp_pool *pool = NULL;
	struct gnp_error error = {0};
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	if (argc < 3 || !read_wanted(argc, argv, &wanted)) {
		fprintf(stderr, "usage: bench_poisson SHAPE POINTS [key=value...]\n");
		return 2;
	}
	gnp_status status = gnp_pool_create(0, &pool, &error);
	if (status == GNP_OK)
		status = run(argv[1], (size_t)atol(argv[2]), &wanted, pool, &error);
	if (status != GNP_OK)
		fprintf(stderr, "bench_poisson: %s\n", error.text);
	gnp_pool_free(pool);
	return status != GNP_OK;
}
