/* OBJ in: vertices `v`, and normals `vn` where there is one a vertex and no face says otherwise. */
#include <string.h>

#include "proto/codec/comments.h"
#include "proto/format/format.h"
#include "proto/tensor/number.h"

struct obj {
	const char *p, *end;
	size_t line, vertices, normals, faces;
	double *points, *directions; /* NULL while counting */
	struct gnp_error *error;
};

/* The three numbers after a keyword. */
static bool read_three(const char *p, const char *stop, double *values)
{
	for (int i = 0; i < 3; i++) {
		while (p < stop && (*p == ' ' || *p == '\t'))
			p++;
		p = gnp_number_read(p, stop, &values[i]);
		if (!p || (p < stop && (unsigned char)*p > ' '))
			return false;
	}
	return true;
}

static gnp_status read_entry(struct obj *obj, const char *p, const char *stop)
{
	double values[3];
	bool normal = p[1] == 'n';
	if (!read_three(p + 1 + normal, stop, values))
		return gnp_error_set(obj->error, GNP_INVALID_ARGUMENT, "obj: line %zu: need 3 numbers after %s", obj->line,
		                     normal ? "vn" : "v");
	size_t *count = normal ? &obj->normals : &obj->vertices;
	double *target = normal ? obj->directions : obj->points;
	if (target)
		memcpy(target + 3 * *count, values, sizeof values);
	++*count;
	return GNP_OK;
}

/* One pass over the lines: counts, and stores where there is room made. */
static gnp_status read_lines(struct obj *obj)
{
	obj->line = obj->vertices = obj->normals = obj->faces = 0;
	const char *p = obj->p;
	while (p < obj->end) {
		const char *newline = memchr(p, '\n', (size_t)(obj->end - p)), *stop = newline ? newline : obj->end;
		obj->line++;
		while (p < stop && (*p == ' ' || *p == '\t'))
			p++;
		gnp_status status = GNP_OK;
		if (stop - p > 2 &&
		    p[0] == 'v' && (p[1] == ' ' || p[1] == '\t' || (p[1] == 'n' && (p[2] == ' ' || p[2] == '\t'))))
			status = read_entry(obj, p, stop);
		else if (stop - p > 1 && p[0] == 'f' && (p[1] == ' ' || p[1] == '\t'))
			obj->faces++;
		if (status != GNP_OK)
			return status;
		p = stop + 1;
	}
	return GNP_OK;
}

static gnp_status decode_file(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct obj obj = {.p = (const char *)decode->body, .error = error};
	obj.end = obj.p + decode->size;
	gnp_status status = read_lines(&obj);
	if (status == GNP_OK && obj.vertices == 0)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "obj: no vertices");
	if (status == GNP_OK)
		status = gnp_decode_check_points(decode, obj.vertices, error);
	if (status != GNP_OK)
		return status;
	size_t shape[] = {obj.vertices, 3};
	struct gnp_tensor *tensor;
	status = gnp_tensors_add(tensors, "points", GNP_FP64, 2, shape, &tensor, error);
	if (status != GNP_OK)
		return status;
	obj.points = tensor->data;
	if (obj.normals == obj.vertices && obj.faces == 0) {
		status = gnp_tensors_add(tensors, "normals", GNP_FP64, 2, shape, &tensor, error);
		if (status != GNP_OK)
			return status;
		obj.directions = tensor->data;
	}
	return read_lines(&obj);
}

static bool begins(const char *text, const char *end)
{
	static const char *const words[] = {"v ", "vn ", "o ", "g ", "mtllib "};
	for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
		if (gnp_format_begins(text, end, words[i]))
			return true;
	return false;
}

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return gnp_comments_read(body, size, "#", NULL, values, error);
}

static const char *const other_media_types[] = {"text/x-obj", NULL};

const struct gnp_format gnp_format_obj = {
	.name = "obj", .media_type = "model/obj", .extension = "obj", .other_media_types = other_media_types,
	.holds = GNP_HOLDS_ROWS, .begins = begins, .decode = decode_file, .parameters = parameters};
