/* bench_support [POINTS]: what a point costs the head `weighted`, in one thread: search, ladder, nodes, first fits,
 * choice of the frame, network and solution, of supports that reach 144, 432 and 1296 points of a torus with noise.
 * Microseconds of processor time, so that other work on the machine disturbs them less; each the least of several runs
 * over the same points. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/base/random.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "core/network/frame_choice.h"
#include "core/network/weighted_head.h"
#include "core/search/order.h"
#include "core/support/first_fits.h"

enum { CHUNK = 64, BATCH = 16, RUNS = 5, STRIDE = GNP_TAYLOR_STRIDE };

static const struct gnp_architecture architecture = {
	.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_WEIGHTED, .features = GNP_SUPPORT_FEATURES, .width = 32,
	.channels = 4, .neurons = 32, .layers = 3, .quadrature = 64, .head_width = 64, .outputs = GNP_WEIGHTED_OUTPUTS,
	.node_width = 32, .frame_width = 48};

enum part { SEARCH, LADDER, CHOICE, BUILD, FIRST_FITS, FORWARD, INFER, SOLVE, PARTS };
static const char *const names[PARTS] = {
	"search",  "ladder",          "choice of the frame", "support", " of it first fits", "forward, for training",
	"forward", " of it solutions"};

struct bench {
	size_t count;
	double *points, *normals;
	struct gnp_roughness roughness;
	struct gnp_support_cloud cloud;
	struct gnp_network *network;
	struct gnp_scratch *scratch;
	struct gnp_support supports[CHUNK];
	const struct gnp_support *list[CHUNK];
};

static double seconds(void)
{
	struct timespec t;
	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void make_cloud(struct bench *bench, size_t count)
{
	struct gnp_random random;
	struct gnp_pool *pool = NULL;
	struct gnp_neighbors *neighbors = NULL;
	double *drawn = malloc(3 * count * sizeof *drawn);
	uint32_t *order = malloc(count * sizeof *order);
	bench->count = count;
	bench->points = malloc(3 * count * sizeof *bench->points);
	bench->normals = malloc(3 * count * sizeof *bench->normals);
	gnp_random_seed(&random, 3, 0);
	for (size_t i = 0; i < 3 * count; i += 3) {
		double a = 2 * M_PI * gnp_random_uniform(&random), b = 2 * M_PI * gnp_random_uniform(&random);
		double r = 0.4 + 0.002 * gnp_random_normal(&random);
		drawn[i] = (1 + r * cos(b)) * cos(a);
		drawn[i + 1] = (1 + r * cos(b)) * sin(a);
		drawn[i + 2] = r * sin(b);
	}
	if (gnp_order_compute(drawn, count, order, NULL) != GNP_OK)
		exit(1);
	for (size_t i = 0; i < count; i++) {
		double *p = bench->points + 3 * i, *n = bench->normals + 3 * i;
		memcpy(p, drawn + 3 * (size_t)order[i], 3 * sizeof *p);
		double radius = hypot(p[0], p[1]), away = hypot(radius - 1, p[2]);
		n[0] = p[0] * (radius - 1) / radius / away;
		n[1] = p[1] * (radius - 1) / radius / away;
		n[2] = p[2] / away;
	}
	free(order);
	free(drawn);
	if (gnp_neighbors_build(bench->points, count, &neighbors, NULL) != GNP_OK ||
	    gnp_pool_create(1, &pool, NULL) != GNP_OK)
		exit(1);
	double from = gnp_clock();
	if (gnp_roughness_measure(neighbors, pool, NULL, &bench->roughness, NULL) != GNP_OK)
		exit(1);
	printf("roughness of %zu points: %.2f us a point of the cloud\n", count,
	       (gnp_clock() - from) / (double)count * 1e6);
	gnp_pool_free(pool);
	bench->cloud = (struct gnp_support_cloud){bench->points, bench->normals, false, neighbors, &bench->roughness};
}

static void make_network(struct bench *bench)
{
	struct gnp_random random;
	struct gnp_layout layout;
	if (gnp_architecture_layout(&architecture, &layout, NULL) != GNP_OK)
		exit(1);
	float *parameters = malloc(layout.total * sizeof *parameters);
	gnp_random_seed(&random, 9, 0);
	for (size_t r = 0; r < layout.rows; r++)
		for (size_t i = 0; i < layout.row[r].count; i++)
			parameters[layout.row[r].offset + i] =
				strstr(layout.row[r].name, "deviation") ? 1 : (float)(0.2 * (2 * gnp_random_uniform(&random) - 1));
	if (gnp_network_create(&architecture, parameters, &bench->network, NULL) != GNP_OK)
		exit(1);
	printf("%zu parameters, batches of %d\n", layout.total, BATCH);
	free(parameters);
}

/* The first fits of a support once more. */
static void fit_first(const struct gnp_support *support)
{
	static const size_t ends[GNP_SUPPORT_FITS] = {16, 48, 80, GNP_SUPPORT_NODES};
	struct gnp_first_sums sums = {.count = 0};
	struct gnp_first_fit fit;
	float summary[1 + GNP_TAYLOR_DEGREE];
	for (size_t f = 0, from = 0; f < GNP_SUPPORT_FITS; f++) {
		size_t to = ends[f] < support->nodes ? ends[f] : support->nodes;
		gnp_first_sums_add(&sums, support->rows + from * STRIDE, support->weight + from, support->y + from, to - from);
		gnp_first_fit_solve(&sums, 0.5, &fit);
		gnp_first_fit_summarise(&fit, summary);
		from = to;
	}
}

static void run_network(struct bench *bench, double *spent)
{
	for (size_t b = 0; b < CHUNK; b += BATCH) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(bench->scratch);
		struct gnp_weighted_pass pass;
		double from = seconds();
		if (gnp_weighted_forward(bench->network, bench->list + b, BATCH, &pass, bench->scratch, NULL) != GNP_OK)
			exit(1);
		spent[FORWARD] += seconds() - from;
		gnp_scratch_release(bench->scratch, mark);
		from = seconds();
		if (gnp_weighted_infer(bench->network, bench->list + b, BATCH, &pass, bench->scratch, NULL) != GNP_OK)
			exit(1);
		spent[INFER] += seconds() - from;
		from = seconds();
		for (size_t p = 0; p < BATCH; p++)
			gnp_weighted_solve(bench->list[b + p], pass.outputs + p * GNP_WEIGHTED_OUTPUTS, pass.logits + pass.start[p],
			                   &pass.fits[p]);
		spent[SOLVE] += seconds() - from;
		gnp_scratch_release(bench->scratch, mark);
	}
}

/* Adds what CHUNK centres from `first` on take. */
static void run_chunk(struct bench *bench, size_t first, unsigned step, double *spent)
{
	struct gnp_scratch_mark mark = gnp_scratch_mark(bench->scratch);
	struct gnp_neighborhoods found;
	uint32_t centres[CHUNK];
	size_t reach = gnp_support_reach(step) > GNP_LADDER_REACH ? gnp_support_reach(step) : GNP_LADDER_REACH;
	for (size_t i = 0; i < CHUNK; i++)
		centres[i] = (uint32_t)(first + i);
	double from = seconds(), to;
	if (gnp_neighborhoods_find(bench->cloud.neighbors, centres, CHUNK, reach, 1, reach, bench->scratch, &found, NULL) !=
	    GNP_OK)
		exit(1);
	spent[SEARCH] += seconds() - from;
	for (size_t i = 0; i < CHUNK; i++) {
		struct gnp_ladder ladder;
		size_t begin = found.start[i], count = found.start[i + 1] - begin;
		from = seconds();
		gnp_support_look(&bench->cloud, centres[i], found.index + begin, count, &ladder);
		spent[LADDER] += (to = seconds()) - from;
		volatile unsigned chosen = gnp_frame_choose(bench->network, &ladder);
		(void)chosen;
		spent[CHOICE] += (from = seconds()) - to;
		if (!gnp_support_build(&bench->cloud, centres[i], &ladder, step, found.index + begin, found.distance + begin,
		                       count, 0, &bench->supports[i]))
			exit(1);
		spent[BUILD] += (to = seconds()) - from;
		fit_first(&bench->supports[i]);
		spent[FIRST_FITS] += seconds() - to;
	}
	gnp_scratch_release(bench->scratch, mark);
	run_network(bench, spent);
}

static void report(const double *spent, unsigned step, size_t centres)
{
	double whole = spent[SEARCH] + spent[LADDER] + spent[CHOICE] + spent[BUILD] + spent[INFER];
	printf("supports of %zu points:\n", gnp_support_reach(step));
	for (int part = 0; part < PARTS; part++)
		printf("  %-22s %7.2f us, %8.0f a second\n", names[part], spent[part] / (double)centres * 1e6,
		       (double)centres / spent[part]);
	printf("  %-22s %7.2f us, %8.0f a second\n", "all but training", whole / (double)centres * 1e6,
	       (double)centres / whole);
}

int main(int argc, char **argv)
{
	static struct bench bench;
	static const unsigned steps[] = {0, 3, 11};
	enum { CHUNKS = 16 };
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	size_t count = argc > 1 ? strtoul(argv[1], NULL, 10) : 100000;
	if (count < CHUNK * CHUNKS)
		return 1;
	make_cloud(&bench, count);
	make_network(&bench);
	bench.scratch = gnp_scratch_create();
	for (size_t i = 0; i < CHUNK; i++)
		bench.list[i] = &bench.supports[i];
	for (size_t s = 0; s < sizeof steps / sizeof *steps; s++) {
		double best[PARTS];
		for (int part = 0; part < PARTS; part++)
			best[part] = INFINITY;
		for (int run = 0; run < RUNS; run++) {
			double spent[PARTS] = {0};
			for (size_t c = 0; c < CHUNKS; c++)
				run_chunk(&bench, c * (count / CHUNKS), steps[s], spent);
			for (int part = 0; part < PARTS; part++)
				best[part] = fmin(best[part], spent[part]);
		}
		report(best, steps[s], (size_t)CHUNK * CHUNKS);
	}
	gnp_scratch_free(bench.scratch);
	gnp_network_free(bench.network);
	gnp_neighbors_free((struct gnp_neighbors *)bench.cloud.neighbors);
	gnp_roughness_clear(&bench.roughness);
	free(bench.normals);
	free(bench.points);
	return 0;
}
