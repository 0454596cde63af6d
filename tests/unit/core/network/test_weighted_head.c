/* The head `weighted` and the trunk below it against the definition in plain double arithmetic; derivatives are judged
 * by differences of that definition. */
#include "core/base/random.h"
#include "core/linear/linalg.h"
#include "core/network/weighted_head.h"
#include "tests/unit/core/support/small_cloud.h"

enum {
	SIZE = GNP_TAYLOR_SIZE,
	STRIDE = GNP_TAYLOR_STRIDE,
	ORDERS = GNP_TAYLOR_DEGREE + 1,
	OUTPUTS = GNP_WEIGHTED_OUTPUTS,
	FEATURES = GNP_SUPPORT_FEATURES,
	SUMMARY = GNP_SUPPORT_SUMMARY,
	SUPPORTS = 3,
	NODES = GNP_SUPPORT_NODES,
	WIDEST = 160
};

static const struct gnp_architecture deep = {
	.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_WEIGHTED, .features = FEATURES, .width = 8, .channels = 2,
	.neurons = 6, .layers = 3, .quadrature = 4, .head_width = 7, .node_width = 5, .frame_width = 4, .outputs = OUTPUTS};

/* ---- A network and supports ---- */

static struct gnp_support supports[SUPPORTS];
static const struct gnp_support *const list[SUPPORTS] = {&supports[0], &supports[1], &supports[2]};

/* Of all 144 nodes, of 66 and of 20. */
static void make_supports(void)
{
	static const size_t counts[SUPPORTS] = {1500, 100, 20};
	static struct small_row row;
	for (size_t k = 0; k < SUPPORTS; k++) {
		struct small_cloud cloud;
		struct gnp_ladder ladder;
		small_cloud_make(counts[k], 0.02, k == 1, &cloud);
		CHECK(small_cloud_support(&cloud, 3, 11, 0.4, &ladder, &row, &supports[k]));
		small_cloud_clear(&cloud);
	}
	CHECK(supports[0].nodes == NODES && supports[1].nodes == 66 && supports[2].nodes == 20);
}

struct setting {
	struct gnp_network *network;
	double *parameters; /* the same in double */
};

/* Penalties of a usual size, so that the solution is well determined; others at random. */
static void make(const struct gnp_architecture *architecture, struct setting *setting)
{
	struct gnp_random random;
	struct gnp_layout layout;
	CHECK(gnp_architecture_layout(architecture, &layout, NULL) == GNP_OK);
	float *parameters = malloc(layout.total * sizeof *parameters);
	setting->parameters = malloc(layout.total * sizeof *setting->parameters);
	gnp_random_seed(&random, 12, 0);
	for (size_t r = 0; r < layout.rows; r++) {
		const struct gnp_parameter_row *row = &layout.row[r];
		double size = row->rank == 2 ? 1 / sqrt((double)row->shape[1]) : 0.2;
		bool spread = strstr(row->name, "deviation") != NULL, penalties = strcmp(row->name, "head.4.bias") == 0;
		for (size_t i = 0; i < row->count; i++)
			parameters[row->offset + i] = (float)(spread ? 2 + gnp_random_uniform(&random) :
			                                      penalties && i < ORDERS ? -1.2 : size * gnp_random_normal(&random));
	}
	for (size_t i = 0; i < layout.total; i++)
		setting->parameters[i] = (double)parameters[i];
	CHECK(gnp_network_create(architecture, parameters, &setting->network, NULL) == GNP_OK);
	free(parameters);
}

static void drop(struct setting *setting)
{
	gnp_network_free(setting->network);
	free(setting->parameters);
}

static const double *tensor(const struct setting *setting, const char *format, unsigned layer)
{
	char name[64];
	snprintf(name, sizeof name, format, layer);
	const struct gnp_parameter_row *row = gnp_layout_find(&setting->network->layout, name);
	CHECK(row != NULL);
	return setting->parameters + row->offset;
}

/* ---- The definition ---- */

/* y = W x + b of the layers of a name, and max(y, 0) where asked for. */
static void linear(const struct setting *setting, const char *name, unsigned layer, size_t out, size_t in,
                   const double *x, bool relu, double *y)
{
	char weight[64], bias[64];
	snprintf(weight, sizeof weight, "%s.weight", name);
	snprintf(bias, sizeof bias, "%s.bias", name);
	const double *w = tensor(setting, weight, layer), *b = tensor(setting, bias, layer);
	for (size_t o = 0; o < out; o++) {
		double sum = b[o];
		for (size_t i = 0; i < in; i++)
			sum += w[o * in + i] * x[i];
		y[o] = relu && sum < 0 ? 0 : sum;
	}
}

/* v times the kernel of a node, in blocks. */
static void kernel_times(const struct setting *setting, int which, unsigned layer, const float *node, const double *v,
                         double *out)
{
	const struct gnp_architecture *a = &setting->network->architecture;
	size_t side = a->width / a->channels;
	double x[FEATURES], first[WIDEST], second[WIDEST], blocks[WIDEST];
	const char *names[3] = {which == 1 ? "convs.%u.kernel1.layers.0" : "convs.%u.kernel2.layers.0",
	                        which == 1 ? "convs.%u.kernel1.layers.1" : "convs.%u.kernel2.layers.1",
	                        which == 1 ? "convs.%u.kernel1.layers.2" : "convs.%u.kernel2.layers.2"};
	for (size_t f = 0; f < FEATURES; f++)
		x[f] = (double)node[f];
	linear(setting, names[0], layer, a->neurons, FEATURES, x, true, first);
	linear(setting, names[1], layer, a->neurons, a->neurons, first, true, second);
	linear(setting, names[2], layer, a->width * side, a->neurons, second, false, blocks);
	for (size_t c = 0; c < a->channels; c++)
		for (size_t o = 0; o < side; o++) {
			out[c * side + o] = 0;
			for (size_t i = 0; i < side; i++)
				out[c * side + o] += v[c * side + i] * blocks[(c * side + i) * side + o];
		}
}

/* values (nodes, width): what goes into the last layer; mean (width): of what comes out of it. */
static void trunk(const struct setting *setting, const struct gnp_support *support, double (*values)[WIDEST],
                  double *mean)
{
	const struct gnp_architecture *a = &setting->network->architecture;
	static double v[NODES][WIDEST];
	double x[FEATURES], z[WIDEST], mixed[WIDEST], pooled[WIDEST], n = (double)support->nodes;
	for (size_t i = 0; i < support->nodes; i++) {
		for (size_t f = 0; f < FEATURES; f++)
			x[f] = (double)support->features[i * FEATURES + f];
		linear(setting, "lift", 0, a->width, FEATURES, x, false, v[i]);
	}
	memset(mean, 0, a->width * sizeof *mean);
	for (unsigned layer = 0; layer < a->layers; layer++) {
		memset(pooled, 0, sizeof pooled);
		memcpy(values, v, sizeof v);
		for (size_t i = 0; i < support->nodes; i++) {
			kernel_times(setting, 1, layer, support->features + i * FEATURES, v[i], z);
			for (size_t o = 0; o < a->width; o++)
				pooled[o] += z[o] / n;
		}
		for (size_t i = 0; i < support->nodes; i++) {
			kernel_times(setting, 2, layer, support->features + i * FEATURES, pooled, z);
			linear(setting, "convs.%u.linear", layer, a->width, a->width, z, false, mixed);
			for (size_t o = 0; o < a->width; o++) {
				v[i][o] += mixed[o];
				v[i][o] = layer + 1 < a->layers && v[i][o] < 0 ? 0 : v[i][o];
				mean[o] += layer + 1 == a->layers ? v[i][o] / n : 0;
			}
		}
	}
}

struct answer {
	double context[WIDEST], outputs[OUTPUTS], logits[NODES], share[NODES], coefficients[SIZE];
};

/* Solves by elimination. */
static void fit(const struct gnp_support *support, struct answer *answer)
{
	static double a[SIZE][SIZE];
	double factor[SIZE], *c = answer->coefficients, rho = exp(2 * answer->outputs[GNP_WEIGHTED_REACH]);
	unsigned order[SIZE];
	gnp_taylor_indices(factor, order);
	memset(a, 0, sizeof a);
	memset(c, 0, SIZE * sizeof *c);
	for (size_t n = 0; n < support->nodes; n++) {
		const double *x = support->rows + n * STRIDE;
		answer->share[n] = 1 / (1 + exp(-answer->logits[n]));
		double weight = support->weight[n] * answer->share[n] / (1 + pow(support->distance[n] / rho, 4)) + 1e-9;
		for (size_t i = 0; i < SIZE; i++) {
			for (size_t j = 0; j < SIZE; j++)
				a[i][j] += weight * x[i] * x[j];
			c[i] += weight * x[i] * support->y[n];
		}
	}
	for (size_t i = 0; i < SIZE; i++)
		a[i][i] += exp(4 * answer->outputs[order[i]]) * factor[i];
	for (size_t k = 0; k < SIZE; k++)
		for (size_t i = k + 1; i < SIZE; i++) {
			double share = a[i][k] / a[k][k];
			for (size_t j = k; j < SIZE; j++)
				a[i][j] -= share * a[k][j];
			c[i] -= share * c[k];
		}
	for (size_t i = SIZE; i-- > 0;) {
		for (size_t j = i + 1; j < SIZE; j++)
			c[i] -= a[i][j] * c[j];
		c[i] /= a[i][i];
	}
}

static void oracle(const struct setting *setting, const struct gnp_support *support, struct answer *answer)
{
	const struct gnp_architecture *a = &setting->network->architecture;
	static double values[NODES][WIDEST];
	double inputs[WIDEST], first[WIDEST], *context = answer->context, told[WIDEST];
	trunk(setting, support, values, inputs);
	for (size_t i = 0; i < SUMMARY; i++)
		inputs[a->width + i] = ((double)support->summary[i] - tensor(setting, "head.mean", 0)[i]) /
		                       tensor(setting, "head.deviation", 0)[i];
	linear(setting, "head.0", 0, a->head_width, a->width + SUMMARY, inputs, true, first);
	linear(setting, "head.2", 0, a->head_width, a->head_width, first, true, context);
	linear(setting, "head.4", 0, OUTPUTS, a->head_width, context, false, answer->outputs);
	linear(setting, "node.context", 0, a->node_width, a->head_width, context, false, told);
	for (size_t n = 0; n < support->nodes; n++) {
		const double *w = tensor(setting, "node.0.weight", 0);
		answer->logits[n] = tensor(setting, "node.2.bias", 0)[0];
		for (size_t h = 0; h < a->node_width; h++, w += a->width + FEATURES) {
			double sum = told[h];
			for (size_t i = 0; i < a->width; i++)
				sum += w[i] * values[n][i];
			for (size_t i = 0; i < FEATURES; i++)
				sum += w[a->width + i] * (double)support->features[n * FEATURES + i];
			answer->logits[n] += sum > 0 ? sum * tensor(setting, "node.2.weight", 0)[h] : 0;
		}
	}
	fit(support, answer);
}

/* ---- Forward ---- */

static void check_forward(const struct setting *setting, const struct gnp_weighted_pass *pass)
{
	static struct answer want;
	CHECK(pass->count == SUPPORTS && pass->rows == NODES + 66 + 20 && pass->start[SUPPORTS] == pass->rows);
	for (size_t p = 0; p < SUPPORTS; p++) {
		const struct gnp_weighted_fit *got = &pass->fits[p];
		oracle(setting, &supports[p], &want);
		CHECK(got->solved && pass->inner[p] == supports[p].nodes && (size_t)(const void *)got->factor % 64 == 0);
		for (size_t o = 0; o < OUTPUTS; o++)
			CHECK_NEAR(pass->outputs[p * OUTPUTS + o], want.outputs[o], 2e-5);
		for (size_t n = 0; n < supports[p].nodes; n++) {
			CHECK_NEAR(pass->logits[pass->start[p] + n], want.logits[n], 2e-5);
			CHECK_NEAR(got->share[n], want.share[n], 1e-5);
		}
		for (size_t c = 0; c < SIZE; c++)
			CHECK_NEAR(got->coefficients[c], want.coefficients[c], 1e-4 * (0.1 + fabs(want.coefficients[c])));
	}
}

static void forward_is_the_definition(void)
{
	for (unsigned layers = 1; layers <= 3; layers += 2) {
		struct gnp_architecture architecture = deep;
		struct gnp_scratch *scratch = gnp_scratch_create();
		struct gnp_weighted_pass pass;
		struct setting setting;
		architecture.layers = layers;
		make(&architecture, &setting);
		CHECK(gnp_weighted_forward(setting.network, list, SUPPORTS, &pass, scratch, NULL) == GNP_OK);
		check_forward(&setting, &pass);
		gnp_scratch_free(scratch);
		drop(&setting);
	}
}

/* Answers are the bytes of the forward pass that keeps a tape. */
static void answers_need_no_tape(void)
{
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_weighted_pass kept, bare;
	struct setting setting;
	make(&deep, &setting);
	CHECK(gnp_weighted_forward(setting.network, list, SUPPORTS, &kept, scratch, NULL) == GNP_OK);
	CHECK(gnp_weighted_infer(setting.network, list, SUPPORTS, &bare, scratch, NULL) == GNP_OK);
	CHECK(kept.trunk && !bare.trunk && bare.rows == kept.rows);
	CHECK(memcmp(bare.outputs, kept.outputs, SUPPORTS * OUTPUTS * sizeof(float)) == 0);
	CHECK(memcmp(bare.logits, kept.logits, kept.rows * sizeof(float)) == 0);
	for (size_t p = 0; p < SUPPORTS; p++)
		CHECK(memcmp(bare.fits[p].coefficients, kept.fits[p].coefficients, sizeof kept.fits[p].coefficients) == 0);
	gnp_scratch_free(scratch);
	drop(&setting);
}

/* ---- Backward ---- */

/* A linear loss of coefficients, shares and outputs. */
struct loss {
	double coefficients[SUPPORTS * SIZE], share[SUPPORTS * NODES];
	float outputs[SUPPORTS * OUTPUTS];
};

static void draw_loss(struct loss *loss)
{
	struct gnp_random random;
	gnp_random_seed(&random, 21, 0);
	for (size_t i = 0; i < SUPPORTS * SIZE; i++)
		loss->coefficients[i] = gnp_random_normal(&random);
	for (size_t i = 0; i < SUPPORTS * NODES; i++)
		loss->share[i] = 0.05 * gnp_random_normal(&random);
	for (size_t i = 0; i < SUPPORTS * OUTPUTS; i++)
		loss->outputs[i] = (float)gnp_random_normal(&random);
}

/* The loss of the parameters as they are; what outputs of errors cost is read at the contexts kept, which they do not
 * teach. Penalties and reach are charged by the coefficients alone. */
static double value(const struct setting *setting, const struct loss *loss, const struct answer *kept)
{
	static struct answer at;
	const size_t hidden = setting->network->architecture.head_width;
	double sum = 0;
	for (size_t p = 0, row = 0; p < SUPPORTS; row += supports[p++].nodes) {
		oracle(setting, &supports[p], &at);
		for (size_t c = 0; c < SIZE; c++)
			sum += loss->coefficients[p * SIZE + c] * at.coefficients[c];
		for (size_t n = 0; n < supports[p].nodes; n++)
			sum += loss->share[row + n] * at.share[n];
		for (size_t o = GNP_WEIGHTED_SLOPE_SCALE; o < OUTPUTS; o++) {
			double told = at.outputs[o];
			if (o <= GNP_WEIGHTED_SECOND_BIAS) {
				told = tensor(setting, "head.4.bias", 0)[o];
				for (size_t h = 0; h < hidden; h++)
					told += tensor(setting, "head.4.weight", 0)[o * hidden + h] * kept[p].context[h];
			}
			sum += (double)loss->outputs[p * OUTPUTS + o] * told;
		}
	}
	return sum;
}

/* A few of every tensor's; of what looks at the data, none teaches. */
static void check_gradient(struct setting *setting, const struct loss *loss, const float *gradient)
{
	static struct answer kept[SUPPORTS];
	struct gnp_random random;
	const struct gnp_layout *layout = &setting->network->layout;
	gnp_random_seed(&random, 31, 0);
	for (size_t p = 0; p < SUPPORTS; p++)
		oracle(setting, &supports[p], &kept[p]);
	for (size_t r = 0; r < layout->rows; r++) {
		const struct gnp_parameter_row *row = &layout->row[r];
		bool fixed = strstr(row->name, "mean") || strstr(row->name, "deviation") || strncmp(row->name, "frame", 5) == 0;
		double size = 0;
		for (size_t i = 0; i < row->count; i++)
			size = fmax(size, fabs((double)gradient[row->offset + i] - 1));
		CHECK(fixed ? size == 0 : size > 0);
		for (int sample = 0; sample < (fixed ? 0 : strncmp(row->name, "head.4", 6) == 0 ? 10 : 3); sample++) {
			double *at = setting->parameters + row->offset + gnp_random_below(&random, row->count);
			double was = *at, h = 1e-5, want;
			*at = was + h;
			want = value(setting, loss, kept);
			*at = was - h;
			want = (want - value(setting, loss, kept)) / (2 * h);
			*at = was;
			double got = (double)gradient[at - setting->parameters] - 1;
			if (!(fabs(got - want) <= 1e-3 * fabs(want) + 2e-4 * size)) {
				fprintf(stderr, "%s: ", row->name);
				CHECK_NEAR(got, want, 1e-3 * fabs(want) + 2e-4 * size);
			}
		}
	}
}

static void backward_is_by_differences(void)
{
	static struct loss loss;
	for (unsigned layers = 1; layers <= 3; layers += 2) {
		struct gnp_architecture architecture = deep;
		struct gnp_scratch *scratch = gnp_scratch_create();
		struct gnp_weighted_pass pass;
		struct setting setting;
		architecture.layers = layers;
		make(&architecture, &setting);
		draw_loss(&loss);
		float *gradient = malloc(setting.network->layout.total * sizeof *gradient), doutputs[SUPPORTS * OUTPUTS];
		for (size_t i = 0; i < setting.network->layout.total; i++)
			gradient[i] = 1; /* is added to */
		memcpy(doutputs, loss.outputs, sizeof doutputs);
		CHECK(gnp_weighted_forward(setting.network, list, SUPPORTS, &pass, scratch, NULL) == GNP_OK);
		CHECK(gnp_weighted_backward(setting.network, list, &pass, loss.coefficients, loss.share, doutputs, gradient,
		                            scratch, NULL) == GNP_OK);
		check_gradient(&setting, &loss, gradient);
		free(gradient);
		gnp_scratch_free(scratch);
		drop(&setting);
	}
}

/* Errors' outputs teach the rows of head.4 that make them, and nothing else. */
static void outputs_of_errors_teach_their_own_weights_alone(void)
{
	static const double none[SUPPORTS * NODES];
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_weighted_pass pass;
	struct setting setting;
	float doutputs[SUPPORTS * OUTPUTS] = {0};
	make(&deep, &setting);
	const struct gnp_layout *layout = &setting.network->layout;
	float *gradient = calloc(layout->total, sizeof *gradient);
	for (size_t p = 0; p < SUPPORTS; p++)
		for (size_t o = GNP_WEIGHTED_SLOPE_SCALE; o <= GNP_WEIGHTED_SECOND_BIAS; o++)
			doutputs[p * OUTPUTS + o] = 1 + (float)p;
	CHECK(gnp_weighted_forward(setting.network, list, SUPPORTS, &pass, scratch, NULL) == GNP_OK);
	CHECK(gnp_weighted_backward(setting.network, list, &pass, none, none, doutputs, gradient, scratch, NULL) == GNP_OK);
	for (size_t r = 0; r < layout->rows; r++) {
		const struct gnp_parameter_row *row = &layout->row[r];
		bool last = strncmp(row->name, "head.4", 6) == 0;
		for (size_t i = 0; i < row->count; i++) {
			size_t o = i / (row->count / row->shape[0]);
			if (last && row->rank == 1 && o >= GNP_WEIGHTED_SLOPE_SCALE && o <= GNP_WEIGHTED_SECOND_BIAS)
				CHECK(gradient[row->offset + i] == 6);
			if (!last || o < GNP_WEIGHTED_SLOPE_SCALE || o > GNP_WEIGHTED_SECOND_BIAS)
				CHECK(gradient[row->offset + i] == 0);
		}
	}
	free(gradient);
	gnp_scratch_free(scratch);
	drop(&setting);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(forward_is_the_definition), TEST(answers_need_no_tape),
	                                    TEST(backward_is_by_differences),
	                                    TEST(outputs_of_errors_teach_their_own_weights_alone)};
	gnp_linalg_init();
	make_supports();
	return RUN_TESTS(tests);
}
