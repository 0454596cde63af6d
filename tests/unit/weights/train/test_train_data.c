#include <unistd.h>

#include "core/base/vector.h"
#include "tests/unit/test.h"
#include "weights/train/train_patches.h"
#include "weights/train/train_window.h"

enum { POINTS = 4000, SHAPES = 5, PATCHES = 24 };

static struct gnp_pool *pool; /* of two workers, for every test */
static char folder[64];

static struct gnp_train_data data_of(enum gnp_regime regime)
{
	return (struct gnp_train_data){.folder = folder, .shapes = SHAPES, .points = POINTS, .regime = regime, .seed = 7};
}

static struct gnp_train_cloud cloud_of(enum gnp_regime regime, uint64_t visit)
{
	struct gnp_train_data data = data_of(regime);
	struct gnp_train_cloud cloud;
	struct gnp_error error = {0};
	if (gnp_train_data_enter(&data, visit, pool, &cloud, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return cloud;
}

static bool same_shape(const struct gnp_train_shape *a, const struct gnp_train_shape *b)
{
	return a->count == b->count && memcmp(a->exact, b->exact, 24 * a->count) == 0 &&
	       memcmp(a->normals, b->normals, 12 * a->count) == 0 && memcmp(a->second_form, b->second_form, 24 * a->count) == 0;
}

static void path_of(const struct gnp_train_shape_key *key, char *path, size_t size)
{
	snprintf(path, size, "%s/radial-%llu-L%u-%zu.shape", folder, (unsigned long long)key->seed, key->degree, key->points);
}

static void damage(const char *path, long at)
{
	FILE *file = fopen(path, "r+b");
	CHECK(file && fseek(file, at, SEEK_SET) == 0 && fputc('!', file) != EOF);
	if (file)
		fclose(file);
}

static void shapes_are_read_back_and_made_anew_when_damaged(void)
{
	const struct gnp_train_shape_key key = {.seed = 91, .degree = 6, .points = POINTS};
	struct gnp_train_shape made, read;
	char path[160];
	path_of(&key, path, sizeof path);
	CHECK(gnp_train_shape_load(folder, &key, pool, NULL, &made, NULL) == GNP_OK);
	const long places[] = {17, 60, 100000};
	for (size_t i = 0; i < 4; i++) {
		CHECK(gnp_train_shape_load(folder, &key, pool, NULL, &read, NULL) == GNP_OK);
		CHECK(same_shape(&made, &read));
		gnp_train_shape_clear(&read);
		if (i < 3)
			damage(path, places[i]);
	}
	CHECK(truncate(path, 5000) == 0);
	CHECK(gnp_train_shape_ensure(folder, &key, pool, NULL, NULL) == GNP_OK);
	CHECK(gnp_train_shape_load(folder, &key, pool, NULL, &read, NULL) == GNP_OK);
	CHECK(same_shape(&made, &read));
	gnp_train_shape_clear(&read);
	gnp_train_shape_clear(&made);
}

static void a_folder_that_cannot_be_made_is_named(void)
{
	const struct gnp_train_shape_key key = {.seed = 1, .degree = 3, .points = 500};
	struct gnp_train_shape shape;
	struct gnp_error error = {0};
	CHECK(gnp_train_shape_load("/proc/none", &key, pool, NULL, &shape, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "/proc/none: cannot make the folder");
}

static void an_epoch_visits_every_shape_and_each_visit_has_its_noise(void)
{
	struct gnp_train_data data = data_of(GNP_REGIME_NOISE_70);
	uint64_t noise[2 * SHAPES];
	for (int epoch = 0; epoch < 2; epoch++) {
		unsigned seen = 0;
		for (uint64_t turn = 0; turn < SHAPES; turn++) {
			struct gnp_train_visit visit;
			CHECK(gnp_train_data_visit(&data, (uint64_t)epoch * SHAPES + turn, &visit, NULL) == GNP_OK);
			CHECK(visit.key.seed < SHAPES && visit.key.degree == gnp_radial_degree(visit.key.seed));
			CHECK(gnp_seed_check_training(visit.noise_seed, NULL) == GNP_OK);
			seen |= 1u << visit.key.seed;
			noise[(uint64_t)epoch * SHAPES + turn] = visit.noise_seed;
		}
		CHECK(seen == (1u << SHAPES) - 1);
	}
	for (int i = 0; i < 2 * SHAPES; i++)
		for (int j = 0; j < i; j++)
			CHECK(noise[i] != noise[j]);
}

static void watched_shapes_are_none_of_training(void)
{
	struct gnp_train_data data = data_of(GNP_REGIME_CLEAN_30);
	struct gnp_train_cloud watched;
	CHECK(gnp_train_data_watch(&data, 1, pool, &watched, NULL) == GNP_OK);
	for (uint64_t visit = 0; visit < SHAPES; visit++) {
		struct gnp_train_cloud cloud = cloud_of(GNP_REGIME_CLEAN_30, visit);
		CHECK(!same_shape(&watched.shape, &cloud.shape));
		gnp_train_cloud_clear(&cloud);
	}
	gnp_train_cloud_clear(&watched);
}

static void outliers_follow_the_regime(void)
{
	struct gnp_train_cloud cloud = cloud_of(GNP_REGIME_OUTLIER_50, 3);
	size_t outliers = 0;
	for (size_t i = 0; i < POINTS; i++) {
		size_t point = cloud.prepared.order[i];
		double moved = 0;
		for (int c = 0; c < 3; c++)
			moved = fmax(moved, fabs(cloud.prepared.points[3 * i + c] - cloud.shape.exact[3 * point + c]));
		CHECK((moved > 0) == cloud.outlier[i]);
		outliers += cloud.outlier[i];
	}
	CHECK(outliers == POINTS / 10);
	gnp_train_cloud_clear(&cloud);
}

static struct gnp_train_patches draw(const struct gnp_train_cloud *cloud, size_t k, double buffer, uint64_t seed,
                                     struct gnp_scratch *scratch)
{
	const struct gnp_train_recipe recipe = {.k = k, .delta0_ratio = 0.1, .buffer = buffer};
	struct gnp_train_patches patches;
	struct gnp_random random;
	struct gnp_error error = {0};
	gnp_random_seed(&random, seed, 0);
	if (gnp_train_patches_draw(cloud, &recipe, PATCHES, &random, scratch, &patches, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return patches;
}

/* The curvatures of the truth's jets are those the shape was sampled with, and the places are those of clean points. */
static void truth_is_the_geometry_of_the_surface(void)
{
	struct gnp_train_cloud cloud = cloud_of(GNP_REGIME_CLEAN_30, 2);
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_train_patches patches = draw(&cloud, 30, 1.5, 1, scratch);
	for (size_t p = 0; p < patches.count; p++) {
		const struct gnp_patch *patch = &patches.patches[p];
		size_t from = patches.truth_start[p], count = patches.truth_start[p + 1] - from;
		CHECK(count == patch->count && patches.inner[p] == count);
		for (size_t i = 0; i < count; i++) {
			const struct gnp_truth *truth = &patches.truth[from + i];
			const float *s = cloud.shape.second_form + 6 * cloud.prepared.order[patch->index[i]];
			const float *node = patches.nodes + 3 * (patches.start[p] + i);
			double g = 1 + truth->jet.u * truth->jet.u + truth->jet.v * truth->jet.v, trace = s[0] + s[3] + s[5];
			double square = s[0] * s[0] + s[3] * s[3] + s[5] * s[5] + 2 * (s[1] * s[1] + s[2] * s[2] + s[4] * s[4]);
			double mean = ((1 + truth->jet.v * truth->jet.v) * truth->jet.uu - 2 * truth->jet.u * truth->jet.v * truth->jet.uv +
			               (1 + truth->jet.u * truth->jet.u) * truth->jet.vv) / (2 * pow(g, 1.5));
			double gaussian = (truth->jet.uu * truth->jet.vv - truth->jet.uv * truth->jet.uv) / (g * g);
			CHECK_NEAR(mean, trace / 2, 1e-4);
			CHECK_NEAR(gaussian, (trace * trace - square) / 2, 1e-3);
			CHECK_NEAR(truth->u, node[0], 1e-6);
			CHECK_NEAR(truth->v, node[1], 1e-6);
			CHECK_NEAR(truth->jet.f / patch->scale_w, node[2], 1e-5);
		}
	}
	gnp_scratch_free(scratch);
	gnp_train_cloud_clear(&cloud);
}

/* Heights, slopes and Hessian belong together: neighbours' heights follow from a point's jet to third order. */
static void truth_of_neighbours_is_one_surface(void)
{
	const struct gnp_train_shape_key key = {.seed = 92, .degree = 3, .points = 30000};
	struct gnp_train_shape shape;
	struct gnp_train_cloud cloud;
	CHECK(gnp_train_shape_load(folder, &key, pool, NULL, &shape, NULL) == GNP_OK);
	CHECK(gnp_train_cloud_enter_take(&shape, GNP_REGIME_NOISE_70, 1e-3, 5, pool, &cloud, NULL) == GNP_OK);
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_train_patches patches = draw(&cloud, 30, 1, 1, scratch);
	double error = 0, size = 0;
	for (size_t p = 0; p < patches.count; p++) {
		double scale = patches.patches[p].scale_xy;
		const struct gnp_truth *truth = patches.truth + patches.truth_start[p];
		for (size_t i = 1; i < 6; i++) {
			double du = scale * (truth[i].u - truth[0].u), dv = scale * (truth[i].v - truth[0].v);
			struct gnp_jet jet = truth[0].jet;
			double taylor = jet.f + jet.u * du + jet.v * dv + jet.uu * du * du / 2 + jet.uv * du * dv + jet.vv * dv * dv / 2;
			error += (taylor - truth[i].jet.f) * (taylor - truth[i].jet.f);
			size += (jet.f - truth[i].jet.f) * (jet.f - truth[i].jet.f);
		}
	}
	CHECK_AT_MOST(sqrt(error / size), 0.01);
	gnp_scratch_free(scratch);
	gnp_train_cloud_clear(&cloud);
}

/* Every other visit has the regime's noise, the others one between the limits. */
static void noise_varies_as_asked(void)
{
	struct gnp_train_data data = data_of(GNP_REGIME_NOISE_70);
	double least = 1, most = 0;
	for (uint64_t visit = 0; visit < 40; visit++) {
		struct gnp_train_visit plain, varied;
		data.least_noise = data.most_noise = 0;
		CHECK(gnp_train_data_visit(&data, visit, &plain, NULL) == GNP_OK && plain.noise == 1e-3);
		data.least_noise = 1e-4;
		data.most_noise = 4e-3;
		CHECK(gnp_train_data_visit(&data, visit, &varied, NULL) == GNP_OK);
		CHECK(varied.noise_seed == plain.noise_seed && varied.key.seed == plain.key.seed);
		CHECK(visit % 2 || varied.noise == 1e-3);
		least = fmin(least, varied.noise);
		most = fmax(most, varied.noise);
	}
	CHECK(least >= 1e-4 && least < 4e-4 && most > 2e-3 && most <= 4e-3);
}

static void centres_and_truth_are_no_outliers(void)
{
	struct gnp_train_cloud cloud = cloud_of(GNP_REGIME_OUTLIER_50, 1);
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_train_patches patches = draw(&cloud, 50, 1.25, 2, scratch);
	for (size_t p = 0; p < patches.count; p++) {
		size_t wanted = 0;
		const struct gnp_patch *patch = &patches.patches[p];
		CHECK(!cloud.outlier[patch->centre]);
		CHECK(patches.start[p + 1] - patches.start[p] == patch->buffer_count && patch->buffer_count > patch->count);
		for (size_t i = 0; i < patch->count; i++)
			wanted += !cloud.outlier[patch->index[i]];
		CHECK(patches.truth_start[p + 1] - patches.truth_start[p] == wanted);
	}
	gnp_scratch_free(scratch);
	gnp_train_cloud_clear(&cloud);
}

/* A patch that reaches further holds as many points, and has the same nodes. */
static void reaching_further_adds_no_nodes(void)
{
	struct gnp_train_cloud cloud = cloud_of(GNP_REGIME_NOISE_70, 4);
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_train_recipe recipe = {.k = 30, .delta0_ratio = 0.1, .buffer = 1.25};
	const uint32_t centres[2] = {17, 18};
	struct gnp_train_patches near, far;
	CHECK(gnp_train_patches_build(&cloud, &recipe, centres, 2, scratch, &near, NULL) == GNP_OK);
	recipe.reach = 200;
	CHECK(gnp_train_patches_build(&cloud, &recipe, centres, 2, scratch, &far, NULL) == GNP_OK);
	CHECK(near.patches[1].buffer_count < 200 && far.patches[1].buffer_count == 200);
	CHECK(near.start[2] == far.start[2] && near.start[1] == far.start[1] && near.truth_start[2] == far.truth_start[2]);
	CHECK(memcmp(near.nodes, far.nodes, 3 * near.start[2] * sizeof(float)) == 0);
	CHECK(memcmp(near.truth, far.truth, near.truth_start[2] * sizeof *near.truth) == 0);
	gnp_scratch_free(scratch);
	gnp_train_cloud_clear(&cloud);
}

static void windows_opened_later_hold_the_same_clouds(void)
{
	struct gnp_train_data data = data_of(GNP_REGIME_NOISE_70);
	struct gnp_train_window *moved, *opened;
	CHECK(gnp_train_window_open(&data, 3, 0, pool, &moved, NULL) == GNP_OK);
	for (int i = 0; i < 7; i++)
		CHECK(gnp_train_window_advance(moved, NULL) == GNP_OK);
	CHECK(gnp_train_window_first(moved) == 7);
	CHECK(gnp_train_window_open(&data, 3, 7, pool, &opened, NULL) == GNP_OK);
	for (size_t i = 0; i < 3; i++) {
		const struct gnp_train_cloud *a = gnp_train_window_at(moved, i), *b = gnp_train_window_at(opened, i);
		CHECK(memcmp(a->prepared.points, b->prepared.points, POINTS * 24) == 0);
		CHECK(memcmp(a->prepared.order, b->prepared.order, POINTS * 4) == 0);
	}
	gnp_train_window_close(moved);
	gnp_train_window_close(opened);
	gnp_train_window_close(NULL);
}

static void a_window_without_its_shapes_fails_when_it_moves(void)
{
	struct gnp_train_data data = data_of(GNP_REGIME_NOISE_70);
	struct gnp_train_window *window;
	struct gnp_error error = {0};
	data.folder = "/proc/none";
	CHECK(gnp_train_window_open(&data, 2, 0, pool, &window, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "/proc/none");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(shapes_are_read_back_and_made_anew_when_damaged),
		TEST(a_folder_that_cannot_be_made_is_named),
		TEST(an_epoch_visits_every_shape_and_each_visit_has_its_noise),
		TEST(watched_shapes_are_none_of_training),
		TEST(outliers_follow_the_regime),
		TEST(truth_is_the_geometry_of_the_surface),
		TEST(truth_of_neighbours_is_one_surface),
		TEST(noise_varies_as_asked),
		TEST(centres_and_truth_are_no_outliers),
		TEST(reaching_further_adds_no_nodes),
		TEST(windows_opened_later_hold_the_same_clouds),
		TEST(a_window_without_its_shapes_fails_when_it_moves),
	};
	snprintf(folder, sizeof folder, "/tmp/gnp-train-data-XXXXXX");
	if (!mkdtemp(folder) || gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int failed = RUN_TESTS(tests);
	char command[96];
	snprintf(command, sizeof command, "rm -r %s", folder);
	failed |= system(command) != 0;
	gnp_pool_free(pool);
	return failed;
}
