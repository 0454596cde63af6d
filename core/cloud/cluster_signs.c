#include "core/cloud/cluster_signs.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/base/simd.h"

enum { SWEEPS = 200, LANES = 16, SEED = 1 };
#define NONE UINT32_MAX
/* The temperature of the first and the last sweep, over the mean cost of a cluster's sign. */
static const double hot = 1, cold = 0.003;

struct search {
	const struct gnp_cluster_signs *problem;
	signed char *sign;
	float *off;     /* (rows) the winding number less 1/2 */
	float *block;   /* (rows) what a block gives to it */
	double *own;    /* (clusters) mean square of a cluster's shares */
	uint32_t *bound; /* (clusters) another of the same block, nearer to its first; or itself */
	uint32_t *next; /* (clusters) the next of the same block, or NONE */
	struct gnp_random random;
};

/* In sixteen sums, which compilers keep in vectors: the order of additions is fixed all the same. */
GNP_INLINE void product_body(const float *a, const float *b, size_t count, double *product)
{
	float lanes[LANES] = {0};
	double sum = 0;
	size_t i = 0;
	for (; i + LANES <= count; i += LANES)
		for (size_t l = 0; l < LANES; l++)
			lanes[l] += a[i + l] * b[i + l];
	for (; i < count; i++)
		sum += a[i] * b[i];
	for (size_t l = 0; l < LANES; l++)
		sum += lanes[l];
	*product = sum;
}
GNP_SIMD_DISPATCH(static, set_product, product_body, (const float *a, const float *b, size_t count, double *product),
                  (a, b, count, product))

static double product(const float *a, const float *b, size_t count)
{
	double sum;
	set_product(a, b, count, &sum);
	return sum;
}

/* to += by * from */
GNP_INLINE void add_body(float *restrict to, const float *restrict from, float by, size_t count)
{
	for (size_t i = 0; i < count; i++)
		to[i] += by * from[i];
}
GNP_SIMD_DISPATCH(static, add, add_body, (float *restrict to, const float *restrict from, float by, size_t count),
                  (to, from, by, count))

static const float *column(const struct gnp_cluster_signs *problem, size_t c)
{
	return problem->shares + c * problem->rows;
}

static void fill_off(const struct gnp_cluster_signs *problem, const signed char *sign, float *off)
{
	for (size_t r = 0; r < problem->rows; r++)
		off[r] = -0.5f;
	for (size_t c = 0; c < problem->clusters; c++)
		add(off, column(problem, c), sign[c], problem->rows);
}

/* How the cost changes when a cluster changes its sign. */
static double change(const struct search *search, size_t c)
{
	const struct gnp_cluster_signs *problem = search->problem;
	double s = search->sign[c], agreement = 0;
	for (size_t l = problem->link_start[c]; l < problem->link_start[c + 1]; l++)
		agreement += problem->link_trust[l] * search->sign[problem->link_to[l]];
	double along = product(column(problem, c), search->off, problem->rows) / (double)problem->rows;
	return 4 * (search->own[c] - s * along) + s * agreement * problem->weight;
}

static void flip(struct search *search, size_t c)
{
	add(search->off, column(search->problem, c), -2.0f * search->sign[c], search->problem->rows);
	search->sign[c] = (signed char)-search->sign[c];
}

/* Looks at each cluster once. Cold: only what lowers the cost is done. */
static bool sweep(struct search *search, double temperature)
{
	bool any = false;
	for (size_t c = 0; c < search->problem->clusters; c++) {
		double d = change(search, c);
		bool take = d < -1e-9;
		if (!take && temperature > 0 && d < 20 * temperature)
			take = gnp_random_uniform(&search->random) < exp(-d / temperature);
		if (!take)
			continue;
		flip(search, c);
		any = true;
	}
	return any;
}

/* The first cluster of a block. */
static uint32_t first_of(uint32_t *bound, uint32_t c)
{
	while (bound[c] != c)
		c = bound[c] = bound[bound[c]];
	return c;
}

/* Binds clusters that agree as their link says to blocks, the surer the stronger the link: flipped together the chance
 * of a state is that of its winding number alone. */
static void bind_blocks(struct search *search, double temperature)
{
	const struct gnp_cluster_signs *problem = search->problem;
	for (uint32_t c = 0; c < problem->clusters; c++)
		search->bound[c] = c;
	for (uint32_t c = 0; c < problem->clusters; c++)
		for (size_t l = problem->link_start[c]; l < problem->link_start[c + 1]; l++) {
			uint32_t to = problem->link_to[l];
			double strength = problem->weight * problem->link_trust[l] * search->sign[c] * search->sign[to];
			if (to < c || strength <= 0 || gnp_random_uniform(&search->random) < exp(-strength / temperature))
				continue;
			uint32_t a = first_of(search->bound, c), b = first_of(search->bound, to);
			search->bound[a < b ? b : a] = a < b ? a : b;
		}
	for (size_t c = problem->clusters; c-- > 0;)
		search->next[c] = NONE;
	for (uint32_t c = (uint32_t)problem->clusters; c-- > 0;) {
		uint32_t first = first_of(search->bound, c);
		if (first == c)
			continue;
		search->next[c] = search->next[first];
		search->next[first] = c;
	}
}

/* Flips blocks: what single clusters cannot do where their links are strong. */
static void sweep_blocks(struct search *search, double temperature)
{
	const struct gnp_cluster_signs *problem = search->problem;
	float *block = search->block, *off = search->off;
	bind_blocks(search, temperature);
	for (uint32_t first = 0; first < problem->clusters; first++) {
		if (search->bound[first] != first)
			continue;
		memset(block, 0, problem->rows * sizeof *block);
		for (uint32_t c = first; c != NONE; c = search->next[c])
			add(block, column(problem, c), search->sign[c], problem->rows);
		double along = product(block, off, problem->rows), own = product(block, block, problem->rows);
		double d = 4 * (own - along) / (double)problem->rows;
		if (d > 20 * temperature || gnp_random_uniform(&search->random) >= exp(-d / temperature))
			continue;
		add(off, block, -2, problem->rows);
		for (uint32_t c = first; c != NONE; c = search->next[c])
			search->sign[c] = (signed char)-search->sign[c];
	}
}

static double cost(const struct search *search)
{
	const struct gnp_cluster_signs *problem = search->problem;
	double conflicts = 0;
	for (size_t c = 0; c < problem->clusters; c++)
		for (size_t l = problem->link_start[c]; l < problem->link_start[c + 1]; l++)
			conflicts -= problem->link_trust[l] * search->sign[c] * search->sign[problem->link_to[l]];
	return product(search->off, search->off, problem->rows) / (double)problem->rows +
	       problem->weight * conflicts / 4;
}

static gnp_status anneal(struct search *search, struct gnp_task *task, signed char *best, struct gnp_error *error)
{
	double least = cost(search), each = 1.0 / (double)search->problem->clusters;
	for (int i = 0; i <= SWEEPS; i++) {
		gnp_status status = gnp_task_check(task, error);
		if (status != GNP_OK)
			return status;
		double temperature = i < SWEEPS ? hot * each * pow(cold / hot, (double)i / SWEEPS) : 0;
		if (i < SWEEPS)
			sweep_blocks(search, temperature);
		for (int again = 0; again < SWEEPS && sweep(search, temperature) && i == SWEEPS; again++)
			;
		double now = cost(search);
		if (now < least) {
			least = now;
			memcpy(best, search->sign, search->problem->clusters);
		}
	}
	return GNP_OK;
}

gnp_status gnp_cluster_signs_find(const struct gnp_cluster_signs *problem, struct gnp_task *task, signed char *sign,
                                  struct gnp_error *error)
{
	struct search search = {.problem = problem};
	gnp_status status = GNP_OK;
	search.off = gnp_array_new(problem->rows, sizeof *search.off);
	search.own = gnp_array_new(problem->clusters, sizeof *search.own);
	search.sign = gnp_array_new(problem->clusters, 1);
	search.block = gnp_array_new(problem->rows, sizeof *search.block);
	search.bound = gnp_array_new(problem->clusters, sizeof *search.bound);
	search.next = gnp_array_new(problem->clusters, sizeof *search.next);
	if (!search.off || !search.own || !search.sign || !search.block || !search.bound || !search.next) {
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu clusters", problem->clusters);
		goto done;
	}
	gnp_random_seed(&search.random, SEED, problem->clusters);
	memcpy(search.sign, sign, problem->clusters);
	fill_off(problem, sign, search.off);
	for (size_t c = 0; c < problem->clusters; c++)
		search.own[c] = product(column(problem, c), column(problem, c), problem->rows) / (double)problem->rows;
	status = anneal(&search, task, sign, error);
done:
	free(search.off);
	free(search.own);
	free(search.sign);
	free(search.block);
	free(search.bound);
	free(search.next);
	return status;
}

double gnp_cluster_signs_energy(const struct gnp_cluster_signs *problem, const signed char *sign)
{
	double sum = 0;
	for (size_t r = 0; r < problem->rows; r++) {
		double off = -0.5;
		for (size_t c = 0; c < problem->clusters; c++)
			off += sign[c] * column(problem, c)[r];
		sum += off * off;
	}
	return sum / (double)problem->rows;
}
