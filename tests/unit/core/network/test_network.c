/* The operator against its definition in plain double arithmetic: a kernel matrix for every edge, nothing factorised. Derivatives
 * are judged by differences of that definition. */
#include "core/base/random.h"
#include "core/linear/linalg.h"
#include "core/network/network.h"
#include "core/network/pooled.h"
#include "core/network/quadrature.h"
#include "tests/unit/test.h"

enum { NODES_MAX = 96, WIDTH_MAX = 64, NEURONS_MAX = 256 };

static struct gnp_layout layout;

static const double *tensor(const double *parameters, const char *format, unsigned layer)
{
	char name[64];
	snprintf(name, sizeof name, format, layer);
	const struct gnp_parameter_row *row = gnp_layout_find(&layout, name);
	CHECK(row != NULL);
	return parameters + row->offset;
}

/* y = W x + b, and max(y, 0) where asked for. */
static void linear(const double *w, const double *b, size_t out, size_t in, const double *x, bool relu, double *y)
{
	for (size_t o = 0; o < out; o++) {
		double sum = b[o];
		for (size_t i = 0; i < in; i++)
			sum += w[o * in + i] * x[i];
		y[o] = relu && sum < 0 ? 0 : sum;
	}
}

/* The kernel's blocks, (channels, side in, side out) from the hidden activations. */
static void block_multiply(const struct gnp_architecture *a, const double *blocks, const double *v, double *out)
{
	size_t side = a->width / a->channels;
	for (size_t c = 0; c < a->channels; c++)
		for (size_t o = 0; o < side; o++) {
			double sum = 0;
			for (size_t i = 0; i < side; i++)
				sum += v[c * side + i] * blocks[(c * side + i) * side + o];
			out[c * side + o] = sum;
		}
}

static double kernel[WIDTH_MAX * WIDTH_MAX], hidden[2][NEURONS_MAX];

static void edge_kernel(const struct gnp_architecture *a, const double *parameters, unsigned layer, const double *source,
                        const double *target)
{
	double edge[16];
	for (size_t f = 0; f < a->features; f++) {
		edge[f] = source[f];
		edge[a->features + f] = target[f];
	}
	linear(tensor(parameters, "model.convs.%u.nn.layers.0.weight", layer),
	       tensor(parameters, "model.convs.%u.nn.layers.0.bias", layer), a->neurons, 2 * a->features, edge, true, hidden[0]);
	linear(tensor(parameters, "model.convs.%u.nn.layers.1.weight", layer),
	       tensor(parameters, "model.convs.%u.nn.layers.1.bias", layer), a->width * (a->width / a->channels), a->neurons, hidden[0],
	       false, kernel);
}

static void node_kernel(const struct gnp_architecture *a, const double *parameters, unsigned layer, int which, const double *node)
{
	static const char *const names[2][6] = {
		{"convs.%u.kernel1.layers.0.weight", "convs.%u.kernel1.layers.0.bias", "convs.%u.kernel1.layers.1.weight",
	     "convs.%u.kernel1.layers.1.bias", "convs.%u.kernel1.layers.2.weight", "convs.%u.kernel1.layers.2.bias"},
		{"convs.%u.kernel2.layers.0.weight", "convs.%u.kernel2.layers.0.bias", "convs.%u.kernel2.layers.1.weight",
	     "convs.%u.kernel2.layers.1.bias", "convs.%u.kernel2.layers.2.weight", "convs.%u.kernel2.layers.2.bias"}};
	const double *t[6];
	for (int i = 0; i < 6; i++)
		t[i] = tensor(parameters, names[which][i], layer);
	linear(t[0], t[1], a->neurons, a->features, node, true, hidden[0]);
	linear(t[2], t[3], a->neurons, a->neurons, hidden[0], true, hidden[1]);
	linear(t[4], t[5], a->width * (a->width / a->channels), a->neurons, hidden[1], false, kernel);
}

/* z (nodes, width): the integrals of a layer. */
static void integrals(const struct gnp_architecture *a, const double *parameters, unsigned layer, const double *x, size_t nodes,
                      const size_t *sources, size_t count, double (*v)[WIDTH_MAX], double (*z)[WIDTH_MAX])
{
	double term[WIDTH_MAX], mean[WIDTH_MAX] = {0};
	memset(z, 0, nodes * sizeof *z);
	for (size_t j = 0; j < count && a->trunk == GNP_TRUNK_SEPARABLE; j++) {
		node_kernel(a, parameters, layer, 0, x + sources[j] * a->features);
		block_multiply(a, kernel, v[sources[j]], term);
		for (size_t o = 0; o < a->width; o++)
			mean[o] += term[o] / (double)count;
	}
	for (size_t i = 0; i < nodes; i++) {
		if (a->trunk == GNP_TRUNK_SEPARABLE) {
			node_kernel(a, parameters, layer, 1, x + i * a->features);
			block_multiply(a, kernel, mean, z[i]);
			continue;
		}
		for (size_t j = 0; j < count; j++) {
			edge_kernel(a, parameters, layer, x + sources[j] * a->features, x + i * a->features);
			block_multiply(a, kernel, v[sources[j]], term);
			for (size_t o = 0; o < a->width; o++)
				z[i][o] += term[o] / (double)count;
		}
	}
}

/* One patch: its coefficients by the definition. */
static void oracle(const struct gnp_architecture *a, const double *parameters, const float *nodes, size_t count, size_t inner,
                   double *coefficients)
{
	static double v[NODES_MAX][WIDTH_MAX], z[NODES_MAX][WIDTH_MAX], x[NODES_MAX * 8];
	static size_t sources[NODES_MAX];
	static float distance[NODES_MAX];
	bool edge = a->trunk == GNP_TRUNK_EDGE;
	double mean[WIDTH_MAX] = {0}, first[WIDTH_MAX], top[NEURONS_MAX];
	size_t used = gnp_quadrature_choose(nodes, a->features, count, edge ? a->quadrature : count, sources, distance);
	for (size_t i = 0; i < count * a->features; i++)
		x[i] = nodes[i];
	for (size_t i = 0; i < count; i++)
		linear(tensor(parameters, edge ? "model.lift.weight" : "lift.weight", 0),
		       tensor(parameters, edge ? "model.lift.bias" : "lift.bias", 0), a->width, a->features, x + i * a->features, false, v[i]);
	for (unsigned layer = 0; layer < a->layers; layer++) {
		integrals(a, parameters, layer, x, count, sources, used, v, z);
		for (size_t i = 0; i < count; i++) {
			double mixed[WIDTH_MAX];
			linear(tensor(parameters, edge ? "model.mixes.%u.weight" : "convs.%u.linear.weight", layer),
			       tensor(parameters, edge ? "model.mixes.%u.bias" : "convs.%u.linear.bias", layer), a->width, a->width, z[i], false,
			       mixed);
			for (size_t o = 0; o < a->width; o++) {
				v[i][o] += mixed[o];
				if (layer + 1 < a->layers && v[i][o] < 0)
					v[i][o] = 0;
			}
		}
	}
	for (size_t i = 0; i < inner; i++) {
		memcpy(first, v[i], sizeof first);
		if (edge)
			linear(tensor(parameters, "model.proj.weight", 0), tensor(parameters, "model.proj.bias", 0), a->width, a->width, v[i], false,
			       first);
		for (size_t o = 0; o < a->width; o++)
			mean[o] += first[o] / (double)inner;
	}
	linear(tensor(parameters, edge ? "mlp.0.weight" : "proj.0.weight", 0), tensor(parameters, edge ? "mlp.0.bias" : "proj.0.bias", 0),
	       a->head_width, a->width, mean, true, top);
	linear(tensor(parameters, edge ? "mlp.2.weight" : "proj.2.weight", 0), tensor(parameters, edge ? "mlp.2.bias" : "proj.2.bias", 0),
	       a->outputs, a->head_width, top, false, coefficients);
}

/* A network with random parameters of a usual size, and patches on a bent sheet. */
struct setting {
	struct gnp_architecture architecture;
	struct gnp_network *network;
	float *parameters;
	double *exact; /* the same in double */
	struct gnp_network_batch batch;
	size_t start[8], inner[8];
	float nodes[7 * NODES_MAX * 4];
	struct gnp_scratch *scratch;
};

static void open_setting(struct setting *s, struct gnp_architecture architecture, size_t patches, const size_t *nodes,
                         const size_t *inner)
{
	struct gnp_random random;
	gnp_random_seed(&random, 7, 0);
	memset(s, 0, sizeof *s);
	s->architecture = architecture;
	CHECK(gnp_architecture_layout(&architecture, &layout, NULL) == GNP_OK);
	s->parameters = malloc(layout.total * sizeof *s->parameters);
	s->exact = malloc(layout.total * sizeof *s->exact);
	for (size_t r = 0; r < layout.rows; r++)
		for (size_t i = 0; i < layout.row[r].count; i++) {
			double bound = layout.row[r].rank == 2 ? 1 / sqrt((double)layout.row[r].shape[1]) : 0.3;
			float value = (float)(bound * (2 * gnp_random_uniform(&random) - 1) * 1.7);
			s->parameters[layout.row[r].offset + i] = value;
			s->exact[layout.row[r].offset + i] = value;
		}
	for (size_t p = 0; p < patches; p++) {
		s->start[p + 1] = s->start[p] + nodes[p];
		s->inner[p] = inner[p];
		for (size_t i = 0; i < nodes[p]; i++) {
			float *x = s->nodes + (s->start[p] + i) * architecture.features;
			double r = sqrt((double)i / (double)inner[p]), angle = 2.4 * (double)i + (double)p;
			x[0] = (float)(r * cos(angle));
			x[1] = (float)(r * sin(angle));
			for (size_t f = 2; f < architecture.features; f++)
				x[f] = (float)(0.5 * x[0] * x[1] - x[1] * x[1] + 0.1 * gnp_random_uniform(&random));
		}
	}
	s->batch = (struct gnp_network_batch){patches, s->start, s->inner, s->nodes};
	s->scratch = gnp_scratch_create();
	CHECK(gnp_network_create(&architecture, s->parameters, &s->network, NULL) == GNP_OK);
}

static void close_setting(struct setting *s)
{
	gnp_network_free(s->network);
	gnp_scratch_free(s->scratch);
	free(s->parameters);
	free(s->exact);
}

static const struct gnp_architecture paper = {.trunk = GNP_TRUNK_EDGE, .head = GNP_HEAD_POOLED, .features = 3, .width = 64,
	.channels = 4, .neurons = 256, .layers = 5, .quadrature = 32, .head_width = 128, .outputs = 16};
static const struct gnp_architecture small = {.trunk = GNP_TRUNK_EDGE, .head = GNP_HEAD_POOLED, .features = 4, .width = 12,
	.channels = 3, .neurons = 19, .layers = 3, .quadrature = 6, .head_width = 10, .outputs = 16};

/* Largest difference from the oracle relative to the largest coefficient, over a batch. */
static double distance_from_oracle(struct gnp_architecture architecture, size_t patches, const size_t *nodes, const size_t *inner)
{
	static struct setting s;
	float got[8 * 64];
	double want[64], difference = 0, largest = 0;
	open_setting(&s, architecture, patches, nodes, inner);
	CHECK(gnp_pooled_forward(s.network, &s.batch, got, NULL, s.scratch, NULL) == GNP_OK);
	for (size_t p = 0; p < patches; p++) {
		oracle(&architecture, s.exact, s.nodes + s.start[p] * architecture.features, nodes[p], inner[p], want);
		for (size_t i = 0; i < architecture.outputs; i++) {
			difference = fmax(difference, fabs(got[p * architecture.outputs + i] - want[i]));
			largest = fmax(largest, fabs(want[i]));
		}
	}
	close_setting(&s);
	CHECK(largest > 1e-3);
	return difference / largest;
}

static void small_networks_are_their_definition(void)
{
	static const size_t nodes[] = {1, 5, 6, 7, 30, 61}, inner[] = {1, 5, 4, 7, 20, 61};
	for (unsigned trunk = 0; trunk < GNP_TRUNK_NONE; trunk++)
		for (unsigned layers = 1; layers <= 4; layers++) {
			struct gnp_architecture a = small;
			a.trunk = (enum gnp_trunk_kind)trunk;
			a.layers = layers;
			CHECK_AT_MOST(distance_from_oracle(a, 6, nodes, inner), 1e-5);
		}
}

static void the_published_networks_are_their_definition(void)
{
	static const size_t nodes[] = {15, 44}, inner[] = {12, 36};
	struct gnp_architecture a = paper;
	a.layers = 3;
	CHECK_AT_MOST(distance_from_oracle(a, 2, nodes, inner), 1e-5);
	a = paper;
	a.trunk = GNP_TRUNK_SEPARABLE;
	CHECK_AT_MOST(distance_from_oracle(a, 2, nodes, inner), 1e-5);
}

/* The loss: a fixed linear form of all coefficients. */
static double oracle_loss(const struct setting *s, const size_t *nodes, const size_t *inner, const float *factors)
{
	double sum = 0, out[64];
	for (size_t p = 0; p < s->batch.patches; p++) {
		oracle(&s->architecture, s->exact, s->nodes + s->start[p] * s->architecture.features, nodes[p], inner[p], out);
		for (size_t i = 0; i < s->architecture.outputs; i++)
			sum += factors[p * s->architecture.outputs + i] * out[i];
	}
	return sum;
}

static void check_gradient(struct gnp_architecture architecture)
{
	static const size_t nodes[] = {4, 11}, inner[] = {3, 8};
	static struct setting s;
	float out[2 * 64], factors[2 * 64];
	const struct gnp_pooled_tape *tape = NULL;
	open_setting(&s, architecture, 2, nodes, inner);
	float *gradient = calloc(layout.total, sizeof *gradient);
	for (size_t i = 0; i < 2 * 64; i++)
		factors[i] = (float)cos(3.0 * (double)i);
	CHECK(gnp_pooled_forward(s.network, &s.batch, out, &tape, s.scratch, NULL) == GNP_OK);
	CHECK(gnp_pooled_backward(s.network, tape, factors, gradient, s.scratch, NULL) == GNP_OK);
	for (size_t r = 0; r < layout.rows; r++) {
		double largest = 0, difference = 0;
		size_t step = 1 + layout.row[r].count / 12;
		for (size_t i = layout.row[r].offset; i < layout.row[r].offset + layout.row[r].count; i += step) {
			const double h = 1e-6, was = s.exact[i];
			s.exact[i] = was + h;
			double above = oracle_loss(&s, nodes, inner, factors);
			s.exact[i] = was - h;
			double below = oracle_loss(&s, nodes, inner, factors), slope = (above - below) / (2 * h);
			s.exact[i] = was;
			difference = fmax(difference, fabs(gradient[i] - slope));
			largest = fmax(largest, fabs(slope));
		}
		if (!(largest > 0 && difference <= 2e-5 * largest + 1e-7)) {
			test_failures++;
			fprintf(stderr, "%s, %u layers: %s: off by %g of %g\n", gnp_trunk_name(architecture.trunk), architecture.layers,
			        layout.row[r].name, difference, largest);
		}
	}
	free(gradient);
	close_setting(&s);
}

static void derivatives_are_differences_of_the_definition(void)
{
	for (unsigned trunk = 0; trunk < GNP_TRUNK_NONE; trunk++)
		for (unsigned layers = 1; layers <= 3; layers++) {
			struct gnp_architecture a = small;
			a.trunk = (enum gnp_trunk_kind)trunk;
			a.layers = layers;
			check_gradient(a);
		}
}

static void gradients_add_up_and_scratch_is_given_back(void)
{
	static const size_t nodes[] = {20}, inner[] = {11};
	static struct setting s;
	float out[16], factors[16] = {1, -1, 2};
	const struct gnp_pooled_tape *tape = NULL;
	open_setting(&s, small, 1, nodes, inner);
	float *once = calloc(layout.total, sizeof *once), *twice = calloc(layout.total, sizeof *twice);
	struct gnp_scratch_mark before = gnp_scratch_mark(s.scratch);
	CHECK(gnp_pooled_forward(s.network, &s.batch, out, NULL, s.scratch, NULL) == GNP_OK);
	struct gnp_scratch_mark after = gnp_scratch_mark(s.scratch);
	CHECK(before.block == after.block && before.used == after.used);
	CHECK(gnp_pooled_forward(s.network, &s.batch, out, &tape, s.scratch, NULL) == GNP_OK);
	CHECK(gnp_pooled_backward(s.network, tape, factors, once, s.scratch, NULL) == GNP_OK);
	for (int i = 0; i < 2; i++)
		CHECK(gnp_pooled_backward(s.network, tape, factors, twice, s.scratch, NULL) == GNP_OK);
	for (size_t i = 0; i < layout.total; i++)
		CHECK_NEAR(twice[i], 2 * once[i], 1e-5 * (fabs(once[i]) + 1e-2));
	free(once);
	free(twice);
	close_setting(&s);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(small_networks_are_their_definition), TEST(the_published_networks_are_their_definition),
		TEST(derivatives_are_differences_of_the_definition), TEST(gradients_add_up_and_scratch_is_given_back),
	};
	gnp_linalg_init();
	return RUN_TESTS(tests);
}
