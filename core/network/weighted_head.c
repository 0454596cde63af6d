#include "core/network/weighted_head.h"

#include <string.h>

#include "core/network/dense.h"

enum { OUTPUTS = GNP_WEIGHTED_OUTPUTS, FEATURES = GNP_SUPPORT_FEATURES, SUMMARY = GNP_SUPPORT_SUMMARY };

/* Where the head's tensors lie in the block of parameters. */
struct places {
	size_t mean, deviation, weight[3], bias[3], node, context, context_bias, last, last_bias;
};

static size_t offset(const struct gnp_network *network, const char *name)
{
	return gnp_layout_find(&network->layout, name)->offset;
}

static struct places places_of(const struct gnp_network *network)
{
	return (struct places){
		.mean = offset(network, "head.mean"),
		.deviation = offset(network, "head.deviation"),
		.weight = {offset(network, "head.0.weight"), offset(network, "head.2.weight"),
	               offset(network, "head.4.weight")},
		.bias = {offset(network, "head.0.bias"), offset(network, "head.2.bias"), offset(network, "head.4.bias")},
		.node = offset(network, "node.0.weight"),
		.context = offset(network, "node.context.weight"),
		.context_bias = offset(network, "node.context.bias"),
		.last = offset(network, "node.2.weight"),
		.last_bias = offset(network, "node.2.bias")};
}

struct sizes {
	size_t width, inputs, hidden, node_inputs, node;
};

static struct sizes sizes_of(const struct gnp_architecture *a)
{
	return (struct sizes){a->width, (size_t)a->width + SUMMARY, a->head_width, (size_t)a->width + FEATURES,
	                      a->node_width};
}

static float *take(struct gnp_scratch *scratch, size_t rows, size_t columns)
{
	return gnp_scratch_take(scratch, rows, columns * sizeof(float));
}

static bool take_pass(const struct sizes *s, const struct gnp_support *const *supports, size_t count,
                      struct gnp_weighted_pass *pass, struct gnp_scratch *scratch)
{
	*pass = (struct gnp_weighted_pass){.count = count,
	                                   .start = gnp_scratch_take(scratch, count + 1, sizeof *pass->start),
	                                   .inner = gnp_scratch_take(scratch, count, sizeof *pass->inner)};
	if (!pass->start || !pass->inner)
		return false;
	pass->start[0] = 0;
	for (size_t p = 0; p < count; p++) {
		pass->inner[p] = supports[p]->nodes;
		pass->start[p + 1] = pass->start[p] + pass->inner[p];
	}
	pass->rows = pass->start[count];
	pass->outputs = take(scratch, count, OUTPUTS);
	pass->logits = take(scratch, pass->rows, 1);
	pass->fits = gnp_scratch_take(scratch, count, sizeof *pass->fits);
	pass->nodes = take(scratch, pass->rows, FEATURES);
	pass->inputs = take(scratch, count, s->inputs);
	pass->hidden[0] = take(scratch, count, s->hidden);
	pass->hidden[1] = take(scratch, count, s->hidden);
	pass->context = take(scratch, count, s->node);
	pass->node_inputs = take(scratch, pass->rows, s->node_inputs);
	pass->node_hidden = take(scratch, pass->rows, s->node);
	return pass->outputs && pass->logits && pass->fits && pass->nodes && pass->inputs && pass->hidden[0] &&
	       pass->hidden[1] && pass->context && pass->node_inputs && pass->node_hidden;
}

/* ---- Forward ---- */

/* The trunk's mean, then the summary in units of its spread over the training data. */
static void fill_inputs(const float *w, const struct places *at, const struct sizes *s,
                        const struct gnp_support *const *supports, const float *mean, struct gnp_weighted_pass *pass)
{
	for (size_t p = 0; p < pass->count; p++) {
		float *row = pass->inputs + p * s->inputs;
		memcpy(row, mean + p * s->width, s->width * sizeof *row);
		for (size_t i = 0; i < SUMMARY; i++)
			row[s->width + i] = (supports[p]->summary[i] - w[at->mean + i]) / w[at->deviation + i];
	}
}

static void run_context(const float *w, const struct places *at, const struct sizes *s, struct gnp_weighted_pass *pass)
{
	size_t n = pass->count;
	gnp_dense_forward(n, s->inputs, s->hidden, pass->inputs, s->inputs, w + at->weight[0], s->inputs, w + at->bias[0],
	                  pass->hidden[0]);
	gnp_relu(n * s->hidden, pass->hidden[0]);
	gnp_dense_forward(n, s->hidden, s->hidden, pass->hidden[0], s->hidden, w + at->weight[1], s->hidden,
	                  w + at->bias[1], pass->hidden[1]);
	gnp_relu(n * s->hidden, pass->hidden[1]);
	gnp_dense_forward(n, s->hidden, OUTPUTS, pass->hidden[1], s->hidden, w + at->weight[2], s->hidden, w + at->bias[2],
	                  pass->outputs);
	gnp_dense_forward(n, s->hidden, s->node, pass->hidden[1], s->hidden, w + at->context, s->hidden,
	                  w + at->context_bias, pass->context);
}

static void run_nodes(const float *w, const struct places *at, const struct sizes *s, const float *values,
                      struct gnp_weighted_pass *pass)
{
	for (size_t i = 0; i < pass->rows; i++) {
		float *row = pass->node_inputs + i * s->node_inputs;
		memcpy(row, values + i * s->width, s->width * sizeof *row);
		memcpy(row + s->width, pass->nodes + i * FEATURES, FEATURES * sizeof *row);
	}
	gnp_dense_forward(pass->rows, s->node_inputs, s->node, pass->node_inputs, s->node_inputs, w + at->node,
	                  s->node_inputs, NULL, pass->node_hidden);
	for (size_t p = 0; p < pass->count; p++)
		gnp_bias_relu(pass->inner[p], s->node, pass->context + p * s->node,
		              pass->node_hidden + pass->start[p] * s->node);
	gnp_dense_forward(pass->rows, s->node, 1, pass->node_hidden, s->node, w + at->last, s->node, w + at->last_bias,
	                  pass->logits);
}

/* keep: what backward needs. */
static gnp_status forward(const struct gnp_network *network, const struct gnp_support *const *supports, size_t count,
                          bool keep, struct gnp_weighted_pass *pass, struct gnp_scratch *scratch,
                          struct gnp_error *error)
{
	const struct sizes s = sizes_of(&network->architecture);
	const struct places at = places_of(network);
	const float *w = network->parameters;
	float *mean = take(scratch, count, s.width), *values = NULL;
	if (!mean || !take_pass(&s, supports, count, pass, scratch) ||
	    (!keep && !(values = take(scratch, pass->rows, s.width))))
		return gnp_no_memory("weighted", count, "supports", error);
	for (size_t p = 0; p < count; p++)
		memcpy(pass->nodes + pass->start[p] * FEATURES, supports[p]->features,
		       pass->inner[p] * FEATURES * sizeof(float));
	const struct gnp_network_batch batch = {count, pass->start, pass->inner, pass->nodes};
	gnp_status status = keep ? gnp_trunk_forward(network, &batch, mean, &pass->trunk, scratch, error)
	                         : gnp_trunk_forward_nodes(network, &batch, mean, values, scratch, error);
	if (status != GNP_OK)
		return status;
	fill_inputs(w, &at, &s, supports, mean, pass);
	run_context(w, &at, &s, pass);
	run_nodes(w, &at, &s, keep ? gnp_trunk_nodes(network, pass->trunk) : values, pass);
	for (size_t p = 0; p < count; p++)
		gnp_weighted_solve(supports[p], pass->outputs + p * OUTPUTS, pass->logits + pass->start[p], &pass->fits[p]);
	return GNP_OK;
}

gnp_status gnp_weighted_forward(const struct gnp_network *network, const struct gnp_support *const *supports,
                                size_t count, struct gnp_weighted_pass *pass, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	return forward(network, supports, count, true, pass, scratch, error);
}

gnp_status gnp_weighted_infer(const struct gnp_network *network, const struct gnp_support *const *supports,
                              size_t count, struct gnp_weighted_pass *pass, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	return forward(network, supports, count, false, pass, scratch, error);
}

/* ---- Backward ---- */

/* Derivatives of activations, in scratch. */
struct derivatives {
	float *logits, *node_hidden, *node_inputs, *context, *hidden[2], *more, *inputs, *mean, *values;
};

static bool take_derivatives(const struct sizes *s, const struct gnp_weighted_pass *pass, struct derivatives *d,
                             struct gnp_scratch *scratch)
{
	size_t n = pass->count, rows = pass->rows;
	*d = (struct derivatives){take(scratch, rows, 1),       take(scratch, rows, s->node),
	                          take(scratch, rows, s->node_inputs), take(scratch, n, s->node),
	                          {take(scratch, n, s->hidden), take(scratch, n, s->hidden)},
	                          take(scratch, n, s->hidden),  take(scratch, n, s->inputs),
	                          take(scratch, n, s->width),   take(scratch, rows, s->width)};
	return d->logits && d->node_hidden && d->node_inputs && d->context && d->hidden[0] && d->hidden[1] && d->more &&
	       d->inputs && d->mean && d->values;
}

static void nodes_backward(const float *w, const struct places *at, const struct sizes *s,
                           const struct gnp_weighted_pass *pass, const struct derivatives *d, float *gradient)
{
	gnp_dense_backward(pass->rows, s->node, 1, pass->node_hidden, s->node, w + at->last, s->node, d->logits,
	                   d->node_hidden, gradient + at->last, gradient + at->last_bias);
	gnp_relu_backward(pass->rows * s->node, pass->node_hidden, d->node_hidden);
	memset(d->context, 0, pass->count * s->node * sizeof *d->context);
	for (size_t p = 0; p < pass->count; p++)
		gnp_rows_sum(pass->inner[p], s->node, d->node_hidden + pass->start[p] * s->node, d->context + p * s->node);
	gnp_dense_backward(pass->rows, s->node_inputs, s->node, pass->node_inputs, s->node_inputs, w + at->node,
	                   s->node_inputs, d->node_hidden, d->node_inputs, gradient + at->node, NULL);
	for (size_t i = 0; i < pass->rows; i++)
		memcpy(d->values + i * s->width, d->node_inputs + i * s->node_inputs, s->width * sizeof *d->values);
}

/* d loss / d context by outputs, but for those of errors. */
static void outputs_backward(const float *w, const struct places *at, const struct sizes *s,
                             const struct gnp_weighted_pass *pass, float *doutputs, const struct derivatives *d,
                             float *gradient)
{
	gnp_dense_backward(pass->count, s->hidden, OUTPUTS, pass->hidden[1], s->hidden, w + at->weight[2], s->hidden,
	                   doutputs, NULL, gradient + at->weight[2], gradient + at->bias[2]);
	for (size_t p = 0; p < pass->count; p++)
		for (int o = GNP_WEIGHTED_SLOPE_SCALE; o <= GNP_WEIGHTED_SECOND_BIAS; o++)
			doutputs[p * OUTPUTS + (size_t)o] = 0;
	gnp_dense_backward(pass->count, s->hidden, OUTPUTS, pass->hidden[1], s->hidden, w + at->weight[2], s->hidden,
	                   doutputs, d->more, NULL, NULL);
}

static void context_backward(const float *w, const struct places *at, const struct sizes *s,
                             const struct gnp_weighted_pass *pass, const struct derivatives *d, float *gradient)
{
	size_t n = pass->count;
	gnp_dense_backward(n, s->hidden, s->node, pass->hidden[1], s->hidden, w + at->context, s->hidden, d->context,
	                   d->hidden[1], gradient + at->context, gradient + at->context_bias);
	for (size_t i = 0; i < n * s->hidden; i++)
		d->hidden[1][i] += d->more[i];
	gnp_relu_backward(n * s->hidden, pass->hidden[1], d->hidden[1]);
	gnp_dense_backward(n, s->hidden, s->hidden, pass->hidden[0], s->hidden, w + at->weight[1], s->hidden, d->hidden[1],
	                   d->hidden[0], gradient + at->weight[1], gradient + at->bias[1]);
	gnp_relu_backward(n * s->hidden, pass->hidden[0], d->hidden[0]);
	gnp_dense_backward(n, s->inputs, s->hidden, pass->inputs, s->inputs, w + at->weight[0], s->inputs, d->hidden[0],
	                   d->inputs, gradient + at->weight[0], gradient + at->bias[0]);
	for (size_t p = 0; p < n; p++)
		memcpy(d->mean + p * s->width, d->inputs + p * s->inputs, s->width * sizeof *d->mean);
}

gnp_status gnp_weighted_backward(const struct gnp_network *network, const struct gnp_support *const *supports,
                                 const struct gnp_weighted_pass *pass, const double *dcoefficients,
                                 const double *dshares, float *doutputs, float *gradient, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	const struct sizes s = sizes_of(&network->architecture);
	const struct places at = places_of(network);
	const float *w = network->parameters;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct derivatives d;
	if (!take_derivatives(&s, pass, &d, scratch)) {
		gnp_scratch_release(scratch, mark);
		return gnp_no_memory("weighted", pass->count, "supports", error);
	}
	for (size_t p = 0; p < pass->count; p++)
		gnp_weighted_solve_backward(supports[p], pass->outputs + p * OUTPUTS, &pass->fits[p],
		                            dcoefficients + p * GNP_TAYLOR_SIZE, dshares + pass->start[p],
		                            doutputs + p * OUTPUTS, d.logits + pass->start[p]);
	nodes_backward(w, &at, &s, pass, &d, gradient);
	outputs_backward(w, &at, &s, pass, doutputs, &d, gradient);
	context_backward(w, &at, &s, pass, &d, gradient);
	gnp_status status = gnp_trunk_backward(network, pass->trunk, d.mean, d.values, gradient, scratch, error);
	gnp_scratch_release(scratch, mark);
	return status;
}
