#include "proto/file/result.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/codec/rows.h"
#include "proto/file/file.h"
#include "proto/operation/call.h"

/* ---- What is known before ---- */

/* The outputs a call will answer. */
struct plan {
	const struct gnp_call *call;
	const struct gnp_tensor_info *points; /* of the outputs; NULL: the answer stands beside the request's */
	uint64_t outputs;
};

static const struct gnp_tensor_info *planned(const struct plan *plan, size_t i)
{
	return plan->outputs >> i & 1 ? &plan->call->operation->outputs[i] : NULL;
}

static const struct gnp_tensor_info *find_planned(const struct plan *plan, const char *name)
{
	for (size_t i = 0; i < plan->call->operation->output_count; i++)
		if (planned(plan, i) && strcmp(planned(plan, i)->name, name) == 0)
			return planned(plan, i);
	return NULL;
}

static struct plan make_plan(const struct gnp_call *call)
{
	struct plan plan = {.call = call, .outputs = gnp_call_outputs(call)};
	plan.points = find_planned(&plan, "points");
	return plan;
}

enum fit { NEVER, MAYBE, ALWAYS };

/* Whether an output will have as many rows as the points. */
static enum fit rows_fit(const struct plan *plan, const struct gnp_tensor_info *output)
{
	int64_t extent = plan->points ? plan->points->shape[0] : -1;
	size_t want = gnp_call_rows(plan->call, extent), rows = gnp_call_rows(plan->call, output->shape[0]);
	if (output->shape[0] == extent)
		return ALWAYS;
	if (want == GNP_ROWS_OPEN || rows == GNP_ROWS_OPEN)
		return MAYBE;
	return rows == want ? ALWAYS : NEVER;
}

/* Columns of an output, those of open extents left aside; no more than one too many. */
static size_t columns_of(const struct plan *plan, const struct gnp_tensor_info *output)
{
	size_t columns = 1;
	for (unsigned d = 1; d < output->rank; d++) {
		size_t extent = gnp_call_rows(plan->call, output->shape[d]);
		if (extent < GNP_ROWS_OTHER &&
		    (!gnp_size_multiply(columns, extent, &columns) || columns > GNP_FORMAT_COLUMNS_MAX))
			return GNP_FORMAT_COLUMNS_MAX + 1;
	}
	return columns;
}

static bool has_too_many_columns(const struct plan *plan)
{
	size_t columns = 1 + (plan->points ? 0 : 3);
	for (size_t i = 0; i < plan->call->operation->output_count; i++)
		if (planned(plan, i) && rows_fit(plan, planned(plan, i)) == ALWAYS)
			columns += columns_of(plan, planned(plan, i));
	return columns > GNP_FORMAT_COLUMNS_MAX;
}

/* The best any of the outputs fits in rows; with `wanted` the worst of those that must not be left out. */
static enum fit fit_in_rows(const struct plan *plan, bool wanted)
{
	bool named = gnp_call_names_outputs(plan->call);
	enum fit best = NEVER, worst = ALWAYS;
	for (size_t i = 0; i < plan->call->operation->output_count; i++) {
		const struct gnp_tensor_info *output = planned(plan, i);
		if (!output)
			continue;
		enum fit fit = rows_fit(plan, output);
		best = fit > best ? fit : best;
		if (fit < worst && (named || !output->optional))
			worst = fit;
	}
	return wanted && worst < best ? worst : best;
}

static size_t arrays_beside_points(const struct plan *plan)
{
	return (size_t)__builtin_popcountll(plan->outputs) - (plan->points != NULL);
}

static bool is_one_array(const struct plan *plan)
{
	size_t arrays = arrays_beside_points(plan);
	return arrays == 1 || (arrays == 0 && plan->points);
}

static bool is_matrix(const struct plan *plan)
{
	bool by_rows = find_planned(plan, "row_offsets") && find_planned(plan, "columns");
	bool alone = is_one_array(plan) && find_planned(plan, "mass"); /* the diagonal of one */
	return alone || (by_rows && (find_planned(plan, "values") || find_planned(plan, "stiffness")));
}

bool gnp_result_fits(const struct gnp_format *format, const struct gnp_call *call)
{
	struct plan plan = make_plan(call);
	if (format->holds == GNP_HOLDS_ARRAY)
		return is_one_array(&plan);
	if (format->holds == GNP_HOLDS_MATRIX)
		return is_matrix(&plan);
	return !gnp_format_of_rows(format) || (fit_in_rows(&plan, true) == ALWAYS && !has_too_many_columns(&plan));
}

gnp_status gnp_result_check(const struct gnp_format *format, const struct gnp_call *call, struct gnp_error *error)
{
	struct plan plan = make_plan(call);
	if (format->holds == GNP_HOLDS_ARRAY && !is_one_array(&plan))
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE,
		                     "%s: holds one array beside points, the answer has %zu: ask for npz or one output",
		                     format->name, arrays_beside_points(&plan));
	if (format->holds == GNP_HOLDS_MATRIX && !is_matrix(&plan))
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE,
		                     "%s: needs row_offsets, columns and values, a sparse matrix, which %s does not answer",
		                     format->name, call->operation->name);
	if (gnp_format_of_rows(format) && fit_in_rows(&plan, false) == NEVER)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE,
		                     "%s: the points have %zu rows, and none of the outputs has: ask for npz or json",
		                     gnp_format_name(format), call->points);
	if (gnp_format_of_rows(format) && has_too_many_columns(&plan))
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: more than %d columns: ask for npz",
		                     gnp_format_name(format), GNP_FORMAT_COLUMNS_MAX);
	return GNP_OK;
}

/* ---- Encoding ---- */

static gnp_status borrow(struct gnp_tensors *tensors, const struct gnp_tensor *tensor, struct gnp_error *error)
{
	return gnp_tensors_add_data(tensors, tensor->name, tensor->datatype, tensor->rank, tensor->shape, tensor->data,
	                            false, NULL, error);
}

/* Whether a file of the format can hold the tensor beside the points. */
static bool is_carried(const struct gnp_format *format, const struct gnp_tensor *points,
                       const struct gnp_tensor *tensor)
{
	return !gnp_format_of_rows(format) || !points || (tensor->rank && tensor->shape[0] == points->shape[0]);
}

/* Borrows what is carried; the names of the rest go to left_out. */
static gnp_status collect(const struct gnp_format *format, const struct gnp_tensor *points,
                          const struct gnp_tensors *outputs,
                          struct gnp_tensors *tensors, struct gnp_buffer *left_out, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (points && !gnp_tensors_find(outputs, "points"))
		status = borrow(tensors, points, error);
	for (size_t i = 0; i < outputs->count && status == GNP_OK; i++) {
		const struct gnp_tensor *output = &outputs->items[i];
		if (is_carried(format, points, output))
			status = borrow(tensors, output, error);
		else
			status = gnp_buffer_printf(left_out, error, "%s%s", left_out->size ? ", " : "", output->name);
	}
	return status;
}

/* The comments with `left_out` before them: where a format cuts them short, this one is kept. */
static gnp_status encode_with(const struct gnp_format *format, const struct gnp_tensors *tensors,
                              const struct gnp_values *comments,
                              const struct gnp_buffer *left_out, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_value first = {.name = "left_out", .type = GNP_VALUE_STRING, .string = (char *)left_out->data};
	struct gnp_values all = {.count = comments->count + 1};
	all.items = gnp_array_new(all.count, sizeof *all.items);
	if (!all.items)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "result: no memory for %zu comments", all.count);
	all.items[0] = first;
	for (size_t i = 0; i < comments->count; i++)
		all.items[i + 1] = comments->items[i];
	gnp_status status = gnp_file_encode(format, tensors, &all, buffer, error);
	free(all.items); /* what they hold is borrowed */
	return status;
}

gnp_status gnp_result_encode(const struct gnp_format *format, const struct gnp_request *request,
                             const struct gnp_response *response, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const struct gnp_tensors *outputs = &response->outputs;
	const struct gnp_tensor *points = gnp_tensors_find(outputs, "points");
	struct gnp_tensors tensors = {0};
	struct gnp_buffer left_out = {0};
	if (!points)
		points = gnp_tensors_find(&request->inputs, "points");
	gnp_status status = collect(format, points, outputs, &tensors, &left_out, error);
	bool nothing = left_out.size && tensors.count == !gnp_tensors_find(outputs, "points");
	if (status == GNP_OK && nothing)
		status = gnp_error_set(error, GNP_NOT_ACCEPTABLE,
		                       "%s: the points have %zu rows, and other numbers of rows have %.200s: ask for npz or "
		                       "json", gnp_format_name(format), points->shape[0], (const char *)left_out.data);
	if (status == GNP_OK && left_out.size)
		status = encode_with(format, &tensors, &response->parameters, &left_out, buffer, error);
	else if (status == GNP_OK)
		status = gnp_file_encode(format, &tensors, &response->parameters, buffer, error);
	gnp_buffer_clear(&left_out);
	gnp_tensors_clear(&tensors);
	return status;
}
