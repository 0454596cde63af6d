#include "proto/json/json_numbers.h"

#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/tensor/number.h"
#include "proto/tensor/scalar.h"

struct reader {
	const char *p, *end;
	const char *name;
	enum gnp_datatype datatype;
	unsigned rank;
	const size_t *shape;
	size_t elements, done;
	unsigned depth, leaf;                        /* leaf: depth of the numbers, 0 until the first one is seen */
	size_t counts[GNP_TENSOR_RANK_MAX + 1];      /* items seen at each depth */
	unsigned char *target;
	struct gnp_error *error;
};

static void skip_space(struct reader *r)
{
	while (r->p < r->end && (*r->p == ' ' || *r->p == '\n' || *r->p == '\r' || *r->p == '\t'))
		r->p++;
}

static gnp_status bad_item(struct reader *r, const char *need)
{
	int length = 0;
	while (length < 24 && r->p + length < r->end && !strchr(",]} \n\r\t", r->p[length]))
		length++;
	return gnp_error_set(r->error, GNP_INVALID_ARGUMENT, "tensor \"%s\": data[%zu]: got %.*s, need %s", r->name, r->done,
	                     length, r->p, need);
}

/* Integers are read as such: a double would lose the low bits of 64. */
static gnp_status read_integer(struct reader *r)
{
	const char *p = r->p;
	bool negative = *p == '-', overflow = false;
	uint64_t magnitude = 0;
	p += negative;
	while (p < r->end && *p >= '0' && *p <= '9') {
		overflow |= __builtin_mul_overflow(magnitude, 10, &magnitude);
		overflow |= __builtin_add_overflow(magnitude, (uint64_t)(*p++ - '0'), &magnitude);
	}
	bool wide = r->datatype == GNP_UINT64 || r->datatype == GNP_INT64;
	bool plain = p == r->end || (*p != '.' && *p != 'e' && *p != 'E');
	double value;
	const char *after = gnp_number_read_json(r->p, r->end, &value);
	if (!after || value != floor(value))
		return bad_item(r, "an integer");
	bool fits = gnp_scalar_store(r->datatype, r->target, value);
	if (wide && plain) {
		uint64_t limit = r->datatype == GNP_UINT64 ? (negative ? 0 : UINT64_MAX) : (uint64_t)INT64_MAX + negative;
		uint64_t bits = negative ? 0 - magnitude : magnitude;
		fits = !overflow && magnitude <= limit;
		memcpy(r->target, &bits, sizeof bits);
	}
	if (!fits)
		return bad_item(r, gnp_datatype_name(r->datatype));
	r->p = after;
	return GNP_OK;
}

static gnp_status read_bool(struct reader *r)
{
	size_t left = (size_t)(r->end - r->p);
	bool yes = left >= 4 && memcmp(r->p, "true", 4) == 0;
	if (!yes && !(left >= 5 && memcmp(r->p, "false", 5) == 0))
		return read_integer(r);
	*r->target = yes;
	r->p += yes ? 4 : 5;
	return GNP_OK;
}

static gnp_status read_floating(struct reader *r)
{
	double value;
	const char *after = gnp_number_read_json(r->p, r->end, &value);
	if (!after)
		return bad_item(r, "a number (NaN and infinity have no JSON form, send binary data)");
	if (isinf(value) || !gnp_scalar_store(r->datatype, r->target, value))
		return bad_item(r, gnp_datatype_name(r->datatype));
	r->p = after;
	return GNP_OK;
}

static gnp_status read_item(struct reader *r)
{
	if (!r->leaf) {
		r->leaf = r->depth;
		if (r->leaf != 1 && r->leaf != r->rank)
			return gnp_error_set(r->error, GNP_INVALID_ARGUMENT,
			                     "tensor \"%s\": data is nested %u deep, need flat or %u deep as the shape", r->name,
			                     r->leaf, r->rank);
	}
	if (r->depth != r->leaf)
		return gnp_error_set(r->error, GNP_INVALID_ARGUMENT, "tensor \"%s\": data[%zu]: a number beside an array",
		                     r->name, r->done);
	if (r->done == r->elements)
		return gnp_error_set(r->error, GNP_INVALID_ARGUMENT, "tensor \"%s\": data has more than the shape's %zu elements",
		                     r->name, r->elements);
	gnp_status status;
	if (r->datatype == GNP_FP32 || r->datatype == GNP_FP64)
		status = read_floating(r);
	else
		status = r->datatype == GNP_BOOL ? read_bool(r) : read_integer(r);
	r->target += gnp_datatype_size(r->datatype);
	r->done++;
	r->counts[r->depth]++;
	return status;
}

static gnp_status open_array(struct reader *r)
{
	unsigned most = r->rank ? r->rank : 1;
	if (r->depth == most || (r->leaf && r->depth == r->leaf))
		return gnp_error_set(r->error, GNP_INVALID_ARGUMENT,
		                     "tensor \"%s\": data[%zu]: an array nested deeper than the shape's rank %u", r->name,
		                     r->done, r->rank);
	r->counts[r->depth]++;
	r->counts[++r->depth] = 0;
	r->p++;
	return GNP_OK;
}

static gnp_status close_array(struct reader *r)
{
	bool nested = r->rank > 1 && r->leaf != 1 && !(r->elements == 0 && r->depth == 1);
	if (nested && r->counts[r->depth] != r->shape[r->depth - 1])
		return gnp_error_set(r->error, GNP_INVALID_ARGUMENT,
		                     "tensor \"%s\": data[%zu]: a row of %zu at depth %u, need the shape's %zu", r->name, r->done,
		                     r->counts[r->depth], r->depth, r->shape[r->depth - 1]);
	r->depth--;
	r->p++;
	return GNP_OK;
}

static gnp_status syntax(struct reader *r)
{
	return gnp_error_set(r->error, GNP_INVALID_ARGUMENT, "tensor \"%s\": data[%zu]: not a JSON array of numbers", r->name,
	                     r->done);
}

/* One item, then a comma or the closing of arrays. *more: another item must follow. */
static gnp_status read_step(struct reader *r, bool *more)
{
	gnp_status status = GNP_OK;
	skip_space(r);
	while (r->p < r->end && *r->p == '[') {
		status = open_array(r);
		if (status != GNP_OK)
			return status;
		skip_space(r);
	}
	if (r->p == r->end)
		return syntax(r);
	bool empty = *r->p == ']' && r->p[-1] != ',' && r->counts[r->depth] == 0;
	if (!empty)
		status = *r->p == ']' ? syntax(r) : read_item(r);
	while (status == GNP_OK && r->depth > 0) {
		skip_space(r);
		if (r->p == r->end)
			return syntax(r);
		if (*r->p == ',') {
			r->p++;
			*more = true;
			return GNP_OK;
		}
		status = *r->p == ']' ? close_array(r) : syntax(r);
	}
	*more = false;
	return status;
}

static gnp_status read_array(struct reader *r)
{
	bool more = true;
	while (more) {
		gnp_status status = read_step(r, &more);
		if (status != GNP_OK)
			return status;
	}
	skip_space(r);
	if (r->p != r->end)
		return syntax(r);
	if (r->done != r->elements)
		return gnp_error_set(r->error, GNP_INVALID_ARGUMENT, "tensor \"%s\": data has %zu elements, need the shape's %zu",
		                     r->name, r->done, r->elements);
	return GNP_OK;
}

gnp_status gnp_json_numbers_read(const char *text, size_t size, const char *name, enum gnp_datatype datatype,
                                 unsigned rank, const size_t *shape, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct reader r = {.p = text, .end = text + size, .name = name, .datatype = datatype, .rank = rank, .shape = shape,
	                   .error = error};
	if (datatype == GNP_FP16)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": FP16 has no JSON form, send binary data", name);
	if (size == 0 || *text != '[')
		return syntax(&r);
	if (rank <= GNP_TENSOR_RANK_MAX && !gnp_tensor_elements(rank, shape, &r.elements))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": the shape's product overflows", name);
	/* Every element takes a digit and a comma or bracket. */
	if (r.elements > size / 2)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": the shape asks for %zu elements, data has fewer",
		                     name, r.elements);
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(tensors, name, datatype, rank, shape, &tensor, error);
	if (status != GNP_OK)
		return status;
	r.target = tensor->data;
	status = read_array(&r);
	if (status != GNP_OK) {
		free(tensor->data);
		tensors->count--;
	}
	return status;
}

gnp_status gnp_json_numbers_shape(const char *text, size_t size, const char *name, unsigned *rank,
                                  size_t shape[GNP_TENSOR_RANK_MAX], struct gnp_error *error)
{
	bool closed[GNP_TENSOR_RANK_MAX + 1] = {false}, item = false;
	size_t counts[GNP_TENSOR_RANK_MAX + 1] = {0};
	unsigned depth = 0, deepest = 0;
	for (const char *p = text; p < text + size; p++) {
		if (*p == '[') {
			if (depth == GNP_TENSOR_RANK_MAX)
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": nested deeper than %d", name,
				                     GNP_TENSOR_RANK_MAX);
			counts[depth] += depth > 0 && !closed[depth];
			deepest = ++depth > deepest ? depth : deepest;
			item = false;
		} else if (*p == ']') {
			if (depth == 0)
				break;
			counts[depth] += item && !closed[depth];
			closed[depth--] = true;
			item = false;
		} else if (*p == ',') {
			counts[depth] += item && !closed[depth];
			item = false;
		} else if (*p > ' ') {
			item = true;
		}
	}
	for (unsigned i = 0; i < deepest; i++)
		shape[i] = counts[i + 1];
	*rank = deepest;
	return GNP_OK;
}

/* One element at text, which has room; 0 when it has no JSON form. */
static size_t write_item(const struct gnp_tensor *tensor, size_t i, char *text)
{
	const char *source = (const char *)tensor->data + i * gnp_datatype_size(tensor->datatype);
	double value;
	float single;
	int64_t wide;
	switch (tensor->datatype) {
	case GNP_FP32:
		memcpy(&single, source, sizeof single);
		return isfinite(single) ? gnp_number_write_float(text, single) : 0;
	case GNP_INT64:
	case GNP_UINT64:
		memcpy(&wide, source, sizeof wide);
		return (size_t)(tensor->datatype == GNP_INT64 ? sprintf(text, "%" PRId64, wide)
		                                              : sprintf(text, "%" PRIu64, (uint64_t)wide));
	case GNP_BOOL:
		return (size_t)sprintf(text, "%s", *source ? "true" : "false");
	default:
		value = gnp_scalar_load(tensor->datatype, source);
		return isfinite(value) ? gnp_number_write_double(text, value) : 0;
	}
}

/* Arrays that begin (or end) before (after) element i: every dimension whose trailing product divides it. */
static unsigned brackets(const struct gnp_tensor *tensor, size_t i)
{
	unsigned count = 0;
	size_t block = 1;
	for (unsigned d = tensor->rank; d-- > 1;) {
		block *= tensor->shape[d];
		if (i % block)
			break;
		count++;
	}
	return count;
}

gnp_status gnp_json_numbers_write(const struct gnp_tensor *tensor, bool nested, struct gnp_buffer *buffer,
                                  struct gnp_error *error)
{
	size_t size = gnp_datatype_size(tensor->datatype), count = size ? tensor->size / size : 0;
	gnp_status status = gnp_buffer_append(buffer, "[", 1, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		status = gnp_buffer_reserve(buffer, GNP_NUMBER_LENGTH_MAX + 2 * GNP_TENSOR_RANK_MAX + 2, error);
		if (status != GNP_OK)
			return status;
		char *start = (char *)buffer->data + buffer->size, *p = start;
		unsigned open = nested ? brackets(tensor, i) : 0;
		if (i) {
			memset(p, ']', open);
			p += open;
			*p++ = ',';
		}
		memset(p, '[', open);
		p += open;
		size_t length = write_item(tensor, i, p);
		if (!length)
			return gnp_error_set(error, GNP_NOT_ACCEPTABLE,
			                     "output \"%s\": element %zu is NaN or infinite, which has no JSON form: ask for binary data",
			                     tensor->name, i);
		buffer->size += (size_t)(p - start) + length;
	}
	for (unsigned d = 1; nested && count && d < tensor->rank && status == GNP_OK; d++)
		status = gnp_buffer_append(buffer, "]", 1, error);
	return status == GNP_OK ? gnp_buffer_append(buffer, "]", 1, error) : status;
}
