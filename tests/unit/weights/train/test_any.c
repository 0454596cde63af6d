/* What the model for every cloud is trained on: clouds, supports, truth in a support's frame, labels of its nodes. */
#include "core/base/vector.h"
#include "core/linear/linalg.h"
#include "core/network/frame_choice.h"
#include "tests/unit/weights/train/any_scene.h"
#include "weights/train/any/any_supports.h"
#include "weights/train/any/any_truth.h"

static struct gnp_scratch *scratch;

/* ---- Clouds ---- */

/* Exact normals lie at the points they belong to: those estimated without noise are near them. */
static void truth_follows_the_curve(void)
{
	const struct gnp_any_recipe recipe = recipe_of(GNP_ANY_RADIAL, 0);
	struct gnp_any_cloud cloud = make_cloud(&recipe, 4);
	double sum = 0;
	for (size_t i = 0; i < cloud.count; i++) {
		CHECK(cloud.piece[i] == 0 && isinf(cloud.edge[i]) && !cloud.outlier[i]);
		sum += fabs(gnp_dot(cloud.normals + 3 * i, cloud.prepared.normals + 3 * i));
	}
	CHECK(!cloud.given && cloud.count == POINTS);
	CHECK_AT_MOST(1 - sum / POINTS, 0.03);
	gnp_any_cloud_clear(&cloud);
}

static void groups_hold_their_kinds(void)
{
	struct gnp_random random;
	int faceted = 0;
	gnp_random_seed(&random, 1, 0);
	for (int i = 0; i < 24; i++) {
		enum gnp_any_group group = (enum gnp_any_group)(i % GNP_ANY_GROUPS);
		struct gnp_any_surface surface;
		CHECK(gnp_any_surface_draw(group, 500, &random, pool, &surface, NULL) == GNP_OK);
		bool rough = strncmp(surface.name, "rough ", 6) == 0, facets = strncmp(surface.name, "facets ", 7) == 0;
		CHECK(surface.count == 500 && surface.spacing > 0 && surface.faceted == facets);
		CHECK((rough || facets) == (group == GNP_ANY_ROUGH));
		CHECK((strncmp(surface.name, "radial ", 7) == 0) == (group == GNP_ANY_RADIAL));
		faceted += facets;
		gnp_any_surface_clear(&surface);
	}
	CHECK(faceted > 0 && faceted < 8); /* of the 8 that are rough */
}

/* Displacement of caller's point i from the cloud without noise, which is the same otherwise. */
static void displacements(const struct gnp_any_cloud *from, const struct gnp_any_cloud *to, double *moved,
                          double *normals)
{
	for (size_t i = 0; i < to->count; i++) {
		memcpy(moved + 3 * to->prepared.order[i], to->prepared.points + 3 * i, 3 * sizeof *moved);
		memcpy(normals + 3 * to->prepared.order[i], to->normals + 3 * i, 3 * sizeof *normals);
	}
	for (size_t i = 0; i < from->count; i++)
		for (size_t c = 0; c < 3; c++)
			moved[3 * from->prepared.order[i] + c] -= from->prepared.points[3 * i + c];
}

/* Root mean square of what is moved, and of its part across the normals. */
static void measure(const double *moved, const double *normals, double *whole, double *across)
{
	*whole = *across = 0;
	for (size_t i = 0; i < POINTS; i++) {
		const double *d = moved + 3 * i;
		double along = gnp_dot(d, normals + 3 * i), square = gnp_dot(d, d);
		*whole += square / POINTS;
		*across += (square - along * along) / POINTS;
	}
	*whole = sqrt(*whole);
	*across = sqrt(fmax(*across, 0));
}

static void noise_is_isotropic_or_along_normals(void)
{
	struct gnp_any_recipe recipe = recipe_of(GNP_ANY_RADIAL, 0);
	struct gnp_any_cloud clean = make_cloud(&recipe, 9);
	double *moved = malloc(3 * POINTS * sizeof *moved), *normals = malloc(3 * POINTS * sizeof *normals);
	double isotropic, along, across;
	recipe.noise = 1;
	struct gnp_any_cloud noisy = make_cloud(&recipe, 9);
	displacements(&clean, &noisy, moved, normals);
	measure(moved, normals, &isotropic, &across);
	CHECK_NEAR(across / isotropic, sqrt(2.0 / 3), 0.02);
	recipe.normal_noise = 1;
	struct gnp_any_cloud thick = make_cloud(&recipe, 9);
	displacements(&clean, &thick, moved, normals);
	measure(moved, normals, &along, &across);
	CHECK_NEAR(along / isotropic, sqrt(1.0 / 3), 0.02);
	CHECK_AT_MOST(across, 1e-7 * along);
	gnp_any_cloud_clear(&clean);
	gnp_any_cloud_clear(&noisy);
	gnp_any_cloud_clear(&thick);
	free(moved);
	free(normals);
}

static void outliers_and_normals_come_as_asked(void)
{
	struct gnp_any_recipe recipe = recipe_of(GNP_ANY_SOLID, 0.1);
	recipe.outliers = 0.2;
	recipe.given = 1;
	struct gnp_any_cloud cloud = make_cloud(&recipe, 2);
	size_t outliers = 0;
	double least = 1;
	for (size_t i = 0; i < cloud.count; i++) {
		outliers += cloud.outlier[i];
		least = fmin(least, gnp_dot(cloud.normals + 3 * i, cloud.prepared.normals + 3 * i));
	}
	CHECK(cloud.given);
	CHECK_NEAR((double)outliers / POINTS, 0.2, 0.04);
	CHECK(least > 0.3); /* tilted by 0.2 at most, so none is turned over */
	gnp_any_cloud_clear(&cloud);
}

static void clouds_do_not_depend_on_workers(void)
{
	struct gnp_pool *three, *keep = pool;
	struct gnp_any_recipe recipe = gnp_any_recipe_defaults();
	recipe.least = recipe.most = POINTS;
	CHECK(gnp_pool_create(3, &three, NULL) == GNP_OK);
	for (uint64_t seed = 0; seed < 6; seed++) {
		struct gnp_any_cloud a = make_cloud(&recipe, seed);
		pool = three;
		struct gnp_any_cloud b = make_cloud(&recipe, seed);
		pool = keep;
		CHECK(a.count == b.count && a.noise == b.noise && a.given == b.given);
		CHECK(memcmp(a.prepared.points, b.prepared.points, 3 * a.count * sizeof(double)) == 0);
		CHECK(memcmp(a.prepared.normals, b.prepared.normals, 3 * a.count * sizeof(double)) == 0);
		CHECK(memcmp(a.second_form, b.second_form, 9 * a.count * sizeof(double)) == 0);
		gnp_any_cloud_clear(&a);
		gnp_any_cloud_clear(&b);
	}
	gnp_pool_free(three);
}

static void rare_centres_are_near_creases_or_outliers(void)
{
	enum { COUNT = 2000 };
	struct gnp_any_recipe recipe = recipe_of(GNP_ANY_SOLID, 0);
	recipe.outliers = 0.2;
	struct gnp_any_cloud cloud = make_cloud(&recipe, 6);
	uint32_t centres[COUNT];
	size_t near[2] = {0}, outliers[2] = {0};
	struct gnp_random random;
	gnp_random_seed(&random, 1, 0);
	for (int rare = 0; rare < 2; rare++) {
		gnp_any_supports_centres(&cloud, rare, COUNT, &random, centres);
		for (size_t i = 0; i < COUNT; i++) {
			near[rare] += !cloud.outlier[centres[i]] && cloud.edge[centres[i]] < 2.5;
			outliers[rare] += cloud.outlier[centres[i]] != GNP_ANY_GOOD;
		}
	}
	CHECK(outliers[0] == 0);
	CHECK_NEAR((double)outliers[1] / COUNT, 0.15, 0.03);
	CHECK(near[0] > 0 && near[0] < 0.9 * COUNT); /* else this cloud shows nothing */
	CHECK_NEAR((double)near[1] / COUNT, 0.85 * (0.2 + 0.8 * (double)near[0] / COUNT), 0.04);
	gnp_any_cloud_clear(&cloud);
}

static void supports_are_those_of_their_centres(void)
{
	enum { COUNT = 12 };
	struct gnp_any_recipe recipe = recipe_of(GNP_ANY_RADIAL, 1);
	struct gnp_any_cloud cloud = make_cloud(&recipe, 6);
	struct gnp_network *network = make_network();
	const struct gnp_support *supports[COUNT];
	const struct gnp_any_cloud *clouds[COUNT];
	struct gnp_any_views views;
	uint32_t centres[COUNT];
	size_t made = 0;
	struct gnp_random random;
	gnp_random_seed(&random, 1, 0);
	gnp_any_supports_centres(&cloud, false, COUNT, &random, centres);
	CHECK(gnp_any_supports_build(&cloud, network, centres, COUNT, &random, scratch, supports, clouds, &made, NULL) ==
	      GNP_OK);
	CHECK(gnp_any_supports_look(&cloud, centres, COUNT, scratch, &views, NULL) == GNP_OK);
	CHECK(made == COUNT);
	for (size_t i = 0; i < made; i++) {
		unsigned step = gnp_frame_choose(network, &views.ladders[i]);
		CHECK(clouds[i] == &cloud && supports[i]->centre == centres[i] && supports[i]->step == step);
		CHECK(supports[i]->points == gnp_support_reach(step) && supports[i]->member[0] == centres[i]);
	}
	gnp_network_free(network);
	gnp_any_cloud_clear(&cloud);
}

/* ---- Truth ---- */

static const double identity[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const double below[3][3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}};

static struct gnp_any_truth truth_of(const double normal[3], const double form[9], const double frame[3][3],
                                     bool faceted)
{
	static struct gnp_support support;
	double n[3], s[9];
	struct gnp_any_cloud cloud = {.normals = n, .second_form = s, .faceted = faceted};
	struct gnp_any_truth truth;
	memcpy(n, normal, sizeof n);
	memcpy(s, form, sizeof s);
	memcpy(support.frame, frame, sizeof support.frame);
	support.radius = 0.5;
	gnp_any_truth_find(&cloud, &support, &truth);
	return truth;
}

/* h = sqrt(r^2 - x^2 - y^2) at (x, 0): h_xx = -1 / h - x^2 / h^3, h_yy = -1 / h; seen from below, the other sign. */
static void sphere_has_its_normal_and_hessian(void)
{
	const double r = 2, x = 1.2, h = 1.6, normal[3] = {x / r, 0, h / r};
	double form[9];
	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++)
			form[3 * a + b] = -((a == b) - normal[a] * normal[b]) / r;
	struct gnp_any_truth above = truth_of(normal, form, identity, false), under = truth_of(normal, form, below, false);
	CHECK(above.curved && under.curved);
	CHECK_NEAR(above.normal[0], 0.6, 1e-12);
	CHECK_NEAR(above.normal[2], 0.8, 1e-12);
	CHECK_NEAR(above.hessian[0], -0.5 * (1 / h + x * x / (h * h * h)), 1e-12);
	CHECK_NEAR(above.hessian[1], 0, 1e-12);
	CHECK_NEAR(above.hessian[2], -0.5 / h, 1e-12);
	CHECK_NEAR(under.normal[0], -0.6, 1e-12);
	CHECK_NEAR(under.normal[2], 0.8, 1e-12);
	CHECK_NEAR(under.hessian[0], -above.hessian[0], 1e-12);
	CHECK_NEAR(under.hessian[2], -above.hessian[2], 1e-12);
}

static void plane_is_flat_and_its_edge_on_view_no_graph(void)
{
	const double flat[9] = {0}, tilted[3] = {0.6, 0, 0.8}, steep[3] = {0.99, 0, 0.14};
	struct gnp_any_truth truth = truth_of(tilted, flat, identity, false);
	CHECK(truth.curved && truth.hessian[0] == 0 && truth.hessian[1] == 0 && truth.hessian[2] == 0);
	CHECK_NEAR(truth.normal[0], 0.6, 1e-12);
	CHECK(!truth_of(steep, flat, identity, false).curved);
	CHECK(!truth_of(tilted, flat, identity, true).curved);
}

static void nodes_are_strange_by_share(void)
{
	static struct gnp_support support;
	uint32_t piece[6] = {7, 7, 8, 7, 7, 8};
	unsigned char outlier[6] = {0, 0, 0, 1, 0, 1};
	const struct gnp_any_cloud cloud = {.piece = piece, .outlier = outlier};
	const uint16_t start[4] = {0, 1, 4, 6};
	const uint32_t member[6] = {0, 1, 2, 3, 5, 4};
	double strange[3];
	support.nodes = 3;
	memcpy(support.start, start, sizeof start);
	memcpy(support.member, member, sizeof member);
	gnp_any_truth_label(&cloud, &support, strange);
	CHECK_NEAR(strange[0], 0, 0);
	CHECK_NEAR(strange[1], 2.0 / 3, 1e-15);
	CHECK_NEAR(strange[2], 0.5, 1e-15);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(truth_follows_the_curve),
		TEST(groups_hold_their_kinds),
		TEST(noise_is_isotropic_or_along_normals),
		TEST(outliers_and_normals_come_as_asked),
		TEST(clouds_do_not_depend_on_workers),
		TEST(rare_centres_are_near_creases_or_outliers),
		TEST(supports_are_those_of_their_centres),
		TEST(sphere_has_its_normal_and_hessian),
		TEST(plane_is_flat_and_its_edge_on_view_no_graph),
		TEST(nodes_are_strange_by_share),
	};
	gnp_linalg_init();
	scratch = gnp_scratch_create();
	if (!scratch || gnp_pool_create(1, &pool, NULL) != GNP_OK)
		return 1;
	int result = RUN_TESTS(tests);
	gnp_pool_free(pool);
	gnp_scratch_free(scratch);
	return result;
}
