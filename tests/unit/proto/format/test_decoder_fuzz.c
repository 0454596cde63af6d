/* Every decoder on damaged input: flipped, cut and spliced bytes. It must answer, not crash, leak or hang; run with
 * SAN=address,undefined it finds more. An argument that is a number asks for that many rounds. */
#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/codec/parameters.h"
#include "proto/file/content_encoding.h"
#include "proto/file/file.h"
#include "proto/file/formats.h"
#include "proto/oip/oip.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"

static int rounds = 300;

static uint64_t next_random(uint64_t *state)
{
	*state ^= *state << 13;
	*state ^= *state >> 7;
	*state ^= *state << 17;
	return *state;
}

static void make_cloud(struct gnp_tensors *tensors)
{
	size_t shape[] = {20, 3}, rows = 20;
	struct gnp_tensor *points, *normals, *h;
	gnp_tensors_add(tensors, "points", GNP_FP32, 2, shape, &points, NULL);
	for (size_t i = 0; i < 60; i++)
		((float *)points->data)[i] = (float)i * 0.37f;
	gnp_tensors_add(tensors, "normals", GNP_FP64, 2, shape, &normals, NULL);
	for (size_t i = 0; i < 60; i++)
		((double *)normals->data)[i] = i % 3 == 1;
	gnp_tensors_add(tensors, "h", GNP_UINT16, 1, &rows, &h, NULL);
	memset(h->data, 7, h->size);
}

/* A damaged copy in memory of its exact size. */
static unsigned char *damage(const unsigned char *data, size_t size, uint64_t *state, size_t *out_size)
{
	static const unsigned char telling[] = {0, 0xff, 0x7f, 0x80, '0', '9', '-', '[', '{', '"', '\n', ' ', ',', 'e'};
	size_t kept = next_random(state) % 4 ? size : next_random(state) % (size + 1);
	unsigned char *copy = malloc(kept ? kept : 1);
	memcpy(copy, data, kept);
	unsigned edits = (unsigned)(next_random(state) % 6);
	for (unsigned e = 0; e < edits && kept; e++) {
		size_t at = next_random(state) % (next_random(state) % 2 && kept > 200 ? 200 : kept);
		switch (next_random(state) % 4) {
		case 0: copy[at] ^= (unsigned char)(1u << next_random(state) % 8); break;
		case 1: copy[at] = telling[next_random(state) % sizeof telling]; break;
		case 2: copy[at] = (unsigned char)next_random(state); break;
		default: copy[at] = data[next_random(state) % size]; break;
		}
	}
	*out_size = kept;
	return copy;
}

static const struct gnp_tensor_info inputs[] = {{.name = "h", .datatype = GNP_BOOL, .rank = 1, .shape = {-1}},
                                                {.name = "w", .datatype = GNP_FP32, .rank = 2, .shape = {-1, -2}}};
static const struct gnp_parameter parameters[] = {{.name = "k"}};
static const struct gnp_operation operation = {.inputs = inputs, .input_count = 2, .parameters = parameters, .parameter_count = 1};
static const struct gnp_file_wants wants = {1000, inputs, 2, &operation};

static void try_file(const struct gnp_format *format, const unsigned char *data, size_t size)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0}, second = {0};
	gnp_status status = gnp_file_decode(format, data, size, &wants, &tensors, &error);
	CHECK(status == GNP_OK || (error.text[0] && tensors.count == 0));
	gnp_tensors_clear(&tensors);
	status = gnp_file_decode_all(format, data, size, &tensors, &second);
	CHECK(status == GNP_OK || (second.text[0] && tensors.count == 0));
	for (size_t i = 0; i < tensors.count; i++) /* every byte is there */
		free(gnp_tensor_to_double(&tensors.items[i]));
	gnp_tensors_clear(&tensors);
	struct gnp_values said = {0};
	error = (struct gnp_error){0};
	CHECK(gnp_file_parameters(format, data, size, &said, &error) == GNP_OK || error.text[0]);
	gnp_values_clear(&said);
}

static void fuzz_file(const struct gnp_format *format, const void *data, size_t size)
{
	uint64_t state = 0x9e3779b97f4a7c15u + (uint64_t)format;
	for (int i = 0; i < rounds; i++) {
		size_t kept;
		unsigned char *copy = damage(data, size, &state, &kept);
		try_file(format, copy, kept);
		free(copy);
	}
}

static void damaged_files_are_answered(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_values said = {0};
	const struct gnp_format *f;
	make_cloud(&tensors);
	CHECK(gnp_values_add_string(&said, "estimator", "gnp", NULL) == GNP_OK);
	CHECK(gnp_values_add_string(&said, "warnings", "mean: removed; heat: more", NULL) == GNP_OK);
	for (size_t i = 0; (f = gnp_format_at(i)); i++) {
		struct gnp_buffer file = {0};
		if (!gnp_format_writable(f) || f == &gnp_format_mtx)
			continue;
		size_t count = tensors.count;
		tensors.count = f == &gnp_format_npy ? 1 : count;
		CHECK(gnp_file_encode(f, &tensors, &said, &file, NULL) == GNP_OK);
		tensors.count = count;
		fuzz_file(f, file.data, file.size);
		gnp_buffer_clear(&file);
	}
	gnp_values_clear(&said);
	gnp_tensors_clear(&tensors);
}

static void damaged_hand_made_files_are_answered(void)
{
	static const char ply[] = "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int i\nelement vertex 2\nproperty float x\n"
	                          "property double y\nproperty uchar z\nproperty list int float w\nend_header\n2 1 2\n0\n1 2 3 1 5\n4 5 6 0\n";
	static const char big[] = "ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty short x\nproperty short y\nproperty short z\n"
	                          "property list uchar short w\nend_header\n\0\1\0\2\0\3\1\0\7\0\4\0\5\0\6\0";
	static const char pcd[] = "FIELDS x y z c\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 2\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
	                          "DATA binary_compressed\n\x0a\0\0\0\x1c\0\0\0\0a\x60\0\xe0\x0c\0\1bb";
	static const char ascii[] = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA ascii\n1 2 3\n4 nan 6\n";
	static const char obj[] = "v 1 2 3\nv 4 5 6\nvn 0 0 1\nvn 0 1 0\n";
	static const char npy[] = "\x93NUMPY\1\0\x3a\0{'descr': '>i2', 'fortran_order': True, 'shape': (2, 3), }\n123456789012";
	fuzz_file(&gnp_format_ply, ply, sizeof ply - 1);
	fuzz_file(&gnp_format_ply, big, sizeof big - 1);
	fuzz_file(&gnp_format_pcd, pcd, sizeof pcd - 1);
	fuzz_file(&gnp_format_pcd, ascii, sizeof ascii - 1);
	fuzz_file(&gnp_format_obj, obj, sizeof obj - 1);
	fuzz_file(&gnp_format_npy, npy, sizeof npy - 1);
}

static void fuzz_oip(const unsigned char *body, size_t size, size_t header, uint64_t *state)
{
	for (int i = 0; i < rounds; i++) {
		struct gnp_request request = {0};
		struct gnp_response response = {0};
		struct gnp_error error = {0};
		struct gnp_call call;
		size_t kept;
		unsigned char *copy = damage(body, size, state, &kept);
		gnp_status status = gnp_oip_decode_request(copy, kept, header, &request, &error);
		CHECK(status == GNP_OK || error.text[0]);
		for (size_t o = 0; gnp_operation_at(o) && status == GNP_OK; o++)
			gnp_call_prepare(gnp_operation_at(o), &request, NULL, &call, NULL);
		gnp_oip_decode_response(copy, kept, header, &response, NULL);
		gnp_request_clear(&request);
		gnp_response_clear(&response);
		free(copy);
	}
}

static void damaged_requests_are_answered(void)
{
	static const char json[] = "{\"id\":\"a\",\"parameters\":{\"k\":30,\"basis\":\"total\"},\"inputs\":[{\"name\":\"points\",\"datatype\":\"FP32\","
	                           "\"shape\":[2,3],\"data\":[[1,2,3],[4.5,-5e1,6]]}],\"outputs\":[{\"name\":\"normals\",\"parameters\":{\"binary_data\":true}}]}";
	static const char mask[] = "{\"parameters\":{\"dt\":\"auto\",\"steps\":2,\"scheme\":\"explicit\",\"estimator\":\"gmls\"},\"inputs\":[{\"name\":"
	                           "\"points\",\"datatype\":\"FP64\",\"shape\":[2,3],\"data\":[1,2,3,4,5,6]},{\"name\":\"fixed\",\"datatype\":\"BOOL\","
	                           "\"shape\":[2],\"data\":[true,0]}],\"outputs\":[{\"name\":\"points\"}]}";
	struct gnp_request request = {0};
	struct gnp_buffer body = {0};
	size_t header;
	uint64_t state = 77;
	make_cloud(&request.inputs);
	CHECK(gnp_oip_encode_request(&request, &body, &header, NULL) == GNP_OK);
	fuzz_oip(body.data, body.size, header, &state);
	fuzz_oip((const unsigned char *)json, sizeof json - 1, GNP_OIP_NO_HEADER, &state);
	fuzz_oip((const unsigned char *)mask, sizeof mask - 1, GNP_OIP_NO_HEADER, &state);
	gnp_request_clear(&request);
	gnp_buffer_clear(&body);
}

static void damaged_compression_is_answered(void)
{
	static const unsigned char gzip[] = {0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3, 0x4b, 0x4c, 0x4c, 0x4c, 0x4c, 0x4c, 0x4c, 0x04, 0x00,
	                                     0x6c, 0x6b, 0x8a, 0x1d, 7, 0, 0, 0};
	uint64_t state = 5;
	for (int i = 0; i < rounds; i++) {
		struct gnp_buffer out = {0};
		size_t kept;
		unsigned char *copy = damage(gzip, sizeof gzip, &state, &kept);
		gnp_content_decode(i % 2 ? "gzip" : "deflate", copy, kept, 1000, &out, NULL);
		CHECK(out.size <= 1000);
		gnp_buffer_clear(&out);
		free(copy);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(damaged_files_are_answered), TEST(damaged_hand_made_files_are_answered),
	                                    TEST(damaged_requests_are_answered), TEST(damaged_compression_is_answered)};
	if (argc > 1 && atoi(argv[1]) > 0) {
		rounds = atoi(argv[1]);
		argc = 1;
	}
	return RUN_TESTS(tests);
}
