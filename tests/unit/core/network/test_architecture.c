/* The table of parameters: the published counts of the reference package's networks, no gaps, and the ranges it refuses. */
#include "core/network/architecture.h"
#include "core/support/weighted_projection.h"
#include "tests/unit/test.h"

static const struct gnp_architecture v1 = {.trunk = GNP_TRUNK_EDGE, .features = 3, .width = 64, .channels = 4, .neurons = 256, .layers = 5,
                                           .quadrature = 32, .head_width = 128, .outputs = 16};

static struct gnp_layout layout;

static void counts_are_the_published_ones(void)
{
	struct gnp_architecture a = v1;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	CHECK(layout.total == 1360400);
	CHECK(gnp_layout_find(&layout, "model.convs.4.nn.layers.1.weight")->shape[0] == 1024);
	a.trunk = GNP_TRUNK_SEPARABLE;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	CHECK(layout.total == 3331280);
}

static void tensors_follow_each_other(void)
{
	struct gnp_architecture a = v1;
	a.head = GNP_HEAD_PROJECTION;
	a.shells = 2;
	a.shell[0] = 40;
	a.shell[1] = 80;
	a.outputs = 10;
	a.features = 4;
	a.ridge = 1e-6;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	size_t end = 0;
	for (size_t i = 0; i < layout.rows; i++) {
		CHECK(layout.row[i].offset == end);
		CHECK(gnp_layout_find(&layout, layout.row[i].name) == &layout.row[i]);
		end += layout.row[i].count;
	}
	CHECK(end == layout.total);
	CHECK(gnp_layout_find(&layout, "mlp.0.weight") == NULL);
}

static const struct gnp_architecture weighted = {
	.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_WEIGHTED, .features = GNP_SUPPORT_FEATURES, .width = 32,
	.channels = 4, .neurons = 48, .layers = 3, .quadrature = 32, .head_width = 64, .outputs = GNP_WEIGHTED_OUTPUTS,
	.node_width = 24, .frame_width = 20};

static void check_row(const char *name, size_t rank, size_t out, size_t in)
{
	const struct gnp_parameter_row *row = gnp_layout_find(&layout, name);
	CHECK(row && row->rank == rank && row->shape[0] == out && row->shape[1] == in && row->count == out * in);
}

static void the_head_weighted_has_tensors_of_its_own(void)
{
	struct gnp_architecture a = weighted;
	size_t end = 0;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	check_row("head.mean", 1, GNP_SUPPORT_SUMMARY, 1);
	check_row("head.deviation", 1, GNP_SUPPORT_SUMMARY, 1);
	check_row("head.0.weight", 2, 64, 32 + GNP_SUPPORT_SUMMARY);
	check_row("head.2.weight", 2, 64, 64);
	check_row("head.4.weight", 2, GNP_WEIGHTED_OUTPUTS, 64);
	check_row("head.4.bias", 1, GNP_WEIGHTED_OUTPUTS, 1);
	check_row("node.0.weight", 2, 24, 32 + GNP_SUPPORT_FEATURES);
	check_row("node.context.weight", 2, 24, 64);
	check_row("node.context.bias", 1, 24, 1);
	check_row("node.2.weight", 2, 1, 24);
	check_row("node.2.bias", 1, 1, 1);
	check_row("frame.mean", 1, GNP_LADDER_LOOKS, 1);
	check_row("frame.deviation", 1, GNP_LADDER_LOOKS, 1);
	check_row("frame.0.weight", 2, 20, GNP_LADDER_LOOKS);
	check_row("frame.0.bias", 1, 20, 1);
	check_row("frame.2.weight", 2, GNP_LADDER_STEPS, 20);
	check_row("frame.2.bias", 1, GNP_LADDER_STEPS, 1);
	CHECK(!gnp_layout_find(&layout, "node.0.bias") && !gnp_layout_find(&layout, "proj.0.weight"));
	for (size_t i = 0; i < layout.rows; i++) {
		CHECK(layout.row[i].offset == end);
		end += layout.row[i].count;
	}
	CHECK(end == layout.total);
	a.layers = GNP_LAYERS_MAX;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK && layout.rows <= GNP_PARAMETER_ROWS_MAX);
}

struct refusal {
	size_t offset;
	unsigned value;
	const char *text;
};

static void check_refusals(const struct gnp_architecture *right, const struct refusal *rows, size_t count)
{
	CHECK(gnp_architecture_layout(right, &layout, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++) {
		struct gnp_architecture a = *right;
		struct gnp_error error = {0};
		memcpy((char *)&a + rows[i].offset, &rows[i].value, sizeof rows[i].value);
		CHECK(gnp_architecture_layout(&a, &layout, &error) == GNP_INVALID_ARGUMENT);
		CHECK_STRING(error.text, rows[i].text);
	}
}

/* The projection head's layers remain; sizes of a trunk that is not there, and a head that needs one, are refused. */
static void without_a_trunk_there_is_the_head_alone(void)
{
	struct gnp_architecture a = {.trunk = GNP_TRUNK_NONE,
	                             .head = GNP_HEAD_PROJECTION,
	                             .head_width = 64,
	                             .outputs = 10,
	                             .shells = 2,
	                             .shell = {40, 80},
	                             .ridge = 1e-6};
	struct gnp_error error = {0};
	CHECK(gnp_architecture_layout(&a, &layout, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(layout.rows == 8 && gnp_layout_find(&layout, "head.0.weight")->shape[1] == 16);
	a.width = 8;
	CHECK(gnp_architecture_layout(&a, &layout, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "width: got 8, need 0..0");
	a = (struct gnp_architecture){.trunk = GNP_TRUNK_NONE, .head_width = 64, .outputs = 16};
	error = (struct gnp_error){0};
	CHECK(gnp_architecture_layout(&a, &layout, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "trunk: got none, the head pooled needs one");
}

static void what_the_head_weighted_does_not_take_is_named(void)
{
	static const struct refusal rows[] = {
		{offsetof(struct gnp_architecture, features), 4, "features: got 4, need 10..10"},
		{offsetof(struct gnp_architecture, outputs), 16, "outputs: got 16, need 15..15"},
		{offsetof(struct gnp_architecture, node_width), 0, "node_width: got 0, need 4..1024"},
		{offsetof(struct gnp_architecture, frame_width), 1025, "frame_width: got 1025, need 4..1024"},
		{offsetof(struct gnp_architecture, shells), 1, "shells: got 1, need 0..0"},
		{offsetof(struct gnp_architecture, trunk), GNP_TRUNK_EDGE,
	     "trunk: got edge, the head weighted needs separable"},
		{offsetof(struct gnp_architecture, head), 3, "head: got 3, need 0..2"}};
	check_refusals(&weighted, rows, sizeof rows / sizeof *rows);
	static const struct refusal others[] = {
		{offsetof(struct gnp_architecture, node_width), 24, "node_width: got 24, need 0..0"},
		{offsetof(struct gnp_architecture, frame_width), 24, "frame_width: got 24, need 0..0"}};
	check_refusals(&v1, others, 2);
}

static void what_does_not_fit_is_named(void)
{
	static const struct refusal rows[] = {
		{offsetof(struct gnp_architecture, width), 66, "width: got 66, need a multiple of the 4 channels"},
		{offsetof(struct gnp_architecture, layers), 0, "layers: got 0, need 1..12"},
		{offsetof(struct gnp_architecture, features), 17, "features: got 17, need 3..16"},
		{offsetof(struct gnp_architecture, shells), 1, "shells: got 1, need 0..0"},
		{offsetof(struct gnp_architecture, outputs), 17, "outputs: got 17, need 16..16"},
		{offsetof(struct gnp_architecture, trunk), 3, "trunk: got 3, need 0..2"}};
	check_refusals(&v1, rows, sizeof rows / sizeof *rows);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(counts_are_the_published_ones),
	                                    TEST(tensors_follow_each_other),
	                                    TEST(the_head_weighted_has_tensors_of_its_own),
	                                    TEST(what_the_head_weighted_does_not_take_is_named),
	                                    TEST(what_does_not_fit_is_named),
	                                    TEST(without_a_trunk_there_is_the_head_alone)};
	return RUN_TESTS(tests);
}
