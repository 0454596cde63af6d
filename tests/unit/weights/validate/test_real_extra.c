/* The real table beside the angles: details of estimators on exact bodies, the filter on samples, and how they are
 * written. */
#include <math.h>

#include "core/linear/linalg.h"
#include "tests/unit/weights/validate/drawn_model.h"
#include "weights/validate/real_body.h"
#include "weights/validate/real_extra.h"

static struct gnp_pool *pool; /* of two workers, for every test */

/* A drawn model that takes every point for near an edge and none for an outlier. */
static struct gnp_models *models;

static struct gnp_real_method method_of(const char *name)
{
	struct gnp_real_method methods[GNP_REAL_METHODS_MAX];
	size_t count = gnp_real_method_list(models, NULL, methods), c = 0;
	while (c < count && strcmp(methods[c].name, name) != 0)
		c++;
	CHECK(c < count);
	return methods[c];
}

/* ---- Details ---- */

static void error_bars_of_adaptive_are_counted_on_a_noisy_torus(void)
{
	const struct gnp_real_method adaptive = method_of("adaptive");
	struct gnp_real_cloud cloud;
	struct gnp_real_detail detail;
	CHECK(gnp_real_body_make(1, pool, &cloud, NULL) == GNP_OK); /* 2,000 points, noise 0.3 */
	CHECK(cloud.detailed && cloud.hardness == GNP_REAL_NOISE);
	CHECK(gnp_real_detail_judge(&adaptive, &cloud, 500, pool, &detail, NULL) == GNP_OK);
	CHECK(detail.centres == 500 && detail.far == 500 && detail.near == 0 && detail.flagged == 0);
	CHECK(detail.angle > 0.1 && detail.angle < 10);
	CHECK(detail.mean_curvature > 0.01 && detail.mean_curvature < 0.6 &&
	      detail.gaussian_curvature > detail.mean_curvature);
	for (int b = 0; b < GNP_REAL_BARS; b++)
		CHECK(detail.normals_within[b] > 100 && detail.curvature_within[b] > 100);
	CHECK(detail.normals_within[0] < detail.normals_within[1] &&
	      detail.curvature_within[0] < detail.curvature_within[1]);
	CHECK(gnp_real_detail_judge(&adaptive, &cloud, 0, pool, &detail, NULL) == GNP_OK &&
	      detail.centres == cloud.count);
	gnp_real_cloud_clear(&cloud);
}

/* The model takes all points for creases, which are flagged where something ends near them: those found are near ones
 * by the cloud's own distances. */
static void creases_are_those_within_a_spacing_of_an_edge(void)
{
	const struct gnp_real_method gnp = method_of("gnp"), gmls = method_of("gmls");
	struct gnp_real_body_name name;
	struct gnp_real_cloud cloud;
	struct gnp_real_detail detail;
	struct gnp_error error = {0};
	size_t i = 0, near = 0;
	while (gnp_real_body_name(i, &name) && strcmp(name.surface, "solid: box") != 0)
		i++;
	CHECK(gnp_real_body_make(i, pool, &cloud, NULL) == GNP_OK && cloud.edge && cloud.hardness == GNP_REAL_EDGES);
	cloud.count = 3000; /* of it the first, so that it is quick */
	for (size_t p = 0; p < 300; p++)
		near += cloud.edge[10 * p] <= 1;
	CHECK(gnp_real_detail_judge(&gnp, &cloud, 300, pool, &detail, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(near > 0 && near < 300 && detail.near == near);
	CHECK(detail.found <= near && 10 * detail.found >= 8 * near);
	CHECK(detail.flagged >= detail.found && detail.flagged < 300);
	CHECK(detail.far == 300 - near && isnan(detail.gaussian_curvature)); /* a box's sides are flat */
	CHECK(gnp_real_detail_judge(&gmls, &cloud, 300, pool, &detail, &error) ==
	      GNP_INVALID_ARGUMENT); /* it has no error bars */
	cloud.open = true;
	CHECK(gnp_real_detail_judge(&gnp, &cloud, 300, pool, &detail, NULL) == GNP_OK && detail.flagged == 0);
	gnp_real_cloud_clear(&cloud);
}

/* ---- Filter ---- */

/* What is far off is found before anything is fitted; the model itself drops nothing. */
static void planted_outliers_are_found_and_good_points_kept(void)
{
	struct gnp_real_cloud cloud;
	struct gnp_real_filtered filtered;
	struct gnp_error error = {0};
	CHECK(gnp_real_body_make(1, pool, &cloud, NULL) == GNP_OK);
	const struct gnp_real_planting none = {0, 0, 1}, far = {50, 5, 1};
	CHECK(gnp_real_filter_judge(&cloud, &none, models, pool, &filtered, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(filtered.good == cloud.count && filtered.dropped == 0 && filtered.outliers == 0 && filtered.found == 0);
	CHECK(gnp_real_filter_judge(&cloud, &far, models, pool, &filtered, NULL) == GNP_OK);
	CHECK(filtered.good > cloud.count * 85 / 100 && filtered.good < cloud.count * 95 / 100);
	CHECK(filtered.dropped * 100 <= filtered.good);
	CHECK(filtered.outliers > cloud.count / 20 && filtered.outliers < cloud.count - filtered.good);
	CHECK(filtered.found * 100 >= 95 * filtered.outliers);
	CHECK(gnp_real_filter_judge(&cloud, &none, NULL, pool, &filtered, &error) == GNP_UNAVAILABLE);
	CHECK_CONTAINS(error.text, "weights: ");
	CHECK(filtered.outliers > 0); /* what was there is unchanged */
	gnp_real_cloud_clear(&cloud);
}

/* ---- Writing ---- */

static struct gnp_real_table small_table(void)
{
	static const struct gnp_real_detail details[] = {
		{.centres = 100,
	     .near = 40,
	     .flagged = 50,
	     .found = 30,
	     .far = 60,
	     .angle = 2,
	     .mean_curvature = 0.5,
	     .gaussian_curvature = NAN,
	     .normals_within = {30, 54},
	     .curvature_within = {45, 60}},
		{.centres = 50,
	     .near = 0,
	     .flagged = 10,
	     .found = 0,
	     .far = 50,
	     .angle = 4,
	     .mean_curvature = 0.25,
	     .gaussian_curvature = 0.125,
	     .normals_within = {20, 50},
	     .curvature_within = {10, 20}},
	};
	static const struct gnp_real_filter_row filters[] = {{"one", "clean", 0, {1000, 10, 0, 0}},
	                                                     {"two", "clean", 0, {1000, 30, 0, 0}},
	                                                     {"one", "clean", 0.02, {900, 9, 100, 98}}};
	struct gnp_real_table table = {.plan = gnp_real_plan_full()};
	for (int r = 0; r < 2; r++) {
		struct gnp_real_row *row = gnp_real_table_add(&table);
		row->section = GNP_REAL_BODIES;
		row->hardness = r ? GNP_REAL_UNEVEN : GNP_REAL_EDGES;
		row->details[GNP_REAL_DETAIL_GNP] = details[r];
		snprintf(row->cloud, sizeof row->cloud, "body %d", r);
	}
	for (int f = 0; f < 3; f++)
		*gnp_real_table_add_filter(&table) = filters[f];
	return table;
}

static void kinds_are_summed(void)
{
	struct gnp_real_table table = small_table();
	const struct gnp_real_detail edges = gnp_real_extra_sum(&table, GNP_REAL_DETAIL_GNP, GNP_REAL_EDGES);
	const struct gnp_real_detail all = gnp_real_extra_sum(&table, GNP_REAL_DETAIL_GNP, GNP_REAL_HARDNESSES);
	CHECK(edges.centres == 100 && edges.found == 30 && edges.normals_within[1] == 54);
	CHECK(all.centres == 150 && all.near == 40 && all.flagged == 60 && all.far == 110 &&
	      all.curvature_within[0] == 55);
	CHECK_NEAR(all.angle, 3, 1e-12);
	CHECK_NEAR(all.mean_curvature, 0.375, 1e-12);
	CHECK_NEAR(all.gaussian_curvature, 0.125, 1e-12); /* of the one that has it */
	CHECK(gnp_real_extra_sum(&table, GNP_REAL_DETAIL_ADAPTIVE, GNP_REAL_HARDNESSES).centres == 0);
	gnp_real_table_clear(&table);
}

static void the_tables_are_written_three_ways(void)
{
	struct gnp_real_table table = small_table(), empty = {.plan = gnp_real_plan_full()};
	char *text = NULL;
	size_t size = 0;
	FILE *out = open_memstream(&text, &size);
	gnp_real_extra_write_text(&table, out);
	gnp_real_table_write_markdown(&table, out);
	gnp_real_table_write_json(&table, out);
	fclose(out);
	CHECK_CONTAINS(text, "body 0                                       40.0       60.0       75.0       33.3       "
	                     "2.00   5.00e-01          -");
	CHECK_CONTAINS(
		text,
		"| all clouds         |                    |      26.7 |      50.0 |      75.0 |      27.3 |      3.00 |");
	CHECK_CONTAINS(
		text,
		"| gnp                | edges              |        60 |      50.0 |      90.0 |      75.0 |     100.0 |");
	CHECK_CONTAINS(
		text,
		"| clean              | none               |         2 |      2.00 |      3.00 |         - |         - |");
	CHECK_CONTAINS(
		text,
		"| clean              | 10 % by 0.02       |         1 |      1.00 |      1.00 |      98.0 |      98.0 |");
	CHECK_CONTAINS(text, "\"kind\": \"uneven\", \"method\": \"gnp\", \"centres\": 50, \"near\": 0, \"flagged\": 10");
	CHECK_CONTAINS(text, "\"planted\": 0.02, \"good\": 900, \"dropped\": 9, \"outliers\": 100, \"found\": 98}");
	free(text);
	text = NULL;
	out = open_memstream(&text, &size);
	gnp_real_extra_write_markdown(&empty, out);
	fclose(out);
	CHECK_STRING(text, "");
	free(text);
	gnp_real_table_clear(&table);
}

/* ---- The model ---- */

static void fix_judgements(const struct gnp_layout *layout, float *parameters)
{
	const struct gnp_parameter_row *weight = gnp_layout_find(layout, "head.4.weight");
	float *outputs = parameters + gnp_layout_find(layout, "head.4.bias")->offset;
	memset(parameters + weight->offset, 0, weight->count * sizeof *parameters);
	outputs[GNP_WEIGHTED_CREASE] = 10;
	outputs[GNP_WEIGHTED_OUTLIER] = -10;
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(error_bars_of_adaptive_are_counted_on_a_noisy_torus),
		TEST(creases_are_those_within_a_spacing_of_an_edge),
		TEST(planted_outliers_are_found_and_good_points_kept),
		TEST(kinds_are_summed),
		TEST(the_tables_are_written_three_ways),
	};
	gnp_linalg_init();
	if (!drawn_model_load(fix_judgements, &models) || gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int code = RUN_TESTS(tests);
	gnp_pool_free(pool);
	gnp_models_release(models);
	return code;
}
