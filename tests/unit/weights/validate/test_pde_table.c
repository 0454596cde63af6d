#include "weights/validate/pde/pde_table_write.h"

#include "core/equations/poisson.h"
#include "core/linear/linalg.h"
#include "tests/unit/test.h"
#include "weights/validate/pde/pde_truth.h"

static struct gnp_pool *pool;

/* The integral of Delta u over a closed surface is zero, and of u Delta u it is minus the energy: below zero. */
static void sources_are_laplacians(void)
{
	enum { N = 8000, COLUMNS = 3 };
	static const char *const names[] = {"sphere", "torus", "genus2"};
	for (size_t shape = 0; shape < 3; shape++) {
		struct gnp_shape *made;
		struct gnp_sample sample;
		double *value = malloc(N * COLUMNS * sizeof *value), *source = malloc(N * COLUMNS * sizeof *source);
		CHECK(gnp_shape_create(names[shape], 1, 0, &made, NULL) == GNP_OK);
		CHECK(gnp_sample_create(made, &(struct gnp_sample_options){.count = N, .seed = 5}, pool, NULL, &sample, NULL) == GNP_OK);
		CHECK(gnp_pde_truth(&sample, 7, COLUMNS, pool, NULL, value, source, NULL) == GNP_OK);
		for (size_t s = 0; s < COLUMNS; s++) {
			double sum = 0, square = 0, energy = 0;
			for (size_t i = 0; i < N; i++) {
				sum += source[i * COLUMNS + s] / N;
				square += source[i * COLUMNS + s] * source[i * COLUMNS + s] / N;
				energy += value[i * COLUMNS + s] * source[i * COLUMNS + s] / N;
			}
			CHECK_NEAR(sum / sqrt(square), 0, 0.02);
			CHECK(energy > 0);
		}
		CHECK(value[0] != value[1] && source[0] != source[1]);
		gnp_sample_clear(&sample);
		gnp_shape_free(made);
		free(value);
		free(source);
	}
}

static void table_is_filled_and_written(void)
{
	struct gnp_models *models;
	struct gnp_error error = {0};
	static struct gnp_pde_table table;
	const struct gnp_pde_plan plan = {.points = 4000, .solutions = 1, .regimes = 1u << GNP_REGIME_CLEAN_50, .sizes_most = 10000};
	char *text = NULL;
	size_t size = 0;
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK); /* tests run in the repository's root */
	CHECK(gnp_pde_table_run(&plan, models, pool, NULL, NULL, &table, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK_AT_MOST(table.cell[2][GNP_REGIME_CLEAN_50][0][0].error, 0.15); /* genus 2, gnp, square: 7e-4 at 20,000 points */
	CHECK(isnan(table.cell[2][GNP_REGIME_NOISE_70][0][0].error));
	CHECK(table.sizes[1] == 10000 && table.sizes[2] == 0 && table.convergence[1] < table.convergence[0] / 3);
	CHECK(table.condition[0] > 100 && table.condition[1] / table.condition[0] > 1.5 && table.condition[1] / table.condition[0] < 3); /* as 1 / h^2 */
	FILE *out = open_memstream(&text, &size);
	gnp_pde_table_write_markdown(&table, out);
	gnp_pde_table_write_text(&table, out);
	fclose(out);
	CHECK_CONTAINS(text, "| clean-50   | gnp      | the paper's   | 8.49e-02 | 1.26e-02 | 3.86e-02 | 9.93e-02 |");
	CHECK_CONTAINS(text, "| noise-70   | adaptive | square        |        - |");
	CHECK_CONTAINS(text, "Delta u = -f on 4000 points");
	free(text);
	gnp_models_release(models);
}

static void a_missing_model_is_named(void)
{
	static struct gnp_pde_table table;
	struct gnp_error error = {0};
	const struct gnp_pde_plan plan = {.points = 1000, .solutions = 1, .regimes = 1, .sizes_most = 0};
	CHECK(gnp_pde_table_run(&plan, NULL, pool, NULL, NULL, &table, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "gnp in clean-30: none of the 0 models is for any cloud (head weighted)");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(sources_are_laplacians), TEST(table_is_filled_and_written), TEST(a_missing_model_is_named)};
	gnp_linalg_init();
	CHECK(gnp_pool_create(0, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
