/* The table of parameters: the published counts of the reference package's networks, no gaps, and the ranges it refuses. */
#include "core/network/architecture.h"
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

static void what_does_not_fit_is_named(void)
{
	const struct {
		size_t offset;
		unsigned value;
		const char *text;
	} rows[] = {{offsetof(struct gnp_architecture, width), 66, "width: got 66, need a multiple of the 4 channels"},
	            {offsetof(struct gnp_architecture, layers), 0, "layers: got 0, need 1..12"},
	            {offsetof(struct gnp_architecture, features), 9, "features: got 9, need 3..8"},
	            {offsetof(struct gnp_architecture, shells), 1, "shells: got 1, need 0..0"},
	            {offsetof(struct gnp_architecture, outputs), 17, "outputs: got 17, need 16..16"},
	            {offsetof(struct gnp_architecture, trunk), 3, "trunk: got 3, need 0..2"}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		struct gnp_architecture a = v1;
		struct gnp_error error = {0};
		memcpy((char *)&a + rows[i].offset, &rows[i].value, sizeof rows[i].value);
		CHECK(gnp_architecture_layout(&a, &layout, &error) == GNP_INVALID_ARGUMENT);
		CHECK_STRING(error.text, rows[i].text);
	}
}

/* The projection head's layers remain; sizes of a trunk that is not there, and a head that needs one, are refused. */
static void without_a_trunk_there_is_the_head_alone(void)
{
	struct gnp_architecture a = {.trunk = GNP_TRUNK_NONE, .head = GNP_HEAD_PROJECTION, .head_width = 64, .outputs = 10, .shells = 2,
	                             .shell = {40, 80}, .ridge = 1e-6};
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

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(counts_are_the_published_ones), TEST(tensors_follow_each_other),
	                                    TEST(what_does_not_fit_is_named), TEST(without_a_trunk_there_is_the_head_alone)};
	return RUN_TESTS(tests);
}
