#include "proto/equation/operation_conditions.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/equations/load.h"

static const char *const columns[] = {"source", "source_strengths", "values", "flux"};
enum { COLUMNS = sizeof columns / sizeof *columns };

static bool has(const struct gnp_call *call, const char *name)
{
	return gnp_tensors_find(&call->request->inputs, name) != NULL;
}

/* The input that says how many columns there are; NULL: none does. */
static const char *leader(const struct gnp_call *call, const char *first)
{
	if (has(call, first))
		return first;
	for (size_t i = 0; i < COLUMNS; i++)
		if (has(call, columns[i]))
			return columns[i];
	return NULL;
}

size_t gnp_conditions_sides(const struct gnp_call *call, const char *first)
{
	const char *name = leader(call, first);
	return name ? gnp_equation_sides(call, name) : 1;
}

/* An input that says nothing without another one. */
static gnp_status check_pair(const struct gnp_call *call, const char *name, const char *needs, const char *says,
                             struct gnp_error *error)
{
	if (!has(call, name) || has(call, needs))
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: need the input %s, which says %s", name, needs, says);
}

static gnp_status check_strengths(const struct gnp_call *call, struct gnp_error *error)
{
	const struct gnp_tensors *inputs = &call->request->inputs;
	const struct gnp_tensor *at = gnp_tensors_find(inputs, "source_points");
	const struct gnp_tensor *strengths = gnp_tensors_find(inputs, "source_strengths");
	if (!at || !strengths || at->shape[0] == strengths->shape[0])
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "source_strengths: got %zu rows, need %zu as source_points has",
	                     strengths->shape[0], at->shape[0]);
}

gnp_status gnp_conditions_check(const struct gnp_call *call, const char *first, struct gnp_error *error)
{
	const char *name = leader(call, first);
	gnp_status status = name ? gnp_equation_check_columns(call, name, NULL, error) : GNP_OK;
	for (size_t i = 0; i < COLUMNS && status == GNP_OK; i++)
		status = gnp_equation_check_columns(call, columns[i], name, error);
	if (status == GNP_OK)
		status = check_pair(call, "values", "fixed", "where they hold", error);
	if (status == GNP_OK)
		status = check_pair(call, "source_strengths", "source_points", "where they are", error);
	return status == GNP_OK ? check_strengths(call, error) : status;
}

/* Zeros where the input is absent and wanted. */
static gnp_status read_columns(const struct gnp_call *call, const char *name, size_t rows, size_t sides, bool wanted,
                               double **out, struct gnp_error *error)
{
	size_t count, found;
	gnp_status status = gnp_equation_columns(call, name, out, &found, error);
	if (status != GNP_OK || *out || !wanted)
		return status;
	*out = gnp_size_multiply(rows, sides, &count) ? gnp_array_zero(count, sizeof **out) : NULL;
	return *out ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu columns", name, sides);
}

static gnp_status read_points(const struct gnp_call *call, struct gnp_conditions *out, struct gnp_error *error)
{
	const struct gnp_tensor *at = gnp_tensors_find(&call->request->inputs, "source_points");
	if (!at)
		return GNP_OK;
	out->source_count = at->shape[0];
	out->source_points = gnp_array_new(out->source_count, sizeof *out->source_points);
	if (!out->source_points)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "source_points: no memory for %zu", out->source_count);
	for (size_t s = 0; s < out->source_count; s++) {
		double index = gnp_tensor_get(at, s);
		if (!(index >= 0 && index < (double)out->points) || index != (double)(uint32_t)index)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "source_points[%zu]: got %.17g, need an index below %zu", s,
			                     index, out->points);
		out->source_points[s] = (uint32_t)index;
	}
	bool ones = !has(call, "source_strengths");
	gnp_status status = read_columns(call, "source_strengths", out->source_count, out->sides, true, &out->strengths,
	                                 error);
	for (size_t i = 0; ones && status == GNP_OK && i < out->source_count * out->sides; i++)
		out->strengths[i] = 1;
	return status;
}

gnp_status gnp_conditions_read(const struct gnp_call *call, size_t points, size_t sides, struct gnp_conditions *out,
                               struct gnp_error *error)
{
	*out = (struct gnp_conditions){.points = points, .sides = sides};
	gnp_status status = gnp_common_mask_read(call->request, "fixed", &out->fixed, error);
	if (status == GNP_OK)
		status = read_columns(call, "source", points, sides, true, &out->source, error);
	if (status == GNP_OK)
		status = read_columns(call, "values", points, sides, out->fixed != NULL, &out->values, error);
	if (status == GNP_OK)
		status = read_columns(call, "flux", points, sides, false, &out->flux, error);
	return status == GNP_OK ? read_points(call, out, error) : status;
}

void gnp_conditions_clear(struct gnp_conditions *conditions)
{
	free(conditions->source);
	free(conditions->fixed);
	free(conditions->values);
	free(conditions->flux);
	free(conditions->source_points);
	free(conditions->strengths);
	*conditions = (struct gnp_conditions){.points = 0};
}

gnp_status gnp_conditions_load(struct gnp_conditions *conditions, const struct gnp_poisson *poisson,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (conditions->flux)
		status = gnp_load_flux(poisson, conditions->flux, conditions->sides, pool, task, conditions->source, NULL,
		                       error);
	if (status == GNP_OK && conditions->source_points)
		status = gnp_load_points(poisson, conditions->source_points, conditions->strengths, conditions->source_count,
		                         conditions->sides, conditions->source, error);
	return status;
}
