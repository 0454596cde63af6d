/* Answers as files: which outputs a format carries, whose points they stand beside, and every type in every format. */
#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/file/file.h"
#include "proto/file/result.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"

enum { N = 4, M = 3 };

static double cloud[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static unsigned char keep[] = {1, 0, 1, 1};
static int64_t positions[] = {0, 2, 3}, huge[] = {-1, 5000000000, 7};
static uint64_t steps[] = {0, 10, 20};
static double times[] = {0, 0.1, 1e-20};

static void add(struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype, unsigned rank, size_t rows, void *data)
{
	size_t shape[] = {rows, 3};
	CHECK(gnp_tensors_add_data(tensors, name, datatype, rank, shape, data, false, NULL, NULL) == GNP_OK);
}

static void make_request(struct gnp_request *request)
{
	add(&request->inputs, "points", GNP_FP64, 2, N, cloud);
}

/* What a filter answers: some outputs have the cloud's rows and some the kept points'. */
static void make_filtered(struct gnp_response *response)
{
	add(&response->outputs, "keep", GNP_BOOL, 1, N, keep);
	add(&response->outputs, "points", GNP_FP64, 2, M, cloud);
	add(&response->outputs, "index", GNP_INT64, 1, M, positions);
	add(&response->outputs, "step", GNP_UINT64, 1, M, steps);
	add(&response->outputs, "time", GNP_FP64, 1, M, times);
	CHECK(gnp_values_add_integer(&response->parameters, "kept", M, NULL) == GNP_OK);
}

static void encode(const struct gnp_format *format, struct gnp_response *response, struct gnp_buffer *file)
{
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	make_request(&request);
	CHECK(gnp_result_encode(format, &request, response, file, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(gnp_buffer_append(file, "", 1, NULL) == GNP_OK);
	file->size--;
	gnp_request_clear(&request);
	gnp_response_clear(response);
}

static void rows_leave_out_what_has_others_and_say_so(void)
{
	struct gnp_response response = {0};
	struct gnp_buffer xyz = {0}, ply = {0}, vtk = {0};
	make_filtered(&response);
	encode(&gnp_format_xyz, &response, &xyz);
	CHECK_STRING((const char *)xyz.data, "# left_out keep\n# kept 3\n# x y z index step time\n0 0 0 0 0 0\n1 0 0 2 10 0.1\n0 1 0 3 20 1e-20\n");
	make_filtered(&response);
	encode(&gnp_format_ply, &response, &ply);
	CHECK_CONTAINS((const char *)ply.data, "comment left_out keep\ncomment kept 3\nelement vertex 3\n");
	CHECK(!strstr((const char *)ply.data, "scalar_keep"));
	make_filtered(&response);
	encode(&gnp_format_vtk, &response, &vtk);
	CHECK_CONTAINS((const char *)vtk.data, "\nleft_out keep,kept 3,gnpd\n");
	gnp_buffer_clear(&xyz);
	gnp_buffer_clear(&ply);
	gnp_buffer_clear(&vtk);
}

static void outputs_without_points_stand_beside_the_cloud(void)
{
	struct gnp_response response = {0};
	struct gnp_buffer xyz = {0};
	add(&response.outputs, "keep", GNP_BOOL, 1, N, keep);
	add(&response.outputs, "index", GNP_INT64, 1, M, positions);
	encode(&gnp_format_xyz, &response, &xyz);
	CHECK_STRING((const char *)xyz.data, "# left_out index\n# x y z keep\n0 0 0 1\n1 0 0 0\n0 1 0 1\n0 0 1 1\n");
	gnp_buffer_clear(&xyz);
}

static void nothing_to_carry_is_an_error(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_buffer file = {0};
	struct gnp_error error = {0};
	make_request(&request);
	add(&response.outputs, "index", GNP_INT64, 1, M, positions);
	add(&response.outputs, "record", GNP_FP64, 2, M, cloud);
	CHECK(gnp_result_encode(&gnp_format_ply, &request, &response, &file, &error) == GNP_NOT_ACCEPTABLE);
	CHECK_STRING(error.text, "ply: the points have 4 rows, and other numbers of rows have index, record: ask for npz or json");
	gnp_request_clear(&request);
	error = (struct gnp_error){0};
	CHECK(gnp_result_encode(&gnp_format_xyz, &request, &response, &file, &error) == GNP_NOT_ACCEPTABLE);
	CHECK_STRING(error.text, "xyz: needs points (n,3)");
	CHECK(gnp_result_encode(&gnp_format_npz, &request, &response, &file, NULL) == GNP_OK);
	gnp_response_clear(&response);
	gnp_buffer_clear(&file);
}

static void check_field(const struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype, const double *values,
                        size_t count)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(tensors, name);
	CHECK(tensor && tensor->datatype == datatype && tensor->rank == 1 && tensor->shape[0] == count);
	for (size_t i = 0; tensor && i < count; i++)
		CHECK_NEAR(gnp_tensor_get(tensor, i), values[i], 0);
}

static void every_type_survives_every_format(void)
{
	static const struct {
		const struct gnp_format *format;
		enum gnp_datatype keep, index, huge, step, time;
	} cases[] = {
		{&gnp_format_npz, GNP_BOOL, GNP_INT64, GNP_INT64, GNP_UINT64, GNP_FP64},
		{&gnp_format_json, GNP_BOOL, GNP_FP64, GNP_FP64, GNP_FP64, GNP_FP64},
		{&gnp_format_ply, GNP_UINT8, GNP_INT32, GNP_FP64, GNP_INT32, GNP_FP64},
		{&gnp_format_xyz, GNP_FP64, GNP_FP64, GNP_FP64, GNP_FP64, GNP_FP64},
		{&gnp_format_csv, GNP_FP64, GNP_FP64, GNP_FP64, GNP_FP64, GNP_FP64},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct gnp_response response = {0};
		struct gnp_buffer file = {0};
		struct gnp_tensors back = {0};
		struct gnp_error error = {0};
		add(&response.outputs, "points", GNP_FP64, 2, M, cloud);
		add(&response.outputs, "keep", GNP_BOOL, 1, M, keep);
		add(&response.outputs, "index", GNP_INT64, 1, M, positions);
		add(&response.outputs, "huge", GNP_INT64, 1, M, huge);
		add(&response.outputs, "step", GNP_UINT64, 1, M, steps);
		add(&response.outputs, "time", GNP_FP64, 1, M, times);
		encode(cases[i].format, &response, &file);
		CHECK(gnp_file_decode_all(cases[i].format, file.data, file.size, &back, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		check_field(&back, "keep", cases[i].keep, (double[]){1, 0, 1}, M);
		check_field(&back, "index", cases[i].index, (double[]){0, 2, 3}, M);
		check_field(&back, "huge", cases[i].huge, (double[]){-1, 5e9, 7}, M);
		check_field(&back, "step", cases[i].step, (double[]){0, 10, 20}, M);
		check_field(&back, "time", cases[i].time, times, M);
		gnp_tensors_clear(&back);
		gnp_buffer_clear(&file);
	}
}

static void vtk_and_npy_hold_every_type(void)
{
	struct gnp_response response = {0};
	struct gnp_buffer vtk = {0}, npy = {0};
	struct gnp_tensors back = {0};
	add(&response.outputs, "points", GNP_FP64, 2, M, cloud);
	add(&response.outputs, "keep", GNP_BOOL, 1, M, keep);
	add(&response.outputs, "index", GNP_INT64, 1, M, positions);
	add(&response.outputs, "huge", GNP_INT64, 1, M, huge);
	encode(&gnp_format_vtk, &response, &vtk);
	CHECK(memmem(vtk.data, vtk.size, "keep 1 3 unsigned_char\n\1\0\1\nindex 1 3 int\n\0\0\0\0\0\0\0\2\0\0\0\3\nhuge 1 3 double\n", 69));
	add(&response.outputs, "keep", GNP_BOOL, 1, N, keep);
	encode(&gnp_format_npy, &response, &npy);
	CHECK(gnp_file_decode_all(&gnp_format_npy, npy.data, npy.size, &back, NULL) == GNP_OK);
	CHECK(back.count == 1 && back.items[0].datatype == GNP_BOOL && back.items[0].shape[0] == N);
	gnp_tensors_clear(&back);
	gnp_buffer_clear(&npy);
	gnp_buffer_clear(&vtk);
}

/* What is known of an answer before it is computed, by operation, outputs ("" for those by default) and format. */
static void formats_are_judged_before_the_work(void)
{
	static const struct {
		const char *operation, *name, *value;
		const struct gnp_format *format;
		bool fits;
		const char *refusal; /* "" where it is taken when asked for */
	} cases[] = {
		{"estimate", "", "", &gnp_format_ply, true, ""},
		{"estimate", "", "", &gnp_format_npz, true, ""},
		{"estimate", "", "", &gnp_format_npy, false, "npy: holds one array beside points, the answer has 3: ask for npz or one output"},
		{"estimate", "quantities", "normals", &gnp_format_npy, true, ""},
		{"estimate", "", "", &gnp_format_mtx, false, "mtx: needs row_offsets, columns and values, a sparse matrix, which estimate does not answer"},
		{"filter", "", "", &gnp_format_ply, true, ""}, /* keep and deviation may be left out */
		{"filter", "outputs", "all", &gnp_format_xyz, true, ""},
		{"filter", "outputs", "keep,points", &gnp_format_ply, false, ""}, /* unless they are named */
		{"filter", "outputs", "keep", &gnp_format_ply, true, ""},
		{"filter", "outputs", "points", &gnp_format_npy, true, ""},
		{"filter", "outputs", "index", &gnp_format_ply, false, ""}, /* all points may be kept */
		{"flow", "", "", &gnp_format_ply, true, ""},
		{"flow", "outputs", "record", &gnp_format_ply, false, ""},
		{"laplacian", "", "", &gnp_format_mtx, true, ""},
		{"laplacian", "", "", &gnp_format_ply, false, ""}, /* kept has a row a point, the operator has not */
		{"laplacian", "outputs", "values,columns", &gnp_format_ply, false, "ply: the points have 200 rows, and none of the outputs has"},
		{"laplacian", "outputs", "values", &gnp_format_mtx, false, "mtx: needs row_offsets, columns and values"},
		{"laplacian", "", "", &gnp_format_json, true, ""},
		{"laplacian", "system", "symmetric", &gnp_format_mtx, true, ""},
		{"spectrum", "", "", &gnp_format_ply, false, ""},
		{"spectrum", "outputs", "eigenvectors", &gnp_format_ply, true, ""},
		{"spectrum", "outputs", "eigenvalues", &gnp_format_vtk, false, "vtk: the points have 200 rows, and none of the outputs has"},
		{"geodesic", "", "", &gnp_format_npy, true, ""},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		enum { POINTS = 200 };
		struct gnp_request request = {0};
		struct gnp_call call;
		struct gnp_tensor *points;
		struct gnp_error error = {0};
		CHECK(gnp_tensors_add(&request.inputs, "points", GNP_FP32, 2, (size_t[]){POINTS, 3}, &points, NULL) == GNP_OK);
		gnp_values_add_string(&request.parameters, "estimator", "gmls", NULL);
		if (*cases[i].name)
			gnp_values_add_string(&request.parameters, cases[i].name, cases[i].value, NULL);
		CHECK(gnp_call_prepare(gnp_operation_find(cases[i].operation), &request, NULL, &call, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		if (gnp_result_fits(cases[i].format, &call) != cases[i].fits)
			CHECK_STRING(cases[i].operation, cases[i].value);
		CHECK(gnp_result_check(cases[i].format, &call, &error) == (*cases[i].refusal ? GNP_NOT_ACCEPTABLE : GNP_OK));
		CHECK_CONTAINS(error.text, cases[i].refusal);
		gnp_request_clear(&request);
	}
}

/* A column a right-hand side: more than a table may have is known from the request. */
static void too_many_columns_are_known_before(void)
{
	enum { POINTS = 200 };
	for (size_t sides = 4000; sides <= 5000; sides += 1000) {
		struct gnp_request request = {0};
		struct gnp_call call;
		struct gnp_tensor *tensor;
		struct gnp_error error = {0};
		CHECK(gnp_tensors_add(&request.inputs, "points", GNP_FP32, 2, (size_t[]){POINTS, 3}, &tensor, NULL) == GNP_OK);
		CHECK(gnp_tensors_add(&request.inputs, "source", GNP_UINT8, 2, (size_t[]){POINTS, sides}, &tensor, NULL) == GNP_OK);
		gnp_values_add_string(&request.parameters, "estimator", "gmls", NULL);
		CHECK(gnp_call_prepare(gnp_operation_find("poisson"), &request, NULL, &call, NULL) == GNP_OK);
		CHECK(gnp_result_fits(&gnp_format_ply, &call) == (sides == 4000));
		CHECK(gnp_result_check(&gnp_format_ply, &call, &error) == (sides == 4000 ? GNP_OK : GNP_NOT_ACCEPTABLE));
		CHECK_STRING(error.text, sides == 4000 ? "" : "ply: more than 4096 columns: ask for npz");
		gnp_request_clear(&request);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(rows_leave_out_what_has_others_and_say_so), TEST(outputs_without_points_stand_beside_the_cloud),
	                                    TEST(nothing_to_carry_is_an_error), TEST(every_type_survives_every_format),
	                                    TEST(vtk_and_npy_hold_every_type), TEST(formats_are_judged_before_the_work),
	                                    TEST(too_many_columns_are_known_before)};
	return RUN_TESTS(tests);
}
