/* Mean-curvature flow from end to end, by its laws on spheres, cylinders, tori, ellipsoids and catenoids. */
#include <pthread.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/flow/flow.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"
#include "tests/laws/flow_laws.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;
static struct gnp_models *models;

/* ---- Clouds ---- */

static struct cloud sampled(const char *name, const struct gnp_sample_options *options, unsigned degree)
{
	struct gnp_shape *shape;
	struct gnp_sample sample;
	struct cloud cloud = cloud_new(options->count);
	CHECK(gnp_shape_create(name, 11, degree, &shape, NULL) == GNP_OK);
	CHECK(gnp_sample_create(shape, options, pool, NULL, &sample, NULL) == GNP_OK);
	memcpy(cloud.points, sample.points, 3 * cloud.count * sizeof(double));
	memcpy(cloud.normals, sample.normals, 3 * cloud.count * sizeof(double));
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
	return cloud;
}

static struct cloud clean(const char *name, size_t count)
{
	return sampled(name, &(struct gnp_sample_options){.count = count, .seed = 3}, 6);
}

/* ---- Flows ---- */

static struct gnp_flow_options gnp_with(const char *weights)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = GNP_FLOW_EXPLICIT;
	options.estimate.estimator = GNP_ESTIMATOR_GNP;
	options.estimate.models = models;
	CHECK(gnp_models_find(models, weights, &options.estimate.model, NULL) == GNP_OK);
	return options;
}

static struct gnp_flow_options gmls(void)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = GNP_FLOW_EXPLICIT;
	return options;
}

static struct gnp_flow flowed(const struct cloud *cloud, const struct gnp_flow_options *options)
{
	struct gnp_flow flow = {0};
	struct gnp_error error = {0};
	const struct gnp_cloud c = {cloud->count, cloud->points, cloud->normals};
	if (gnp_flow_run(&c, cloud->fixed, options, pool, NULL, &flow, &error) != GNP_OK) {
		CHECK_STRING(error.text, "");
		flow = (struct gnp_flow){0};
	}
	return flow;
}

static void check_refused(const struct cloud *cloud, const struct gnp_flow_options *options, gnp_status status, const char *text)
{
	struct gnp_flow flow = {0};
	struct gnp_error error = {0};
	const struct gnp_cloud c = {cloud->count, cloud->points, cloud->normals};
	CHECK(gnp_flow_run(&c, cloud->fixed, options, pool, NULL, &flow, &error) == status);
	CHECK_CONTAINS(error.text, text);
	CHECK(flow.points == NULL);
}

static double last_time(const struct gnp_flow *flow)
{
	return flow->records[flow->steps].time;
}

/* ---- Laws ---- */

static void sphere_shrinks_by_its_law(void)
{
	struct cloud cloud = clean("sphere", 2500);
	struct gnp_flow_options options = gnp_with("fit_clean_50k");
	options.steps = 50;
	options.dt = 1e-3;
	for (int scheme = GNP_FLOW_EXPLICIT; scheme <= GNP_FLOW_CONFORMAL; scheme++) {
		options.scheme = scheme;
		struct gnp_flow flow = flowed(&cloud, &options);
		struct spread spread = radii(flow.points, flow.normals, flow.count);
		CHECK(flow.stop == GNP_FLOW_STEPS && flow.steps == 50);
		CHECK_NEAR(last_time(&flow), 0.05, 1e-12);
		/* (I - dt/2 Delta) is first order in dt: twice dt / R^2 of the change, 1e-4 */
		CHECK_NEAR(spread.mean * spread.mean, 1 - 2 * 0.05, scheme == GNP_FLOW_EXPLICIT ? 9e-5 : 9e-4);
		CHECK_AT_MOST(spread.worst, 2e-3);
		gnp_flow_clear(&flow);
	}
	cloud_free(&cloud);
}

static void cylinder_between_held_ends_shrinks_by_its_law(void)
{
	struct cloud cloud = cylinder(0.5, 1, 0.06);
	struct gnp_flow_options options = gnp_with("fit_clean_50k");
	options.steps = 20;
	options.dt = 1.5e-3;
	struct gnp_flow flow = flowed(&cloud, &options);
	double sum = 0;
	size_t count = 0;
	CHECK(flow.stop == GNP_FLOW_STEPS);
	for (size_t i = 0; i < flow.count; i++) {
		const double *p = flow.points + 3 * i;
		if (cloud.fixed[i])
			CHECK(memcmp(p, cloud.points + 3 * i, 3 * sizeof *p) == 0);
		if (fabs(p[2]) > 0.2) /* the ends are felt further out */
			continue;
		sum += p[0] * p[0] + p[1] * p[1];
		count++;
	}
	CHECK_NEAR(sum / (double)count, 0.25 - 0.03, 2.5e-4);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void surface_between_rings_becomes_a_catenoid(void)
{
	struct cloud cloud = cylinder(1, 0.5, 0.1);
	struct gnp_flow_options options = gnp_with("fit_clean_50k");
	options.scheme = GNP_FLOW_SEMI_IMPLICIT;
	options.steps = 60;
	options.dt = 0.03;
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.count == cloud.count);
	CHECK_AT_MOST(off_catenoid(flow.points, flow.count), 0.01);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void thin_torus_shrinks_to_a_circle_and_says_so(void)
{
	struct cloud cloud = clean("torus", 3000);
	struct gnp_flow_options options = gnp_with("fit_clean_30k");
	options.steps = 1000;
	struct gnp_flow flow = flowed(&cloud, &options);
	double ring = 0, tube = 0;
	CHECK(flow.stop == GNP_FLOW_SINGULARITY && flow.steps > 20 && flow.steps < 1000);
	CHECK_CONTAINS(flow.reason, "curvature times spacing is ");
	for (size_t i = 0; i < flow.count; i++)
		ring += hypot(flow.points[3 * i], flow.points[3 * i + 1]) / (double)flow.count;
	for (size_t i = 0; i < flow.count; i++)
		tube = fmax(tube, hypot(hypot(flow.points[3 * i], flow.points[3 * i + 1]) - ring, flow.points[3 * i + 2]));
	CHECK_AT_MOST(tube, 0.2); /* it was 1/3, about a ring of 2/3 */
	CHECK_NEAR(ring, 0.6, 0.05);
	for (size_t r = 0; r < flow.steps; r++)
		CHECK(flow.records[r + 1].area < flow.records[r].area && flow.records[r + 1].volume < flow.records[r].volume);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void bumpy_torus_loses_its_bumps(void)
{
	struct cloud cloud = clean("bumpy_torus", 6000);
	struct gnp_flow_options options = gnp_with("fit_clean_30k");
	options.steps = 24;
	options.snapshot_every = 4;
	struct gnp_flow flow = flowed(&cloud, &options);
	double before = bumps(cloud.points, cloud.count), start = before;
	CHECK(flow.snapshots.count == 7);
	CHECK(start > 0.01);
	for (size_t s = 1; s < flow.snapshots.count; s++) {
		size_t first = flow.snapshots.start[s];
		double now = bumps(flow.snapshots.points + 3 * first, flow.snapshots.start[s + 1] - first);
		CHECK(now < before);
		before = now;
	}
	CHECK_AT_MOST(before, 0.15 * start);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void ellipsoid_keeping_its_volume_becomes_a_sphere(void)
{
	struct cloud cloud = clean("ellipsoid", 1500);
	struct gnp_flow_options options = gnp_with("fit_clean_30k");
	options.volume = GNP_FLOW_VOLUME_PRESERVE;
	options.scheme = GNP_FLOW_SEMI_IMPLICIT;
	options.steps = 100;
	options.dt = 0.025;
	struct gnp_flow flow = flowed(&cloud, &options);
	struct spread spread = radii(flow.points, flow.normals, flow.count);
	CHECK(flow.stop == GNP_FLOW_STEPS);
	CHECK_NEAR(pow(spread.mean, 3), 1 * 0.8 * 0.6, 0.005 * 0.48);
	CHECK_AT_MOST(spread.worst, 2e-3);
	CHECK_NEAR(flow.records[flow.steps].volume, flow.records[0].volume, 1e-5);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void ellipsoid_tends_to_a_sphere_as_it_shrinks(void)
{
	struct cloud cloud = clean("ellipsoid", 1500);
	struct gnp_flow_options options = gnp_with("fit_clean_30k");
	options.steps = 40;
	double before = radii(cloud.points, cloud.normals, cloud.count).worst;
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.steps > 0);
	CHECK_AT_MOST(radii(flow.points, flow.normals, flow.count).worst, 0.9 * before);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void conformal_flow_makes_a_radial_shape_round(void)
{
	struct cloud cloud = clean("radial", 2500);
	struct gnp_flow_options options = gmls();
	options.scheme = GNP_FLOW_CONFORMAL;
	options.volume = GNP_FLOW_VOLUME_PRESERVE;
	options.steps = 100;
	options.dt = 0.05;
	double before = radii(cloud.points, cloud.normals, cloud.count).worst;
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(before > 0.15);
	CHECK_AT_MOST(radii(flow.points, flow.normals, flow.count).worst, 0.01);
	CHECK_NEAR(flow.records[flow.steps].volume / flow.records[0].volume, 1, 2e-3);
	CHECK(flow.count == cloud.count);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

/* ---- Noise ---- */

/* dt 1.6 h^2 without smoothing: what the fits make of noise is all there is. */
static void check_noise(const struct gnp_sample_options *sample, const char *weights)
{
	struct cloud cloud = sampled("bumpy_torus", sample, 0);
	struct gnp_flow_options learned = gnp_with(weights), plain = gmls();
	learned.dt = plain.dt = 1.6 * 9.03 / (double)sample->count;
	learned.smoothing_radius = plain.smoothing_radius = 0;
	learned.steps = plain.steps = 20;
	plain.singularity = 1e6; /* its curvatures would stop it sooner */
	struct gnp_flow flow = flowed(&cloud, &learned);
	CHECK(flow.stop == GNP_FLOW_STEPS);
	CHECK(flow.steps == 20 && flow.records[20].curvature < flow.records[0].curvature);
	gnp_flow_clear(&flow);
	const struct gnp_cloud c = {cloud.count, cloud.points, cloud.normals};
	struct gnp_error error = {0};
	gnp_status status = gnp_flow_run(&c, NULL, &plain, pool, NULL, &flow, &error);
	CHECK(status == GNP_INVALID_ARGUMENT || (status == GNP_OK && flow.stop == GNP_FLOW_UNSTABLE));
	CHECK_CONTAINS(status == GNP_OK ? flow.reason : error.text, status == GNP_OK ? "to and fro" : "unstable");
	if (status == GNP_OK)
		gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void noise_that_breaks_least_squares_does_not_break_the_operator(void)
{
	/* as far in spacings as 1e-3 is at 100,000 points */
	check_noise(&(struct gnp_sample_options){.count = 6000, .seed = 3, .noise = 4e-3}, "fit_noise_70k");
}

static void outliers_that_break_least_squares_do_not_break_the_operator(void)
{
	check_noise(&(struct gnp_sample_options){.count = 6000, .seed = 3, .outlier_fraction = 0.1, .outlier_noise = 0.02},
	            "fit_outlier_50k");
}

/* ---- What holds of every flow ---- */

static void check_same(const struct gnp_flow *a, const struct gnp_flow *b)
{
	CHECK(a->count == b->count && a->steps == b->steps && a->count > 0);
	CHECK(memcmp(a->points, b->points, 3 * a->count * sizeof(double)) == 0);
	CHECK(memcmp(a->normals, b->normals, 3 * a->count * sizeof(double)) == 0);
	CHECK(memcmp(a->mean_curvature, b->mean_curvature, a->count * sizeof(double)) == 0);
	CHECK(memcmp(a->index, b->index, a->count * sizeof *a->index) == 0);
}

static void bytes_do_not_depend_on_workers(void)
{
	struct cloud cloud = clean("torus", 2000);
	struct gnp_flow_options options = gmls();
	struct gnp_pool *shared = pool;
	options.steps = 4;
	options.tangential = 0.3;
	for (int scheme = GNP_FLOW_EXPLICIT; scheme <= GNP_FLOW_CONFORMAL; scheme++) {
		struct gnp_flow one, many;
		options.scheme = scheme;
		CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
		one = flowed(&cloud, &options);
		gnp_pool_free(pool);
		CHECK(gnp_pool_create(3, &pool, NULL) == GNP_OK);
		many = flowed(&cloud, &options);
		gnp_pool_free(pool);
		check_same(&one, &many);
		gnp_flow_clear(&one);
		gnp_flow_clear(&many);
	}
	pool = shared;
	cloud_free(&cloud);
}

/* Points in millimetres flow as those in metres do. */
static void defaults_scale_with_the_cloud(void)
{
	struct cloud cloud = clean("ellipsoid", 1500);
	struct gnp_flow_options options = gmls();
	options.steps = 5;
	options.scheme = GNP_FLOW_SEMI_IMPLICIT;
	struct gnp_flow flow = flowed(&cloud, &options);
	for (int power = -3; power <= 3; power += 6) {
		double scale = pow(10, power), worst = 0;
		struct cloud other = cloud_new(cloud.count);
		for (size_t i = 0; i < 3 * cloud.count; i++) {
			other.points[i] = scale * cloud.points[i];
			other.normals[i] = cloud.normals[i];
		}
		struct gnp_flow scaled = flowed(&other, &options);
		CHECK_NEAR(scaled.dt / (scale * scale * flow.dt), 1, 1e-12);
		CHECK(scaled.count == flow.count);
		for (size_t i = 0; i < 3 * flow.count && scaled.count == flow.count; i++)
			worst = fmax(worst, fabs(scaled.points[i] / scale - flow.points[i]));
		CHECK_AT_MOST(worst, 1e-9);
		gnp_flow_clear(&scaled);
		cloud_free(&other);
	}
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void given_normals_say_which_side_is_out(void)
{
	struct cloud cloud = clean("sphere", 1500);
	struct gnp_flow_options options = gmls();
	options.steps = 5;
	for (size_t i = 0; i < 3 * cloud.count; i++)
		cloud.normals[i] = -cloud.normals[i];
	struct gnp_flow flow = flowed(&cloud, &options);
	for (size_t i = 0; i < flow.count; i++)
		CHECK(gnp_dot(flow.points + 3 * i, flow.normals + 3 * i) < 0 && flow.mean_curvature[i] > 0);
	/* H n is the same vector: it shrinks all the same */
	CHECK(flow.records[5].area < flow.records[0].area);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void crowded_points_are_thinned_and_held_ones_stay(void)
{
	struct cloud cloud = clean("sphere", 3000);
	struct gnp_flow_options options = gmls();
	size_t held = 0, left = 0;
	for (size_t i = 0; i < cloud.count; i += 10)
		cloud.fixed[i] = 1, held++;
	options.steps = 1;
	options.spacing = 0.09; /* points are 0.065 apart */
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.count < 2200 && flow.records[1].thinned == (double)(cloud.count - flow.count));
	for (size_t i = 0; i < flow.count; i++) {
		CHECK(flow.index[i] >= 0 && (i == 0 || flow.index[i - 1] < flow.index[i]));
		left += cloud.fixed[flow.index[i]];
		for (size_t j = 0; j < i; j++) {
			const double *p = flow.points + 3 * i, *q = flow.points + 3 * j, d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
			CHECK((cloud.fixed[flow.index[i]] && cloud.fixed[flow.index[j]]) || gnp_dot(d, d) >= 0.09 * 0.09);
		}
	}
	CHECK(left == held);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

/* A sphere that lacks the points about one pole, up to a gap of 1.7 spacings. */
static void gaps_are_filled_from_the_surface(void)
{
	struct cloud cloud = clean("sphere", 3000);
	struct gnp_flow_options options = gmls();
	double h = sqrt(4 * acos(-1) / 3000);
	size_t left = 0;
	for (size_t i = 0; i < cloud.count; i++) {
		const double *p = cloud.points + 3 * i;
		if (p[2] > 0 && hypot(p[0], p[1]) < 1.7 * h)
			continue;
		memmove(cloud.points + 3 * left, p, 3 * sizeof *p);
		memmove(cloud.normals + 3 * left++, cloud.normals + 3 * i, 3 * sizeof *p);
	}
	CHECK(left < cloud.count);
	cloud.count = left;
	options.steps = 1;
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.records[1].inserted > 0 && flow.records[1].inserted < 8);
	CHECK(flow.count == left + (size_t)flow.records[1].inserted);
	for (size_t i = left; i < flow.count; i++) {
		const double *p = flow.points + 3 * i;
		CHECK(flow.index[i] == -1);
		CHECK_NEAR(sqrt(gnp_dot(p, p)), 1 - last_time(&flow), 5e-4);
		CHECK(p[2] > 0 && hypot(p[0], p[1]) < 1.7 * h);
	}
	gnp_flow_clear(&flow);
	options.insertion = 0;
	flow = flowed(&cloud, &options);
	CHECK(flow.count == left);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void moving_along_the_surface_evens_points_out(void)
{
	struct cloud cloud = sampled("sphere", &(struct gnp_sample_options){.count = 2000, .seed = 5}, 0);
	struct gnp_flow_options options = gnp_with("fit_clean_50k");
	struct gnp_random random;
	gnp_random_seed(&random, 5, 0);
	for (size_t i = 0; i < cloud.count; i++) { /* random points, not blue noise */
		double p[3] = {gnp_random_normal(&random), gnp_random_normal(&random), gnp_random_normal(&random)}, r = sqrt(gnp_dot(p, p));
		for (size_t c = 0; c < 3; c++)
			cloud.points[3 * i + c] = cloud.normals[3 * i + c] = p[c] / r;
	}
	options.steps = 12;
	options.dt = 1e-3;
	options.spacing = options.insertion = 0;
	options.tangential = 0.8;
	struct gnp_flow flow = flowed(&cloud, &options);
	struct spread spread = radii(flow.points, flow.normals, flow.count);
	double nearest = INFINITY, before = INFINITY;
	for (size_t i = 0; i < flow.count; i++)
		for (size_t j = 0; j < i; j++) {
			const double *p = flow.points + 3 * i, *q = flow.points + 3 * j, d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
			const double *a = cloud.points + 3 * i, *b = cloud.points + 3 * j, e[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
			nearest = fmin(nearest, gnp_dot(d, d));
			before = fmin(before, gnp_dot(e, e));
		}
	CHECK(nearest > 100 * before);
	CHECK_NEAR(spread.mean * spread.mean, 1 - 2 * 0.012, 4e-4);
	CHECK_AT_MOST(spread.worst, 2e-3);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void snapshots_hold_start_and_end(void)
{
	struct cloud cloud = clean("sphere", 1200);
	struct gnp_flow_options options = gmls();
	options.steps = 5;
	options.snapshot_every = 2;
	struct gnp_flow flow = flowed(&cloud, &options);
	const struct gnp_flow_snapshots *s = &flow.snapshots;
	CHECK(s->count == 4 && s->start[0] == 0);
	CHECK(s->step[0] == 0 && s->step[1] == 2 && s->step[2] == 4 && s->step[3] == 5);
	CHECK(memcmp(s->points, cloud.points, 3 * cloud.count * sizeof(double)) == 0);
	CHECK(memcmp(s->points + 3 * s->start[3], flow.points, 3 * flow.count * sizeof(double)) == 0);
	CHECK(s->start[4] - s->start[3] == flow.count);
	for (size_t i = 0; i < s->count; i++)
		CHECK(s->time[i] == flow.records[s->step[i]].time);
	CHECK_NEAR(flow.records[0].area, 4 * acos(-1), 0.05);
	CHECK_NEAR(flow.records[0].volume, 4 * acos(-1) / 3, 0.03);
	CHECK_NEAR(flow.spacing, sqrt(4 * acos(-1) / 1200), 1e-3);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

/* ---- Bad input and ends ---- */

/* The defaults but for one field. */
static struct gnp_flow_options with(const char *field, double value)
{
	struct gnp_flow_options o = gmls();
	const struct {
		const char *name;
		int *integer;
		double *number;
	} fields[] = {{"scheme", &o.scheme, NULL}, {"volume", &o.volume, NULL}, {"steps", &o.steps, NULL}, {"snapshot_every", &o.snapshot_every, NULL},
	              {"dt", NULL, &o.dt}, {"smoothing_radius", NULL, &o.smoothing_radius}, {"spacing", NULL, &o.spacing},
	              {"insertion", NULL, &o.insertion}, {"tangential", NULL, &o.tangential}, {"projection", NULL, &o.projection},
	              {"singularity", NULL, &o.singularity}, {"spacing_limit", NULL, &o.spacing_limit}};
	size_t found = 0;
	while (strcmp(fields[found].name, field) != 0)
		found++;
	if (fields[found].integer)
		*fields[found].integer = (int)value;
	else
		*fields[found].number = value;
	return o;
}

static void bad_options_are_refused_with_the_limit(void)
{
	struct cloud cloud = clean("sphere", 1200);
	const struct {
		const char *field;
		double value;
		const char *text;
	} rows[] = {
		{"dt", 0, "dt: got 0, need a number above 0"},
		{"dt", -1e-3, "dt: got -0.001, need a number above 0"},
		{"dt", INFINITY, "dt: got inf"},
		{"dt", 1e9, "dt: got 1e+09, need less than 0.5"},
		{"dt", 0.3, "flow: no step can be taken (unstable): dt: got 0.3"},
		{"steps", 0, "steps: got 0, need 1..1000000"},
		{"scheme", 7, "scheme: got 7"},
		{"volume", -1, "volume: got -1"},
		{"smoothing_radius", 1e-9, "smoothing_radius: got 1e-09, need 0.017"},
		{"smoothing_radius", 5, "smoothing_radius: got 5, need 0.017"},
		{"smoothing_radius", -1, "smoothing_radius: got -1, need a length of at least 0"},
		{"spacing", 3, "spacing: got 3, need at most 0.2"},
		{"insertion", 0.01, "insertion: got 0.01, need at least 0.09"},
		{"tangential", 1.5, "tangential: got 1.5, need 0..1"},
		{"projection", -1, "projection: got -1, need 0..1"},
		{"singularity", 0, "singularity: got 0"},
		{"singularity", 0.01, "flow: no step can be taken (singularity): curvature times spacing is 0.1"},
		{"spacing_limit", 1, "spacing_limit: got 1"},
		{"snapshot_every", -1, "snapshot_every: got -1"},
	};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		struct gnp_flow_options options = with(rows[i].field, rows[i].value);
		check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, rows[i].text);
	}
	struct gnp_flow_options many = gmls();
	many.steps = 1000000;
	many.snapshot_every = 1;
	check_refused(&cloud, &many, GNP_TOO_LARGE, "snapshot_every: got 1, 1000002 snapshots of 1200 points need up to 6.72e+10 bytes, need at most 4.29e+09: take one every 16 steps");
	cloud_free(&cloud);
}

/* A point a thousand spacings away does not stretch the lengths that follow the cloud. */
static void a_far_point_does_not_stretch_lengths(void)
{
	struct cloud cloud = clean("sphere", 1200);
	struct gnp_flow_options options = gmls();
	for (int c = 0; c < 3; c++)
		cloud.points[c] = 100;
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK_NEAR(flow.spacing, sqrt(4 * acos(-1) / 1200), 2e-3);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void open_surfaces_have_no_volume_to_keep(void)
{
	struct cloud cloud = clean("plane", 1200);
	struct gnp_flow_options options = gmls();
	options.volume = GNP_FLOW_VOLUME_PRESERVE;
	check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, "volume: got preserve, need a closed surface: ");
	cloud_free(&cloud);
}

static void small_clouds_and_lines_are_refused(void)
{
	struct cloud cloud = clean("sphere", 1200);
	struct gnp_flow_options options = gmls();
	cloud.count = 29;
	check_refused(&cloud, &options, GNP_INVALID_ARGUMENT, "points: got 29, need at least 33");
	cloud.count = 1200;
	for (size_t i = 0; i < cloud.count; i++)
		cloud.points[3 * i + 1] = cloud.points[3 * i + 2] = 0;
	check_refused(&cloud, &options, GNP_DEGENERATE, "points: ");
	cloud_free(&cloud);
}

/* So long a flow of a sphere must end before time 1/2. */
static void sphere_stops_before_it_vanishes(void)
{
	struct cloud cloud = clean("sphere", 1000);
	struct gnp_flow_options options = gmls();
	options.steps = 10000;
	options.scheme = GNP_FLOW_SEMI_IMPLICIT;
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.stop == GNP_FLOW_SINGULARITY || flow.stop == GNP_FLOW_VANISHED);
	CHECK(flow.steps < 10000 && last_time(&flow) < 0.52 && flow.count >= 30);
	for (size_t i = 0; i < 3 * flow.count; i++)
		CHECK(isfinite(flow.points[i]) && isfinite(flow.normals[i]));
	gnp_flow_clear(&flow);
	options.singularity = 1e6;
	flow = flowed(&cloud, &options);
	CHECK(flow.stop != GNP_FLOW_STEPS && flow.reason[0]);
	CHECK(last_time(&flow) < 0.6);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void held_points_alone_do_not_move(void)
{
	struct cloud cloud = clean("sphere", 1000);
	struct gnp_flow_options options = gmls();
	options.steps = 3;
	memset(cloud.fixed, 1, cloud.count);
	for (int scheme = GNP_FLOW_EXPLICIT; scheme <= GNP_FLOW_CONFORMAL; scheme++) {
		options.scheme = scheme;
		struct gnp_flow flow = flowed(&cloud, &options);
		CHECK(flow.count == cloud.count && memcmp(flow.points, cloud.points, 3 * cloud.count * sizeof(double)) == 0);
		gnp_flow_clear(&flow);
	}
	cloud_free(&cloud);
}

/* ---- Cancelling ---- */

static void *cancel_later(void *task)
{
	struct timespec pause = {0, 150000000};
	nanosleep(&pause, NULL);
	gnp_task_cancel(task);
	return NULL;
}

static void flow_stops_when_cancelled(void)
{
	struct cloud cloud = clean("torus", 20000);
	struct gnp_flow_options options = gmls();
	struct gnp_task task;
	struct gnp_flow flow = {0};
	struct gnp_error error = {0};
	pthread_t thread;
	options.steps = 100000;
	gnp_task_init(&task);
	double begun = gnp_clock();
	pthread_create(&thread, NULL, cancel_later, &task);
	const struct gnp_cloud c = {cloud.count, cloud.points, cloud.normals};
	CHECK(gnp_flow_run(&c, NULL, &options, pool, &task, &flow, &error) == GNP_CANCELLED);
	CHECK_AT_MOST(gnp_clock() - begun, 2); /* 0.25 on a machine with nothing else to do */
	CHECK(flow.points == NULL && gnp_task_fraction(&task) < 1);
	pthread_join(thread, NULL);
	cloud_free(&cloud);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(sphere_shrinks_by_its_law),
		TEST(cylinder_between_held_ends_shrinks_by_its_law),
		TEST(surface_between_rings_becomes_a_catenoid),
		TEST(thin_torus_shrinks_to_a_circle_and_says_so),
		TEST(bumpy_torus_loses_its_bumps),
		TEST(ellipsoid_keeping_its_volume_becomes_a_sphere),
		TEST(ellipsoid_tends_to_a_sphere_as_it_shrinks),
		TEST(conformal_flow_makes_a_radial_shape_round),
		TEST(noise_that_breaks_least_squares_does_not_break_the_operator),
		TEST(outliers_that_break_least_squares_do_not_break_the_operator),
		TEST(bytes_do_not_depend_on_workers),
		TEST(defaults_scale_with_the_cloud),
		TEST(given_normals_say_which_side_is_out),
		TEST(crowded_points_are_thinned_and_held_ones_stay),
		TEST(gaps_are_filled_from_the_surface),
		TEST(moving_along_the_surface_evens_points_out),
		TEST(snapshots_hold_start_and_end),
		TEST(bad_options_are_refused_with_the_limit),
		TEST(a_far_point_does_not_stretch_lengths),
		TEST(open_surfaces_have_no_volume_to_keep),
		TEST(small_clouds_and_lines_are_refused),
		TEST(sphere_stops_before_it_vanishes),
		TEST(held_points_alone_do_not_move),
		TEST(flow_stops_when_cancelled),
	};
	gnp_linalg_init();
	CHECK(gnp_pool_create(0, &pool, NULL) == GNP_OK);
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK); /* tests run in the repository's root */
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return failed;
}
