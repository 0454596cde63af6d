/* The operation filter from request to answer: what is kept and dropped of a sphere with points off it, types, report. */
#include "tests/bench/cloud_request.h"

#include <stdint.h>

enum { ON = 2000, FAR = 20, ALL = ON + FAR };

static void check_kept(const struct gnp_request *request, const struct gnp_response *response, enum gnp_datatype datatype)
{
	const struct gnp_tensor *cloud = gnp_tensors_find(&request->inputs, "points");
	size_t kept = (size_t)number(response, "kept"), at = 0;
	const struct gnp_tensor *keep = output(response, "keep", GNP_BOOL, ALL, 0);
	const struct gnp_tensor *index = output(response, "index", GNP_INT64, kept, 0);
	const struct gnp_tensor *points = output(response, "points", datatype, kept, 3);
	for (size_t i = 0; i < ALL && keep && index && points; i++) {
		CHECK(gnp_tensor_get(keep, i) == (i < ON));
		if (gnp_tensor_get(keep, i) == 0)
			continue;
		CHECK(gnp_tensor_get(index, at) == (double)i);
		for (size_t a = 0; a < 3; a++)
			CHECK(gnp_tensor_get(points, 3 * at + a) == gnp_tensor_get(cloud, 3 * i + a));
		at++;
	}
	CHECK(at == kept);
}

static void far_points_are_dropped_and_the_rest_is_as_it_was(void)
{
	static const enum gnp_datatype datatypes[] = {GNP_FP32, GNP_FP64};
	for (int t = 0; t < 2; t++) {
		struct gnp_request request = {0};
		struct gnp_response response = {0};
		add_sphere(&request, datatypes[t], ON, FAR);
		set_parameters(&request, "estimator=adaptive gross=3");
		run_well("filter", &request, &response);
		check_kept(&request, &response, datatypes[t]);
		output(&response, "deviation", datatypes[t], ALL, 0);
		const struct gnp_tensor *normals = output(&response, "normals", datatypes[t], ON, 3);
		const struct gnp_tensor *points = gnp_tensors_find(&response.outputs, "points");
		for (size_t i = 0; normals && i < 3 * ON; i++)
			CHECK_NEAR(gnp_tensor_get(normals, i), gnp_tensor_get(points, i), 0.02);
		CHECK(number(&response, "dropped_gross") + number(&response, "dropped_deviation") + number(&response, "dropped_consensus") == FAR);
		CHECK_STRING(text(&response, "estimator"), "adaptive");
		CHECK_STRING(text(&response, "warnings"), "");
		CHECK(number(&response, "patches") > 0 && !gnp_values_find(&response.parameters, "stop"));
		gnp_response_clear(&response);
		gnp_request_clear(&request);
	}
}

static void projection_moves_points_and_says_how_it_ended(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	add_sphere(&request, GNP_FP64, ON, 0);
	struct gnp_tensor *cloud = &request.inputs.items[0];
	for (size_t i = 0; i < 3 * ON; i++) /* rough */
		((double *)cloud->data)[i] *= 1 + 0.002 * ((double)(i / 3 * 7919 % 101) / 100 - 0.5);
	set_parameters(&request, "estimator=gmls alpha=1000000 project=true iterations=3 tolerance=0");
	run_well("filter", &request, &response);
	const struct gnp_tensor *points = output(&response, "points", GNP_FP64, ON, 3);
	double before = 0, after = 0;
	for (size_t i = 0; points && i < ON; i++) {
		const double *p = (const double *)cloud->data + 3 * i, *q = (const double *)points->data + 3 * i;
		before += fabs(sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1);
		after += fabs(sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) - 1);
	}
	CHECK_AT_MOST(after, 0.8 * before);
	CHECK(number(&response, "iterations") >= 1 && number(&response, "moved") > 0 && text(&response, "stop")[0]);
	gnp_response_clear(&response);
	gnp_request_clear(&request);
}

static void only_wanted_outputs_are_made(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	add_sphere(&request, GNP_FP32, ON, 0);
	set_parameters(&request, "estimator=gmls outputs=index,keep");
	run_well("filter", &request, &response);
	CHECK(response.outputs.count == 2);
	CHECK_STRING(response.outputs.items[0].name, "keep");
	CHECK_STRING(response.outputs.items[1].name, "index");
	gnp_response_clear(&response);
	gnp_request_clear(&request);
}

static int ascending(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

/* A rough sphere, and for alpha its median deviation. */
static void noise_is_told_from_contamination(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	add_sphere(&request, GNP_FP64, ON, 0);
	struct gnp_tensor *cloud = &request.inputs.items[0];
	for (size_t i = 0; i < 3 * ON; i++)
		((double *)cloud->data)[i] *= 1 + 0.002 * ((double)(i / 3 * 7919 % 101) / 100 - 0.5);
	set_parameters(&request, "estimator=gmls alpha=1000000");
	run_well("filter", &request, &response);
	struct gnp_tensor *deviation = (struct gnp_tensor *)(uintptr_t)output(&response, "deviation", GNP_FP64, ON, 0);
	double median = 0;
	if (deviation) {
		qsort(deviation->data, ON, sizeof(double), ascending);
		median = ((double *)deviation->data)[ON / 2];
	}
	gnp_response_clear(&response);
	gnp_values_clear(&request.parameters);
	set_parameters(&request, "estimator=gmls");
	gnp_values_add_number(&request.parameters, "alpha", median, NULL);
	run_well("filter", &request, &response);
	CHECK_NEAR(number(&response, "kept"), ON / 2, 1);
	CHECK_CONTAINS(text(&response, "warnings"), "dropped: 50 % of the points were dropped by a limit that cuts through them: ");
	gnp_response_clear(&response);
	gnp_request_clear(&request);
	for (double share = 0.1; share < 0.25; share += 0.1) { /* of outliers, on a cloud without noise */
		add_sphere(&request, GNP_FP64, ON, (size_t)(share * ON));
		set_parameters(&request, "estimator=gmls");
		run_well("filter", &request, &response);
		CHECK(!strstr(text(&response, "warnings"), "dropped: "));
		CHECK(number(&response, "kept") > 0.98 * ON);
		gnp_response_clear(&response);
		gnp_request_clear(&request);
	}
}

static void check_refused(const char *parameters, gnp_status status, const char *want)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_error error = {0};
	add_sphere(&request, GNP_FP32, ON, 0);
	set_parameters(&request, parameters);
	CHECK(run_request("filter", &request, &response, &error) == status);
	CHECK_CONTAINS(error.text, want);
	CHECK(response.outputs.count == 0);
	gnp_request_clear(&request);
}

static void bad_parameters_are_refused(void)
{
	check_refused("alpha=-1", GNP_INVALID_ARGUMENT, "alpha: got -1, need 0..1000000");
	check_refused("alpha=nan", GNP_INVALID_ARGUMENT, "alpha: got \"nan\", need a number");
	check_refused("gross=0.5 estimator=gmls", GNP_INVALID_ARGUMENT, "gross: got 0.5, need");
	check_refused("cluster=0", GNP_INVALID_ARGUMENT, "cluster: got 0, need 1..1000000");
	check_refused("iterations=101", GNP_INVALID_ARGUMENT, "iterations: got 101, need 1..100");
	check_refused("project=maybe", GNP_INVALID_ARGUMENT, "project: got \"maybe\", need true or false");
	check_refused("outputs=nothing", GNP_INVALID_ARGUMENT, "outputs: unknown \"nothing\", known: keep, deviation, points, index, normals");
	check_refused("consensus=true", GNP_UNAVAILABLE, "weights: none are loaded, the estimator gnp needs some");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(far_points_are_dropped_and_the_rest_is_as_it_was), TEST(projection_moves_points_and_says_how_it_ended),
	                                    TEST(only_wanted_outputs_are_made), TEST(noise_is_told_from_contamination),
	                                    TEST(bad_parameters_are_refused)};
	return RUN_TESTS(tests);
}
