/* The estimator gnp from end to end: small models made here where only the way to them matters, the shipped ones where answers do. */
#include <dirent.h>
#include <unistd.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/estimate/estimate.h"
#include "core/linear/eigen.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/network/pooled.h"
#include "core/network/projection.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

/* ---- Models ---- */

static char folder[64];

static const struct gnp_architecture projection = {.trunk = GNP_TRUNK_EDGE, .head = GNP_HEAD_PROJECTION, .features = 4, .width = 8,
	.channels = 2, .neurons = 8, .layers = 2, .quadrature = 8, .head_width = 8, .outputs = 11, .shells = 3,
	.shell = {60, 120, 240}, .ridge = 2e-5};
static const struct gnp_architecture published = {.trunk = GNP_TRUNK_EDGE, .head = GNP_HEAD_POOLED, .features = 3, .width = 64,
	.channels = 4, .neurons = 256, .layers = 5, .quadrature = 32, .head_width = 128, .outputs = 16};
static const struct gnp_recipe usual = {.k = 50, .buffer = 1.25, .height_scale = 2, .delta0_ratio = 0.5};

/* A random network; that of a projection is near what training begins with. */
static void write_model(const char *name, const char *regime, const struct gnp_architecture *a, const struct gnp_recipe *recipe)
{
	char path[128];
	struct gnp_layout layout;
	struct gnp_random random;
	struct gnp_error error = {0};
	gnp_random_seed(&random, 77, 0);
	CHECK(gnp_architecture_layout(a, &layout, NULL) == GNP_OK);
	float *parameters = malloc(layout.total * sizeof *parameters);
	for (size_t r = 0; r < layout.rows; r++)
		for (size_t i = 0; i < layout.row[r].count; i++)
			parameters[layout.row[r].offset + i] = (float)((layout.row[r].rank == 2 ? 1 / sqrt((double)layout.row[r].shape[1]) : 0.1) *
			                                               (2 * gnp_random_uniform(&random) - 1));
	const struct gnp_parameter_row *mean = gnp_layout_find(&layout, "head.mean");
	for (size_t i = 0; mean && i < mean->count; i++) {
		parameters[mean->offset + i] = -5;
		parameters[gnp_layout_find(&layout, "head.deviation")->offset + i] = 4;
	}
	if (mean)
		gnp_projection_begin(a, (double)a->shell[a->shells - 1] / recipe->k,
		                     parameters + gnp_layout_find(&layout, "head.4.bias")->offset);
	snprintf(path, sizeof path, "%s/%s.safetensors", folder, name);
	const struct gnp_model_source source = {.architecture = *a, .recipe = *recipe, .regime = regime, .parameters = parameters};
	if (gnp_model_save(path, &source, &error) != GNP_OK)
		fprintf(stderr, "%s\n", error.text);
	CHECK(error.status == GNP_OK);
	free(parameters);
}

static void open_folder(void)
{
	strcpy(folder, "/tmp/test_learned.XXXXXX");
	CHECK(mkdtemp(folder) != NULL);
}

/* What was written since open_folder; the files are gone after. */
static struct gnp_models *load_folder(void)
{
	struct gnp_models *models = NULL;
	char path[400];
	CHECK(gnp_models_load(folder, &models, NULL) == GNP_OK);
	DIR *directory = opendir(folder);
	for (struct dirent *entry; directory && (entry = readdir(directory));) {
		snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
		if (entry->d_name[0] != '.')
			unlink(path);
	}
	closedir(directory);
	rmdir(folder);
	return models;
}

static struct gnp_models *one_of_each_regime(void)
{
	open_folder();
	write_model("a", "clean", &projection, &usual);
	write_model("b", "outlier", &projection, &usual);
	write_model("c", "noise", &projection, &usual);
	return load_folder();
}

static const struct gnp_model *named(const struct gnp_models *models, const char *name)
{
	const struct gnp_model *model = NULL;
	CHECK(gnp_models_find(models, name, &model, NULL) == GNP_OK);
	return model;
}

/* ---- Clouds and estimates ---- */

static struct gnp_sample sample_of(const char *name, unsigned degree, struct gnp_sample_options options)
{
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample = {0};
	struct gnp_error error = {0};
	if (gnp_shape_create(name, 5, degree, &shape, &error) != GNP_OK ||
	    gnp_sample_create(shape, &options, pool, NULL, &sample, &error) != GNP_OK) {
		fprintf(stderr, "%s: %s\n", name, error.text);
		CHECK(!"the sample was made");
	}
	gnp_shape_free(shape);
	return sample;
}

static struct gnp_cloud cloud_of(const struct gnp_sample *sample)
{
	return (struct gnp_cloud){sample->count, sample->points, sample->normals};
}

static struct gnp_estimate_options options_of(const struct gnp_models *models, const struct gnp_model *model)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	options.estimator = GNP_ESTIMATOR_GNP;
	options.quantities = GNP_QUANTITY_ALL;
	options.models = models;
	options.model = model;
	return options;
}

static struct gnp_estimate estimate_by(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                                       struct gnp_pool *workers)
{
	struct gnp_estimate estimate = {0};
	struct gnp_error error = {0};
	if (gnp_estimate_run(cloud, options, workers, NULL, &estimate, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		CHECK(!"the estimate succeeded");
		exit(1);
	}
	return estimate;
}

/* At `count` points all over the cloud. */
static struct gnp_estimate estimate_some(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, size_t count,
                                         uint32_t *at)
{
	struct gnp_estimate estimate = {0};
	struct gnp_error error = {0};
	for (size_t i = 0; i < count; i++)
		at[i] = (uint32_t)(i * cloud->count / count);
	if (gnp_estimate_at(cloud, options, at, count, pool, NULL, &estimate, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		CHECK(!"the estimate succeeded");
		exit(1);
	}
	return estimate;
}

static size_t width_of(const struct gnp_estimate *e, int q)
{
	size_t width = gnp_quantity_info((enum gnp_quantity)q)->width;
	return width ? width : e->basis_size;
}

static bool same_bytes(const struct gnp_estimate *a, const struct gnp_estimate *b)
{
	bool same = a->count == b->count && a->model == b->model && a->degenerate == b->degenerate;
	for (int q = 0; q < GNP_QUANTITY_COUNT && same; q++) {
		same = !a->values[q] == !b->values[q];
		if (same && a->values[q])
			same = memcmp(a->values[q], b->values[q], a->count * width_of(a, q) * sizeof(double)) == 0;
	}
	return same;
}

/* ---- The model says how ---- */

static void patches_are_the_models_whatever_k_is_asked_for(void)
{
	struct gnp_models *models = one_of_each_regime();
	struct gnp_sample sample = sample_of("torus", 0, (struct gnp_sample_options){.count = 2000, .seed = 1});
	struct gnp_cloud cloud = cloud_of(&sample);
	struct gnp_estimate_options options = options_of(NULL, named(models, "a"));
	struct gnp_estimate a = estimate_by(&cloud, &options, pool);
	options.k = 12;
	options.degree = 7;
	options.basis = GNP_BASIS_TOTAL;
	struct gnp_estimate b = estimate_by(&cloud, &options, pool);
	CHECK(a.model == named(models, "a") && a.basis_size == GNP_TAYLOR_SIZE && a.count == cloud.count);
	CHECK(same_bytes(&a, &b));
	for (size_t i = 0; i < cloud.count; i++)
		CHECK(isfinite(a.values[GNP_MEAN_CURVATURE][i]));
	gnp_estimate_clear(&a);
	gnp_estimate_clear(&b);
	gnp_sample_clear(&sample);
	gnp_models_release(models);
}

static int by_value(const void *a, const void *b)
{
	const double *x = a, *y = b;
	return (*x > *y) - (*x < *y);
}

/* The patch of a point from scratch: its radius, in-plane extent and the spread of its heights. */
static double patch_spread(const struct gnp_cloud *cloud, size_t at, size_t k, double *epsilon)
{
	double *distance = malloc(cloud->count * sizeof *distance), *sorted = malloc(cloud->count * sizeof *sorted);
	double mean[3] = {0}, s[6] = {0}, values[3], vectors[3][3], members = 0;
	for (size_t i = 0; i < cloud->count; i++) {
		const double *p = cloud->points + 3 * i, *o = cloud->points + 3 * at;
		double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		sorted[i] = distance[i] = sqrt(gnp_dot(d, d));
	}
	qsort(sorted, cloud->count, sizeof *sorted, by_value);
	*epsilon = 1.1 * sorted[k - 1];
	for (int pass = 0; pass < 2; pass++)
		for (size_t i = 0; i < cloud->count; i++) {
			const double *p = cloud->points + 3 * i, d[3] = {p[0] - mean[0], p[1] - mean[1], p[2] - mean[2]};
			if (distance[i] > *epsilon)
				continue;
			members += !pass;
			for (int r = 0, n = 0; r < 3 && pass; r++)
				for (int c = r; c < 3; c++, n++)
					s[n] += d[r] * d[c] / members;
			for (int c = 0; c < 3 && !pass; c++)
				mean[c] += (p[c] - mean[c]) / members;
		}
	gnp_eigen_symmetric3(s, values, vectors);
	free(distance);
	free(sorted);
	return sqrt(fmax(values[2], 0));
}

/* The coefficients of the patch in the frame that was answered, its nodes gathered from scratch. */
static void check_coefficients(const struct gnp_cloud *cloud, const struct gnp_model *model, const struct gnp_estimate *e, size_t row,
                               size_t at, double epsilon)
{
	enum { NODES = 400, OUTPUTS = 16 };
	static double order[NODES][4];
	float nodes[3 * NODES], want[OUTPUTS];
	double largest = 0;
	size_t start[2] = {0, 0}, inner = 0;
	const double *origin = e->values[GNP_ORIGIN] + 3 * row, *frame = e->values[GNP_FRAME] + 9 * row, *scale = e->values[GNP_SCALE] + 2 * row;
	struct gnp_scratch *scratch = gnp_scratch_create();
	for (size_t i = 0; i < cloud->count && start[1] < NODES; i++) {
		const double *p = cloud->points + 3 * i, *o = cloud->points + 3 * at;
		double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]}, r = sqrt(gnp_dot(d, d));
		for (int c = 0; c < 3; c++)
			d[c] = p[c] - origin[c];
		if (r > epsilon * model->recipe.buffer)
			continue;
		inner += r <= epsilon;
		const double node[4] = {r, gnp_dot(d, frame) / scale[0], gnp_dot(d, frame + 3) / scale[0], gnp_dot(d, frame + 6) / scale[1]};
		memcpy(order[start[1]++], node, sizeof node);
	}
	qsort(order, start[1], sizeof *order, by_value);
	for (size_t i = 0; i < start[1]; i++)
		for (int c = 0; c < 3; c++)
			nodes[3 * i + (size_t)c] = (float)order[i][c + 1];
	const struct gnp_network_batch batch = {1, start, &inner, nodes};
	CHECK(gnp_pooled_forward(model->network, &batch, want, NULL, scratch, NULL) == GNP_OK);
	for (size_t i = 0; i < OUTPUTS; i++)
		largest = fmax(largest, fabs((double)want[i]));
	for (size_t i = 0; i < OUTPUTS; i++)
		CHECK_NEAR(e->values[GNP_SURFACE_COEFFICIENTS][OUTPUTS * row + i], (double)want[i], 1e-5 * largest);
	gnp_scratch_free(scratch);
}

/* The published layout and recipe: heights are divided by two deviations of theirs, at least by a length. */
static void a_published_network_gets_the_patches_it_was_made_for(void)
{
	enum { AT = 4 };
	const struct gnp_recipe recipe = {.k = 50, .buffer = 1.25, .height_scale = 2, .delta0 = 0.005};
	uint32_t at[AT];
	open_folder();
	write_model("clean_50k_v1", "clean", &published, &recipe);
	struct gnp_models *models = load_folder();
	struct gnp_sample sample = sample_of("torus", 0, (struct gnp_sample_options){.count = 3000, .seed = 2});
	struct gnp_cloud cloud = cloud_of(&sample);
	struct gnp_estimate_options options = options_of(models, gnp_models_at(models, 0));
	for (int size = 0; size < 3; size++) { /* the last is so small that delta0 exceeds the heights */
		struct gnp_estimate e = estimate_some(&cloud, &options, AT, at);
		CHECK(e.model == gnp_models_at(models, 0) && e.basis_size == 16);
		for (size_t i = 0; i < AT; i++) {
			double epsilon, wanted = 2 * patch_spread(&cloud, at[i], recipe.k, &epsilon);
			CHECK(size == 2 ? wanted < recipe.delta0 : wanted > recipe.delta0);
			wanted = fmax(wanted, recipe.delta0);
			CHECK_NEAR(e.values[GNP_SCALE][2 * i + 1], wanted, 1e-9 * wanted);
			check_coefficients(&cloud, gnp_models_at(models, 0), &e, i, at[i], epsilon);
		}
		gnp_estimate_clear(&e);
		for (size_t i = 0; i < 3 * sample.count; i++)
			sample.points[i] *= size == 0 ? 7.0 : 1e-3;
	}
	gnp_sample_clear(&sample);
	gnp_models_release(models);
}

/* ---- What is refused ---- */

static void check_refused(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, gnp_status status, const char *text)
{
	struct gnp_estimate e = {0};
	struct gnp_error error = {0};
	CHECK(gnp_estimate_run(cloud, options, pool, NULL, &e, &error) == status);
	CHECK_CONTAINS(error.text, text);
	CHECK(e.count == 0 && !e.model);
}

static void what_no_model_can_do_is_refused(void)
{
	struct gnp_sample sample = sample_of("sphere", 0, (struct gnp_sample_options){.count = 2000, .seed = 4, .noise = 0.02});
	struct gnp_cloud cloud = cloud_of(&sample);
	struct gnp_estimate_options options = options_of(NULL, NULL);
	check_refused(&cloud, &options, GNP_UNAVAILABLE, "weights: none are loaded");
	open_folder();
	struct gnp_models *none = load_folder();
	options.models = none;
	check_refused(&cloud, &options, GNP_UNAVAILABLE, "weights: none are loaded");
	open_folder();
	write_model("a", "clean", &projection, &usual);
	write_model("b", "outlier", &projection, &usual);
	struct gnp_models *models = load_folder();
	options.models = models;
	check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, "weights: got auto, none of the 2 models is for any cloud");
	options.model = named(models, "b");
	options.quantities = GNP_QUANTITY_BIT(GNP_CREASE);
	check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, "quantities: the estimator gnp has no crease with weights b");
	options.quantities = GNP_QUANTITY_BIT(GNP_NORMALS_STDERR);
	check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, "the estimator gnp has no normals_stderr with weights b");
	options.quantities = GNP_QUANTITY_ALL;
	options.k = 12;
	for (size_t count = 12; count < 50; count += 37) {
		cloud.count = count;
		char text[64];
		snprintf(text, sizeof text, "points: got %zu, need at least 50", count);
		check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, text);
	}
	gnp_models_release(models);
	gnp_models_release(none);
	gnp_sample_clear(&sample);
}

/* A model that is not told of outliers says nothing of them, instead of "none". */
static void outliers_are_told_where_they_were_looked_for(void)
{
	struct gnp_models *models = one_of_each_regime();
	struct gnp_sample sample = sample_of("torus", 0, (struct gnp_sample_options){.count = 2000, .seed = 1, .outlier_fraction = 0.05, .outlier_noise = 0.3});
	struct gnp_cloud cloud = cloud_of(&sample);
	for (size_t m = 0; m < gnp_models_count(models); m++) {
		const struct gnp_model *model = gnp_models_at(models, m);
		bool told = strcmp(model->regime, "outlier") == 0;
		struct gnp_estimate_options options = options_of(models, model);
		struct gnp_estimate e = estimate_by(&cloud, &options, pool);
		double found = 0;
		for (size_t i = 0; told && e.values[GNP_OUTLIER] && i < cloud.count; i++)
			found += e.values[GNP_OUTLIER][i];
		CHECK(told ? found > 50 && found < 150 : !e.values[GNP_OUTLIER]);
		gnp_estimate_clear(&e);
		options.quantities = GNP_QUANTITY_BIT(GNP_OUTLIER);
		if (!told)
			check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, "quantities: got outlier, which the estimator gnp does not judge with weights");
	}
	gnp_sample_clear(&sample);
	gnp_models_release(models);
}

/* As many points as set the patch's radius are enough, if fewer than a shell. */
static void small_clouds_are_answered(void)
{
	struct gnp_models *models = one_of_each_regime();
	static const size_t counts[] = {50, 51, 59, 61, 239};
	for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
		for (size_t m = 0; m < 3; m++) {
			struct gnp_sample sample = sample_of("sphere", 0, (struct gnp_sample_options){.count = counts[i], .seed = 6});
			struct gnp_cloud cloud = cloud_of(&sample);
			struct gnp_estimate_options options = options_of(models, gnp_models_at(models, m));
			struct gnp_estimate e = estimate_by(&cloud, &options, pool);
			for (size_t p = 0; p < cloud.count; p++)
				CHECK(isfinite(e.values[GNP_MEAN_CURVATURE][p]) && isfinite(e.values[GNP_RESIDUAL][p]));
			gnp_estimate_clear(&e);
			gnp_sample_clear(&sample);
		}
	gnp_models_release(models);
}

/* ---- What answers must not depend on ---- */

static void any_number_of_workers_gives_the_same_bytes(void)
{
	struct gnp_models *models = one_of_each_regime();
	struct gnp_sample sample = sample_of("torus", 0,
	                                     (struct gnp_sample_options){.count = 3000, .seed = 7, .outlier_fraction = 0.1, .outlier_noise = 0.03});
	struct gnp_cloud cloud = cloud_of(&sample);
	for (int cover = GNP_COVER_COVER; cover <= GNP_COVER_ALL; cover++) {
		struct gnp_estimate_options options = options_of(models, named(models, "b"));
		struct gnp_estimate first = {0};
		options.cover = cover;
		for (unsigned workers = 1; workers <= 3; workers++) {
			struct gnp_pool *mine = NULL;
			CHECK(gnp_pool_create(workers, &mine, NULL) == GNP_OK);
			struct gnp_estimate e = estimate_by(&cloud, &options, mine);
			if (workers == 1) {
				first = e;
			} else {
				CHECK(same_bytes(&first, &e));
				gnp_estimate_clear(&e);
			}
			gnp_pool_free(mine);
		}
		gnp_estimate_clear(&first);
	}
	gnp_sample_clear(&sample);
	gnp_models_release(models);
}

/* Powers of two change not a bit of what has no unit; other factors what rounding leaves. */
static void answers_scale_with_the_cloud(void)
{
	static const double scales[] = {0x1p10, 0x1p-10, 1e-3, 1e3};
	struct gnp_models *models = one_of_each_regime();
	struct gnp_sample sample = sample_of("torus", 0, (struct gnp_sample_options){.count = 2000, .seed = 8, .noise = 1e-3});
	struct gnp_cloud cloud = cloud_of(&sample);
	struct gnp_estimate_options options = options_of(models, named(models, "c"));
	struct gnp_estimate want = estimate_by(&cloud, &options, pool);
	double *points = malloc(3 * sample.count * sizeof *points);
	for (int s = 0; s < 4; s++) {
		cloud.points = points;
		for (size_t i = 0; i < 3 * sample.count; i++)
			points[i] = scales[s] * sample.points[i];
		struct gnp_estimate got = estimate_by(&cloud, &options, pool);
		CHECK(got.model == want.model && got.patches == want.patches);
		if (s < 2)
			CHECK(memcmp(got.values[GNP_NORMALS], want.values[GNP_NORMALS], 3 * sample.count * sizeof(double)) == 0);
		for (size_t i = 0; i < sample.count; i++) {
			CHECK_NEAR(got.values[GNP_MEAN_CURVATURE][i] * scales[s], want.values[GNP_MEAN_CURVATURE][i], 1e-3);
			CHECK_NEAR(got.values[GNP_POINTS][3 * i] / scales[s], want.values[GNP_POINTS][3 * i], 1e-6);
		}
		gnp_estimate_clear(&got);
	}
	free(points);
	gnp_estimate_clear(&want);
	gnp_sample_clear(&sample);
	gnp_models_release(models);
}

/* Two flat sheets, back to back and much nearer than their points: each is answered as if it were alone. */
static void a_sheet_behind_is_not_seen(void)
{
	enum { SIDE = 24, COUNT = 2 * SIDE * SIDE };
	static double points[3 * COUNT], normals[3 * COUNT];
	struct gnp_models *models = one_of_each_regime();
	struct gnp_random random;
	gnp_random_seed(&random, 9, 0);
	for (size_t i = 0; i < COUNT; i++) {
		double side = i < COUNT / 2 ? 1 : -1, *p = points + 3 * i;
		p[0] = (double)(i % SIDE) + 0.6 * gnp_random_uniform(&random);
		p[1] = (double)(i / SIDE % SIDE) + 0.6 * gnp_random_uniform(&random);
		p[2] = 0.05 * side;
		normals[3 * i + 2] = side;
	}
	struct gnp_cloud cloud = {COUNT, points, normals};
	struct gnp_estimate_options options = options_of(models, named(models, "a"));
	struct gnp_estimate e = estimate_by(&cloud, &options, pool);
	for (size_t i = 0; i < COUNT; i++) {
		CHECK_NEAR(e.values[GNP_NORMALS][3 * i + 2], normals[3 * i + 2], 1e-9);
		CHECK_NEAR(e.values[GNP_MEAN_CURVATURE][i], 0, 1e-7);
	}
	gnp_estimate_clear(&e);
	gnp_models_release(models);
}

/* ---- The shipped models ---- */

enum { JUDGED = 300 };

/* Relative L2 error of the mean curvature at points that are no outliers, by an estimator. */
static double error_of(const struct gnp_sample *sample, const struct gnp_estimate_options *options)
{
	struct gnp_cloud cloud = cloud_of(sample);
	uint32_t at[JUDGED];
	struct gnp_estimate e = estimate_some(&cloud, options, JUDGED, at);
	double error = 0, size = 0;
	for (size_t i = 0; i < JUDGED; i++) {
		double want = sample->mean_curvature[at[i]], off = e.values[GNP_MEAN_CURVATURE][i] - want;
		if (sample->outlier[at[i]])
			continue;
		error += off * off;
		size += want * want;
	}
	gnp_estimate_clear(&e);
	return sqrt(error / size);
}

/* The first by name that is no pooled one; NULL: none. */
static const struct gnp_model *of_regime(const struct gnp_models *models, const char *regime)
{
	for (size_t i = 0; i < gnp_models_count(models); i++) {
		const struct gnp_model *model = gnp_models_at(models, i);
		if (strcmp(model->regime, regime) == 0 && model->architecture.head != GNP_HEAD_POOLED)
			return model;
	}
	return NULL;
}

static void check_accuracy(const struct gnp_models *models, const char *regime, struct gnp_sample_options displaced,
                           const double bounds[3])
{
	static const char *const names[3] = {"sphere", "torus", "radial"};
	CHECK(of_regime(models, regime) != NULL);
	for (int s = 0; s < 3; s++) {
		struct gnp_sample sample = sample_of(names[s], 6, displaced);
		struct gnp_estimate_options options = options_of(models, of_regime(models, regime));
		double error = error_of(&sample, &options);
		options.estimator = GNP_ESTIMATOR_GMLS;
		options.k = 70;
		options.quantities = GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE);
		double classical = error_of(&sample, &options);
		if (!(error <= bounds[s]) || !(error <= classical / 2)) {
			test_failures++;
			fprintf(stderr, "%s, %s: H is off by %g, need at most %g and half of gmls's %g\n", names[s], regime, error, bounds[s],
			        classical);
		}
		gnp_sample_clear(&sample);
	}
}

static void the_shipped_models_are_accurate(void)
{
	static const double noise[3] = {0.03, 0.06, 0.06}, exact[3] = {1e-3, 1e-3, 1e-3};
	struct gnp_models *models = NULL;
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK); /* tests run in the repository's root */
	check_accuracy(models, "noise", (struct gnp_sample_options){.count = 12000, .seed = 11, .noise = 2e-3}, noise);
	check_accuracy(models, "outlier",
	               (struct gnp_sample_options){.count = 12000, .seed = 11, .outlier_fraction = 0.1, .outlier_noise = 1e-2}, exact);
	check_accuracy(models, "clean", (struct gnp_sample_options){.count = 12000, .seed = 11}, exact);
	gnp_models_release(models);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(patches_are_the_models_whatever_k_is_asked_for), TEST(a_published_network_gets_the_patches_it_was_made_for),
		TEST(what_no_model_can_do_is_refused),
		TEST(outliers_are_told_where_they_were_looked_for),
		TEST(small_clouds_are_answered), TEST(any_number_of_workers_gives_the_same_bytes), TEST(answers_scale_with_the_cloud),
		TEST(a_sheet_behind_is_not_seen), TEST(the_shipped_models_are_accurate),
	};
	gnp_linalg_init();
	if (gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
