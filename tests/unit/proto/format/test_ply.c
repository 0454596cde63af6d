/* PLY: every encoding and type, what our own writer makes, and files that lie. */
#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/file/file.h"

/* A heap copy of the exact size lets the address sanitizer see reads past the end. */
static gnp_status decode_bytes(const void *data, size_t size, bool all, size_t most, struct gnp_tensors *tensors,
                               struct gnp_error *error)
{
	unsigned char *body = malloc(size ? size : 1);
	memcpy(body, data, size);
	gnp_status status = all ? gnp_file_decode_all(&gnp_format_ply, body, size, tensors, error)
	                        : gnp_file_decode(&gnp_format_ply, body, size, &(struct gnp_file_wants){.max_points = most}, tensors, error);
	free(body); /* PLY never borrows */
	return status;
}

static void check_refused(const char *text, const char *want)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(decode_bytes(text, strlen(text), false, 0, &tensors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, want);
	CHECK(tensors.count == 0);
}

static void check_points(const char *text, enum gnp_datatype datatype, size_t tensors_wanted)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(decode_bytes(text, strlen(text), false, 0, &tensors, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(tensors.count == tensors_wanted);
	const struct gnp_tensor *points = gnp_tensors_find(&tensors, "points");
	CHECK(points && points->datatype == datatype && points->shape[0] == 2);
	for (size_t i = 0; points && i < 6; i++)
		CHECK_NEAR(gnp_tensor_get(points, i), (double)i + 1, 0);
	const struct gnp_tensor *normals = gnp_tensors_find(&tensors, "normals");
	for (size_t i = 0; normals && i < 6; i++)
		CHECK_NEAR(gnp_tensor_get(normals, i), i % 3 == 2, 0);
	gnp_tensors_clear(&tensors);
}

#define HEAD "ply\nformat ascii 1.0\n"
#define XYZ "property float x\nproperty float y\nproperty float z\n"

static void ascii_files(void)
{
	check_points(HEAD "comment hi\nelement vertex 2\n" XYZ "end_header\n1 2 3\n4 5 6\n", GNP_FP32, 1);
	check_points(HEAD "element vertex 2\n" XYZ "end_header\n1 2 3\n4 5 6", GNP_FP32, 1);
	check_points("ply\r\nformat ascii 1.0\r\nelement vertex 2\r\nproperty float x\r\nproperty float y\r\nproperty double z\r\n"
	             "end_header\r\n1 2 3\r\n4 5 6\r\n", GNP_FP64, 1);
	check_points(HEAD "obj_info a b c d e f g h i j k\nelement face 2\nproperty list uchar int vertex_indices\nelement vertex 2\n"
	             "property uchar red\nproperty float nx\nproperty float ny\nproperty float nz\nproperty list int float extra\n" XYZ
	             "element edge 7\nproperty int a\nend_header\n3 0 1 2\n0\n9 0 0 1 2 7 7 1 2 3\n9 0 0 1 0 4 5 6\n", GNP_FP32, 2);
	check_points(HEAD "element vertex 2\nproperty int z\nproperty int16 x\nproperty int8 y\nproperty float normalx\n"
	             "property float normaly\nproperty float normalz\nend_header\n3 1 2 0 0 1\n6 4 5 0 0 1\n", GNP_FP64, 2);
	check_points(HEAD "element vertex 2\n" XYZ "property float normal_x\nproperty float normal_y\nproperty float normal_z\n"
	             "end_header\n1 2 3 0 0 1\n4 5 6 0 0 1\n", GNP_FP32, 2);
	check_points("ply\rformat ascii 1.0\relement vertex 2\rproperty float x\rproperty float y\rproperty float z\rend_header\r"
	             "1 2 3\r4 5 6\r", GNP_FP32, 1);
}

/* Bytes of a value in either order. */
static void put(unsigned char **p, const void *value, size_t size, bool big)
{
	for (size_t i = 0; i < size; i++)
		*(*p)++ = ((const unsigned char *)value)[big ? size - 1 - i : i];
}

static void binary_files_of_both_orders(void)
{
	for (int big = 0; big < 2; big++) {
		unsigned char body[1024], *p = body;
		p += sprintf((char *)p, "ply\nformat binary_%s_endian 1.0\nelement face 1\nproperty list ushort int i\nelement vertex 2\n"
		             "property short x\nproperty list uchar double w\nproperty double y\nproperty float z\nproperty uint tag\nend_header\n",
		             big ? "big" : "little");
		uint16_t three = 3;
		put(&p, &three, 2, big);
		p += 12;
		for (int row = 0; row < 2; row++) {
			int16_t x = (int16_t)(3 * row - 300);
			double y = 3 * row + 0.125, skipped = 99;
			float z = 3.5f;
			uint32_t tag = 4000000000u;
			put(&p, &x, 2, big);
			*p++ = (unsigned char)row;
			for (int i = 0; i < row; i++)
				put(&p, &skipped, 8, big);
			put(&p, &y, 8, big);
			put(&p, &z, 4, big);
			put(&p, &tag, 4, big);
		}
		struct gnp_tensors tensors = {0};
		struct gnp_error error = {0};
		CHECK(decode_bytes(body, (size_t)(p - body), true, 0, &tensors, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		const struct gnp_tensor *points = gnp_tensors_find(&tensors, "points"), *tag = gnp_tensors_find(&tensors, "tag");
		CHECK(points && points->datatype == GNP_FP64 && gnp_tensor_get(points, 0) == -300 && gnp_tensor_get(points, 3) == -297);
		CHECK(points && gnp_tensor_get(points, 4) == 3.125 && gnp_tensor_get(points, 5) == 3.5);
		CHECK(tag && tag->datatype == GNP_UINT32 && gnp_tensor_get(tag, 1) == 4000000000.0);
		gnp_tensors_clear(&tensors);
		for (size_t size = 0; size < (size_t)(p - body); size++) /* every truncation */
			CHECK(decode_bytes(body, size, true, 0, &tensors, NULL) == GNP_INVALID_ARGUMENT);
	}
}

static void counts_are_not_believed(void)
{
	check_refused(HEAD "element vertex 1000000000000\n" XYZ "end_header\n1 2 3\n", "got 1000000000000 rows, the body has room for 1");
	check_refused("ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\n" XYZ "end_header\n1234", "room for 0");
	check_refused(HEAD "element vertex 99999999999999999999\n" XYZ "end_header\n", "need an integer");
	check_refused(HEAD "element vertex -1\n" XYZ "end_header\n", "count -1, need an integer");
	check_refused(HEAD "element x 9999999999\nelement vertex 3\n" XYZ "end_header\n10 20 30 40 50 60 70 80 ", "row 2 of 3 is cut short");
	check_refused(HEAD "element f 1\nproperty list int int i\nelement vertex 1\n" XYZ "end_header\n-1 1 2 3", "element f: row 0 of 1");
	check_refused(HEAD "element f 1\nproperty list int int i\nelement vertex 1\n" XYZ "end_header\n999999999 1 2 3 4 5 6", "element f");
	check_refused(HEAD "element vertex 1\n" XYZ "end_header\n1 2 3\n4 5 6\n", "6 bytes after the last of the 1 rows of element vertex");
	check_refused("ply\nformat binary_little_endian 1.0\nelement vertex 1\n" XYZ "end_header\n123412341234123412341234",
	              "12 bytes after the last of the 1 rows of element vertex");
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	const char *broken = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" XYZ "end_header\n123412341234\r\n";
	CHECK(decode_bytes(broken, strlen(broken), false, 0, &tensors, NULL) == GNP_OK && tensors.count == 1);
	gnp_tensors_clear(&tensors);
	const char *text = HEAD "element vertex 2\n" XYZ "end_header\n1 2 3\n4 5 6\n \r\n";
	CHECK(decode_bytes(text, strlen(text), false, 1, &tensors, &error) == GNP_TOO_LARGE);
	CHECK_STRING(error.text, "points: got 2, need at most 1");
}

static void broken_headers_are_refused(void)
{
	check_refused("", "the first line is not `ply`");
	check_refused("plx\n", "the first line is not `ply`");
	check_refused("ply\n", "no end_header");
	check_refused("ply\nelement vertex 1\nend_header\n", "no format line");
	check_refused("ply\nformat utf8 1.0\nend_header\n", "unknown format");
	check_refused(HEAD "end_header\n", "no element vertex");
	check_refused(HEAD "property float x\nend_header\n", "a property before the first element");
	check_refused(HEAD "element vertex 1\nproperty float128 x\nend_header\n1", "known types");
	check_refused(HEAD "element vertex 1\nproperty float x\nproperty float y\nend_header\n1 2", "no x, y and z");
	check_refused(HEAD "element vertex 1\nproperty list uchar float x\nproperty float y\nproperty float z\nend_header\n1 2 3 4", "no x, y and z");
	check_refused(HEAD "hello\nend_header\n", "unknown line");
	check_refused(HEAD "element vertex 1\n" XYZ "end_header\n1 two 3\n", "row 0 of 1");
	check_refused(HEAD "element vertex 1\n" XYZ "end_header\n1 2 3x\n", "row 0 of 1");
	char *text = malloc(3 << 20);
	memset(text, 'a', 3 << 20);
	memcpy(text, HEAD "comment ", 28);
	strcpy(text + (2 << 20), "\nelement vertex 0\n" XYZ "end_header\n");
	check_refused(text, "no end_header within the first MiB");
	free(text);
}

/* What is written reads back the same, and again after that. */
static void written_files_read_back(void)
{
	struct gnp_tensors tensors = {0}, back = {0};
	struct gnp_values comments = {0};
	struct gnp_buffer file = {0};
	size_t vectors[] = {2, 3}, matrix[] = {2, 2, 2}, rows = 2;
	float points[] = {1, 2, 3, 4, 5, 6}, normals[] = {0, 0, 1, 0, 1, 0}, metric[] = {1, 2, 3, 4, 5, 6, 7, 8};
	double h[] = {-0.5, 0.1};
	bool keep[] = {true, false};
	gnp_tensors_add_data(&tensors, "mean_curvature", GNP_FP64, 1, &rows, h, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "points", GNP_FP32, 2, vectors, points, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "metric", GNP_FP32, 3, matrix, metric, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "keep", GNP_BOOL, 1, &rows, keep, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "normals", GNP_FP32, 2, vectors, normals, false, NULL, NULL);
	gnp_values_add_string(&comments, "estimator", "gmls\nend_header", NULL);
	CHECK(gnp_file_encode(&gnp_format_ply, &tensors, &comments, &file, NULL) == GNP_OK);
	const char *want = "ply\nformat binary_little_endian 1.0\ncomment estimator gmls end_header\nelement vertex 2\n"
	                   "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n"
	                   "property float nz\nproperty double quality\nproperty double scalar_mean_curvature\nproperty float scalar_metric_0\n"
	                   "property float scalar_metric_1\nproperty float scalar_metric_2\nproperty float scalar_metric_3\n"
	                   "property uchar scalar_keep\nend_header\n";
	CHECK(file.size == strlen(want) + 2 * (6 * 4 + 16 + 16 + 1) && memcmp(file.data, want, strlen(want)) == 0);
	for (int round = 0; round < 2; round++) {
		struct gnp_error error = {0};
		CHECK(decode_bytes(file.data, file.size, true, 0, &back, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		CHECK(back.count == 9);
		CHECK(memcmp(gnp_tensors_find(&back, "points")->data, points, sizeof points) == 0);
		CHECK(memcmp(gnp_tensors_find(&back, "normals")->data, normals, sizeof normals) == 0);
		CHECK(memcmp(gnp_tensors_find(&back, "quality")->data, h, sizeof h) == 0);
		CHECK(memcmp(gnp_tensors_find(&back, "mean_curvature")->data, h, sizeof h) == 0);
		CHECK_NEAR(gnp_tensor_get(gnp_tensors_find(&back, "metric_3"), 1), 8, 0);
		file.size = 0;
		CHECK(gnp_file_encode(&gnp_format_ply, &back, NULL, &file, NULL) == GNP_OK);
		gnp_tensors_clear(&back);
	}
	gnp_buffer_clear(&file);
	gnp_values_clear(&comments);
	gnp_tensors_clear(&tensors);
}

static void what_has_no_row_a_point_is_not_acceptable(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_buffer file = {0};
	struct gnp_error error = {0}, second = {0};
	size_t shape[] = {2, 3}, rows = 3;
	float points[] = {1, 2, 3, 4, 5, 6};
	gnp_tensors_add_data(&tensors, "index", GNP_INT32, 1, &rows, points, false, NULL, NULL);
	CHECK(gnp_file_encode(&gnp_format_ply, &tensors, NULL, &file, &error) == GNP_NOT_ACCEPTABLE);
	CHECK_STRING(error.text, "ply: needs points (n,3)");
	gnp_tensors_add_data(&tensors, "points", GNP_FP32, 2, shape, points, false, NULL, NULL);
	CHECK(gnp_file_encode(&gnp_format_ply, &tensors, NULL, &file, &second) == GNP_NOT_ACCEPTABLE);
	CHECK_CONTAINS(second.text, "\"index\" has 3 rows, need 2 as points has");
	CHECK(file.size == 0);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&file);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(ascii_files),
	                                    TEST(binary_files_of_both_orders),
	                                    TEST(counts_are_not_believed),
	                                    TEST(broken_headers_are_refused),
	                                    TEST(written_files_read_back),
	                                    TEST(what_has_no_row_a_point_is_not_acceptable)};
	return RUN_TESTS(tests);
}
