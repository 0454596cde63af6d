/* bench_network [CASE]: the networks alone, on patches like those of 100,000 points with cover=cover and k = 50: 60 points, and a
 * buffer to 95 nodes for the edge trunk. For the published networks and two of the size that is trained here: patches a second of
 * all cores and of one, forward and with the backward pass, and the rate of all matrix products, as if the rest took no time,
 * against that of sgemm in the same run. Rates are by processor time, so that other work on the machine disturbs them less. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/base/pool.h"
#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "core/network/pooled.h"

enum { BATCH = 32, BATCHES = 16, NODES = 95, INNER = 60, PATCHES_100K = 7500, OUTPUTS = 16 };

#define ARCHITECTURE(trunk_, neurons_, layers_)                                                                               \
	{.trunk = trunk_, .head = GNP_HEAD_POOLED, .features = 3, .width = 64, .channels = 4, .neurons = neurons_,                \
	 .layers = layers_, .quadrature = 32, .head_width = 128, .outputs = OUTPUTS}

static const struct {
	const char *name;
	size_t nodes;
	struct gnp_architecture architecture;
} cases[] = {
	{"published v1", NODES, ARCHITECTURE(GNP_TRUNK_EDGE, 256, 5)},
	{"published v2", INNER, ARCHITECTURE(GNP_TRUNK_SEPARABLE, 256, 5)},
	{"edge, n = 64, 3 layers", NODES, ARCHITECTURE(GNP_TRUNK_EDGE, 64, 3)},
	{"separable, n = 64, 3 layers", INNER, ARCHITECTURE(GNP_TRUNK_SEPARABLE, 64, 3)},
};

static size_t start[BATCH + 1], inner[BATCH];
static float nodes[BATCH * NODES * 3];

struct work {
	const struct gnp_network *network;
	struct gnp_network_batch batch;
	float *gradient; /* NULL: forward only */
};

static gnp_status run_batches(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct work *work = context;
	float coefficients[BATCH * OUTPUTS];
	gnp_status status = GNP_OK;
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		const struct gnp_pooled_tape *tape = NULL;
		status = gnp_pooled_forward(work->network, &work->batch, coefficients, work->gradient ? &tape : NULL, scratch, error);
		if (status == GNP_OK && work->gradient)
			status = gnp_pooled_backward(work->network, tape, coefficients, work->gradient, scratch, error);
		gnp_scratch_release(scratch, mark);
	}
	return status;
}

/* Seconds of all threads. */
static double processor_clock(void)
{
	return (double)clock() / CLOCKS_PER_SEC;
}

/* Best of several products of 768 x 768 on one core. */
static double sgemm_rate(void)
{
	enum { N = 768, TRIES = 7 };
	static float a[N * N], b[N * N], c[N * N];
	double best = 0;
	for (size_t i = 0; i < (size_t)N * N; i++)
		a[i] = b[i] = (float)(i % 97) / 97;
	for (int i = 0; i < TRIES; i++) {
		double from = processor_clock();
		gnp_linalg_sgemm(N, N, N, a, b, c);
		double rate = 2.0 * N * N * N / (processor_clock() - from);
		best = rate > best ? rate : best;
	}
	return best;
}

static void draw_patches(size_t count)
{
	struct gnp_random random;
	gnp_random_seed(&random, 5, 0);
	for (size_t p = 0; p < BATCH; p++) {
		start[p + 1] = start[p] + count;
		inner[p] = INNER;
	}
	for (size_t i = 0; i < BATCH * count * 3; i++)
		nodes[i] = (float)(2 * gnp_random_uniform(&random) - 1);
}

/* Of one batch, each the least of several runs. */
struct seconds {
	double wall, processor;
};

static struct seconds measure(struct gnp_pool *pool, struct work *work)
{
	struct seconds best = {1e9, 1e9};
	for (int i = 0; i < 5; i++) {
		double wall = gnp_clock(), processor = processor_clock();
		if (gnp_pool_run(pool, NULL, BATCHES, 1, run_batches, work, NULL) != GNP_OK)
			exit(1);
		best.wall = fmin(best.wall, (gnp_clock() - wall) / BATCHES);
		best.processor = fmin(best.processor, (processor_clock() - processor) / BATCHES);
	}
	return best;
}

static void report(const char *what, struct seconds spent, double operations, double rate, unsigned workers)
{
	printf("  %-13s %u cores: %6.0f patches/s, %6.2f s for %d patches, %5.1f GFLOP/s a core, %.2f of sgemm\n", what, workers,
	       BATCH / spent.wall, spent.wall / BATCH * PATCHES_100K, PATCHES_100K, operations / spent.processor * 1e-9,
	       operations / spent.processor / rate);
}

int main(int argc, char **argv)
{
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	const char *wanted = argc > 1 ? argv[1] : "";
	struct gnp_pool *all = NULL, *one = NULL;
	if (gnp_pool_create(0, &all, NULL) != GNP_OK || gnp_pool_create(1, &one, NULL) != GNP_OK)
		return 1;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct gnp_layout layout;
		struct work work = {0};
		struct gnp_network *network = NULL;
		struct gnp_random random;
		if (!strstr(cases[i].name, wanted) || gnp_architecture_layout(&cases[i].architecture, &layout, NULL) != GNP_OK)
			continue;
		gnp_random_seed(&random, 9, 0);
		float *parameters = malloc(layout.total * sizeof *parameters), *gradient = calloc(layout.total, sizeof *gradient);
		for (size_t k = 0; k < layout.total; k++)
			parameters[k] = (float)(0.1 * (2 * gnp_random_uniform(&random) - 1));
		if (gnp_network_create(&cases[i].architecture, parameters, &network, NULL) != GNP_OK)
			return 1;
		draw_patches(cases[i].nodes);
		work.network = network;
		work.batch = (struct gnp_network_batch){BATCH, start, inner, nodes};
		double rate = sgemm_rate(), forward = gnp_trunk_operations(network, &work.batch, false);
		printf("%s: %zu parameters, sgemm %.1f GFLOP/s\n", cases[i].name, layout.total, rate * 1e-9);
		report("forward", measure(all, &work), forward, rate, gnp_pool_workers(all));
		report("forward", measure(one, &work), forward, rate, 1);
		work.gradient = gradient;
		report("and backward", measure(one, &work), forward + gnp_trunk_operations(network, &work.batch, true), rate, 1);
		gnp_network_free(network);
		free(parameters);
		free(gradient);
	}
	gnp_pool_free(all);
	gnp_pool_free(one);
	return 0;
}
