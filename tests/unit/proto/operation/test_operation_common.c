/* What operations share on the way back: numbers that single precision cannot hold. */
#include "tests/bench/cloud_request.h"

enum { COUNT = 3000 };

static struct gnp_request sphere_of(double radius, enum gnp_datatype datatype, const char *parameters)
{
	struct gnp_request request = {0};
	add_sphere(&request, datatype, COUNT, 0);
	struct gnp_tensor *points = &request.inputs.items[0];
	for (size_t i = 0; i < 3 * COUNT; i++)
		set_value(points, i, radius * gnp_tensor_get(points, i));
	set_parameters(&request, parameters);
	return request;
}

/* K of so small a sphere is 1e50; it came out as infinity. */
static void numbers_beyond_single_precision_are_refused(void)
{
	static const char *const operations[] = {"estimate", "flow"};
	for (size_t o = 0; o < 2; o++) {
		struct gnp_request request = sphere_of(o ? 1e-40 : 1e-25, GNP_FP32, "estimator=gmls");
		struct gnp_response response = {0};
		struct gnp_error error = {0};
		CHECK(run_request(operations[o], &request, &response, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, o ? "mean_curvature: number " : "gaussian_curvature: number ");
		CHECK_CONTAINS(error.text, "single precision ends at 3.40282e+38: send points as FP64, or in another unit of length");
		CHECK(response.outputs.count == 0);
		gnp_request_clear(&request);
	}
}

/* K of so large a one is 1e-50; it came out as 0, as if the sphere were flat. */
static void numbers_that_vanish_in_single_precision_are_told(void)
{
	struct gnp_request request = sphere_of(1e25, GNP_FP32, "estimator=gmls");
	struct gnp_response response = {0};
	run_well("estimate", &request, &response);
	CHECK_CONTAINS(text(&response, "warnings"), "range: 3000 of 3000 numbers of gaussian_curvature are too small for single precision and came out as 0");
	gnp_response_clear(&response);
	gnp_request_clear(&request);
}

static void double_precision_holds_both(void)
{
	for (int s = -1; s <= 1; s += 2) {
		double radius = s < 0 ? 1e-25 : 1e25;
		struct gnp_request request = sphere_of(radius, GNP_FP64, "estimator=gmls");
		struct gnp_response response = {0};
		run_well("estimate", &request, &response);
		const struct gnp_tensor *k = output(&response, "gaussian_curvature", GNP_FP64, COUNT, 0);
		for (size_t i = 0; k && i < COUNT; i++)
			CHECK_NEAR(gnp_tensor_get(k, i) * radius * radius, 1, 0.1);
		CHECK(!strstr(text(&response, "warnings"), "range: "));
		gnp_response_clear(&response);
		gnp_request_clear(&request);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(numbers_beyond_single_precision_are_refused), TEST(numbers_that_vanish_in_single_precision_are_told),
	                                    TEST(double_precision_holds_both)};
	return RUN_TESTS(tests);
}
