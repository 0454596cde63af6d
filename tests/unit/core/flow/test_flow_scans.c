/* Flows of what scanners give: sharp edges, noise, random points, rows, open edges, thin plates. */
#include <math.h>

#include "core/base/random.h"
#include "core/flow/flow.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "tests/laws/flow_laws.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;
static struct gnp_models *models;

/* ---- Clouds ---- */

/* A cube of side 2 by random points, disturbed by so much noise. */
static struct cloud cube(size_t count, double noise)
{
	struct gnp_random random;
	struct cloud cloud = cloud_new(count);
	gnp_random_seed(&random, 5, 0);
	for (size_t i = 0; i < count; i++) {
		size_t axis = i % 3;
		double side = i / 3 % 2 ? 1 : -1;
		for (size_t c = 0; c < 3; c++) {
			double place = c == axis ? side : 2 * gnp_random_uniform(&random) - 1;
			cloud.points[3 * i + c] = place + noise * gnp_random_normal(&random);
			cloud.normals[3 * i + c] = c == axis ? side : 0;
		}
	}
	return cloud;
}

/* Rows of points in the square from 0 to 1 at height z, facing up or down. */
static void sheet(struct cloud *cloud, size_t begin, size_t rows, size_t each, double z, double up, double noise)
{
	struct gnp_random random;
	gnp_random_seed(&random, 7, 0);
	for (size_t i = 0; i < rows * each; i++) {
		double *p = cloud->points + 3 * (begin + i);
		p[0] = (double)(i % each) / (double)(each - 1);
		p[1] = (double)(i / each) / (double)(rows - 1);
		p[2] = z + noise * gnp_random_normal(&random);
		for (size_t c = 0; c < 3; c++)
			cloud->normals[3 * (begin + i) + c] = c == 2 ? up : 0;
	}
}

/* ---- Flows ---- */

static struct gnp_flow flowed(const struct cloud *cloud, const struct gnp_flow_options *options)
{
	struct gnp_flow flow = {0};
	struct gnp_error error = {0};
	const struct gnp_cloud c = {cloud->count, cloud->points, cloud->normals};
	if (gnp_flow_run(&c, NULL, options, pool, NULL, &flow, &error) != GNP_OK)
		CHECK_STRING(error.text, "");
	return flow;
}

static struct gnp_flow_options steps(int count)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.steps = count;
	return options;
}

/* By the model for any cloud. */
static struct gnp_flow_options any(int count)
{
	struct gnp_flow_options options = steps(count);
	options.estimate.estimator = GNP_ESTIMATOR_GNP;
	options.estimate.models = models;
	return options;
}

/* How far points about the middle of the cube's faces are off each face's mean, root mean square. */
static double roughness(const double *points, size_t count)
{
	double sum = 0, all = 0;
	for (size_t face = 0; face < 6; face++) {
		size_t axis = face / 2, within = 0;
		double side = face % 2 ? 1 : -1, mean = 0, square = 0;
		for (size_t i = 0; i < count; i++) {
			const double *p = points + 3 * i;
			if (side * p[axis] < 0.5 || fabs(p[(axis + 1) % 3]) > 0.5 || fabs(p[(axis + 2) % 3]) > 0.5)
				continue;
			within++;
			mean += p[axis];
			square += p[axis] * p[axis];
		}
		CHECK(within > 0);
		sum += square - mean * mean / (double)within;
		all += (double)within;
	}
	return sqrt(sum / all);
}

static void extent(const double *points, size_t count, size_t axis, double *low, double *high)
{
	*low = *high = points[axis];
	for (size_t i = 0; i < count; i++) {
		*low = fmin(*low, points[3 * i + axis]);
		*high = fmax(*high, points[3 * i + axis]);
	}
}

static double deviation(const double *points, size_t count)
{
	double mean = 0, sum = 0;
	for (size_t i = 0; i < count; i++)
		mean += points[3 * i + 2] / (double)count;
	for (size_t i = 0; i < count; i++)
		sum += pow(points[3 * i + 2] - mean, 2) / (double)count;
	return sqrt(sum);
}

/* ---- Cases ---- */

/* "no step can be taken (singularity)" was all that scans got. */
static void sharp_edges_and_noise_are_rounded_first(void)
{
	struct cloud cloud = cube(3000, 0.03);
	struct gnp_flow_options options = steps(10);
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.stop == GNP_FLOW_STEPS && flow.steps == 10);
	CHECK_AT_MOST(roughness(flow.points, flow.count), roughness(cloud.points, cloud.count) / 2);
	CHECK(flow.unresolved > 0.1);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

/* Explicit steps refuse the same cloud, as they always did; where they are made to go on, dt is halved until one can be
 * taken, and the record's times say which. */
static void a_step_left_open_is_halved_until_it_can_be_made(void)
{
	struct cloud cloud = cube(3000, 0.03);
	struct gnp_flow_options options = steps(2);
	struct gnp_error error = {0};
	struct gnp_flow none;
	const struct gnp_cloud c = {cloud.count, cloud.points, cloud.normals};
	options.scheme = GNP_FLOW_EXPLICIT;
	CHECK(gnp_flow_run(&c, NULL, &options, pool, NULL, &none, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "flow: no step can be taken (singularity): curvature times spacing is ");
	CHECK_CONTAINS(error.text, "scheme=semi_implicit");
	options.singularity = 1e6;
	options.smoothing_radius = 0;
	options.steps = 1;
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.steps == 1 && flow.records[1].time < 0.6 * flow.dt);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

/* Displacements are along normals, so nothing pulls an edge inwards. */
static void an_open_patch_stays_where_it_ends(void)
{
	struct cloud cloud = cloud_new(1600);
	struct gnp_flow_options options = any(10);
	sheet(&cloud, 0, 40, 40, 0, 1, 0.005);
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.stop == GNP_FLOW_STEPS);
	for (size_t axis = 0; axis < 2; axis++) {
		double low, high;
		extent(flow.points, flow.count, axis, &low, &high);
		CHECK_AT_MOST(fabs(low), 0.005);
		CHECK_AT_MOST(fabs(high - 1), 0.005);
	}
	CHECK_AT_MOST(deviation(flow.points, flow.count), deviation(cloud.points, cloud.count) / 2);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void rows_of_a_scanner_take_their_steps(void)
{
	struct cloud cloud = cloud_new(16 * 100);
	struct gnp_flow_options options = any(5);
	sheet(&cloud, 0, 16, 100, 0, 1, 0.002);
	struct gnp_flow flow = flowed(&cloud, &options);
	double low, high;
	extent(flow.points, flow.count, 1, &low, &high);
	CHECK(flow.stop == GNP_FLOW_STEPS && low > -0.02 && high < 1.02 && high - low > 0.98);
	CHECK_AT_MOST(deviation(flow.points, flow.count), deviation(cloud.points, cloud.count) / 2);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

/* Two sheets three spacings apart that face away from each other. */
static void a_thin_plate_keeps_its_thickness(void)
{
	struct cloud cloud = cloud_new(2 * 900);
	struct gnp_flow_options options = any(5);
	double gap = 3.0 / 29, up = 0, down = 0, above = 0, below = 0;
	sheet(&cloud, 0, 30, 30, gap, 1, 0);
	sheet(&cloud, 900, 30, 30, 0, -1, 0);
	struct gnp_flow flow = flowed(&cloud, &options);
	CHECK(flow.stop == GNP_FLOW_STEPS);
	for (size_t i = 0; i < flow.count; i++) {
		bool top = flow.normals[3 * i + 2] > 0;
		*(top ? &up : &down) += flow.points[3 * i + 2];
		*(top ? &above : &below) += 1;
	}
	CHECK_NEAR(up / above - down / below, gap, 0.05 * gap);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(sharp_edges_and_noise_are_rounded_first), TEST(a_step_left_open_is_halved_until_it_can_be_made),
		TEST(an_open_patch_stays_where_it_ends), TEST(rows_of_a_scanner_take_their_steps),
		TEST(a_thin_plate_keeps_its_thickness)};
	gnp_linalg_init();
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return failed;
}
