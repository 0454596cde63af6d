/* Requests with a sphere, for the tests of operations: radius 1, points on a spiral, then points off the surface. */
#ifndef GNP_TESTS_CLOUD_REQUEST_H
#define GNP_TESTS_CLOUD_REQUEST_H

#include "proto/operation/call.h"
#include "proto/operation/operations.h"
#include "tests/unit/test.h"

static inline void set_value(struct gnp_tensor *tensor, size_t i, double value)
{
	if (tensor->datatype == GNP_FP64)
		((double *)tensor->data)[i] = value;
	else
		((float *)tensor->data)[i] = (float)value;
}

/* `count` points of the sphere and `far` at twice its radius. */
static inline void add_sphere(struct gnp_request *request, enum gnp_datatype datatype, size_t count, size_t far)
{
	size_t shape[] = {count + far, 3};
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(&request->inputs, "points", datatype, 2, shape, &tensor, NULL) == GNP_OK);
	for (size_t i = 0; i < count + far; i++) {
		size_t at = i < count ? i : (i - count) * (count / (far + 1));
		double z = 1 - (2 * (double)at + 1) / (double)count, r = sqrt(1 - z * z), phi = 2.399963229728653 * (double)at;
		double radius = i < count ? 1 : 2, p[] = {radius * r * cos(phi), radius * r * sin(phi), radius * z};
		for (size_t a = 0; a < 3; a++)
			set_value(tensor, 3 * i + a, p[a]);
	}
}

/* "name=value name=value" as a query gives them. */
static inline void set_parameters(struct gnp_request *request, const char *text)
{
	char copy[256], *rest = NULL;
	snprintf(copy, sizeof copy, "%s", text);
	for (char *pair = strtok_r(copy, " ", &rest); pair; pair = strtok_r(NULL, " ", &rest)) {
		char *equals = strchr(pair, '=');
		*equals = '\0';
		CHECK(gnp_values_add_string(&request->parameters, pair, equals + 1, NULL) == GNP_OK);
	}
}

/* Prepares and runs. The request stays the caller's. */
static inline gnp_status run_request(const char *operation, const struct gnp_request *request, struct gnp_response *response,
                              struct gnp_error *error)
{
	struct gnp_pool *pool = NULL;
	struct gnp_call call;
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	gnp_status status = gnp_call_prepare(gnp_operation_find(operation), request, NULL, &call, error);
	if (status == GNP_OK)
		status = gnp_call_run(&call, pool, NULL, response, error);
	gnp_pool_free(pool);
	return status;
}

/* The same, which must succeed. */
static inline void run_well(const char *operation, const struct gnp_request *request, struct gnp_response *response)
{
	struct gnp_error error = {0};
	CHECK(run_request(operation, request, response, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
}

/* An output with its type and shape checked; columns 0: rank 1. */
static inline const struct gnp_tensor *output(const struct gnp_response *response, const char *name, enum gnp_datatype datatype, size_t rows,
                                       size_t columns)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(&response->outputs, name);
	bool good = tensor && tensor->datatype == datatype && tensor->rank == (columns ? 2 : 1) && tensor->shape[0] == rows &&
	            (!columns || tensor->shape[1] == columns);
	if (!good)
		CHECK_STRING(name, tensor ? "another type or shape" : "missing");
	return good ? tensor : NULL;
}

static inline double number(const struct gnp_response *response, const char *name)
{
	const struct gnp_value *value = gnp_values_find(&response->parameters, name);
	if (!value)
		CHECK_STRING(name, "missing in the report");
	return !value ? NAN : value->type == GNP_VALUE_INTEGER ? (double)value->integer : value->number;
}

static inline const char *text(const struct gnp_response *response, const char *name)
{
	const struct gnp_value *value = gnp_values_find(&response->parameters, name);
	return value && value->type == GNP_VALUE_STRING ? value->string : "";
}

#endif
