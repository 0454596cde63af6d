#include "tests/property/judge.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "proto/operation/call.h"

static bool wrong(char text[JUDGE_TEXT], const char *format, ...) __attribute__((format(printf, 2, 3)));
static bool wrong(char text[JUDGE_TEXT], const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, JUDGE_TEXT, format, arguments);
	va_end(arguments);
	return false;
}

/* ---- Shapes ---- */

static enum gnp_datatype expected_type(const struct gnp_call *call, const struct gnp_tensor_info *info)
{
	const struct gnp_tensor *points = gnp_tensors_find(&call->request->inputs, "points");
	return info->datatype != GNP_FP32 ? info->datatype : points->datatype == GNP_FP64 ? GNP_FP64 : GNP_FP32;
}

/* Free extents mean the same number in all outputs of an answer. */
static bool shape_fits(const struct gnp_call *call, const struct gnp_tensor_info *info, const struct gnp_tensor *tensor, size_t free[8],
                       char text[JUDGE_TEXT])
{
	if (tensor->rank != info->rank || tensor->datatype != expected_type(call, info))
		return wrong(text, "%s: rank %u of %s, announced rank %u", info->name, tensor->rank, gnp_datatype_name(tensor->datatype), info->rank);
	for (unsigned d = 0; d < info->rank; d++) {
		size_t announced = gnp_call_rows(call, info->shape[d]), got = tensor->shape[d];
		if (announced < GNP_ROWS_OTHER && got != announced)
			return wrong(text, "%s: extent %u is %zu, announced %zu", info->name, d, got, announced);
		if (info->shape[d] >= -1)
			continue;
		size_t *known = &free[-info->shape[d]];
		if (*known != SIZE_MAX && *known != got)
			return wrong(text, "%s: extent %u is %zu, in another output %zu", info->name, d, got, *known);
		*known = got;
	}
	return true;
}

static bool is_in(const char *name, const char *list)
{
	const char *at = strstr(list, name);
	return at && (at == list || at[-1] == ' ') && (at[strlen(name)] == ' ' || at[strlen(name)] == '\0');
}

/* Quantities that some estimators have no answer for: `all` is all there are. */
static const char of_some_estimators[] = "points_stderr normals_stderr gaussian_curvature_stderr mean_curvature_stderr "
                                         "principal_curvatures_stderr outlier crease surface_coefficients";

static bool names_all(const struct gnp_call *call)
{
	const struct gnp_value *value = gnp_values_find(&call->request->parameters, "quantities");
	return !call->request->output_count && value && strcmp(value->string, "all") == 0;
}

static bool judge_shapes(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_operation *operation = call->operation;
	uint64_t wanted = gnp_call_outputs(call);
	size_t free[8], expected = 0;
	memset(free, 0xff, sizeof free);
	for (size_t i = 0; i < operation->output_count; i++) {
		const struct gnp_tensor_info *info = &operation->outputs[i];
		const struct gnp_tensor *tensor = gnp_tensors_find(&response->outputs, info->name);
		if (!(wanted >> i & 1))
			continue;
		if (!tensor && !info->optional && !(names_all(call) && is_in(info->name, of_some_estimators)))
			return wrong(text, "%s: asked for and not answered", info->name);
		expected += tensor != NULL;
		if (tensor && !shape_fits(call, info, tensor, free, text))
			return false;
	}
	return expected == response->outputs.count || wrong(text, "%zu outputs, %zu were asked for", response->outputs.count, expected);
}

/* ---- Numbers ---- */

static bool judge_finite(const struct gnp_call *call, const struct gnp_tensor *tensor, char text[JUDGE_TEXT])
{
	bool may_be_far = strcmp(call->operation->name, "geodesic") == 0; /* the one documented infinity */
	size_t count;
	gnp_tensor_elements(tensor->rank, tensor->shape, &count);
	for (size_t i = 0; i < count; i++) {
		double value = gnp_tensor_get(tensor, i);
		if (!isfinite(value) && !(may_be_far && value > 0))
			return wrong(text, "%s: number %zu is %g", tensor->name, i, value);
	}
	return true;
}

static double close_to(const struct gnp_tensor *tensor)
{
	return tensor->datatype == GNP_FP64 ? 1e-9 : 1e-5;
}

/* Rows of three are unit vectors, `at_a_time` of them orthogonal to each other. */
static bool judge_orthonormal(const struct gnp_tensor *tensor, size_t at_a_time, char text[JUDGE_TEXT])
{
	size_t count;
	gnp_tensor_elements(tensor->rank, tensor->shape, &count);
	for (size_t row = 0; row < count / 3; row++)
		for (size_t other = row / at_a_time * at_a_time; other <= row; other++) {
			double product = 0;
			for (size_t c = 0; c < 3; c++)
				product += gnp_tensor_get(tensor, 3 * row + c) * gnp_tensor_get(tensor, 3 * other + c);
			if (!(fabs(product - (row == other)) <= close_to(tensor)))
				return wrong(text, "%s: vectors %zu and %zu have the product %.9g", tensor->name, row, other, product);
		}
	return true;
}

/* Forms are symmetric; the metric and its inverse positive as well. */
static bool judge_form(const struct gnp_tensor *tensor, bool positive, char text[JUDGE_TEXT])
{
	for (size_t i = 0; i < tensor->shape[0]; i++) {
		double a = gnp_tensor_get(tensor, 4 * i), b = gnp_tensor_get(tensor, 4 * i + 1), c = gnp_tensor_get(tensor, 4 * i + 2),
		       d = gnp_tensor_get(tensor, 4 * i + 3);
		if (!(fabs(b - c) <= close_to(tensor) * fmax(fmax(fabs(a), fabs(d)), fabs(b))))
			return wrong(text, "%s: item %zu has %g and %g", tensor->name, i, b, c);
		if (positive && !(a > 0 && d > 0))
			return wrong(text, "%s: item %zu has %g and %g on its diagonal", tensor->name, i, a, d);
	}
	return true;
}

static bool judge_order(const struct gnp_tensor *tensor, char text[JUDGE_TEXT])
{
	for (size_t i = 0; i < tensor->shape[0]; i++)
		if (gnp_tensor_get(tensor, 2 * i) < gnp_tensor_get(tensor, 2 * i + 1))
			return wrong(text, "%s: item %zu has %g before %g", tensor->name, i, gnp_tensor_get(tensor, 2 * i), gnp_tensor_get(tensor, 2 * i + 1));
	return true;
}

static bool judge_between(const struct gnp_tensor *tensor, double low, double high, char text[JUDGE_TEXT])
{
	size_t count;
	gnp_tensor_elements(tensor->rank, tensor->shape, &count);
	for (size_t i = 0; i < count; i++) {
		double value = gnp_tensor_get(tensor, i);
		if (!(value >= low && value <= high))
			return wrong(text, "%s: number %zu is %.9g, need %g..%g", tensor->name, i, value, low, high);
	}
	return true;
}

/* Mean and Gaussian curvature are those of the principal ones. */
static bool judge_curvatures(const struct gnp_tensors *outputs, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *k = gnp_tensors_find(outputs, "principal_curvatures"), *mean = gnp_tensors_find(outputs, "mean_curvature"),
	                        *gauss = gnp_tensors_find(outputs, "gaussian_curvature");
	for (size_t i = 0; k && i < k->shape[0]; i++) {
		double a = gnp_tensor_get(k, 2 * i), b = gnp_tensor_get(k, 2 * i + 1), size = fmax(fabs(a), fabs(b)), close = 10 * close_to(k);
		if (mean && !(fabs(gnp_tensor_get(mean, i) - (a + b) / 2) <= close * size))
			return wrong(text, "mean_curvature: item %zu is %g where k1 = %g and k2 = %g", i, gnp_tensor_get(mean, i), a, b);
		if (gauss && size > 1e-15 && size < 1e15 && !(fabs(gnp_tensor_get(gauss, i) - a * b) <= close * size * size))
			return wrong(text, "gaussian_curvature: item %zu is %g where k1 = %g and k2 = %g", i, gnp_tensor_get(gauss, i), a, b);
	}
	return true;
}

static bool judge_estimate(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	for (size_t i = 0; i < response->outputs.count; i++) {
		const struct gnp_tensor *tensor = &response->outputs.items[i];
		const char *name = tensor->name;
		bool good = true;
		if (is_in(name, "principal_directions frame"))
			good = judge_orthonormal(tensor, tensor->shape[1], text);
		if (is_in(name, "metric inverse_metric second_fundamental_form"))
			good = judge_form(tensor, name[0] != 's', text);
		if (strcmp(name, "principal_curvatures") == 0)
			good = judge_order(tensor, text);
		if (is_in(name, "outlier boundary crease"))
			good = judge_between(tensor, 0, 1, text);
		if (is_in(name, "residual deviation metric_determinant scale") || strstr(name, "_stderr"))
			good = judge_between(tensor, 0, INFINITY, text);
		if (!good)
			return false;
	}
	(void)call;
	return judge_curvatures(&response->outputs, text);
}

/* ---- Indices ---- */

static bool judge_ascending(const struct gnp_tensor *tensor, bool strictly, double limit, char text[JUDGE_TEXT])
{
	for (size_t i = 0; tensor && i < tensor->shape[0]; i++) {
		double value = gnp_tensor_get(tensor, i), before = i ? gnp_tensor_get(tensor, i - 1) : -1;
		if (!(value >= 0 && value < limit) || (strictly ? value <= before : value < before))
			return wrong(text, "%s: %g at %zu after %g, need less than %g", tensor->name, value, i, before, limit);
	}
	return true;
}

static bool judge_filter(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *keep = gnp_tensors_find(&response->outputs, "keep"), *index = gnp_tensors_find(&response->outputs, "index"),
	                        *deviation = gnp_tensors_find(&response->outputs, "deviation");
	size_t kept = 0;
	for (size_t i = 0; keep && i < keep->shape[0]; i++)
		kept += gnp_tensor_get(keep, i) != 0;
	if (keep && index && kept != index->shape[0])
		return wrong(text, "index: %zu rows, keep has %zu", index->shape[0], kept);
	for (size_t i = 0; keep && index && i < index->shape[0]; i++)
		if (gnp_tensor_get(keep, (size_t)gnp_tensor_get(index, i)) == 0)
			return wrong(text, "index: row %zu is a point that is not kept", i);
	return judge_ascending(index, true, (double)call->points, text) && (!deviation || judge_between(deviation, 0, INFINITY, text));
}

static bool judge_flow(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *index = gnp_tensors_find(&response->outputs, "index"), *start = gnp_tensors_find(&response->outputs, "snapshot_start"),
	                        *record = gnp_tensors_find(&response->outputs, "record"),
	                        *points = gnp_tensors_find(&response->outputs, "snapshot_points");
	if (index && !judge_between(index, -1, (double)call->points - 1, text))
		return false;
	if (start && points && gnp_tensor_get(start, start->shape[0] - 1) != (double)points->shape[0])
		return wrong(text, "snapshot_start: ends at %g of %zu rows", gnp_tensor_get(start, start->shape[0] - 1), points->shape[0]);
	for (size_t i = 0; record && i < record->shape[0]; i++)
		if (gnp_tensor_get(record, 10 * i) != (double)i)
			return wrong(text, "record: row %zu is of step %g", i, gnp_tensor_get(record, 10 * i));
	return judge_ascending(start, false, INFINITY, text);
}

/* Every point is there, and none went farther than the noise that was given. */
static bool judge_smooth(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *points = gnp_tensors_find(&response->outputs, "points");
	const struct gnp_tensor *moved = gnp_tensors_find(&response->outputs, "moved");
	const struct gnp_value *asked = gnp_values_find(&call->request->parameters, "noise");
	const struct gnp_value *noise = gnp_values_find(&response->parameters, "noise");
	double slack = 0;
	if (points && points->shape[0] != call->points)
		return wrong(text, "points: %zu rows of %zu points", points->shape[0], call->points);
	if (!points || !moved || !asked || asked->type != GNP_VALUE_NUMBER || !noise)
		return true;
	for (size_t i = 0; i < 3 * points->shape[0]; i++)
		slack = fmax(slack, 1e-5 * fabs(gnp_tensor_get(points, i)));
	return judge_between(moved, -4.01 * noise->number - slack, 4.01 * noise->number + slack, text);
}

/* Columns ascend within rows and lie below `kept`; offsets ascend to the number of entries. */
static bool judge_laplacian(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *offsets = gnp_tensors_find(&response->outputs, "row_offsets"), *columns = gnp_tensors_find(&response->outputs, "columns"),
	                        *kept = gnp_tensors_find(&response->outputs, "kept");
	const struct gnp_tensor *mass = gnp_tensors_find(&response->outputs, "mass");
	double width = kept ? (double)kept->shape[0] : (double)call->points;
	if (mass && !judge_between(mass, 1e-300, INFINITY, text))
		return false;
	if (!judge_ascending(kept, true, (double)call->points, text) || !judge_ascending(offsets, false, INFINITY, text))
		return false;
	if (offsets && columns && gnp_tensor_get(offsets, offsets->shape[0] - 1) != (double)columns->shape[0])
		return wrong(text, "row_offsets: end at %g of %zu entries", gnp_tensor_get(offsets, offsets->shape[0] - 1), columns->shape[0]);
	for (size_t row = 0; offsets && columns && row + 1 < offsets->shape[0]; row++) {
		size_t begin = (size_t)gnp_tensor_get(offsets, row), end = (size_t)gnp_tensor_get(offsets, row + 1);
		for (size_t e = begin; e < end; e++) {
			double column = gnp_tensor_get(columns, e);
			if (!(column >= 0 && column < width) || (e > begin && column <= gnp_tensor_get(columns, e - 1)))
				return wrong(text, "columns: entry %zu of row %zu is %g, need ascending ones below %g", e, row, column, width);
		}
	}
	return true;
}

static bool judge_sums(const struct gnp_tensors *outputs, const char *name, double sum, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *offsets = gnp_tensors_find(outputs, "row_offsets"), *values = gnp_tensors_find(outputs, name);
	for (size_t row = 0; offsets && values && row + 1 < offsets->shape[0]; row++) {
		size_t begin = (size_t)gnp_tensor_get(offsets, row), end = (size_t)gnp_tensor_get(offsets, row + 1);
		double total = 0, size = fabs(sum);
		for (size_t e = begin; e < end; e++) {
			total += gnp_tensor_get(values, e);
			size += fabs(gnp_tensor_get(values, e));
		}
		if (begin < end && !(fabs(total - sum) <= 1e-6 * size))
			return wrong(text, "%s: row %zu has the sum %g of %g, need %g", name, row, total, size, sum);
	}
	return true;
}

/* ---- Equations ---- */

static double parameter(const struct gnp_call *call, const char *name)
{
	for (size_t i = 0; i < call->operation->parameter_count; i++)
		if (strcmp(call->operation->parameters[i].name, name) == 0)
			return *(const double *)(const void *)(call->options + call->operation->parameters[i].offset);
	return NAN;
}

static const char *report_text(const struct gnp_response *response, const char *name)
{
	const struct gnp_value *value = gnp_values_find(&response->parameters, name);
	return value && value->string ? value->string : "";
}

static bool warns(const struct gnp_response *response, const char *kind)
{
	char begin[80];
	const char *warnings = report_text(response, "warnings");
	snprintf(begin, sizeof begin, "; %s: ", kind);
	return strncmp(warnings, begin + 2, strlen(begin) - 2) == 0 || strstr(warnings, begin);
}

static bool judge_poisson(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *residual = gnp_tensors_find(&response->outputs, "residual");
	bool iterative = strcmp(report_text(response, "solver"), "iterative") == 0;
	return !residual || warns(response, "residual") || judge_between(residual, 0, iterative ? 1.01 * parameter(call, "tolerance") : 1e-6, text);
}

static bool judge_spectrum(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *residual = gnp_tensors_find(&response->outputs, "residual"), *values = gnp_tensors_find(&response->outputs, "eigenvalues");
	for (size_t i = 1; values && i < values->shape[0]; i++)
		if (gnp_tensor_get(values, i) < gnp_tensor_get(values, i - 1))
			return wrong(text, "eigenvalues: %g before %g", gnp_tensor_get(values, i - 1), gnp_tensor_get(values, i));
	const struct gnp_tensor *imaginary = gnp_tensors_find(&response->outputs, "imaginary");
	bool symmetric = strcmp(report_text(response, "system"), "symmetric") == 0;
	if (symmetric && values && !judge_between(values, 0, INFINITY, text))
		return false;
	if (symmetric && imaginary && !judge_between(imaginary, 0, 0, text))
		return false;
	return !residual || judge_between(residual, 0, 1.01 * parameter(call, "accuracy"), text);
}

static bool has_input(const struct gnp_call *call, const char *name)
{
	return gnp_tensors_find(&call->request->inputs, name) != NULL;
}

/* What keeps the range to rounding: an M-matrix, and one stage. */
static bool keeps_range(const struct gnp_call *call, const struct gnp_response *response)
{
	const struct gnp_value *scheme = gnp_values_find(&call->request->parameters, "scheme");
	return strcmp(report_text(response, "system"), "symmetric") == 0 && strcmp(report_text(response, "solver"), "direct") == 0 &&
	       (!scheme || strcmp(scheme->string, "tr_bdf2") != 0) && !gnp_values_find(&call->request->parameters, "filter");
}

/* The maximum principle: without a source no value leaves the range of those at the start, or the answer says so; by
 * the symmetric operator's backward Euler steps there is nothing to say. */
static bool judge_heat(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *solution = gnp_tensors_find(&response->outputs, "solution"), *initial = gnp_tensors_find(&call->request->inputs, "initial");
	bool exact = keeps_range(call, response);
	bool driven = has_input(call, "source") || has_input(call, "source_points") || has_input(call, "flux") ||
	              has_input(call, "fixed");
	if (driven || !initial || !solution || (!exact && warns(response, "heat")))
		return true;
	double share = exact ? 1e-9 : 0.2, level = exact ? 1e-9 : 0.02;
	size_t count = 0, columns = initial->shape[1];
	gnp_tensor_elements(initial->rank, initial->shape, &count);
	for (size_t c = 0; c < columns; c++) {
		double low = INFINITY, high = -INFINITY;
		for (size_t i = c; i < count; i += columns) {
			low = fmin(low, gnp_tensor_get(initial, i));
			high = fmax(high, gnp_tensor_get(initial, i));
		}
		for (size_t i = c; i < count; i += columns) {
			double value = gnp_tensor_get(solution, i), room = share * (high - low) + level * fmax(fabs(high), fabs(low));
			if (!(value >= low - room && value <= high + room))
				return wrong(text, "solution: %g at the start within %g..%g, and no warning", value, low, high);
		}
	}
	return true;
}

/* Weights are from 0 to 1 and some point counts; heights are numbers. */
static bool judge_patch(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *weight = gnp_tensors_find(&response->outputs, "weight");
	double sum = 0;
	if (!weight)
		return true;
	if (!judge_between(weight, 0, 1, text))
		return false;
	for (size_t i = 0; i < call->points; i++)
		sum += gnp_tensor_get(weight, i);
	return sum > 0 || wrong(text, "weight: 0 at all %zu points", call->points);
}

static double straight(const struct gnp_tensor *points, size_t i, size_t j)
{
	double d[3];
	for (size_t c = 0; c < 3; c++)
		d[c] = gnp_tensor_get(points, 3 * i + c) - gnp_tensor_get(points, 3 * j + c);
	return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* Both points of a pair are as far from each other as straight, at least. */
static bool judge_pairs(const struct gnp_tensor *points, const struct gnp_tensor *pairs,
                        const struct gnp_tensor *distance, char text[JUDGE_TEXT])
{
	for (size_t p = 0; p < distance->shape[0]; p++) {
		size_t from = (size_t)gnp_tensor_get(pairs, 2 * p), to = (size_t)gnp_tensor_get(pairs, 2 * p + 1);
		double line = straight(points, from, to), got = gnp_tensor_get(distance, p);
		if (!(got >= (1 - 1e-9) * line) || (from == to && got != 0))
			return wrong(text, "pair_distance: %g at pair %zu, the straight line is %g", got, p, line);
	}
	return true;
}

/* As long as the way, zero where none leads. */
static bool judge_log(const struct gnp_tensor *log, const struct gnp_tensor *basis, const struct gnp_tensor *distance,
                      char text[JUDGE_TEXT])
{
	for (size_t i = 0; distance && i < log->shape[0]; i++) {
		double length = hypot(gnp_tensor_get(log, 2 * i), gnp_tensor_get(log, 2 * i + 1));
		double way = gnp_tensor_get(distance, i);
		if (!(isinf(way) ? length == 0 : fabs(length - way) <= 1e-6 * way))
			return wrong(text, "log: point %zu has the length %g, the way has %g", i, length, way);
	}
	return !basis || judge_orthonormal(basis, 2, text);
}

/* No way along a surface is shorter than the straight one. */
static bool judge_geodesic(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	const struct gnp_tensor *points = gnp_tensors_find(&call->request->inputs, "points");
	const struct gnp_tensor *distance = gnp_tensors_find(&response->outputs, "distance");
	const struct gnp_tensor *pair = gnp_tensors_find(&response->outputs, "pair_distance");
	const struct gnp_tensor *log = gnp_tensors_find(&response->outputs, "log");
	if (log && !judge_log(log, gnp_tensors_find(&response->outputs, "basis"), distance, text))
		return false;
	if (distance && !judge_between(distance, 0, INFINITY, text))
		return false;
	if (gnp_values_find(&call->request->parameters, "filter"))
		return true; /* points have moved */
	if (pair && !judge_pairs(points, gnp_tensors_find(&call->request->inputs, "pairs"), pair, text))
		return false;
	if (!distance || gnp_tensors_find(&call->request->inputs, "sources"))
		return true;
	size_t n = call->points, source = n;
	for (size_t i = 0; i < n && source == n; i++)
		source = gnp_tensor_get(distance, i) == 0 ? i : n;
	for (size_t i = 0; i < n && source < n; i++)
		if (!(gnp_tensor_get(distance, i) >= (1 - 1e-9) * straight(points, i, source)))
			return wrong(text, "distance: %g at point %zu, less than straight", gnp_tensor_get(distance, i), i);
	return source < n || wrong(text, "distance: nowhere 0");
}

/* ---- All of it ---- */

static bool judge_parameters(const struct gnp_response *response, char text[JUDGE_TEXT])
{
	for (size_t i = 0; i < response->parameters.count; i++) {
		const struct gnp_value *value = &response->parameters.items[i];
		if (value->type == GNP_VALUE_NUMBER && !isfinite(value->number))
			return wrong(text, "parameter %s is %g", value->name, value->number);
	}
	if (!report_text(response, "estimator")[0])
		return wrong(text, "parameters: no estimator");
	return true;
}

static const struct {
	const char *operation;
	bool (*judge)(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT]);
} judges[] = {{"estimate", judge_estimate}, {"patch", judge_patch}, {"filter", judge_filter},
              {"flow", judge_flow}, {"smooth", judge_smooth}, {"laplacian", judge_laplacian},
              {"poisson", judge_poisson}, {"heat", judge_heat}, {"geodesic", judge_geodesic}, {"spectrum", judge_spectrum}};

static bool judge_tensors(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	for (size_t i = 0; i < response->outputs.count; i++) {
		const struct gnp_tensor *tensor = &response->outputs.items[i];
		if (!judge_finite(call, tensor, text) || (strcmp(tensor->name, "normals") == 0 && !judge_orthonormal(tensor, 1, text)))
			return false;
	}
	return true;
}

bool judge_answer(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT])
{
	bool good = judge_shapes(call, response, text) && judge_parameters(response, text) && judge_tensors(call, response, text) &&
	            judge_sums(&response->outputs, "values", 0, text) &&
	            judge_sums(&response->outputs, "stiffness", 0, text) && judge_sums(&response->outputs, "value", 1, text);
	for (size_t i = 0; good && i < sizeof judges / sizeof *judges; i++)
		if (strcmp(judges[i].operation, call->operation->name) == 0)
			return judges[i].judge(call, response, text);
	return good;
}

bool judge_refusal(gnp_status status, const struct gnp_error *error, char text[JUDGE_TEXT])
{
	static const gnp_status clear[] = {GNP_INVALID_ARGUMENT, GNP_DEGENERATE, GNP_SINGULAR, GNP_NO_CONVERGENCE, GNP_TOO_LARGE, GNP_NOT_ACCEPTABLE,
	                                   GNP_DEADLINE};
	if (error->status != status)
		return wrong(text, "refused as %s, the text is of %s", gnp_status_name(status), gnp_status_name(error->status));
	if (strlen(error->text) < 12)
		return wrong(text, "refused as %s: \"%s\" says nothing", gnp_status_name(status), error->text);
	for (size_t i = 0; i < sizeof clear / sizeof *clear; i++)
		if (status == clear[i])
			return true;
	return wrong(text, "refused as %s: %.200s", gnp_status_name(status), error->text);
}

static bool same_value(const struct gnp_value *a, const struct gnp_value *b)
{
	if (strcmp(a->name, b->name) != 0 || a->type != b->type)
		return false;
	switch (a->type) {
	case GNP_VALUE_STRING: return strcmp(a->string, b->string) == 0;
	case GNP_VALUE_NUMBER: return a->number == b->number || strncmp(a->name, "seconds_", 8) == 0;
	case GNP_VALUE_BOOL: return a->boolean == b->boolean;
	default: return a->integer == b->integer;
	}
}

/* Seconds of a stage that took none are left out. */
static size_t next_value(const struct gnp_values *values, size_t i)
{
	while (i < values->count && strncmp(values->items[i].name, "seconds_", 8) == 0)
		i++;
	return i;
}

static bool same_values(const struct gnp_values *one, const struct gnp_values *other, char text[JUDGE_TEXT])
{
	size_t a = next_value(one, 0), b = next_value(other, 0);
	for (; a < one->count && b < other->count; a = next_value(one, a + 1), b = next_value(other, b + 1))
		if (!same_value(&one->items[a], &other->items[b]))
			return wrong(text, "parameter %s differs from another run's %s", one->items[a].name, other->items[b].name);
	return (a == one->count && b == other->count) || wrong(text, "parameters: another run has more or fewer");
}

/* A flow's record has the seconds of its steps in the last column. */
static bool same_bytes(const struct gnp_tensor *a, const struct gnp_tensor *b)
{
	if (a->size != b->size || strcmp(a->name, "record") != 0)
		return a->size == b->size && memcmp(a->data, b->data, a->size) == 0;
	for (size_t i = 0; i < a->size / sizeof(double); i++)
		if (i % 10 != 9 && memcmp((double *)a->data + i, (double *)b->data + i, sizeof(double)) != 0)
			return false;
	return true;
}

bool judge_same(const struct gnp_response *one, const struct gnp_response *other, char text[JUDGE_TEXT])
{
	if (one->outputs.count != other->outputs.count)
		return wrong(text, "%zu outputs, in another run %zu", one->outputs.count, other->outputs.count);
	for (size_t i = 0; i < one->outputs.count; i++)
		if (!same_bytes(&one->outputs.items[i], &other->outputs.items[i]))
			return wrong(text, "%s: another run has other bytes", one->outputs.items[i].name);
	return same_values(&one->parameters, &other->parameters, text);
}
