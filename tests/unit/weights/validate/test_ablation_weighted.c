/* Weighted models with a part taken away: which parameters change and how, and that what is left answers. */
#include <math.h>

#include "core/linear/linalg.h"
#include "core/network/weighted_head.h"
#include "tests/unit/weights/validate/drawn_model.h"
#include "weights/validate/ablation_weighted.h"
#include "weights/validate/real_method.h"

enum { POINTS = 1200, WIDTH = DRAWN_WIDTH };

static struct gnp_pool *pool;     /* of two workers, for every test */
static struct gnp_models *models; /* a drawn one, any */

static const struct gnp_model *find(const struct gnp_models *among)
{
	const struct gnp_model *model = NULL;
	CHECK(gnp_models_find(among, "any", &model, NULL) == GNP_OK);
	return model;
}

static struct gnp_models *alter(enum gnp_ablation_part part)
{
	struct gnp_models *altered = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_ablation_has(find(models), part));
	CHECK(gnp_ablation_models(models, part, POINTS, pool, &altered, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(gnp_models_count(altered) == 1);
	return altered;
}

/* Whether a tensor is what it was. */
static bool same(const struct gnp_models *altered, const struct gnp_parameter_row *row)
{
	return memcmp(find(altered)->network->parameters + row->offset, find(models)->network->parameters + row->offset,
	              row->count * sizeof(float)) == 0;
}

static void removing_the_trunk_takes_its_columns_of_both_layers(void)
{
	struct gnp_models *altered = alter(GNP_ABLATION_REMOVED);
	const struct gnp_layout *layout = &find(models)->network->layout;
	const float *before = find(models)->network->parameters, *after = find(altered)->network->parameters;
	for (size_t r = 0; r < layout->rows; r++) {
		const struct gnp_parameter_row *row = &layout->row[r];
		bool told = strcmp(row->name, "head.0.weight") == 0 || strcmp(row->name, "node.0.weight") == 0;
		CHECK(same(altered, row) == !told);
		for (size_t i = 0; i < row->count && told; i++)
			CHECK(after[row->offset + i] == (i % row->shape[1] < WIDTH ? 0 : before[row->offset + i]));
	}
	gnp_models_release(altered);
}

static void a_random_trunk_leaves_head_nodes_and_frames(void)
{
	struct gnp_models *altered = alter(GNP_ABLATION_RANDOM);
	const struct gnp_layout *layout = &find(models)->network->layout;
	size_t kept = 0;
	for (size_t r = 0; r < layout->rows; r++) {
		const char *name = layout->row[r].name;
		bool other =
			strncmp(name, "head.", 5) == 0 || strncmp(name, "node.", 5) == 0 || strncmp(name, "frame.", 6) == 0;
		CHECK(same(altered, &layout->row[r]) == other);
		kept += other;
	}
	CHECK(kept > 0 && kept < layout->rows);
	gnp_models_release(altered);
}

static void constant_outputs_are_the_mean_over_bodies(void)
{
	struct gnp_models *altered = alter(GNP_ABLATION_CONSTANT);
	const struct gnp_layout *layout = &find(models)->network->layout;
	const struct gnp_parameter_row *weight = gnp_layout_find(layout, "head.4.weight"),
								   *bias = gnp_layout_find(layout, "head.4.bias");
	const float *after = find(altered)->network->parameters;
	float mean[GNP_WEIGHTED_OUTPUTS], again[GNP_WEIGHTED_OUTPUTS];
	struct gnp_pool *single;
	CHECK(gnp_pool_create(1, &single, NULL) == GNP_OK);
	CHECK(gnp_ablation_mean_outputs(find(models), POINTS, pool, mean, NULL) == GNP_OK);
	CHECK(gnp_ablation_weighted_outputs(find(models), POINTS, single, again, NULL) == GNP_OK);
	CHECK(memcmp(mean, again, sizeof mean) == 0); /* for any worker count */
	CHECK(gnp_ablation_mean_outputs(find(altered), POINTS, pool, again, NULL) == GNP_OK);
	double square = 0;
	for (size_t i = 0; i < GNP_WEIGHTED_OUTPUTS; i++) {
		double plain = (double)find(models)->network->parameters[bias->offset + i];
		CHECK(isfinite(mean[i]) && after[bias->offset + i] == mean[i]);
		CHECK_NEAR(again[i], mean[i], 1e-5 * (1 + fabs(mean[i])));
		square += (mean[i] - plain) * (mean[i] - plain);
	}
	CHECK(square > 1e-4); /* what the head makes of supports is not its last bias */
	for (size_t i = 0; i < weight->count; i++)
		CHECK(after[weight->offset + i] == 0);
	for (size_t r = 0; r < layout->rows; r++)
		CHECK(same(altered, &layout->row[r]) == (&layout->row[r] != weight && &layout->row[r] != bias));
	gnp_models_release(altered);
}

/* Of features that are drawn: the shares do not go by them any more. */
static void node_weights_of_one_are_one_at_every_node(void)
{
	struct gnp_models *altered = alter(GNP_ABLATION_WEIGHTS);
	const struct gnp_parameter_row *weight = gnp_layout_find(&find(models)->network->layout, "node.2.weight");
	const struct gnp_parameter_row *bias = gnp_layout_find(&find(models)->network->layout, "node.2.bias");
	static struct gnp_support support;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_weighted_pass pass;
	struct gnp_random random;
	gnp_random_seed(&random, 3, 0);
	support.nodes = GNP_SUPPORT_NODES;
	for (size_t i = 0; i < GNP_SUPPORT_NODES * GNP_SUPPORT_FEATURES; i++)
		support.features[i] = (float)gnp_random_normal(&random);
	for (size_t i = 0; i < GNP_SUPPORT_NODES; i++)
		support.weight[i] = 1;
	for (int whole = 0; whole < 2; whole++) {
		const struct gnp_support *one = &support;
		CHECK(gnp_weighted_forward(find(whole ? models : altered)->network, &one, 1, &pass, scratch, NULL) == GNP_OK);
		for (size_t i = 0; i < GNP_SUPPORT_NODES; i++)
			CHECK(whole ? pass.fits[0].share[i] < 1 - 1e-6 : pass.fits[0].share[i] > 1 - 1e-12);
	}
	gnp_scratch_free(scratch);
	for (size_t r = 0; r < find(models)->network->layout.rows; r++) {
		const struct gnp_parameter_row *row = &find(models)->network->layout.row[r];
		CHECK(same(altered, row) == (row != weight && row != bias));
	}
	gnp_models_release(altered);
}

static void the_real_table_lists_every_part_of_the_default(void)
{
	struct gnp_real_method methods[GNP_REAL_METHODS_MAX];
	size_t count = gnp_real_method_list(models, NULL, methods);
	CHECK(count == 4); /* gnp, adaptive, gmls, pca: the model's name is no column beside gnp */
	CHECK_STRING(methods[0].name, "gnp");
	CHECK(methods[0].model == find(models));
	for (unsigned part = GNP_ABLATION_NONE + 1; part < GNP_ABLATION_PARTS; part++)
		CHECK(gnp_real_method_ablated(models, (enum gnp_ablation_part)part, count, methods) == count + 1 &&
		      methods[count].part == (enum gnp_ablation_part)part);
	CHECK(gnp_real_method_list(NULL, NULL, methods) == 3);
}

/* ---- The model ---- */

static void widen_spreads(const struct gnp_layout *layout, float *parameters)
{
	static const char *const spreads[] = {"head.deviation", "frame.deviation"};
	for (int s = 0; s < 2; s++) {
		const struct gnp_parameter_row *row = gnp_layout_find(layout, spreads[s]);
		for (size_t p = 0; p < row->count; p++)
			parameters[row->offset + p] = 4;
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(removing_the_trunk_takes_its_columns_of_both_layers), TEST(a_random_trunk_leaves_head_nodes_and_frames),
		TEST(constant_outputs_are_the_mean_over_bodies),           TEST(node_weights_of_one_are_one_at_every_node),
		TEST(the_real_table_lists_every_part_of_the_default),
	};
	gnp_linalg_init();
	if (!drawn_model_load(widen_spreads, &models) || gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int code = RUN_TESTS(tests);
	gnp_pool_free(pool);
	gnp_models_release(models);
	return code;
}
