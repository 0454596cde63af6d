/* One fit on view: which points of a box count in the surface at a point of it. */
#include "core/base/random.h"
#include "core/estimate/patch_view.h"
#include "core/model/models.h"
#include "tests/unit/test.h"

enum { COUNT = 8000 };

static struct gnp_pool *pool;
static struct gnp_models *models; /* the shipped ones; tests run in the repository's root */

static struct gnp_estimate_options defaults(void)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	options.estimator = GNP_ESTIMATOR_GNP;
	options.models = models;
	return options;
}

/* Two faces of a box that meet along x = z = 0: the first half lies in z = 0 with x < 0, the other in x = 0 with z < 0;
 * |y| < 1. */
static void make_edge(double *points)
{
	struct gnp_random random;
	gnp_random_seed(&random, 12, 0);
	for (size_t i = 0; i < COUNT; i++) {
		double across = -gnp_random_uniform(&random), along = 2 * gnp_random_uniform(&random) - 1;
		points[3 * i] = i < COUNT / 2 ? across : 0;
		points[3 * i + 1] = along;
		points[3 * i + 2] = i < COUNT / 2 ? 0 : across;
	}
}

/* The point of the first face that is nearest to (x, 0, 0). */
static size_t nearest_to(const double *points, double x)
{
	size_t best = 0;
	for (size_t i = 0; i < COUNT / 2; i++)
		if (hypot(points[3 * i] - x, points[3 * i + 1]) < hypot(points[3 * best] - x, points[3 * best + 1]))
			best = i;
	return best;
}

static void the_other_face_does_not_count(void)
{
	static double points[3 * COUNT];
	struct gnp_patch_view view;
	make_edge(points);
	struct gnp_estimate_options options = defaults();
	size_t at = nearest_to(points, -0.06); /* four spacings from the edge */
	double own = 0, other = 0, highest = 0;
	const struct gnp_cloud cloud = {COUNT, points, NULL};
	CHECK(gnp_patch_view_make(&cloud, &options, at, pool, NULL, &view, NULL) == GNP_OK);
	CHECK(view.count == COUNT && view.model && view.normals_estimated && !view.crease && !view.outlier);
	CHECK_NEAR(fabs(view.normal[2]), 1, 1e-4);
	CHECK(view.scale > 0 && view.scale < view.radius && view.points >= 144);
	size_t within = 0;
	for (size_t i = 0; i < COUNT; i++) {
		const double *p = points + 3 * i, *c = points + 3 * at;
		double far = hypot(hypot(p[0] - c[0], p[1] - c[1]), p[2] - c[2]);
		CHECK(view.weight[i] >= 0 && view.weight[i] <= 1);
		CHECK((view.weight[i] == 0) == (far > view.radius * (1 + 1e-12)));
		CHECK(view.weight[i] > 0 || view.height[i] == 0);
		within += far <= view.radius * (1 + 1e-12);
		*(i < COUNT / 2 ? &own : &other) += view.weight[i];
		if (i < COUNT / 2 && view.weight[i] > 0.1)
			highest = fmax(highest, fabs(view.height[i]));
	}
	CHECK(within == view.points);
	CHECK(own > 20 && other < 0.02 * own);
	CHECK_AT_MOST(highest, 1e-3);
	gnp_patch_view_clear(&view);
}

static void what_cannot_be_shown_is_refused(void)
{
	static double points[3 * COUNT];
	struct gnp_patch_view view = {.count = 7};
	struct gnp_error first = {0}, second = {0}, third = {0};
	make_edge(points);
	struct gnp_estimate_options options = defaults();
	const struct gnp_cloud cloud = {COUNT, points, NULL};
	CHECK(gnp_patch_view_make(&cloud, &options, COUNT, pool, NULL, &view, &first) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(first.text, "at: got 8000, need at most 7999");
	options.estimator = GNP_ESTIMATOR_ADAPTIVE;
	CHECK(gnp_patch_view_make(&cloud, &options, 0, pool, NULL, &view, &second) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(second.text, "adaptive, which gives points no weights");
	options = defaults();
	CHECK(gnp_models_find(models, "fit_clean_30k", &options.model, NULL) == GNP_OK);
	CHECK(gnp_patch_view_make(&cloud, &options, 0, pool, NULL, &view, &third) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(third.text, "fit_clean_30k");
	CHECK(view.count == 7);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(the_other_face_does_not_count),
		TEST(what_cannot_be_shown_is_refused),
	};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return failed;
}
