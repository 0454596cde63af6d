/* The published networks against automatic differentiation: tests/oracles/oracle_network.py made tests/oracles/data/network.npz and says how
 * parameters are made. */
#include "core/linear/linalg.h"
#include "core/network/pooled.h"
#include "core/network/quadrature.h"
#include "tests/oracles/frozen.h"
#include "tests/unit/test.h"

enum { PATCHES = 2, OUTPUTS = 16, SAMPLES = 12, NODES = 90 };

static struct frozen frozen = {.path = "tests/oracles/data/network.npz"};

static const double *doubles(const char *name, size_t count)
{
	const double *values = frozen_doubles(&frozen, name, count);
	if (!values) {
		fprintf(stderr, "%s: %s is not what it should be\n", frozen.path, name);
		exit(1);
	}
	return values;
}

static double uniform(size_t row, size_t i)
{
	uint32_t x = (uint32_t)(1000003 * row + i);
	for (int round = 0; round < 2; round++)
		x = (x ^ x >> 16) * UINT32_C(0x45D9F3B);
	return (x ^ x >> 16) / 4294967296.0;
}

static void fill(const struct gnp_layout *layout, float *parameters)
{
	for (size_t r = 0; r < layout->rows; r++) {
		double bound = layout->row[r].rank == 2 ? 1.7 / sqrt((double)layout->row[r].shape[1]) : 0.3;
		for (size_t i = 0; i < layout->row[r].count; i++)
			parameters[layout->row[r].offset + i] = (float)(bound * (2 * uniform(r, i) - 1));
	}
}

static void check_gradient(const struct gnp_layout *layout, const float *gradient, const char *name)
{
	const double *want = doubles(name, layout->rows * (SAMPLES + 1));
	for (size_t r = 0; r < layout->rows; r++, want += SAMPLES + 1)
		for (size_t i = 0; i < SAMPLES; i++)
			CHECK_NEAR(gradient[layout->row[r].offset + layout->row[r].count * i / SAMPLES], want[i], 2e-5 * want[SAMPLES]);
}

static void check_network(enum gnp_trunk_kind trunk, const char *name, const char *gradient_name)
{
	struct gnp_architecture a = {.trunk = trunk, .head = GNP_HEAD_POOLED, .features = 3, .width = 64, .channels = 4,
		.neurons = 256, .layers = 5, .quadrature = 32, .head_width = 128, .outputs = OUTPUTS};
	const double *stored = doubles("nodes", 3 * NODES), *start = doubles("start", PATCHES + 1), *inner = doubles("inner", PATCHES);
	const double *want = doubles(name, PATCHES * OUTPUTS);
	const size_t starts[] = {(size_t)start[0], (size_t)start[1], (size_t)start[2]};
	const size_t inners[] = {(size_t)inner[0], (size_t)inner[1]};
	float nodes[3 * NODES], got[PATCHES * OUTPUTS], factors[PATCHES * OUTPUTS];
	struct gnp_network_batch batch = {PATCHES, starts, inners, nodes};
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_layout layout;
	struct gnp_network *network = NULL;
	const struct gnp_pooled_tape *tape = NULL;
	double largest = 0;
	for (size_t i = 0; i < 3 * NODES; i++)
		nodes[i] = (float)stored[i];
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	float *parameters = malloc(layout.total * sizeof *parameters), *gradient = calloc(layout.total, sizeof *gradient);
	fill(&layout, parameters);
	CHECK(gnp_network_create(&a, parameters, &network, NULL) == GNP_OK);
	CHECK(gnp_pooled_forward(network, &batch, got, &tape, scratch, NULL) == GNP_OK);
	for (size_t i = 0; i < PATCHES * OUTPUTS; i++)
		largest = fmax(largest, fabs(want[i]));
	for (size_t i = 0; i < PATCHES * OUTPUTS; i++) {
		CHECK_NEAR(got[i], want[i], 1e-5 * largest);
		factors[i] = (float)cos(3.0 * (double)i);
	}
	CHECK(gnp_pooled_backward(network, tape, factors, gradient, scratch, NULL) == GNP_OK);
	check_gradient(&layout, gradient, gradient_name);
	gnp_network_free(network);
	gnp_scratch_free(scratch);
	free(parameters);
	free(gradient);
}

static void the_edge_network_is_the_published_one(void)
{
	check_network(GNP_TRUNK_EDGE, "edge", "edge_gradient");
}

static void the_separable_network_is_the_published_one(void)
{
	check_network(GNP_TRUNK_SEPARABLE, "separable", "separable_gradient");
}

/* On a line the order is known: the far end, the middle, the quarters. Nodes at one place are still different nodes. */
static void quadrature_points_are_far_from_each_other(void)
{
	float nodes[17][3] = {{0}}, distance[17];
	size_t chosen[17];
	for (int i = 0; i < 17; i++)
		nodes[i][1] = (float)i;
	CHECK(gnp_quadrature_choose(*nodes, 3, 17, 5, chosen, distance) == 5);
	CHECK(chosen[0] == 0 && chosen[1] == 16 && chosen[2] == 8 && chosen[3] == 4 && chosen[4] == 12);
	CHECK(gnp_quadrature_choose(*nodes, 3, 4, 32, chosen, distance) == 4);
	CHECK(chosen[0] == 0 && chosen[3] == 3);
	memset(nodes, 0, sizeof nodes);
	CHECK(gnp_quadrature_choose(*nodes, 3, 17, 16, chosen, distance) == 16);
	for (int i = 0; i < 16; i++)
		for (int j = 0; j < i; j++)
			CHECK(chosen[i] != chosen[j]);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(the_edge_network_is_the_published_one), TEST(the_separable_network_is_the_published_one),
		TEST(quadrature_points_are_far_from_each_other),
	};
	gnp_linalg_init();
	return RUN_TESTS(tests);
}
