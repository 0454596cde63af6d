/* Models with a part taken away: which parameters change and how, and what Table 1 makes of them. */
#include <math.h>
#include <unistd.h>

#include "core/base/random.h"
#include "core/linear/linalg.h"
#include "tests/unit/test.h"
#include "weights/validate/ablation_table.h"
#include "weights/validate/validation.h"

enum { POINTS = 3000 };

static struct gnp_pool *pool;     /* of two workers, for every test */
/* Drawn ones: fit_noise_70k with a trunk, fit_clean_30k and fit_clean_50k without, and clean_30k_pooled. */
static struct gnp_models *models;

/* fit_noise_70k of the altered models, and its layout. */
static struct gnp_models *alter(enum gnp_ablation_part part, const struct gnp_model **model)
{
	struct gnp_models *altered = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_ablation_models(models, part, POINTS, pool, &altered, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(gnp_models_count(altered) == (part == GNP_ABLATION_NONE ? 4 : part == GNP_ABLATION_CONSTANT ? 3 : 1));
	CHECK(gnp_models_find(altered, "fit_noise_70k", model, NULL) == GNP_OK);
	return altered;
}

static const struct gnp_model *whole(void)
{
	const struct gnp_model *model = NULL;
	CHECK(gnp_models_find(models, "fit_noise_70k", &model, NULL) == GNP_OK);
	return model;
}

static bool is_head(const struct gnp_parameter_row *row)
{
	return strncmp(row->name, "head.", 5) == 0;
}

static bool same(const struct gnp_model *a, const struct gnp_model *b, const struct gnp_parameter_row *row)
{
	return memcmp(a->network->parameters + row->offset, b->network->parameters + row->offset,
	              row->count * sizeof(float)) == 0;
}

static void a_whole_model_stays_as_it_is(void)
{
	const struct gnp_model *model;
	struct gnp_models *altered = alter(GNP_ABLATION_NONE, &model);
	for (size_t r = 0; r < model->network->layout.rows; r++)
		CHECK(same(model, whole(), &model->network->layout.row[r]));
	CHECK_STRING(model->regime, whole()->regime);
	gnp_models_release(altered);
}

static void without_its_trunk_the_head_is_told_nothing_of_it(void)
{
	const struct gnp_model *model;
	struct gnp_models *altered = alter(GNP_ABLATION_REMOVED, &model);
	const struct gnp_layout *layout = &model->network->layout;
	const struct gnp_parameter_row *first = gnp_layout_find(layout, "head.0.weight");
	const float *own = model->network->parameters + first->offset;
	const float *before = whole()->network->parameters + first->offset;
	for (size_t r = 0; r < layout->rows; r++)
		CHECK(same(model, whole(), &layout->row[r]) == (&layout->row[r] != first));
	for (size_t i = 0; i < first->count; i++)
		CHECK(own[i] == (i % first->shape[1] < model->architecture.width ? 0 : before[i]));
	gnp_models_release(altered);
}

static void a_random_trunk_has_the_size_of_the_trained_one(void)
{
	const struct gnp_model *model;
	struct gnp_models *altered = alter(GNP_ABLATION_RANDOM, &model);
	const struct gnp_layout *layout = &model->network->layout;
	for (size_t r = 0; r < layout->rows; r++) {
		const struct gnp_parameter_row *row = &layout->row[r];
		double own = 0, before = 0;
		CHECK(same(model, whole(), row) == is_head(row));
		for (size_t i = 0; i < row->count; i++) {
			own += pow((double)model->network->parameters[row->offset + i], 2);
			before += pow((double)whole()->network->parameters[row->offset + i], 2);
		}
		if (row->count >= 256 && before > 0)
			CHECK_NEAR(own / before, 1, 0.4);
	}
	gnp_models_release(altered);
}

static void constant_outputs_are_the_mean_ones(void)
{
	const struct gnp_model *model;
	struct gnp_models *altered = alter(GNP_ABLATION_CONSTANT, &model);
	const struct gnp_layout *layout = &model->network->layout;
	const struct gnp_parameter_row *weight = gnp_layout_find(layout, "head.4.weight");
	const struct gnp_parameter_row *bias = gnp_layout_find(layout, "head.4.bias");
	float before[64], after[64];
	CHECK(gnp_ablation_mean_outputs(whole(), POINTS, pool, before, NULL) == GNP_OK);
	CHECK(gnp_ablation_mean_outputs(model, POINTS, pool, after, NULL) == GNP_OK);
	for (size_t i = 0; i < weight->count; i++)
		CHECK(model->network->parameters[weight->offset + i] == 0);
	for (size_t i = 0; i < bias->count; i++) {
		CHECK(isfinite(before[i]) && model->network->parameters[bias->offset + i] == before[i]);
		CHECK_NEAR(after[i], before[i], 1e-5 * (1 + fabs(before[i])));
	}
	gnp_models_release(altered);
}

static void table_1_is_judged_with_every_part(void)
{
	const struct gnp_protocol protocol = {.points = POINTS, .shapes = 1, .centres = 50};
	struct gnp_selection selection = {.families = 1u << GNP_FAMILY_RADIAL,
	                                  .regimes = 1u << GNP_REGIME_NOISE_70 | 1u << GNP_REGIME_CLEAN_30};
	struct gnp_table table;
	struct gnp_ablation_table ablation;
	struct gnp_error error = {0};
	char *text = NULL;
	size_t size = 0;
	gnp_selection_take(&selection, 1u << GNP_METHOD_FIT | 1u << GNP_METHOD_GMLS);
	CHECK(gnp_table_create(&protocol, &selection, models, &table, &error) == GNP_OK);
	CHECK(gnp_validation_run(&table, pool, NULL, &error) == GNP_OK);
	CHECK(gnp_ablation_table_run(&table, pool, NULL, &ablation, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	const struct gnp_row row = {GNP_FAMILY_RADIAL, GNP_REGIME_NOISE_70, GNP_METHOD_FIT};
	for (unsigned part = 0; part < GNP_ABLATION_PARTS; part++) {
		double mean = ablation.mean[part][GNP_METHOD_FIT][GNP_FAMILY_RADIAL][GNP_REGIME_NOISE_70][GNP_SCORE_MEAN];
		if (part == GNP_ABLATION_WEIGHTS) { /* of which fit has none */
			CHECK(isnan(mean));
			continue;
		}
		CHECK(isfinite(mean) && (mean == gnp_table_mean(&table, &row, GNP_SCORE_MEAN)) == (part == GNP_ABLATION_NONE));
		CHECK(isnan(ablation.mean[part][GNP_METHOD_FIT][GNP_FAMILY_TOROIDAL][GNP_REGIME_NOISE_70][GNP_SCORE_MEAN]));
	}
	FILE *out = open_memstream(&text, &size);
	gnp_ablation_table_write_text(&ablation, out);
	gnp_ablation_table_write_markdown(&ablation, out);
	fclose(out);
	CHECK_CONTAINS(text, "radial    noise-70    trunk removed");
	CHECK_CONTAINS(text, "radial    clean-30    outputs constant");
	CHECK(isnan(ablation.mean[GNP_ABLATION_REMOVED][GNP_METHOD_FIT][GNP_FAMILY_RADIAL][GNP_REGIME_CLEAN_30][0]));
	CHECK_CONTAINS(text, "| radial   | noise-70   | outputs constant |");
	CHECK_CONTAINS(text, "| radial   | noise-70   | node weights one |              - |");
	free(text);
	gnp_table_clear(&table);
}

/* ---- The models ---- */

static const struct gnp_architecture with_trunk = {.trunk = GNP_TRUNK_EDGE,
                                                   .head = GNP_HEAD_PROJECTION,
                                                   .features = 4,
                                                   .width = 16,
                                                   .channels = 4,
                                                   .neurons = 16,
                                                   .layers = 2,
                                                   .quadrature = 16,
                                                   .head_width = 16,
                                                   .outputs = 11,
                                                   .shells = 3,
                                                   .shell = {60, 120, 240},
                                                   .ridge = 2e-5};
static const struct gnp_architecture without = {.trunk = GNP_TRUNK_NONE,
                                                .head = GNP_HEAD_PROJECTION,
                                                .head_width = 16,
                                                .outputs = 11,
                                                .shells = 3,
                                                .shell = {60, 120, 240},
                                                .ridge = 2e-5};
static const struct gnp_architecture pooled = {.trunk = GNP_TRUNK_SEPARABLE,
                                               .head = GNP_HEAD_POOLED,
                                               .features = 3,
                                               .width = 8,
                                               .channels = 2,
                                               .neurons = 4,
                                               .layers = 1,
                                               .quadrature = 8,
                                               .head_width = 8,
                                               .outputs = 16};

static const struct drawn {
	const char *name, *regime;
	const struct gnp_architecture *architecture;
} drawn[] = {{"fit_noise_70k", "noise", &with_trunk},
             {"fit_clean_30k", "clean", &without},
             {"fit_clean_50k", "clean", &without},
             {"clean_30k_pooled", "clean", &pooled}};
enum { DRAWN = sizeof drawn / sizeof *drawn };

static void path_of(const char *folder, size_t i, char path[128])
{
	snprintf(path, 128, "%s/%s.safetensors", folder, drawn[i].name);
}

static bool save(const char *folder, size_t i)
{
	struct gnp_layout layout;
	struct gnp_random random;
	char path[128];
	gnp_random_seed(&random, 11, i);
	if (gnp_architecture_layout(drawn[i].architecture, &layout, NULL) != GNP_OK)
		return false;
	float *parameters = malloc(layout.total * sizeof *parameters);
	for (size_t p = 0; p < layout.total; p++)
		parameters[p] = (float)(0.3 * gnp_random_normal(&random));
	const struct gnp_parameter_row *deviation = gnp_layout_find(&layout, "head.deviation");
	for (size_t p = 0; deviation && p < deviation->count; p++)
		parameters[deviation->offset + p] = 1;
	const struct gnp_model_source source = {.architecture = *drawn[i].architecture,
	                                        .recipe = {.k = 30, .buffer = 1.25, .height_scale = 2, .delta0_ratio = 0.1},
	                                        .regime = drawn[i].regime,
	                                        .parameters = parameters};
	path_of(folder, i, path);
	bool good = gnp_model_save(path, &source, NULL) == GNP_OK;
	free(parameters);
	return good;
}

/* Loads them from a folder that is gone afterwards. */
static bool draw_models(void)
{
	char folder[] = "/tmp/gnp-ablation-XXXXXX", path[128];
	bool good = mkdtemp(folder) != NULL;
	for (size_t i = 0; i < DRAWN && good; i++)
		good = save(folder, i);
	good = good && gnp_models_load(folder, &models, NULL) == GNP_OK;
	for (size_t i = 0; i < DRAWN; i++) {
		path_of(folder, i, path);
		unlink(path);
	}
	rmdir(folder);
	return good;
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(a_whole_model_stays_as_it_is),
		TEST(without_its_trunk_the_head_is_told_nothing_of_it),
		TEST(a_random_trunk_has_the_size_of_the_trained_one),
		TEST(constant_outputs_are_the_mean_ones),
		TEST(table_1_is_judged_with_every_part),
	};
	gnp_linalg_init();
	if (!draw_models() || gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int code = RUN_TESTS(tests);
	gnp_pool_free(pool);
	gnp_models_release(models);
	return code;
}
