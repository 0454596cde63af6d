/* Calls: requests that are checked against their operation, and a run on a sphere with exact geometry. */
#include "tests/unit/test.h"

#include "core/estimate/estimate.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"

static const struct gnp_operation *estimate(void)
{
	return gnp_operation_find("estimate");
}

static void add(struct gnp_request *request, const char *name, enum gnp_datatype datatype, size_t rows, size_t columns)
{
	size_t shape[] = {rows, columns};
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(&request->inputs, name, datatype, 2, shape, &tensor, NULL) == GNP_OK);
	memset(tensor->data, 0, tensor->size);
}

static void check_request_error(struct gnp_request *request, size_t most, gnp_status status, const char *want)
{
	struct gnp_limits limits = {.points = most};
	struct gnp_error error = {0};
	struct gnp_call call;
	CHECK(gnp_call_prepare(estimate(), request, &limits, &call, &error) == status);
	CHECK_CONTAINS(error.text, want);
	gnp_request_clear(request);
}

static void requests_are_checked(void)
{
	struct gnp_request request = {0};
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "input \"points\": missing");
	add(&request, "points", GNP_FP32, 5, 2);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "input \"points\": shape [5,2], need [n,3]");
	add(&request, "points", GNP_BOOL, 5, 3);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "datatype BOOL, need a numeric one");
	add(&request, "points", GNP_FP32, 5, 3);
	add(&request, "normals", GNP_FP32, 4, 3);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "input \"normals\": 4 rows, need 5");
	add(&request, "points", GNP_FP32, 5, 3);
	add(&request, "colors", GNP_FP32, 5, 3);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "unknown input \"colors\", known: points, normals");
	add(&request, "points", GNP_FP32, 5, 3);
	add(&request, "points", GNP_FP32, 5, 3);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "input \"points\": given twice");
	add(&request, "points", GNP_FP32, 5, 3);
	check_request_error(&request, 4, GNP_TOO_LARGE, "points: got 5, need at most 4");
	add(&request, "points", GNP_FP32, 5, 3);
	gnp_values_add_string(&request.parameters, "colour", "red", NULL);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "unknown parameter \"colour\", known: estimator");
	add(&request, "points", GNP_FP32, 5, 3);
	gnp_values_add_number(&request.parameters, "k", 30.25, NULL);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "k: got 30.25, need an integer");
	add(&request, "points", GNP_FP32, 5, 3);
	gnp_values_add_bool(&request.parameters, "k", true, NULL);
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "k: got \"true\", need an integer");
	add(&request, "points", GNP_FP32, 5, 3);
	gnp_values_add_integer(&request.parameters, "weights", 7, NULL);
	check_request_error(&request, 0, GNP_UNAVAILABLE, "weights: got \"7\", known: none are loaded");
}

static void ask(struct gnp_request *request, const char *name)
{
	request->outputs = realloc(request->outputs, (request->output_count + 1) * sizeof *request->outputs);
	memset(&request->outputs[request->output_count], 0, sizeof *request->outputs);
	snprintf(request->outputs[request->output_count++].name, GNP_TENSOR_NAME_MAX, "%s", name);
}

static void requested_outputs_override_quantities(void)
{
	struct gnp_request request = {0};
	struct gnp_call call;
	add(&request, "points", GNP_INT16, 50, 3);
	gnp_values_add_string(&request.parameters, "quantities", "all", NULL);
	gnp_values_add_number(&request.parameters, "k", 40.0, NULL);
	gnp_values_add_integer(&request.parameters, "priority", 3, NULL);
	gnp_values_add_integer(&request.parameters, "timeout", 5, NULL);
	gnp_values_add_string(&request.parameters, "triton_x", "y", NULL);
	gnp_values_add_bool(&request.parameters, "sequence_start", true, NULL);
	ask(&request, "metric");
	CHECK(gnp_call_prepare(estimate(), &request, NULL, &call, NULL) == GNP_OK);
	const struct gnp_estimate_options *options = gnp_call_options(&call);
	CHECK(options->quantities == GNP_QUANTITY_BIT(GNP_METRIC) && options->k == 40 && call.points == 50 &&
	      call.memory > 0);
	ask(&request, "metric");
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "output \"metric\": asked for twice");
	add(&request, "points", GNP_FP32, 5, 3);
	ask(&request, "colour");
	check_request_error(&request, 0, GNP_INVALID_ARGUMENT, "unknown output \"colour\", known: points, normals");
}

/* What is wrong with numbers alone is said before anything is computed; a job was taken and failed. */
static void too_few_points_are_known_before(void)
{
	static const struct {
		const char *operation, *name, *value;
		size_t points;
		const char *text;
	} cases[] = {{"estimate", "k", "30", 29, "points: got 29, need at least 30"},
	             {"estimate", "k", "400", 300, "points: got 300, need at least 400"},
	             {"estimate", "degree", "7", 300, "k: got 30, need at least 64 for degree 7"},
	             {"filter", "k", "31", 30, "points: got 30, need at least 31"},
	             {"flow", "k", "31", 30, "points: got 30, need at least "},
	             {"flow", "outputs", "snapshot_points", 300,
	              "snapshot_points: needs snapshot_every, got 0, need at least 1"},
	             {"laplacian", "stencil", "14", 300, "stencil: got 14, need 0 or at least 21 for function_degree 5"},
	             {"laplacian", "k", "12", 11, "points: got 11, need at least 12"},
	             {"spectrum", "system", "square", 135, "points: got 135, need at least 136, 4 count + 96"},
	             {"spectrum", "count", "10", 9, "points: got 9, need at least 10, as many as count"},
	             {"laplacian", "outputs", "stiffness", 300, "outputs: got stiffness, which system=symmetric alone has"},
	             {"laplacian", "outputs", "mass", 300, "outputs: got mass, which system=symmetric alone has"},
	             {"geodesic", "source", "300", 300, "source: got 300, need at most 299"}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct gnp_request request = {0};
		struct gnp_call call;
		struct gnp_error error = {0};
		add(&request, "points", GNP_FP32, cases[i].points, 3);
		gnp_values_add_string(&request.parameters, "estimator", "gmls", NULL);
		gnp_values_add_string(&request.parameters, cases[i].name, cases[i].value, NULL);
		CHECK(gnp_call_prepare(gnp_operation_find(cases[i].operation), &request, NULL, &call,
		                       &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, cases[i].text);
		gnp_request_clear(&request);
	}
}

/* A Fibonacci sphere of radius 2. */
static void add_sphere(struct gnp_request *request, enum gnp_datatype datatype, size_t count)
{
	add(request, "points", datatype, count, 3);
	struct gnp_tensor *tensor = &request->inputs.items[0];
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z), phi = 2.399963229728653 * (double)i;
		double p[] = {2 * r * cos(phi), 2 * r * sin(phi), 2 * z};
		for (int a = 0; a < 3; a++) {
			if (datatype == GNP_FP64)
				((double *)tensor->data)[3 * i + (size_t)a] = p[a];
			else
				((float *)tensor->data)[3 * i + (size_t)a] = (float)p[a];
		}
	}
}

static void a_sphere_has_its_curvatures(void)
{
	static const enum gnp_datatype datatypes[] = {GNP_FP32, GNP_FP64};
	struct gnp_pool *pool = NULL;
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	for (int t = 0; t < 2; t++) {
		struct gnp_request request = {0};
		struct gnp_response response = {0};
		struct gnp_call call;
		struct gnp_task task;
		struct gnp_error error = {0};
		gnp_task_init(&task);
		add_sphere(&request, datatypes[t], 2000);
		gnp_values_add_string(&request.parameters, "estimator", "gmls", NULL);
		gnp_values_add_string(&request.parameters, "quantities", "normals,mean_curvature,surface_coefficients,tangents",
		                      NULL);
		CHECK(gnp_call_prepare(estimate(), &request, NULL, &call, &error) == GNP_OK);
		CHECK(gnp_call_run(&call, pool, &task, &response, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		CHECK(response.outputs.count == 4);
		const struct gnp_tensor *h = gnp_tensors_find(&response.outputs, "mean_curvature");
		const struct gnp_tensor *c = gnp_tensors_find(&response.outputs, "surface_coefficients");
		const struct gnp_tensor *s = gnp_tensors_find(&response.outputs, "tangents");
		CHECK(h && h->datatype == datatypes[t] && h->rank == 1 && h->shape[0] == 2000);
		CHECK(c && c->rank == 2 && c->shape[1] == 16);
		CHECK(s && s->rank == 3 && s->shape[1] == 2 && s->shape[2] == 3);
		double worst = 0;
		for (size_t i = 0; h && i < 2000; i++)
			worst = fmax(worst, fabs(gnp_tensor_get(h, i) + 0.5));
		CHECK_AT_MOST(worst, 0.02);
		const struct gnp_value *k = gnp_values_find(&response.parameters, "k");
		CHECK(k && k->integer == 30);
		CHECK(gnp_values_find(&response.parameters, "normals_estimated")->boolean);
		CHECK_STRING(gnp_values_find(&response.parameters, "estimator")->string, "gmls");
		CHECK(gnp_values_find(&response.parameters, "seconds_neighbors") != NULL);
		gnp_response_clear(&response);
		gnp_request_clear(&request);
	}
	gnp_pool_free(pool);
}

static void a_failed_run_leaves_no_outputs(void)
{
	struct gnp_pool *pool = NULL;
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_call call;
	struct gnp_error error = {0};
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	add(&request, "points", GNP_FP32, 100, 3); /* all at the origin */
	CHECK(gnp_call_prepare(estimate(), &request, NULL, &call, NULL) == GNP_OK);
	CHECK(gnp_call_run(&call, pool, NULL, &response, &error) == GNP_DEGENERATE);
	CHECK(error.text[0] && response.outputs.count == 0 && response.parameters.count == 0);
	gnp_request_clear(&request);
	gnp_pool_free(pool);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(requests_are_checked),
	                                    TEST(requested_outputs_override_quantities),
	                                    TEST(too_few_points_are_known_before), TEST(a_sphere_has_its_curvatures),
	                                    TEST(a_failed_run_leaves_no_outputs)};
	return RUN_TESTS(tests);
}
