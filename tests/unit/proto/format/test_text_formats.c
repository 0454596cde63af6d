/* XYZ, CSV, PCD, OBJ, VTK and JSON files, and telling formats apart. */
#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/file/file.h"
#include "proto/operation/operation.h"

static gnp_status decode_bytes(const struct gnp_format *format, const void *data, size_t size, bool all,
                               struct gnp_tensors *tensors, struct gnp_error *error)
{
	unsigned char *body = malloc(size ? size : 1); /* the exact size, for the address sanitizer */
	memcpy(body, data, size);
	gnp_status status = all ? gnp_file_decode_all(format, body, size, tensors, error)
	                        : gnp_file_decode(format, body, size, NULL, tensors, error);
	free(body);
	return status;
}

/* Points 1 2 3 / 4 5 6 and, when wanted, normals 0 0 1. */
static void check_points(const struct gnp_format *format, const char *text, size_t size, bool normals)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(decode_bytes(format, text, size, false, &tensors, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(tensors.count == (normals ? 2 : 1));
	const struct gnp_tensor *p = gnp_tensors_find(&tensors, "points"), *n = gnp_tensors_find(&tensors, "normals");
	CHECK(p && p->rank == 2 && p->shape[0] == 2 && (n != NULL) == normals);
	for (size_t i = 0; p && i < 6; i++)
		CHECK_NEAR(gnp_tensor_get(p, i), (double)i + 1, 0);
	for (size_t i = 0; n && i < 6; i++)
		CHECK_NEAR(gnp_tensor_get(n, i), i % 3 == 2, 0);
	gnp_tensors_clear(&tensors);
}

static void check_refused(const struct gnp_format *format, const char *text, const char *want)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(decode_bytes(format, text, strlen(text), false, &tensors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, want);
	CHECK(tensors.count == 0);
}

static void tables_of_numbers(void)
{
	static const struct {
		const char *text;
		bool normals;
	} cases[] = {
		{"1 2 3\n4 5 6\n", false},
		{"# hello\r\n\r\n  1\t2\t3\r\n4 5 6", false},
		{"2\n1 2 3 7\n4 5 6 8\n", false},                         /* PTS: a count first */
		{"1,2,3\n4, 5, 6\n", false},
		{"1;2;3;0;0;1\n4;5;6;0;0;1\n", true},
		{"x,y,z,nx,ny,nz\n1,2,3,0,0,1\n4,5,6,0,0,1\n", true},
		{"//Z Y X R G B\n3 2 1 255 0 0\n6 5 4 0 9 9\n", false},
		{"\"X\",\"Intensity\",\"Y\",\"Z\"\n1,9,2,3\n4,9,5,6\n", false},
		{"# normal_x normal_y normal_z x y z w\n0 0 1 1 2 3 0\n0 0 1 4 5 6 nan\n", true},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
		check_points(&gnp_format_xyz, cases[i].text, strlen(cases[i].text), cases[i].normals);
	check_refused(&gnp_format_xyz, "", "xyz: no row of numbers");
	check_refused(&gnp_format_xyz, "1 2\n", "xyz: line 1: \"1 2\": need 3 or more numbers");
	check_refused(&gnp_format_xyz, "1 2 3\n4 5\n", "xyz: line 2: \"4 5\": need the first row's count of numbers");
	check_refused(&gnp_format_xyz, "1 2 3\n4 five 6\n", "xyz: line 2: \"4 five 6\"");
	check_refused(&gnp_format_xyz, "1 2 3 255 0 0\n", "columns 4 to 6 have length 255, need unit normals or a heading");
	check_refused(&gnp_format_xyz, "x y z w\n1 2 3\n", "line 2");
}

/* A row that begins with nan or inf was taken for a heading, and lost. */
static void rows_that_are_not_finite(void)
{
	static const char *const texts[] = {"nan 2 3\n4 5 6\n", "inf,2,3\n4,5,6\n", "# x y z\ninf 2 3\n4 5 6\n"};
	for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
		struct gnp_tensors tensors = {0};
		CHECK(decode_bytes(&gnp_format_xyz, texts[i], strlen(texts[i]), false, &tensors, NULL) == GNP_OK);
		const struct gnp_tensor *p = gnp_tensors_find(&tensors, "points");
		CHECK(p && p->shape[0] == 2 && !isfinite(gnp_tensor_get(p, 0)) && gnp_tensor_get(p, 5) == 6);
		gnp_tensors_clear(&tensors);
	}
}

static void pcd_files(void)
{
#define PCD "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb normal_x normal_y normal_z hist\nSIZE 4 4 4 4 4 4 4 1\nTYPE F F F U F F F U\n" \
            "COUNT 1 1 1 1 1 1 1 3\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n"
	const char *ascii = PCD "DATA ascii\n1 2 3 7 0 0 1 1 2 3\n4 5 6 7 0 0 1 1 2 3\n";
	check_points(&gnp_format_pcd, ascii, strlen(ascii), true);
	char binary[1024], compressed[1024];
	size_t head = (size_t)sprintf(binary, PCD "DATA binary\n"), at = head;
	for (int row = 0; row < 2; row++) {
		float numbers[] = {(float)(3 * row + 1), (float)(3 * row + 2), (float)(3 * row + 3), 9, 0, 0, 1};
		memcpy(binary + at, numbers, sizeof numbers);
		memcpy(binary + at + sizeof numbers, "abc", 3);
		at += sizeof numbers + 3;
	}
	check_points(&gnp_format_pcd, binary, at, true);
	struct gnp_tensors tensors = {0};
	for (size_t cut = 0; cut < at; cut++)
		CHECK(decode_bytes(&gnp_format_pcd, binary, cut, true, &tensors, NULL) == GNP_INVALID_ARGUMENT);

	/* Field by field, as LZF literals; the last ten bytes by a reference to themselves where they repeat. */
	float columns[] = {1, 4, 2, 5, 3, 6, 9, 9, 0, 0, 0, 0, 1, 1};
	unsigned char plain[sizeof columns + 6];
	memcpy(plain, columns, sizeof columns);
	memcpy(plain + sizeof columns, "aaaaaa", 6);
	size_t start = (size_t)sprintf(compressed, PCD "DATA binary_compressed\n"), packed = start + 8;
	for (size_t i = 0; i < sizeof columns; i += 28) {
		compressed[packed++] = 27;
		memcpy(compressed + packed, plain + i, 28);
		packed += 28;
	}
	memcpy(compressed + packed, "\0a\x60\0", 4); /* one literal, then length 3 + 2 at distance 1 */
	packed += 4;
	uint32_t sizes[] = {(uint32_t)(packed - start - 8), sizeof plain};
	memcpy(compressed + start, sizes, 8);
	check_points(&gnp_format_pcd, compressed, packed, true);
	compressed[packed - 1] = 100; /* a distance before the beginning */
	compressed[packed - 2] = 0x7f;
	CHECK(decode_bytes(&gnp_format_pcd, compressed, packed, true, &tensors, NULL) == GNP_INVALID_ARGUMENT);
	check_refused(&gnp_format_pcd, "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4000000000\nHEIGHT 4000000000\nDATA binary\n", "pcd: the number of points overflows");
	check_refused(&gnp_format_pcd, "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 99999999999999\nDATA ascii\n1 2 3\n", "the body has room for 1");
	check_refused(&gnp_format_pcd, "FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "as many entries each");
	check_refused(&gnp_format_pcd, "FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "TYPE and SIZE need");
	check_refused(&gnp_format_pcd, "FIELDS x y z\n", "the header has no DATA line");
	check_refused(&gnp_format_pcd, "FIELDS x y w\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "no x, y and z");
}

static void obj_files(void)
{
	const char *plain = "# obj\no thing\nv 1 2 3\nvt 0 0\nv 4 5 6 0.5 0.5 0.5\nf 1 2 1\n";
	check_points(&gnp_format_obj, plain, strlen(plain), false);
	const char *normals = "v 1 2 3\r\nvn 0 0 1\r\nv 4 5 6\r\nvn 0 0 1";
	check_points(&gnp_format_obj, normals, strlen(normals), true);
	const char *faces = "v 1 2 3\nvn 0 0 1\nv 4 5 6\nvn 0 0 1\nf 1//2 2//1 1//1\n";
	check_points(&gnp_format_obj, faces, strlen(faces), false);
	check_refused(&gnp_format_obj, "o thing\n", "obj: no vertices");
	check_refused(&gnp_format_obj, "v 1 2\n", "obj: line 1: need 3 numbers after v");
}

static void json_files(void)
{
	static const char *const good[] = {"{\"points\":[[1,2,3],[4,5,6]],\"n\":0}", "{\"points\":[1,2,3,4,5,6]}",
	                                   "{\"meta\":{\"points\":[9]},\"list\":[\"a\",[]],\"points\":[ [1,2,3] ,[4,5,6] ]}"};
	for (size_t i = 0; i < 3; i++)
		check_points(&gnp_format_json, good[i], strlen(good[i]), false);
	const char *both = "{\"normals\":[[0,0,1],[0,0,1]],\"points\":[[1,2,3],[4,5,6]]}";
	check_points(&gnp_format_json, both, strlen(both), true);
	check_refused(&gnp_format_json, "{}", "json: need \"points\"");
	check_refused(&gnp_format_json, "{\"points\":[[1,2],[3,4]]}", "json: \"points\": need an array of [x, y, z]");
	check_refused(&gnp_format_json, "{\"points\":[[1,2,3],[4,5]]}", "tensor \"points\"");
	check_refused(&gnp_format_json, "{\"points\":[[1,2,3],[4,5,null]]}", "got null");
	check_refused(&gnp_format_json, "{\"points\":[[1,2,3],[4,5,6]],\"points\":[]}", "duplicate");
	check_refused(&gnp_format_json, "{\"points\":5}", "json: \"points\": need an array of [x, y, z]");
	check_refused(&gnp_format_json, "{\"points\":null}", "json: need \"points\"");
}

static void make_tensors(struct gnp_tensors *tensors)
{
	static float points[] = {1, 2, 3, 4, 5, 6}, normals[] = {0, 0, 1, 0, 0, 1};
	static double metric[] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 1e-20};
	size_t vectors[] = {2, 3}, matrix[] = {2, 2, 2};
	gnp_tensors_add_data(tensors, "points", GNP_FP32, 2, vectors, points, false, NULL, NULL);
	gnp_tensors_add_data(tensors, "metric", GNP_FP64, 3, matrix, metric, false, NULL, NULL);
	gnp_tensors_add_data(tensors, "normals", GNP_FP32, 2, vectors, normals, false, NULL, NULL);
}

static char *encode(const struct gnp_format *format, const struct gnp_tensors *tensors, struct gnp_buffer *file)
{
	struct gnp_values comments = {0};
	struct gnp_error error = {0};
	gnp_values_add_integer(&comments, "k", 30, NULL);
	CHECK(gnp_file_encode(format, tensors, &comments, file, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	gnp_values_clear(&comments);
	gnp_buffer_append(file, "", 1, NULL);
	file->size--;
	return (char *)file->data;
}

static void xyz_and_json_are_written_and_read_back(void)
{
	struct gnp_tensors tensors = {0}, back = {0};
	struct gnp_buffer xyz = {0}, csv = {0}, json = {0};
	make_tensors(&tensors);
	CHECK_STRING(encode(&gnp_format_csv, &tensors, &csv), "x,y,z,nx,ny,nz,metric_0,metric_1,metric_2,metric_3\n"
	                                                     "1,2,3,0,0,1,0.1,0.2,0.3,0.4\n4,5,6,0,0,1,0.5,0.6,0.7,1e-20\n");
	check_points(&gnp_format_csv, (char *)csv.data, csv.size, true);
	gnp_buffer_clear(&csv);
	CHECK_STRING(encode(&gnp_format_xyz, &tensors, &xyz), "# k 30\n# x y z nx ny nz metric_0 metric_1 metric_2 metric_3\n"
	                                                     "1 2 3 0 0 1 0.1 0.2 0.3 0.4\n4 5 6 0 0 1 0.5 0.6 0.7 1e-20\n");
	check_points(&gnp_format_xyz, (char *)xyz.data, xyz.size, true);
	CHECK(decode_bytes(&gnp_format_xyz, xyz.data, xyz.size, true, &back, NULL) == GNP_OK);
	CHECK_NEAR(gnp_tensor_get(gnp_tensors_find(&back, "metric_3"), 1), 1e-20, 0);
	gnp_tensors_clear(&back);
	CHECK_STRING(encode(&gnp_format_json, &tensors, &json),
	             "{\"parameters\":{\"k\":30},\n\"points\":[[1,2,3],[4,5,6]],\n\"metric\":[[[0.1,0.2],[0.3,0.4]],[[0.5,0.6],[0.7,1e-20]]],\n"
	             "\"normals\":[[0,0,1],[0,0,1]]}\n");
	check_points(&gnp_format_json, (char *)json.data, json.size, true);
	CHECK(decode_bytes(&gnp_format_json, json.data, json.size, true, &back, NULL) == GNP_OK);
	const struct gnp_tensor *metric = gnp_tensors_find(&back, "metric");
	CHECK(back.count == 3 && metric && metric->rank == 3 && memcmp(metric->data, tensors.items[1].data, 64) == 0);
	gnp_tensors_clear(&back);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&xyz);
	gnp_buffer_clear(&json);
}

/* The inputs of an operation beside points and normals: a mask, and numbers in several columns. */
static const struct gnp_tensor_info inputs[] = {{.name = "points", .datatype = GNP_FP32, .rank = 2, .shape = {-1, 3}},
                                                {.name = "fixed", .datatype = GNP_BOOL, .rank = 1, .shape = {-1}},
                                                {.name = "source", .datatype = GNP_FP32, .rank = 2, .shape = {-1, -2}}};
static const struct gnp_file_wants wants = {.inputs = inputs, .input_count = 3};

/* fixed 0 1 and source (2, width) counting from 10. */
static void check_inputs(const struct gnp_format *format, const char *text, size_t size, size_t width)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	unsigned char *body = malloc(size);
	memcpy(body, text, size);
	CHECK(gnp_file_decode(format, body, size, &wants, &tensors, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	const struct gnp_tensor *fixed = gnp_tensors_find(&tensors, "fixed"), *source = gnp_tensors_find(&tensors, "source");
	CHECK(tensors.count == (width ? 3 : 2));
	CHECK(fixed && fixed->rank == 1 && fixed->shape[0] == 2 && gnp_tensor_get(fixed, 0) == 0 && gnp_tensor_get(fixed, 1) == 1);
	CHECK(!width || (source && source->rank == 2 && source->shape[0] == 2 && source->shape[1] == width));
	for (size_t i = 0; source && i < 2 * width; i++)
		CHECK_NEAR(gnp_tensor_get(source, i), 10 + (double)i, 0);
	gnp_tensors_clear(&tensors);
	free(body);
}

static void columns_are_inputs_by_their_names(void)
{
	static const struct {
		const struct gnp_format *format;
		const char *text;
		size_t width;
	} cases[] = {
		{&gnp_format_xyz, "# x y z fixed\n1 2 3 0\n4 5 6 1\n", 0},
		{&gnp_format_xyz, "# x y z scalar_fixed source_9 fixedx\n1 2 3 0 7 7\n4 5 6 1 7 7\n", 0},
		{&gnp_format_xyz, "# x y z source fixed\n1 2 3 10 0\n4 5 6 11 1\n", 1},
		{&gnp_format_xyz, "# source_1 x y z source_0 fixed other\n11 1 2 3 10 0 5\n13 4 5 6 12 1 5\n", 2},
		{&gnp_format_ply, "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
		                 "property uchar fixed\nproperty list uchar int l\nproperty short scalar_source_0\nproperty float scalar_source_1\n"
		                 "property double source_2\nend_header\n1 2 3 0 0 10 11 12\n4 5 6 1 1 9 13 14 15\n", 3},
		{&gnp_format_pcd, "FIELDS fixed x y z source_0 source_1\nSIZE 1 4 4 4 4 4\nTYPE U F F F F F\nPOINTS 2\nDATA ascii\n"
		                 "0 1 2 3 10 11\n1 4 5 6 12 13\n", 2},
		{&gnp_format_json, "{\"fixed\":[ false,true],\"points\":[[1,2,3],[4,5,6]],\"source\":[10,11],\"other\":[1]}", 1},
		{&gnp_format_json, "{\"scalar_fixed\":[0,1],\"points\":[[1,2,3],[4,5,6]],\"source\":[[10,11],[12,13]]}", 2},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
		check_inputs(cases[i].format, cases[i].text, strlen(cases[i].text), cases[i].width);
}

static void arrays_are_inputs_by_their_names(void)
{
	static float points[] = {1, 2, 3, 4, 5, 6}, source[] = {10, 11, 12, 13};
	static unsigned char fixed[] = {0, 1};
	struct gnp_tensors tensors = {0};
	struct gnp_buffer npz = {0};
	size_t vectors[] = {2, 3}, columns[] = {2, 2}, rows = 2;
	gnp_tensors_add_data(&tensors, "source", GNP_FP32, 2, columns, source, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "points", GNP_FP32, 2, vectors, points, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "fixed", GNP_BOOL, 1, &rows, fixed, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "other", GNP_FP32, 1, &rows, points, false, NULL, NULL);
	CHECK(gnp_file_encode(&gnp_format_npz, &tensors, NULL, &npz, NULL) == GNP_OK);
	check_inputs(&gnp_format_npz, (const char *)npz.data, npz.size, 2);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&npz);
}

static void vtk_is_big_endian(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_buffer file = {0};
	make_tensors(&tensors);
	const char *text = encode(&gnp_format_vtk, &tensors, &file);
	const char *head = "# vtk DataFile Version 3.0\nk 30,gnpd\nBINARY\nDATASET POLYDATA\n"
	                   "FIELD FieldData 1\nparameters 1 8 unsigned_char\n{\"k\":30}\nPOINTS 2 float\n";
	CHECK(memcmp(text, head, strlen(head)) == 0);
	CHECK(memcmp(text + strlen(head), "\x3f\x80\0\0\x40\0\0\0\x40\x40\0\0\x40\x80\0\0\x40\xa0\0\0\x40\xc0\0\0\nVERTICES 2 4\n"
	                                  "\0\0\0\1\0\0\0\0\0\0\0\1\0\0\0\1\nPOINT_DATA 2\nNORMALS normals float\n", 24 + 14 + 17 + 36) == 0);
	const char *field = "FIELD quantities 1\nmetric 4 2 double\n";
	const char *at = memmem(text, file.size, field, strlen(field));
	CHECK(at && memcmp(at + strlen(field), "\x3f\xb9\x99\x99\x99\x99\x99\x9a", 8) == 0);
	CHECK(at && at + strlen(field) + 64 + 1 == text + file.size);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&file);
}

static void nan_has_no_json_form(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_buffer file = {0};
	struct gnp_error error = {0};
	double values[] = {1, NAN};
	size_t rows = 2;
	gnp_tensors_add_data(&tensors, "h", GNP_FP64, 1, &rows, values, false, NULL, NULL);
	CHECK(gnp_file_encode(&gnp_format_json, &tensors, NULL, &file, &error) == GNP_NOT_ACCEPTABLE);
	CHECK_CONTAINS(error.text, "\"h\": element 1 is NaN");
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&file);
}

/* Of a request to an operation whose output `mean` is called like a parameter. */
static gnp_status decode_request(const char *text, struct gnp_tensors *tensors, struct gnp_error *error)
{
	static const struct gnp_parameter parameters[] = {{.name = "k"}, {.name = "scale"}, {.name = "mean"}, {.name = "cover"}};
	static const struct gnp_tensor_info outputs[] = {{.name = "mean", .datatype = GNP_FP64, .rank = 1, .shape = {-2}}};
	static const struct gnp_operation operation = {.name = "test", .inputs = inputs, .input_count = 3, .outputs = outputs, .output_count = 1,
	                                               .parameters = parameters, .parameter_count = 4};
	static const struct gnp_file_wants request = {.inputs = inputs, .input_count = 3, .operation = &operation};
	return gnp_file_decode(&gnp_format_json, (const unsigned char *)text, strlen(text), &request, tensors, error);
}

/* Parameters in a body had no effect and nobody was told. */
static void members_of_json_without_effect_are_refused(void)
{
	static const struct {
		const char *members, *want;
	} cases[] = {
		{"\"k\":30", "json: \"k\" is a parameter: give it in the query: ?k=30"},
		{"\"scale\":0.5", "?scale=0.5"},
		{"\"cover\":\"auto\"", "?cover=auto"},
		{"\"mean\":true", "?mean=true"},
		{"\"k\":null", "\"k\" is a parameter"},
		{"\"k\":[1,2]", "\"k\" is a parameter: give it in the query: ?k=..."},
		{"\"mean\":[\"a\"]", "\"mean\" is a parameter"},
		{"\"format\":\"ply\"", "?format=ply"},
		{"\"timeout\":\"3s\"", "?timeout=3s"},
		{"\"parameters\":{\"x\":1,\"k\":30}", "json: \"parameters\" is passed over only where an answer wrote it: give parameters in the query: ?k=30"},
		{"\"parameters\":{\"estimator\":\"gmls\",\"k\":30}", "?k=30"},
		{"\"parameters\":{\"estimator\":\"gmls\",\"normals_estimated\":true,\"k\":{}}", "?k=..."},
		{"\"parameters\":[1]", "?NAME=VALUE"},
		{"\"parameters\":5", "?NAME=VALUE"},
		{"\"meta\":1", "json: unknown member \"meta\", known: points, normals, fixed, source, and arrays of numbers; parameters go into the query"},
		{"\"meta\":null", "unknown member \"meta\""},
		{"\"meta\":{\"a\":[1]}", "unknown member \"meta\""},
		{"\"inputs\":[{\"name\":\"points\"}]", "unknown member \"inputs\""},
		{"\"names\":[ \"a\"]", "unknown member \"names\""},
		{"\"normals\":5", "json: \"normals\": need an array of [x, y, z]"},
		{"\"fixed\":\"no\"", "json: \"fixed\": need an array of numbers"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		char text[256];
		struct gnp_tensors tensors = {0};
		struct gnp_error error = {0};
		snprintf(text, sizeof text, "{\"points\":[[0,0,0]],%s}", cases[i].members);
		CHECK(decode_request(text, &tensors, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, cases[i].want);
		CHECK(tensors.count == 0);
		if (strstr(cases[i].want, "need an array"))
			continue;
		CHECK(gnp_file_decode(&gnp_format_json, (const unsigned char *)text, strlen(text), &wants, &tensors, NULL) == GNP_OK);
		gnp_tensors_clear(&tensors);
	}
}

/* The daemon refused its own answers, and null for a member that need not be there. */
static void members_that_answers_carry_are_passed_over(void)
{
	static const char *const members[] = {
		"\"gaussian_curvature\":[-1.5]", "\"keep\":[true]", "\"columns\":[]", "\"metric\":[ [ 1,2]]", "\"mean\":[0.5]",
		"\"parameters\":{\"estimator\":\"gmls\",\"k\":30,\"normals_estimated\":false,\"seconds_search\":0.1,\"left\":null}",
		"\"normals\":null", "\"fixed\":null,\"scalar_source\":null",
	};
	for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
		char text[256];
		struct gnp_tensors tensors = {0};
		struct gnp_error error = {0};
		snprintf(text, sizeof text, "{%s,\"points\":[[0,0,0]]}", members[i]);
		CHECK(decode_request(text, &tensors, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		CHECK(tensors.count == 1);
		gnp_tensors_clear(&tensors);
	}
}

static void a_text_is_not_read_to_its_end_to_say_too_many(void)
{
	static const char text[] = "0 0 0\n1 1 1\n2 2 2\n3 3 3\n4 4 4\n";
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(gnp_file_decode(&gnp_format_xyz, (const unsigned char *)text, strlen(text), &(struct gnp_file_wants){.max_points = 3}, &tensors, &error) ==
	      GNP_TOO_LARGE);
	CHECK_STRING(error.text, "points: got more than 3, need at most 3");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(tables_of_numbers), TEST(rows_that_are_not_finite), TEST(pcd_files), TEST(obj_files), TEST(json_files),
	                                    TEST(xyz_and_json_are_written_and_read_back), TEST(columns_are_inputs_by_their_names),
	                                    TEST(arrays_are_inputs_by_their_names), TEST(vtk_is_big_endian),
	                                    TEST(nan_has_no_json_form),
	                                    TEST(members_of_json_without_effect_are_refused),
	                                    TEST(members_that_answers_carry_are_passed_over), TEST(a_text_is_not_read_to_its_end_to_say_too_many)};
	return RUN_TESTS(tests);
}
