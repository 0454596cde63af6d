/* The operation flow from request to answer: a sphere shrinks, records and snapshots agree, masks hold, types, report. */
#include "tests/bench/cloud_request.h"

#include <stdint.h>

#include "core/flow/flow.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"

enum { COUNT = 3000 };

static double radius(const struct gnp_tensor *points)
{
	double sum = 0;
	for (size_t i = 0; i < points->shape[0]; i++) {
		double x = gnp_tensor_get(points, 3 * i), y = gnp_tensor_get(points, 3 * i + 1), z = gnp_tensor_get(points, 3 * i + 2);
		sum += sqrt(x * x + y * y + z * z);
	}
	return sum / (double)points->shape[0];
}

static void a_sphere_shrinks_as_it_must(void)
{
	static const enum gnp_datatype datatypes[] = {GNP_FP32, GNP_FP64};
	for (int t = 0; t < 2; t++) {
		struct gnp_request request = {0};
		struct gnp_response response = {0};
		add_sphere(&request, datatypes[t], COUNT, 0);
		set_parameters(&request, "estimator=gmls steps=4");
		run_well("flow", &request, &response);
		size_t rows = (size_t)number(&response, "points");
		const struct gnp_tensor *points = output(&response, "points", datatypes[t], rows, 3);
		const struct gnp_tensor *record = output(&response, "record", GNP_FP64, 5, GNP_FLOW_RECORD_WIDTH);
		output(&response, "normals", datatypes[t], rows, 3);
		output(&response, "mean_curvature", datatypes[t], rows, 0);
		output(&response, "index", GNP_INT64, rows, 0);
		CHECK(response.outputs.count == 5);
		double time = number(&response, "time");
		CHECK_NEAR(points ? radius(points) : NAN, sqrt(1 - 2 * time), 0.01 * time);
		CHECK_NEAR(number(&response, "area"), 4 * M_PI * (1 - 2 * time), 0.05);
		for (size_t i = 0; record && i < 5; i++)
			CHECK(gnp_tensor_get(record, 10 * i) == (double)i);
		CHECK(record && gnp_tensor_get(record, 41) == time && gnp_tensor_get(record, 42) == (double)rows);
		CHECK(record && gnp_tensor_get(record, 11) <= number(&response, "dt"));
		CHECK_STRING(text(&response, "stop"), "steps");
		CHECK_STRING(text(&response, "estimator"), "gmls");
		CHECK(text(&response, "reason")[0] && number(&response, "steps") == 4 && number(&response, "cloud_spacing") > 0);
		gnp_response_clear(&response);
		gnp_request_clear(&request);
	}
}

static void snapshots_are_states_of_the_flow(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	add_sphere(&request, GNP_FP64, COUNT, 0);
	set_parameters(&request, "estimator=gmls steps=5 snapshot_every=2 spacing=0 insertion=0");
	run_well("flow", &request, &response);
	const struct gnp_tensor *start = output(&response, "snapshot_start", GNP_INT64, 5, 0);
	const struct gnp_tensor *step = output(&response, "snapshot_step", GNP_INT64, 4, 0);
	const struct gnp_tensor *time = output(&response, "snapshot_time", GNP_FP64, 4, 0);
	const struct gnp_tensor *points = output(&response, "snapshot_points", GNP_FP64, 4 * COUNT, 3);
	output(&response, "snapshot_normals", GNP_FP64, 4 * COUNT, 3);
	output(&response, "snapshot_mean_curvature", GNP_FP64, 4 * COUNT, 0);
	const struct gnp_tensor *end = output(&response, "points", GNP_FP64, COUNT, 3);
	const struct gnp_tensor *record = output(&response, "record", GNP_FP64, 6, GNP_FLOW_RECORD_WIDTH);
	static const size_t steps[] = {0, 2, 4, 5};
	for (size_t i = 0; step && time && start && record && i < 4; i++) {
		CHECK(gnp_tensor_get(step, i) == (double)steps[i]);
		CHECK(gnp_tensor_get(start, i) == (double)(i * COUNT));
		CHECK(gnp_tensor_get(time, i) == gnp_tensor_get(record, 10 * steps[i] + 1));
	}
	CHECK(points && memcmp(points->data, request.inputs.items[0].data, 24 * COUNT) == 0);
	CHECK(points && end && memcmp((char *)points->data + 72 * COUNT, end->data, 24 * COUNT) == 0);
	gnp_response_clear(&response);
	gnp_request_clear(&request);
}

static void fixed_points_stay(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	size_t rows = COUNT;
	struct gnp_tensor *mask;
	add_sphere(&request, GNP_FP64, COUNT, 0);
	CHECK(gnp_tensors_add(&request.inputs, "fixed", GNP_FP32, 1, &rows, &mask, NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++)
		((float *)mask->data)[i] = i < 100;
	set_parameters(&request, "estimator=gmls steps=2 spacing=0 insertion=0");
	run_well("flow", &request, &response);
	const struct gnp_tensor *points = output(&response, "points", GNP_FP64, COUNT, 3), *cloud = &request.inputs.items[0];
	CHECK(points && memcmp(points->data, cloud->data, 24 * 100) == 0);
	for (size_t i = 300; points && i < 3 * COUNT; i += 3)
		CHECK(gnp_tensor_get(points, i) != gnp_tensor_get(cloud, i));
	((float *)mask->data)[17] = 3;
	gnp_response_clear(&response);
	struct gnp_error error = {0};
	CHECK(run_request("flow", &request, &response, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "fixed[17]: got 3, need 0 or 1");
	gnp_request_clear(&request);
}

static void an_early_end_is_told(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	add_sphere(&request, GNP_FP64, 1000, 0);
	set_parameters(&request, "estimator=gmls steps=200 dt=0.008");
	run_well("flow", &request, &response);
	char want[80];
	snprintf(want, sizeof want, "flow: it ended after %.0f of 200 steps (%s): ", number(&response, "steps"), text(&response, "stop"));
	CHECK(number(&response, "steps") > 1 && number(&response, "steps") < 200);
	CHECK_CONTAINS(text(&response, "warnings"), want);
	gnp_response_clear(&response);
	gnp_request_clear(&request);
}

static void check_refused(const char *parameters, gnp_status want, const char *said)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_error error = {0};
	add_sphere(&request, GNP_FP32, COUNT, 0);
	set_parameters(&request, parameters);
	CHECK(run_request("flow", &request, &response, &error) == want);
	CHECK_CONTAINS(error.text, said);
	CHECK(response.outputs.count == 0);
	gnp_request_clear(&request);
}

static void bad_parameters_are_refused(void)
{
	check_refused("dt=0", GNP_INVALID_ARGUMENT, "dt: got 0, need auto or >0..1e+200");
	check_refused("dt=-1", GNP_INVALID_ARGUMENT, "dt: got -1, need auto or >0..1e+200");
	check_refused("dt=nan", GNP_INVALID_ARGUMENT, "dt: got \"nan\", need auto or a number");
	check_refused("dt=1e9 estimator=gmls", GNP_INVALID_ARGUMENT, "dt: got 1e+09, need");
	check_refused("steps=0", GNP_INVALID_ARGUMENT, "steps: got 0, need 1..1000000");
	check_refused("scheme=magic", GNP_INVALID_ARGUMENT, "scheme: got \"magic\", need one of explicit, semi_implicit, conformal");
	check_refused("smoothing_radius=-1", GNP_INVALID_ARGUMENT, "smoothing_radius: got -1, need auto or 0..1e+100");
	check_refused("tangential=1.5", GNP_INVALID_ARGUMENT, "tangential: got 1.5, need 0..1");
	check_refused("steps=1000000 snapshot_every=1 estimator=gmls", GNP_TOO_LARGE, "snapshot_every: got 1, ");
	check_refused("outputs=points,snapshot_time estimator=gmls", GNP_INVALID_ARGUMENT,
	              "snapshot_time: needs snapshot_every, got 0, need at least 1");
	check_refused("scheme=explicit", GNP_UNAVAILABLE, "weights: got \"fit_clean_50k\", known: none are loaded");
}

/* Whichever of them are wanted; where none is, no memory goes to any. */
static void snapshots_come_only_when_they_are_wanted(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	add_sphere(&request, GNP_FP32, COUNT, 0);
	set_parameters(&request, "estimator=gmls steps=2 snapshot_every=1 outputs=points,snapshot_step");
	run_well("flow", &request, &response);
	CHECK(response.outputs.count == 2 && output(&response, "snapshot_step", GNP_INT64, 3, 0));
	gnp_response_clear(&response);
	gnp_values_clear(&request.parameters);
	struct gnp_call call;
	set_parameters(&request, "estimator=gmls steps=2 snapshot_every=1 outputs=points");
	CHECK(gnp_call_prepare(gnp_operation_find("flow"), &request, NULL, &call, NULL) == GNP_OK);
	CHECK(((const struct gnp_flow_options *)(const void *)call.options)->snapshot_every == 0);
	gnp_request_clear(&request);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(a_sphere_shrinks_as_it_must), TEST(snapshots_are_states_of_the_flow), TEST(an_early_end_is_told), TEST(fixed_points_stay),
	                                    TEST(bad_parameters_are_refused), TEST(snapshots_come_only_when_they_are_wanted)};
	return RUN_TESTS(tests);
}
