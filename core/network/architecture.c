#include "core/network/architecture.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/fit/taylor.h"
#include "core/support/weighted_projection.h"

const char *gnp_trunk_name(enum gnp_trunk_kind kind)
{
	static const char *const names[GNP_TRUNKS] = {"edge", "separable", "none"};
	return (unsigned)kind < GNP_TRUNKS ? names[kind] : NULL;
}

const char *gnp_head_name(enum gnp_head_kind kind)
{
	static const char *const names[GNP_HEADS] = {"pooled", "projection", "weighted"};
	return (unsigned)kind < GNP_HEADS ? names[kind] : NULL;
}

size_t gnp_projection_summary(const struct gnp_architecture *architecture)
{
	return architecture->head == GNP_HEAD_WEIGHTED ? (size_t)GNP_SUPPORT_SUMMARY
	                                               : (size_t)architecture->shells * (1 + GNP_TAYLOR_DEGREE);
}

size_t gnp_projection_outputs(const struct gnp_architecture *architecture)
{
	return architecture->head == GNP_HEAD_WEIGHTED ? (size_t)GNP_WEIGHTED_OUTPUTS
	                                               : (size_t)architecture->shells + 1 + GNP_TAYLOR_DEGREE;
}

size_t gnp_projection_reach(const struct gnp_architecture *architecture)
{
	size_t last = architecture->shell[architecture->shells - 1];
	return last + last / 6 + 8;
}

static gnp_status check_shells(const struct gnp_architecture *a, struct gnp_error *error)
{
	for (unsigned i = 0; i < a->shells; i++) {
		unsigned low = i ? a->shell[i - 1] + 1 : 8;
		if (a->shell[i] < low || a->shell[i] > 4096)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "shell %u: got %u points, need %u..4096", i, a->shell[i], low);
	}
	return GNP_OK;
}

static gnp_status check(const struct gnp_architecture *a, struct gnp_error *error)
{
	unsigned projection = a->head == GNP_HEAD_PROJECTION, weighted = a->head == GNP_HEAD_WEIGHTED;
	unsigned outputs = a->head == GNP_HEAD_POOLED ? 16 : (unsigned)gnp_projection_outputs(a);
	unsigned trunk = a->trunk != GNP_TRUNK_NONE;
	const struct {
		const char *name;
		unsigned value, low, high;
	} rows[] = {{"trunk", (unsigned)a->trunk, 0, GNP_TRUNKS - 1},
	            {"head", (unsigned)a->head, 0, GNP_HEADS - 1},
	            {"features", a->features, weighted ? GNP_SUPPORT_FEATURES : 3 * trunk,
	             weighted ? GNP_SUPPORT_FEATURES : 16 * trunk},
	            {"width", a->width, 4 * trunk, 256 * trunk},
	            {"channels", a->channels, trunk, a->width},
	            {"neurons", a->neurons, 4 * trunk, 1024 * trunk},
	            {"layers", a->layers, trunk, GNP_LAYERS_MAX * trunk},
	            {"quadrature", a->quadrature, 4 * trunk, GNP_QUADRATURE_MAX * trunk},
	            {"head_width", a->head_width, 4, 1024},
	            {"node_width", a->node_width, weighted ? 4 : 0, weighted ? 1024 : 0},
	            {"frame_width", a->frame_width, weighted ? 4 : 0, weighted ? 1024 : 0},
	            {"shells", a->shells, projection, projection ? GNP_SHELLS_MAX : 0},
	            {"outputs", a->outputs, outputs, outputs}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
		if (rows[i].value < rows[i].low || rows[i].value > rows[i].high)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %u, need %u..%u", rows[i].name, rows[i].value,
			                     rows[i].low, rows[i].high);
	if (!trunk && !projection)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "trunk: got none, the head %s needs one",
		                     gnp_head_name(a->head));
	if (trunk && a->width % a->channels)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "width: got %u, need a multiple of the %u channels", a->width,
		                     a->channels);
	if (weighted && a->trunk != GNP_TRUNK_SEPARABLE)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "trunk: got %s, the head weighted needs %s",
		                     gnp_trunk_name(a->trunk), gnp_trunk_name(GNP_TRUNK_SEPARABLE));
	if (projection && !(a->ridge >= 1e-15 && a->ridge <= 1))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "ridge: got %g, need 1e-15..1", a->ridge);
	if (projection && trunk && a->features < 4)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "features: got %u, the projection head's nodes have 4", a->features);
	return check_shells(a, error);
}

static void add(struct gnp_layout *layout, size_t out, size_t in, size_t rank, const char *format, ...)
{
	struct gnp_parameter_row *row = &layout->row[layout->rows++];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(row->name, sizeof row->name, format, arguments);
	va_end(arguments);
	row->rank = rank;
	row->shape[0] = out;
	row->shape[1] = in;
	row->offset = layout->total;
	row->count = out * in;
	layout->total += row->count;
}

/* A linear layer. */
static void add_linear(struct gnp_layout *layout, const char *name, size_t out, size_t in)
{
	add(layout, out, in, 2, "%s.weight", name);
	add(layout, out, 1, 1, "%s.bias", name);
}

static void add_edge(const struct gnp_architecture *a, struct gnp_layout *layout)
{
	size_t block = a->width / a->channels;
	char name[48];
	add_linear(layout, "model.lift", a->width, a->features);
	for (unsigned i = 0; i < a->layers; i++) {
		snprintf(name, sizeof name, "model.convs.%u.nn.layers.0", i);
		add_linear(layout, name, a->neurons, 2 * (size_t)a->features);
		snprintf(name, sizeof name, "model.convs.%u.nn.layers.1", i);
		add_linear(layout, name, a->channels * block * block, a->neurons);
		snprintf(name, sizeof name, "model.mixes.%u", i);
		add_linear(layout, name, a->width, a->width);
	}
	add_linear(layout, "model.proj", a->width, a->width);
}

static void add_separable(const struct gnp_architecture *a, struct gnp_layout *layout)
{
	size_t block = a->width / a->channels;
	char name[48];
	add_linear(layout, "lift", a->width, a->features);
	for (unsigned i = 0; i < a->layers; i++) {
		for (int kernel = 1; kernel <= 2; kernel++) {
			const size_t sizes[4] = {a->features, a->neurons, a->neurons, a->channels * block * block};
			for (int layer = 0; layer < 3; layer++) {
				snprintf(name, sizeof name, "convs.%u.kernel%d.layers.%d", i, kernel, layer);
				add_linear(layout, name, sizes[layer + 1], sizes[layer]);
			}
		}
		snprintf(name, sizeof name, "convs.%u.linear", i);
		add_linear(layout, name, a->width, a->width);
	}
}

/* What weighs nodes and chooses frames. */
static void add_weighting(const struct gnp_architecture *a, struct gnp_layout *layout)
{
	add(layout, a->node_width, a->width + a->features, 2, "node.0.weight");
	add_linear(layout, "node.context", a->node_width, a->head_width);
	add_linear(layout, "node.2", 1, a->node_width);
	add(layout, GNP_LADDER_LOOKS, 1, 1, "frame.mean");
	add(layout, GNP_LADDER_LOOKS, 1, 1, "frame.deviation");
	add_linear(layout, "frame.0", a->frame_width, GNP_LADDER_LOOKS);
	add_linear(layout, "frame.2", GNP_LADDER_STEPS, a->frame_width);
}

static void add_head(const struct gnp_architecture *a, struct gnp_layout *layout)
{
	if (a->head == GNP_HEAD_POOLED) {
		const char *name = a->trunk == GNP_TRUNK_EDGE ? "mlp" : "proj";
		char first[16], second[16];
		snprintf(first, sizeof first, "%s.0", name);
		snprintf(second, sizeof second, "%s.2", name);
		add_linear(layout, first, a->head_width, a->width);
		add_linear(layout, second, a->outputs, a->head_width);
		return;
	}
	add(layout, gnp_projection_summary(a), 1, 1, "head.mean");
	add(layout, gnp_projection_summary(a), 1, 1, "head.deviation");
	add_linear(layout, "head.0", a->head_width, a->width + gnp_projection_summary(a));
	add_linear(layout, "head.2", a->head_width, a->head_width);
	add_linear(layout, "head.4", a->outputs, a->head_width);
	if (a->head == GNP_HEAD_WEIGHTED)
		add_weighting(a, layout);
}

gnp_status gnp_architecture_layout(const struct gnp_architecture *architecture, struct gnp_layout *layout,
                                   struct gnp_error *error)
{
	gnp_status status = check(architecture, error);
	if (status != GNP_OK)
		return status;
	layout->rows = layout->total = 0;
	if (architecture->trunk == GNP_TRUNK_EDGE)
		add_edge(architecture, layout);
	else if (architecture->trunk == GNP_TRUNK_SEPARABLE)
		add_separable(architecture, layout);
	add_head(architecture, layout);
	return GNP_OK;
}

const struct gnp_parameter_row *gnp_layout_find(const struct gnp_layout *layout, const char *name)
{
	for (size_t i = 0; i < layout->rows; i++)
		if (strcmp(layout->row[i].name, name) == 0)
			return &layout->row[i];
	return NULL;
}
