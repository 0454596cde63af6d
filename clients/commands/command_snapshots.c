/* gnp snapshots: writes the states of a flow, which one NPZ holds, as a file each. */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "clients/command.h"
#include "clients/file_io.h"

static const struct gnp_option options[] = {
	{"output", 'o', "NAME", "where to write, with %d or %06d for the step: run_%06d.ply (needed)"},
	{"format", 0, "NAME", "format of the output (default: by extension)"},
	{"input-format", 0, "NAME", "format of the input (default: by extension, else by its first bytes)"},
};

/* A name with a place for a number. The text is the user's and never a format of printf. */
struct pattern {
	const char *text, *rest; /* the number stands between text[0 .. before) and rest */
	int before, digits;      /* least digits of the number */
};

/* %d, or %0Nd with N of 1 to 18, and no other %. */
static bool read_conversion(const char *percent, struct pattern *pattern)
{
	const char *p = percent + 1;
	pattern->digits = 1;
	if (*p == '0' && isdigit((unsigned char)p[1])) {
		pattern->digits = 0;
		for (p++; isdigit((unsigned char)*p) && pattern->digits <= 18; p++)
			pattern->digits = 10 * pattern->digits + (*p - '0');
	}
	pattern->rest = p + 1;
	return *p == 'd' && pattern->digits >= 1 && pattern->digits <= 18 && !strchr(pattern->rest, '%');
}

static gnp_status read_pattern(const char *text, struct pattern *pattern, struct gnp_error *error)
{
	const char *percent = strchr(text, '%');
	*pattern = (struct pattern){.text = text};
	if (!percent || !read_conversion(percent, pattern))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--output: got '%s', need one %%d or %%06d for the step and no other %%", text);
	pattern->before = (int)(percent - text);
	return GNP_OK;
}

/* Snapshots of a flow as its answer names them; time, normals and curvature may be NULL. */
struct series {
	size_t count;
	const struct gnp_tensor *start, *step, *time, *points, *normals, *curvature;
};

static gnp_status bad_shape(const struct gnp_tensor *tensor, size_t rows, size_t columns, struct gnp_error *error)
{
	char got[GNP_TENSOR_RANK_MAX * 24] = "";
	for (unsigned d = 0; d < tensor->rank; d++)
		sprintf(got + strlen(got), "%s%zu", d ? "," : "", tensor->shape[d]);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: shape [%s], need [%zu%s]", tensor->name, got, rows, columns > 1 ? ",3" : "");
}

static bool has_shape(const struct gnp_tensor *tensor, size_t rows, size_t columns)
{
	bool vector = columns > 1;
	return tensor->datatype != GNP_BYTES && tensor->rank == 1u + vector && tensor->shape[0] == rows &&
	       (!vector || tensor->shape[1] == columns);
}

/* Whether value is a whole number of at least `least`. */
static bool is_whole(double value, double least)
{
	return value >= least && value < 0x1p53 && value == floor(value);
}

/* Rows begin at 0 and end at `rows`. Steps differ, so that no file is written twice. */
static gnp_status check_order(const struct series *s, size_t rows, struct gnp_error *error)
{
	double start = 0, before = 0, step = 0, last = -1;
	for (size_t i = 0; i <= s->count; i++, before = start) {
		start = gnp_tensor_get(s->start, i);
		if (!is_whole(start, before) || (i == 0 && start > 0) || (i == s->count && start != (double)rows))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "snapshot_start[%zu]: got %g, need rows in order from 0 to %zu", i, start,
			                     rows);
	}
	for (size_t i = 0; i < s->count; i++, last = step) {
		step = gnp_tensor_get(s->step, i);
		if (!is_whole(step, last + 1))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "snapshot_step[%zu]: got %g, need ascending steps from 0", i, step);
	}
	return GNP_OK;
}

/* Of what check_order let pass. */
static size_t count_at(const struct gnp_tensor *tensor, size_t i)
{
	return (size_t)gnp_tensor_get(tensor, i);
}

static gnp_status check_series(struct series *s, struct gnp_error *error)
{
	size_t rows = s->points->rank ? s->points->shape[0] : 0;
	s->count = s->step->rank ? s->step->shape[0] : 0;
	const struct {
		const struct gnp_tensor *tensor;
		size_t rows, columns;
	} needs[] = {{s->step, s->count, 1}, {s->start, s->count + 1, 1}, {s->time, s->count, 1},
	             {s->points, rows, 3},   {s->normals, rows, 3},       {s->curvature, rows, 1}};
	for (size_t i = 0; i < sizeof needs / sizeof needs[0]; i++) {
		if (needs[i].tensor && !has_shape(needs[i].tensor, needs[i].rows, needs[i].columns))
			return bad_shape(needs[i].tensor, needs[i].rows, needs[i].columns, error);
	}
	return check_order(s, rows, error);
}

static gnp_status find_series(const char *path, const struct gnp_tensors *tensors, struct series *out, struct gnp_error *error)
{
	struct series s = {
		.start = gnp_tensors_find(tensors, "snapshot_start"),     .step = gnp_tensors_find(tensors, "snapshot_step"),
		.time = gnp_tensors_find(tensors, "snapshot_time"),       .points = gnp_tensors_find(tensors, "snapshot_points"),
		.normals = gnp_tensors_find(tensors, "snapshot_normals"), .curvature = gnp_tensors_find(tensors, "snapshot_mean_curvature")};
	struct gnp_error cause = {0};
	if (!s.start || !s.step || !s.points || (s.step->rank && s.step->shape[0] == 0))
		return gnp_error_set(error, GNP_NOT_FOUND, "%s: no snapshots in it; gnp flow --snapshot_every N -o RUN.npz makes such a file", path);
	gnp_status status = check_series(&s, &cause);
	if (status != GNP_OK)
		return gnp_error_set(error, status, "%s: %s", path, cause.text);
	*out = s;
	return GNP_OK;
}

/* Rows [first, first + rows) of a tensor, borrowed, under another name. */
static gnp_status add_rows(struct gnp_tensors *to, const char *name, const struct gnp_tensor *tensor, size_t first, size_t rows,
                           struct gnp_error *error)
{
	if (!tensor)
		return GNP_OK;
	size_t shape[] = {rows, 3}, width = tensor->rank == 2 ? 3 : 1;
	unsigned char *data = (unsigned char *)tensor->data + first * width * gnp_datatype_size(tensor->datatype);
	return gnp_tensors_add_data(to, name, tensor->datatype, tensor->rank, shape, data, false, NULL, error);
}

static gnp_status add_fields(const struct series *s, size_t i, struct gnp_tensors *tensors, struct gnp_values *comments,
                             struct gnp_error *error)
{
	size_t first = count_at(s->start, i), rows = count_at(s->start, i + 1) - first;
	gnp_status status = add_rows(tensors, "points", s->points, first, rows, error);
	if (status == GNP_OK)
		status = add_rows(tensors, "normals", s->normals, first, rows, error);
	if (status == GNP_OK)
		status = add_rows(tensors, "mean_curvature", s->curvature, first, rows, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(comments, "step", (int64_t)count_at(s->step, i), error);
	return status == GNP_OK && s->time ? gnp_values_add_number(comments, "time", gnp_tensor_get(s->time, i), error) : status;
}

static gnp_status write_snapshot(const struct series *s, size_t i, const struct pattern *pattern, const struct gnp_format *format,
                                 struct gnp_error *error)
{
	struct gnp_buffer name = {0};
	struct gnp_tensors tensors = {0};
	struct gnp_values comments = {0};
	gnp_status status = gnp_buffer_printf(&name, error, "%.*s%0*zu%s", pattern->before, pattern->text, pattern->digits,
	                                      count_at(s->step, i), pattern->rest);
	if (status == GNP_OK)
		status = add_fields(s, i, &tensors, &comments, error);
	if (status == GNP_OK)
		status = gnp_file_save((const char *)name.data, format, &tensors, &comments, error);
	gnp_values_clear(&comments);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&name);
	return status;
}

static gnp_status write_all(const struct gnp_arguments *arguments, const struct pattern *pattern, const struct gnp_format *format,
                            struct gnp_error *error)
{
	const char *path = arguments->operands[0];
	struct gnp_buffer content = {0};
	struct gnp_tensors tensors = {0};
	struct series series = {0};
	gnp_status status = gnp_file_load(path, gnp_arguments_get(arguments, "input-format", NULL), &content, &tensors, error);
	if (status == GNP_OK)
		status = find_series(path, &tensors, &series, error);
	for (size_t i = 0; i < series.count && status == GNP_OK; i++)
		status = write_snapshot(&series, i, pattern, format, error);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&content);
	return status;
}

static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	(void)command;
	const char *output = gnp_arguments_get(arguments, "output", "");
	struct pattern pattern;
	const struct gnp_format *format;
	if (read_pattern(output, &pattern, error) != GNP_OK ||
	    gnp_file_format_out(gnp_arguments_get(arguments, "format", NULL), output, &format, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	return gnp_exit_of(write_all(arguments, &pattern, format, error), false);
}

const struct gnp_command gnp_command_snapshots = {
	.name = "snapshots",
	.operands = "RUN.npz -o NAME_%06d.ply",
	.help = "write the snapshots of a flow as a file each, with the step in its name",
	.options = options,
	.option_count = sizeof options / sizeof options[0],
	.operands_least = 1,
	.operands_most = 1,
	.run = run,
};
