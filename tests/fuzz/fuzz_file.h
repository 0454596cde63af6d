/* A file format under fuzzing: what decodes must be encoded, and decode to the same again. */
#ifndef GNP_TESTS_FUZZ_FILE_H
#define GNP_TESTS_FUZZ_FILE_H

#include "proto/file/file.h"
#include "proto/operation/operation.h"
#include "tests/fuzz/fuzz.h"

enum { FUZZ_POINTS_MAX = 1000 };

static inline bool fuzz_same_tensor(const struct gnp_tensor *a, const struct gnp_tensor *b)
{
	return strcmp(a->name, b->name) == 0 && a->datatype == b->datatype && a->rank == b->rank &&
	       memcmp(a->shape, b->shape, a->rank * sizeof a->shape[0]) == 0 && a->size == b->size &&
	       (a->size == 0 || memcmp(a->data, b->data, a->size) == 0);
}

static inline bool fuzz_same_tensors(const struct gnp_tensors *a, const struct gnp_tensors *b)
{
	bool same = a->count == b->count;
	for (size_t i = 0; i < a->count && same; i++)
		same = fuzz_same_tensor(&a->items[i], &b->items[i]);
	return same;
}

/* Encodes tensors and decodes what comes out, which must work; false when the format has no form for them. */
static inline bool fuzz_pass(const struct gnp_format *format, const struct gnp_tensors *tensors, struct gnp_tensors *back,
                             struct gnp_buffer *file)
{
	struct gnp_error error = {0};
	if (gnp_file_encode(format, tensors, NULL, file, &error) != GNP_OK) {
		FUZZ_REQUIRE(error.text[0] && error.status != GNP_OK);
		return false;
	}
	gnp_status status = gnp_file_decode_all(format, file->data, file->size, back, &error);
	if (status != GNP_OK)
		fprintf(stderr, "what was encoded does not decode: %s\n", error.text);
	FUZZ_REQUIRE(status == GNP_OK);
	return true;
}

/* lossless: the first pass must give the same tensors; else (formats that rename or widen what they hold) the second one must. */
static inline void fuzz_round_trip(const struct gnp_format *format, bool lossless, const struct gnp_tensors *tensors)
{
	struct gnp_tensors first = {0}, second = {0};
	struct gnp_buffer file = {0}, again = {0};
	if (fuzz_pass(format, tensors, &first, &file)) {
		if (lossless)
			FUZZ_REQUIRE(fuzz_same_tensors(tensors, &first));
		else if (fuzz_pass(format, &first, &second, &again))
			FUZZ_REQUIRE(fuzz_same_tensors(&first, &second));
	}
	gnp_tensors_clear(&second);
	gnp_tensors_clear(&first);
	gnp_buffer_clear(&again);
	gnp_buffer_clear(&file);
}

/* As the server decodes it, for an operation with inputs beside points and normals. */
static inline void fuzz_wanted(const struct gnp_format *format, const unsigned char *body, size_t size)
{
	static const struct gnp_tensor_info inputs[] = {{.name = "points", .datatype = GNP_FP32, .rank = 2, .shape = {-1, 3}},
	                                                {.name = "fixed", .datatype = GNP_BOOL, .rank = 1, .shape = {-1}},
	                                                {.name = "source", .datatype = GNP_FP32, .rank = 2, .shape = {-1, -2}}};
	static const struct gnp_parameter parameters[] = {{.name = "k"}, {.name = "mean"}};
	static const struct gnp_operation operation = {.inputs = inputs, .input_count = 3, .parameters = parameters, .parameter_count = 2};
	static const struct gnp_file_wants wants = {FUZZ_POINTS_MAX, inputs, 3, &operation};
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	gnp_status status = gnp_file_decode(format, body, size, &wants, &tensors, &error);
	FUZZ_REQUIRE(status == GNP_OK ? tensors.count > 0 : error.text[0] && tensors.count == 0);
	const struct gnp_tensor *points = gnp_tensors_find(&tensors, "points");
	if (status == GNP_OK) {
		FUZZ_REQUIRE(points && points->rank == 2 && points->shape[1] == 3 && points->shape[0] <= FUZZ_POINTS_MAX);
		FUZZ_REQUIRE(points->datatype == GNP_FP32 || points->datatype == GNP_FP64);
	}
	gnp_tensors_clear(&tensors);
}

/* Reads every element, so that a sanitizer sees a tensor that is shorter than its shape. */
static inline void fuzz_touch(const struct gnp_tensors *tensors)
{
	for (size_t i = 0; i < tensors->count; i++) {
		double *values = tensors->items[i].datatype == GNP_BYTES ? NULL : gnp_tensor_to_double(&tensors->items[i]);
		free(values);
	}
}

static inline int fuzz_file(const struct gnp_format *format, bool lossless, const uint8_t *data, size_t size)
{
	unsigned char *body = fuzz_copy(data, size);
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	fuzz_wanted(format, body, size);
	gnp_status status = gnp_file_decode_all(format, body, size, &tensors, &error);
	FUZZ_REQUIRE(status == GNP_OK || (error.text[0] && tensors.count == 0));
	fuzz_touch(&tensors);
	if (status == GNP_OK && gnp_format_writable(format))
		fuzz_round_trip(format, lossless, &tensors);
	gnp_tensors_clear(&tensors);
	free(body);
	return 0;
}

#endif
