/* bench OUT.json [CASE]: times the core on analytic clouds; a row a case with points, median seconds (whole and by stage),
 * peak memory, and the single-core sgemm rate of the same run, so that figures of different machines compare as ratios.
 * Every case runs in a process of its own: its peak memory is its alone. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/estimate/estimate.h"
#include "core/estimate/filter.h"
#include "core/flow/flow.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"

enum { RUNS_MAX = 9 };

/* What is timed: an estimate, a filter, a step of a flow (the mean of STEPS). */
enum work { ESTIMATE, FILTER, FLOW_EXPLICIT, FLOW_SEMI_IMPLICIT, FLOW_CONFORMAL };
enum { STEPS = 5 };

struct row {
	double seconds, stage[GNP_STAGE_COUNT]; /* medians */
	double bytes; /* peak resident size above that of the loaded sample */
	double sgemm; /* floating-point operations a second of one core */
	int failed;
};

struct bench_case {
	const char *name, *shape;
	size_t points;
	int runs, estimator, cover, k, with_normals;
	uint64_t quantities; /* 0: the default ones */
	const char *weights; /* of ./weights or auto; v1 and v2: the reference package's networks with random parameters */
	enum work work;
};

static const struct bench_case cases[] = {
	{"estimate_all_100k", "toroidal", 100000, 7, GNP_ESTIMATOR_GMLS, GNP_COVER_ALL, 30, 1, GNP_QUANTITY_ALL, NULL, ESTIMATE},
	{"estimate_all_100k_k50", "toroidal", 100000, 5, GNP_ESTIMATOR_GMLS, GNP_COVER_ALL, 50, 1, GNP_QUANTITY_ALL, NULL, ESTIMATE},
	{"estimate_cover_100k", "toroidal", 100000, 7, GNP_ESTIMATOR_GMLS, GNP_COVER_COVER, 30, 1, GNP_QUANTITY_ALL, NULL, ESTIMATE},
	{"estimate_default_100k_no_normals", "toroidal", 100000, 5, GNP_ESTIMATOR_GMLS, GNP_COVER_COVER, 30, 0, 0, NULL, ESTIMATE},
	{"adaptive_all_100k", "toroidal", 100000, 3, GNP_ESTIMATOR_ADAPTIVE, GNP_COVER_ALL, 30, 1, GNP_QUANTITY_ALL, NULL, ESTIMATE},
	{"gnp_clean_cover_100k", "toroidal", 100000, 5,
	 GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, GNP_QUANTITY_ALL, "fit_clean_50k", ESTIMATE},
	{"gnp_outlier_cover_100k", "toroidal", 100000, 3,
	 GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, GNP_QUANTITY_ALL, "fit_outlier_50k", ESTIMATE},
	{"gnp_noise_cover_100k", "toroidal", 100000, 5,
	 GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, GNP_QUANTITY_ALL, "fit_noise_70k", ESTIMATE},
	{"gnp_auto_cover_100k", "toroidal", 100000, 3, GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, GNP_QUANTITY_ALL, "auto", ESTIMATE},
	{"gnp_clean_all_100k", "toroidal", 100000, 1,
	 GNP_ESTIMATOR_GNP, GNP_COVER_ALL, 30, 1, GNP_QUANTITY_ALL, "fit_clean_50k", ESTIMATE},
	{"gnp_v1_cover_100k", "toroidal", 100000, 1, GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, GNP_QUANTITY_ALL, "v1", ESTIMATE},
	{"gnp_v2_cover_100k", "toroidal", 100000, 1, GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, GNP_QUANTITY_ALL, "v2", ESTIMATE},
	{"estimate_all_2k", "toroidal", 2000, 9, GNP_ESTIMATOR_GMLS, GNP_COVER_ALL, 30, 1, GNP_QUANTITY_ALL, NULL, ESTIMATE},
	{"estimate_all_1m", "toroidal", 1000000, 3, GNP_ESTIMATOR_GMLS, GNP_COVER_ALL, 30, 1, GNP_QUANTITY_ALL, NULL, ESTIMATE},
	{"estimate_all_1m_no_normals", "toroidal", 1000000, 1, GNP_ESTIMATOR_GMLS, GNP_COVER_ALL, 30, 0, GNP_QUANTITY_ALL, NULL, ESTIMATE},
	{"filter_gnp_100k", "toroidal", 100000, 3, GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, 0, "fit_outlier_50k", FILTER},
	{"flow_step_gnp_100k", "torus", 100000, 1,
	 GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, 0, "fit_clean_50k", FLOW_EXPLICIT},
	{"flow_step_gmls_100k", "torus", 100000, 1, GNP_ESTIMATOR_GMLS, GNP_COVER_COVER, 30, 1, 0, NULL, FLOW_EXPLICIT},
	{"flow_step_semi_implicit_gnp_100k", "torus", 100000, 1,
	 GNP_ESTIMATOR_GNP, GNP_COVER_COVER, 30, 1, 0, "fit_clean_50k", FLOW_SEMI_IMPLICIT},
	{"flow_step_conformal_100k", "torus", 100000, 1, GNP_ESTIMATOR_GMLS, GNP_COVER_COVER, 30, 1, 0, NULL, FLOW_CONFORMAL},
};

static double median(double *values, int count)
{
	qsort(values, (size_t)count, sizeof *values, gnp_double_compare);
	return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

/* Best of several products of 768 x 768: the rate a kernel could reach. */
static double sgemm_rate(void)
{
	enum { N = 768, TRIES = 9 };
	float *a = malloc(N * N * sizeof *a), *b = malloc(N * N * sizeof *b), *c = malloc(N * N * sizeof *c);
	double best = 0;
	for (size_t i = 0; a && b && i < (size_t)N * N; i++)
		a[i] = b[i] = (float)(i % 97) / 97;
	for (int i = 0; a && b && c && i < TRIES; i++) {
		double start = gnp_clock();
		gnp_linalg_sgemm(N, N, N, a, b, c);
		double rate = 2.0 * N * N * N / (gnp_clock() - start);
		best = rate > best ? rate : best;
	}
	free(a);
	free(b);
	free(c);
	return best;
}

static double peak_bytes(void)
{
	struct rusage usage;
	getrusage(RUSAGE_SELF, &usage);
	return 1024.0 * (double)usage.ru_maxrss;
}

/* Resident now: what the inputs take before the work starts. */
static double resident_bytes(void)
{
	long pages = 0;
	FILE *file = fopen("/proc/self/statm", "r");
	if (!file || fscanf(file, "%*d %ld", &pages) != 1)
		pages = 0;
	if (file)
		fclose(file);
	return (double)pages * (double)sysconf(_SC_PAGESIZE);
}

/* The reference package's network of version 1 or 2 with random parameters, at k = 50. */
static gnp_status published_model(bool second, struct gnp_model *model, struct gnp_error *error)
{
	struct gnp_layout layout;
	struct gnp_random random;
	*model = (struct gnp_model){
		.name = "published", .sha256 = "", .regime = "clean",
		.architecture = {.trunk = second ? GNP_TRUNK_SEPARABLE : GNP_TRUNK_EDGE, .features = 3, .width = 64, .channels = 4,
	                     .neurons = 256, .layers = 5, .quadrature = 32, .head_width = 128, .outputs = 16},
		.recipe = {.k = 50, .buffer = 1.25, .height_scale = second ? 1 : 2, .delta0 = second ? 0.001 : 0.005}};
	gnp_status status = gnp_architecture_layout(&model->architecture, &layout, error);
	float *parameters = status == GNP_OK ? malloc(layout.total * sizeof *parameters) : NULL;
	if (!parameters)
		return status != GNP_OK ? status : gnp_error_set(error, GNP_OUT_OF_MEMORY, "bench: no memory for parameters");
	gnp_random_seed(&random, 1, 1);
	for (size_t i = 0; i < layout.total; i++)
		parameters[i] = (float)(0.1 * (gnp_random_uniform(&random) - 0.5));
	status = gnp_network_create(&model->architecture, parameters, &model->network, error);
	free(parameters);
	return status;
}

/* The case's model; published is room for one that is no file's. */
static gnp_status set_model(const struct bench_case *test, const struct gnp_models *models, struct gnp_model *published,
                            struct gnp_estimate_options *options, struct gnp_error *error)
{
	options->models = models;
	if (!test->weights || strcmp(test->weights, "auto") == 0)
		return GNP_OK;
	if (test->weights[0] != 'v')
		return gnp_models_find(models, test->weights, &options->model, error);
	options->model = published;
	return published_model(test->weights[1] == '2', published, error);
}

static gnp_status time_flow(const struct bench_case *test, const struct gnp_estimate_options *options, const struct gnp_cloud *cloud,
                            struct gnp_pool *pool, struct gnp_task *task, double *seconds, struct gnp_error *error)
{
	struct gnp_flow_options with = gnp_flow_defaults();
	struct gnp_flow flow;
	with.estimate = *options;
	with.scheme = (int)test->work - FLOW_EXPLICIT + GNP_FLOW_EXPLICIT;
	with.steps = STEPS;
	gnp_status status = gnp_flow_run(cloud, NULL, &with, pool, task, &flow, error);
	if (status != GNP_OK)
		return status;
	*seconds = 0;
	for (size_t step = 1; step <= flow.steps; step++)
		*seconds += flow.records[step].seconds / (double)flow.steps;
	gnp_flow_clear(&flow);
	return GNP_OK;
}

static gnp_status time_filter(const struct gnp_estimate_options *options, const struct gnp_cloud *cloud, struct gnp_pool *pool,
                              struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_filter_options with = gnp_filter_defaults();
	struct gnp_filter filter;
	with.estimate = *options;
	gnp_status status = gnp_filter_run(cloud, &with, pool, task, &filter, error);
	if (status == GNP_OK)
		gnp_filter_clear(&filter);
	return status;
}

static gnp_status time_estimate(const struct gnp_estimate_options *options, const struct gnp_cloud *cloud, struct gnp_pool *pool,
                                struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_estimate estimate;
	gnp_status status = gnp_estimate_run(cloud, options, pool, task, &estimate, error);
	if (status == GNP_OK)
		gnp_estimate_clear(&estimate);
	return status;
}

static gnp_status time_run(const struct bench_case *test, const struct gnp_estimate_options *options, const struct gnp_cloud *cloud,
                           struct gnp_pool *pool, struct gnp_task *task, double *seconds, struct gnp_error *error)
{
	double start = gnp_clock();
	gnp_task_init(task);
	if (test->work >= FLOW_EXPLICIT)
		return time_flow(test, options, cloud, pool, task, seconds, error);
	gnp_status status = test->work == FILTER ? time_filter(options, cloud, pool, task, error)
	                                         : time_estimate(options, cloud, pool, task, error);
	*seconds = gnp_clock() - start;
	return status;
}

static gnp_status time_runs(const struct bench_case *test, const struct gnp_estimate_options *options, const struct gnp_cloud *cloud,
                            struct gnp_pool *pool, struct row *row, struct gnp_error *error)
{
	double seconds[RUNS_MAX], stage[GNP_STAGE_COUNT][RUNS_MAX];
	for (int run = 0; run < test->runs; run++) {
		struct gnp_task task;
		gnp_status status = time_run(test, options, cloud, pool, &task, &seconds[run], error);
		if (status != GNP_OK)
			return status;
		for (int s = 0; s < GNP_STAGE_COUNT; s++)
			stage[s][run] = task.seconds[s];
	}
	row->seconds = median(seconds, test->runs);
	for (int s = 0; s < GNP_STAGE_COUNT; s++)
		row->stage[s] = median(stage[s], test->runs);
	return GNP_OK;
}

static gnp_status timed_runs(const struct bench_case *test, const struct gnp_cloud *cloud, struct gnp_pool *pool,
                             struct row *row, struct gnp_error *error)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	options.estimator = test->estimator;
	options.cover = test->cover;
	options.k = test->k;
	options.quantities = test->quantities ? test->quantities : options.quantities;
	struct gnp_models *models = NULL;
	struct gnp_model published = {.network = NULL};
	gnp_status status = test->estimator == GNP_ESTIMATOR_GNP ? gnp_models_load("weights", &models, error) : GNP_OK;
	if (status == GNP_OK)
		status = set_model(test, models, &published, &options, error);
	if (status == GNP_OK)
		status = time_runs(test, &options, cloud, pool, row, error);
	gnp_network_free(published.network);
	gnp_models_release(models);
	return status;
}

static gnp_status run_case(const struct bench_case *test, struct row *row, struct gnp_error *error)
{
	struct gnp_pool *pool = NULL;
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample = {0};
	const struct gnp_sample_options wanted = {.count = test->points, .seed = 1};
	gnp_status status = gnp_pool_create(0, &pool, error);
	if (status == GNP_OK)
		status = gnp_shape_create(test->shape, 1, 0, &shape, error);
	if (status == GNP_OK)
		status = gnp_sample_create(shape, &wanted, pool, NULL, &sample, error);
	if (status == GNP_OK) {
		const struct gnp_cloud cloud = {sample.count, sample.points, test->with_normals ? sample.normals : NULL};
		double before = resident_bytes(), sampled = peak_bytes();
		status = timed_runs(test, &cloud, pool, row, error);
		double after = peak_bytes();
		row->bytes = after > sampled ? after - before : 0; /* 0: hidden below the sampler's own peak */
		row->sgemm = sgemm_rate();
	}
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
	gnp_pool_free(pool);
	return status;
}

static struct row run_in_child(const struct bench_case *test)
{
	struct row row = {.failed = 1};
	int ends[2];
	if (pipe(ends) != 0)
		return row;
	pid_t child = fork();
	if (child == 0) {
		struct gnp_error error = {0};
		row.failed = run_case(test, &row, &error) != GNP_OK;
		if (row.failed)
			fprintf(stderr, "bench: %s: %s\n", test->name, error.text);
		ssize_t written = write(ends[1], &row, sizeof row);
		_exit(written == (ssize_t)sizeof row ? 0 : 1);
	}
	close(ends[1]);
	if (child < 0 || read(ends[0], &row, sizeof row) != (ssize_t)sizeof row)
		row.failed = 1;
	close(ends[0]);
	if (child > 0)
		waitpid(child, NULL, 0);
	return row;
}

static void write_row(FILE *out, const struct bench_case *test, const struct row *row, int last)
{
	fprintf(out, "  {\"case\": \"%s\", \"points\": %zu, \"k\": %d, \"seconds\": %.4f", test->name, test->points, test->k, row->seconds);
	for (int s = GNP_STAGE_ORDER; s <= GNP_STAGE_ESTIMATE; s++)
		fprintf(out, ", \"seconds_%s\": %.4f", gnp_stage_name((enum gnp_stage)s), row->stage[s]);
	fprintf(out, ", \"peak_bytes\": %.0f, \"bytes_a_point\": %.0f, \"sgemm_flops\": %.4g}%s\n", row->bytes,
	        row->bytes / (double)test->points, row->sgemm, last ? "" : ",");
	printf("%-34s %8zu points %8.4f s  (order %.3f neighbors %.3f orient %.3f prepare %.3f estimate %.3f)  %5.0f B/point  sgemm %.0f GFLOP/s\n",
	       test->name, test->points, row->seconds, row->stage[GNP_STAGE_ORDER], row->stage[GNP_STAGE_NEIGHBORS],
	       row->stage[GNP_STAGE_ORIENT], row->stage[GNP_STAGE_PREPARE], row->stage[GNP_STAGE_ESTIMATE], row->bytes / (double)test->points, 1e-9 * row->sgemm);
	fflush(stdout);
}

int main(int argc, char **argv)
{
	if (argc < 2) {
		fprintf(stderr, "usage: bench OUT.json [CASE]\n");
		return 2;
	}
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	FILE *out = fopen(argv[1], "w");
	if (!out) {
		perror(argv[1]);
		return 1;
	}
	int failed = 0;
	size_t count = sizeof cases / sizeof *cases, chosen = 0, done = 0;
	for (size_t i = 0; i < count; i++)
		chosen += argc < 3 || strcmp(cases[i].name, argv[2]) == 0;
	fprintf(out, "[\n");
	for (size_t i = 0; i < count; i++) {
		if (argc > 2 && strcmp(cases[i].name, argv[2]) != 0)
			continue;
		struct row row = run_in_child(&cases[i]);
		failed |= row.failed;
		write_row(out, &cases[i], &row, ++done == chosen);
	}
	fprintf(out, "]\n");
	return fclose(out) != 0 || failed || !chosen;
}
