/* Whether the memory that an operation says it needs is what it takes. The daemon takes the estimate from its budget
 * before the work begins, so that less than what is used endangers every other request, and far more turns requests
 * away for nothing: use <= estimate <= 1.5 use, and 12 MiB, must hold for every operation, each estimator and solver,
 * even and random and noisy clouds, 5,000 points with one worker and up to 40,000 with two.
 *
 * All allocations of the process count: it begins itself again with tests/counting_malloc.so before it; under a
 * sanitizer, which has a malloc of its own, by that one's hooks, and then only what is used is held against the
 * estimate (a sanitizer's pieces are larger). MEMORY_TABLE=1 prints use and estimate of each. */
#include "tests/bench/cloud_request.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdatomic.h>
#include <unistd.h>

#include "core/base/random.h"
#include "core/base/task.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"

static const double FLOOR = 12 << 20, MOST = 1.5;

/* ---- Counting ---- */

static size_t (*counted_live)(void), (*counted_peak)(void);
static void (*counted_restart)(void);

/* Sanitizers' interface; NULL without one. */
int __sanitizer_install_malloc_and_free_hooks(void (*allocated)(const volatile void *, size_t),
                                              void (*freed)(const volatile void *)) __attribute__((weak));
size_t __sanitizer_get_allocated_size(const volatile void *piece) __attribute__((weak));

static atomic_size_t live, peak;

static void allocated(const volatile void *piece, size_t size)
{
	size_t now = atomic_fetch_add(&live, piece ? size : 0) + size, most = atomic_load(&peak);
	while (now > most && !atomic_compare_exchange_weak(&peak, &most, now))
		continue;
}

static void freed(const volatile void *piece)
{
	if (piece)
		atomic_fetch_sub(&live, __sanitizer_get_allocated_size(piece));
}

static size_t own_live(void)
{
	return atomic_load(&live);
}

static size_t own_peak(void)
{
	return atomic_load(&peak);
}

static void own_restart(void)
{
	atomic_store(&peak, atomic_load(&live));
}

/* Does not return where the program has to begin again, with the library before it. */
static bool begin_counting(char **argv)
{
	char program[PATH_MAX] = "", library[2 * PATH_MAX];
	*(void **)&counted_live = dlsym(RTLD_DEFAULT, "counting_malloc_live");
	*(void **)&counted_peak = dlsym(RTLD_DEFAULT, "counting_malloc_peak");
	*(void **)&counted_restart = dlsym(RTLD_DEFAULT, "counting_malloc_restart");
	if (counted_live && counted_peak && counted_restart)
		return true;
	if (__sanitizer_install_malloc_and_free_hooks) {
		counted_live = own_live;
		counted_peak = own_peak;
		counted_restart = own_restart;
		return __sanitizer_install_malloc_and_free_hooks(allocated, freed) > 0;
	}
	ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
	for (int up = 0; length > 0 && up < 4; up++)
		*strrchr(program, '/') = '\0';
	const char *others = getenv("LD_PRELOAD");
	if (length <= 0 || (others && strstr(others, "counting_malloc.so")))
		return false;
	if (snprintf(library, sizeof library, "%s/counting_malloc.so:%s", program, others ? others : "") >= (int)sizeof library)
		return false;
	setenv("LD_PRELOAD", library, 1);
	execv("/proc/self/exe", argv);
	return false;
}

/* ---- Clouds ---- */

enum kind { EVEN, RANDOM, NOISY, SPOILT, KINDS }; /* spoilt: one point in ten is an outlier */
static const char *const kind_names[KINDS] = {"even", "random", "noisy", "spoilt"};

/* Points of the unit sphere with their normals, if they are given. */
static void add_cloud(struct gnp_request *request, enum kind kind, size_t count, bool normals)
{
	struct gnp_tensor *points, *given;
	size_t shape[] = {count, 3};
	struct gnp_random random;
	gnp_random_seed(&random, 7, count);
	enum gnp_datatype type = kind == RANDOM ? GNP_FP32 : GNP_FP64;
	CHECK(gnp_tensors_add(&request->inputs, "points", type, 2, shape, &points, NULL) == GNP_OK);
	CHECK(!normals || gnp_tensors_add(&request->inputs, "normals", type, 2, shape, &given, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, phi = 2.399963229728653 * (double)i, noise = 0;
		if (kind == RANDOM) {
			z = 2 * gnp_random_uniform(&random) - 1;
			phi = 6.283185307179586 * gnp_random_uniform(&random);
		}
		if (kind == NOISY)
			noise = 0.003 * gnp_random_normal(&random);
		if (kind == SPOILT && i % 10 == 0)
			noise = 0.1 * gnp_random_normal(&random);
		double r = sqrt(1 - z * z), p[] = {r * cos(phi), r * sin(phi), z};
		for (size_t a = 0; a < 3; a++) {
			set_value(points, 3 * i + a, p[a] * (1 + noise));
			if (normals)
				set_value(given, 3 * i + a, p[a]);
		}
	}
}

/* (count, columns) of z. */
static void add_columns(struct gnp_request *request, const char *name, size_t columns)
{
	const struct gnp_tensor *points = gnp_tensors_find(&request->inputs, "points");
	size_t shape[] = {points->shape[0], columns};
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(&request->inputs, name, GNP_FP64, 2, shape, &tensor, NULL) == GNP_OK);
	for (size_t i = 0; i < shape[0] * columns; i++)
		set_value(tensor, i, gnp_tensor_get(points, 3 * (i / columns) + 2) * (1 + (double)(i % columns)));
}

/* Every tenth point. */
static void add_sources(struct gnp_request *request)
{
	const struct gnp_tensor *points = gnp_tensors_find(&request->inputs, "points");
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(&request->inputs, "sources", GNP_BOOL, 1, points->shape, &tensor, NULL) == GNP_OK);
	for (size_t i = 0; i < points->shape[0]; i++)
		((unsigned char *)tensor->data)[i] = i % 10 == 0;
}

/* Of each point with one of the first twenty. */
static void add_pairs(struct gnp_request *request)
{
	const struct gnp_tensor *points = gnp_tensors_find(&request->inputs, "points");
	struct gnp_tensor *tensor;
	const size_t shape[] = {points->shape[0], 2};
	CHECK(gnp_tensors_add(&request->inputs, "pairs", GNP_INT64, 2, shape, &tensor, NULL) == GNP_OK);
	for (size_t i = 0; i < points->shape[0]; i++) {
		((int64_t *)tensor->data)[2 * i] = (int64_t)i;
		((int64_t *)tensor->data)[2 * i + 1] = (int64_t)(i % 20);
	}
}

/* ---- Runs ---- */

/* An operation with parameters, and what goes in beside points. */
struct run {
	const char *operation, *parameters, *columns; /* the input of columns; NULL: none */
	size_t column_count;                          /* 0: it is a mask of sources, or pairs of points */
	bool normals;
	unsigned kinds;       /* mask of the clouds it is run on */
	size_t points_most;
};
enum { ALL = 1 << EVEN | 1 << RANDOM | 1 << NOISY };

static void print_row(const struct run *run, enum kind kind, size_t points, unsigned workers, size_t use,
                      size_t estimate)
{
	if (getenv("MEMORY_TABLE"))
		printf("%-9s %-62s %-6s %zu %6zu %u %8.2f %8.2f MB %5.2f  %6.0f %6.0f B\n", run->operation, run->parameters, kind_names[kind], run->column_count,
		       points, workers, (double)use / 1e6, (double)estimate / 1e6, (double)estimate / (double)use, (double)use / (double)points,
		       (double)estimate / (double)points);
}

static void judge(const struct run *run, enum kind kind, size_t points, unsigned workers, size_t use, size_t estimate)
{
	bool sanitized = __sanitizer_install_malloc_and_free_hooks != NULL;
	print_row(run, kind, points, workers, use, estimate);
	if (use <= estimate && (sanitized || (double)estimate <= MOST * (double)use + FLOOR))
		return;
	fprintf(stderr, "%s %s, %s, %zu points, %u workers: uses %zu bytes, estimate %zu, need at most 1.5 times the use and 12 MiB\n", run->operation,
	        run->parameters, kind_names[kind], points, workers, use, estimate);
	CHECK(!"estimate of memory");
}

static struct gnp_models *models;

/* *use: the most bytes there were at a time beside those before; *estimate: what the operation said. False: it
 * failed. */
static bool measure(const struct run *run, enum kind kind, size_t points, struct gnp_pool *pool, size_t *use,
                    size_t *estimate)
{
	const struct gnp_limits limits = {.models = models};
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_error error = {0};
	struct gnp_task task;
	struct gnp_call call;
	add_cloud(&request, kind, points, run->normals);
	if (run->columns && run->column_count == 0)
		strcmp(run->columns, "pairs") == 0 ? add_pairs(&request) : add_sources(&request);
	else if (run->columns)
		add_columns(&request, run->columns, run->column_count);
	set_parameters(&request, run->parameters);
	gnp_task_init(&task);
	size_t before = counted_live();
	counted_restart();
	gnp_status status = gnp_call_prepare(gnp_operation_find(run->operation), &request, &limits, &call, &error);
	if (status == GNP_OK)
		status = gnp_call_run(&call, pool, &task, &response, &error);
	*use = counted_peak() - before;
	*estimate = call.memory;
	CHECK_STRING(error.text, "");
	gnp_response_clear(&response);
	gnp_request_clear(&request);
	return status == GNP_OK;
}

/* The scratch of workers belongs to the pool, which keeps it from one request to the next: a small cloud makes it
 * before a larger one is measured. */
static void run_once(const struct run *run, enum kind kind, size_t points, unsigned workers)
{
	enum { SMALL = 4000 };
	struct gnp_pool *pool = NULL;
	size_t use, estimate;
	CHECK(gnp_pool_create(workers, &pool, NULL) == GNP_OK);
	if (measure(run, kind, SMALL, pool, &use, &estimate) && measure(run, kind, points, pool, &use, &estimate))
		judge(run, kind, points, workers, use, estimate);
	gnp_pool_free(pool);
}

static void run_all(const struct run *runs, size_t count)
{
	size_t most = getenv("MEMORY_POINTS") ? strtoul(getenv("MEMORY_POINTS"), NULL, 10) : 0;
	for (size_t r = 0; r < count; r++)
		for (int kind = 0; kind < KINDS; kind++) {
			if (!(runs[r].kinds >> kind & 1))
				continue;
			run_once(&runs[r], (enum kind)kind, 5000, 1);
			if (runs[r].points_most > 5000)
				run_once(&runs[r], (enum kind)kind, most ? most : runs[r].points_most, 2);
		}
}
#define RUN_ALL(runs) run_all(runs, sizeof(runs) / sizeof *(runs))

static void estimates(void)
{
	static const struct run runs[] = {
		{"estimate", "estimator=gmls", NULL, 0, false, ALL, 40000},
		{"estimate", "estimator=gmls", NULL, 0, true, 1 << EVEN, 40000},
		{"estimate", "estimator=gmls quantities=all degree=7 k=100", NULL, 0, true, 1 << EVEN, 40000},
		{"estimate", "estimator=gmls cover=all k=100 degree=4", NULL, 0, true, 1 << EVEN, 40000},
		{"estimate", "estimator=adaptive", NULL, 0, false, ALL, 40000},
		{"estimate", "estimator=adaptive quantities=all", NULL, 0, true, 1 << EVEN | 1 << RANDOM, 40000},
		{"estimate", "estimator=gnp", NULL, 0, false, 1 << NOISY | 1 << SPOILT, 40000},
		{"estimate", "estimator=gnp quantities=normals", NULL, 0, true, 1 << SPOILT, 20000},
		{"patch", "estimator=gnp", NULL, 0, false, 1 << RANDOM, 40000},
		{"patch", "estimator=gnp at=100", NULL, 0, true, 1 << NOISY, 40000},
		{"estimate", "estimator=gnp outliers=left_out weights=fit_clean_30k", NULL, 0, true, 1 << EVEN, 40000},
		{"estimate", "estimator=gnp weights=fit_noise_70k quantities=normals", NULL, 0, true, 1 << NOISY, 40000},
		{"estimate", "estimator=gnp quantities=all", NULL, 0, true, 1 << EVEN, 40000}};
	RUN_ALL(runs);
}

static void filters(void)
{
	static const struct run runs[] = {
		{"filter", "estimator=gmls", NULL, 0, false, 1 << EVEN | 1 << RANDOM, 40000},
		{"filter", "estimator=gnp project=true", NULL, 0, true, 1 << EVEN, 40000},
		{"filter", "estimator=adaptive project=true", NULL, 0, false, 1 << NOISY, 40000}};
	RUN_ALL(runs);
}

static void flows(void)
{
	static const struct run runs[] = {
		{"flow", "estimator=gmls steps=2", NULL, 0, false, 1 << EVEN | 1 << RANDOM, 40000},
		{"flow", "estimator=gmls steps=2 scheme=semi_implicit", NULL, 0, true, 1 << EVEN, 40000},
		{"flow", "estimator=gnp steps=1 tangential=0.5", NULL, 0, true, 1 << EVEN, 40000},
		{"flow", "estimator=gmls steps=2 scheme=conformal", NULL, 0, true, 1 << EVEN, 40000},
		{"flow", "estimator=gmls steps=4 snapshot_every=1", NULL, 0, true, 1 << EVEN, 40000},
		{"smooth", "estimator=gmls", NULL, 0, false, 1 << EVEN | 1 << RANDOM, 40000},
		{"smooth", "estimator=gnp features=keep rounds=1", NULL, 0, true, 1 << NOISY, 40000}};
	RUN_ALL(runs);
}

static void laplacians(void)
{
	static const struct run runs[] = {
		{"laplacian", "estimator=gmls", NULL, 0, false, 1 << EVEN, 40000},
		{"laplacian", "estimator=gmls outputs=all", NULL, 0, true, 1 << EVEN, 40000},
		{"laplacian", "estimator=gmls system=symmetric", NULL, 0, true, 1 << EVEN | 1 << RANDOM, 40000},
		{"laplacian", "estimator=gmls system=least_squares", NULL, 0, true, 1 << EVEN, 40000}};
	RUN_ALL(runs);
}

static void equations(void)
{
	static const struct run runs[] = {
		{"poisson", "estimator=gmls", "source", 1, false, ALL, 5000},
		{"poisson", "estimator=gmls", "source", 1, true, 1 << EVEN, 40000},
		{"poisson", "estimator=gmls", "source", 30, true, 1 << EVEN, 5000},
		{"poisson", "estimator=gmls function_degree=4", "source", 1, true, 1 << EVEN, 5000},
		{"poisson", "estimator=gmls stencil=80", "source", 1, true, 1 << EVEN, 5000},
		{"poisson", "estimator=gmls solver=iterative screening=1", "source", 1, true, 1 << EVEN, 40000},
		{"poisson", "estimator=gmls solver=iterative screening=1", "source", 30, true, 1 << EVEN, 5000},
		{"poisson", "estimator=gmls solver=iterative system=least_squares screening=1", "source", 1, true, 1 << EVEN, 5000},
		{"poisson", "estimator=gmls system=least_squares", "source", 1, true, 1 << EVEN, 20000},
		{"poisson", "estimator=gmls filter=true", "source", 1, true, 1 << EVEN, 5000},
		{"heat", "estimator=gmls dt=0.01 steps=2", "initial", 2, true, 1 << EVEN, 5000},
		{"geodesic", "estimator=gmls", NULL, 0, true, 1 << EVEN | 1 << RANDOM, 40000},
		{"geodesic", "estimator=gmls", "sources", 0, true, 1 << EVEN | 1 << RANDOM, 40000},
		{"geodesic", "estimator=gmls log=true", NULL, 0, true, 1 << EVEN, 40000},
		{"geodesic", "estimator=gmls", "vectors", 3, true, 1 << EVEN, 40000},
		{"geodesic", "estimator=gmls", "pairs", 0, true, 1 << EVEN, 40000},
		{"geodesic", "estimator=gmls filter=true", NULL, 0, false, 1 << EVEN, 40000},
		{"spectrum", "estimator=gmls count=10", NULL, 0, true, 1 << EVEN | 1 << RANDOM, 5000},
		{"spectrum", "estimator=gmls count=60", NULL, 0, true, 1 << EVEN, 5000},
		{"spectrum", "estimator=gmls system=symmetric count=10", NULL, 0, true, 1 << EVEN, 40000},
		{"spectrum", "estimator=gmls system=symmetric count=100", NULL, 0, true, 1 << EVEN | 1 << RANDOM, 20000},
		{"spectrum", "estimator=gmls system=symmetric count=60 shift=10", NULL, 0, true, 1 << EVEN, 20000}};
	RUN_ALL(runs);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(estimates), TEST(filters), TEST(flows), TEST(laplacians), TEST(equations)};
	if (!begin_counting(argv) || gnp_models_load("weights", &models, NULL) != GNP_OK) {
		fprintf(stderr, "test_memory_estimates: cannot count allocations, or load the models of ./weights\n");
		return 1;
	}
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	return failed;
}
