/* What an answer says of itself: the whole table of operations, by every estimator, in every format that is written and over both protocols;
 * and the ways it takes there and back. */
#include "core/model/models.h"
#include "proto/codec/parameters.h"
#include "proto/file/file.h"
#include "proto/file/formats.h"
#include "proto/file/result.h"
#include "proto/oip/oip.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"
#include "proto/tensor/warnings.h"
#include "tests/bench/cloud_request.h"

static const char *const estimators[] = {"gnp", "gmls", "adaptive"};
static struct gnp_models *models;
static struct gnp_pool *pool;
enum { FORMATS_MAX = 32 };
static unsigned carried[FORMATS_MAX]; /* answers that each format held */

/* ---- Every operation ---- */

/* The inputs that an operation cannot be without, each the points' height. */
static void add_inputs(const struct gnp_operation *operation, size_t count, struct gnp_request *request)
{
	add_sphere(request, GNP_FP64, count, 0);
	for (size_t i = 0; i < operation->input_count; i++) {
		const struct gnp_tensor_info *info = &operation->inputs[i];
		size_t shape[] = {count, 1};
		struct gnp_tensor *tensor;
		bool begins = strcmp(info->name, "source") == 0 || strcmp(info->name, "initial") == 0; /* one of several must */
		if ((info->optional && !begins) || strcmp(info->name, "points") == 0)
			continue;
		CHECK(gnp_tensors_add(&request->inputs, info->name, GNP_FP64, info->rank, shape, &tensor, NULL) == GNP_OK);
		for (size_t row = 0; row < count; row++)
			((double *)tensor->data)[row] = 1 - (2 * (double)row + 1) / (double)count;
	}
}

static bool is_text(const struct gnp_values *values, const char *name, const char *want)
{
	const struct gnp_value *value = gnp_values_find(values, name);
	return value && value->type == GNP_VALUE_STRING && (want ? strcmp(value->string, want) == 0 : value->string[0] != '\0');
}

/* A digest of a model that is loaded under the name beside it. */
static bool names_a_model(const struct gnp_values *values)
{
	const struct gnp_value *name = gnp_values_find(values, "weights"), *digest = gnp_values_find(values, "weights_sha256");
	for (size_t i = 0; name && digest && i < gnp_models_count(models); i++)
		if (strcmp(gnp_models_at(models, i)->name, name->string) == 0 && strcmp(gnp_models_at(models, i)->sha256, digest->string) == 0)
			return true;
	return false;
}

static void check_report(const char *where, const char *operation, const char *estimator, const struct gnp_values *values)
{
	bool learned = strcmp(estimator, "gnp") == 0;
	bool good = is_text(values, "estimator", estimator) && (learned ? names_a_model(values) : !gnp_values_find(values, "weights"));
	if (!good)
		fprintf(stderr, "%s by %s in %s:\n", operation, estimator, where);
	CHECK(good);
}

static bool has_place(const struct gnp_format *format)
{
	return format != &gnp_format_npy && format != &gnp_format_csv;
}

static void check_formats(const struct gnp_call *call, const struct gnp_response *response, const char *estimator)
{
	const struct gnp_format *f;
	for (size_t i = 0; (f = gnp_format_at(i)); i++) {
		struct gnp_buffer file = {0};
		struct gnp_values values = {0};
		if (!gnp_format_writable(f) || gnp_result_check(f, call, NULL) != GNP_OK)
			continue;
		CHECK(gnp_result_encode(f, call->request, response, &file, NULL) == GNP_OK);
		CHECK(gnp_file_parameters(f, file.data, file.size, &values, NULL) == GNP_OK);
		if (has_place(f))
			check_report(gnp_format_name(f), call->operation->name, estimator, &values);
		else
			CHECK(values.count == 0);
		carried[i]++;
		gnp_values_clear(&values);
		gnp_buffer_clear(&file);
	}
}

static void check_header(const struct gnp_call *call, const struct gnp_response *response, const char *estimator)
{
	struct gnp_buffer header = {0};
	struct gnp_values values = {0};
	CHECK(gnp_parameters_write_short(&response->parameters, &header, NULL) == GNP_OK);
	CHECK(header.size && gnp_parameters_read((const char *)header.data, header.size, &values, NULL) == GNP_OK);
	check_report("a header", call->operation->name, estimator, &values);
	CHECK(values.count == response->parameters.count);
	gnp_values_clear(&values);
	gnp_buffer_clear(&header);
}

static void check_inference(const struct gnp_call *call, const struct gnp_response *response, const char *estimator)
{
	struct gnp_buffer head = {0};
	struct gnp_request binary = {.binary_default = true};
	struct gnp_values values = {0};
	const struct gnp_tensor **tails;
	size_t count;
	CHECK(gnp_oip_encode_response(call->operation, &binary, response, &head, &tails, &count, NULL) == GNP_OK);
	CHECK(gnp_file_parameters(&gnp_format_json, head.data, head.size, &values, NULL) == GNP_OK);
	check_report("v2", call->operation->name, estimator, &values);
	gnp_values_clear(&values);
	gnp_buffer_clear(&head);
	free(tails);
}

static void run_one(const struct gnp_operation *operation, const char *estimator, const char *more)
{
	const struct gnp_limits limits = {.models = models};
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_error error = {0};
	struct gnp_call call;
	add_inputs(operation, 400, &request);
	CHECK(gnp_values_add_string(&request.parameters, "estimator", estimator, NULL) == GNP_OK);
	set_parameters(&request, more);
	gnp_status status = gnp_call_prepare(operation, &request, &limits, &call, &error);
	if (status == GNP_OK)
		status = gnp_call_run(&call, pool, NULL, &response, &error);
	CHECK_STRING(error.text, "");
	if (status == GNP_OK) {
		check_report("the response", operation->name, estimator, &response.parameters);
		check_formats(&call, &response, estimator);
		check_header(&call, &response, estimator);
		check_inference(&call, &response, estimator);
	}
	gnp_response_clear(&response);
	gnp_request_clear(&request);
}

static void every_answer_names_its_estimator_and_weights(void)
{
	const struct gnp_operation *operation;
	const struct gnp_format *f;
	memset(carried, 0, sizeof carried);
	for (size_t i = 0; (operation = gnp_operation_at(i)); i++)
		for (size_t e = 0; e < sizeof estimators / sizeof *estimators; e++)
			if (strcmp(operation->name, "patch") != 0 || strcmp(estimators[e], "gnp") == 0) /* others weigh no points */
				run_one(operation, estimators[e], strcmp(operation->name, "flow") == 0 ? "steps=2" : "");
	run_one(gnp_operation_find("estimate"), "gnp", "quantities=mean_curvature weights=fit_noise_70k");
	run_one(gnp_operation_find("laplacian"), "gnp", "filter=true");
	for (size_t i = 0; (f = gnp_format_at(i)); i++)
		CHECK(!gnp_format_writable(f) || carried[i]);
}

/* A sphere of 2,000 points, some of noise, of which every 40th lies off the surface. */
static void run_spoilt(const char *parameters, struct gnp_response *response)
{
	const struct gnp_limits limits = {.models = models};
	struct gnp_request request = {0};
	struct gnp_call call;
	add_sphere(&request, GNP_FP64, 2000, 0);
	double *points = request.inputs.items[0].data;
	for (size_t i = 0; i < 2000; i++)
		for (size_t a = 0; a < 3; a++)
			points[3 * i + a] *= i % 40 ? 1 + 0.004 * sin((double)(i * i)) : 1.1;
	set_parameters(&request, parameters);
	CHECK(gnp_call_prepare(gnp_operation_find("estimate"), &request, &limits, &call, NULL) == GNP_OK);
	CHECK(gnp_call_run(&call, pool, NULL, response, NULL) == GNP_OK);
	gnp_request_clear(&request);
}

static bool same_outputs(const struct gnp_response *a, const struct gnp_response *b)
{
	bool same = a->outputs.count == b->outputs.count;
	for (size_t i = 0; same && i < a->outputs.count; i++)
		same = a->outputs.items[i].size == b->outputs.items[i].size &&
		       memcmp(a->outputs.items[i].data, b->outputs.items[i].data, a->outputs.items[i].size) == 0;
	return same;
}

/* How many points the quantity outlier says are none of the surface: all that are not, and few others. */
static double check_outliers(const struct gnp_response *response)
{
	const struct gnp_tensor *outlier = gnp_tensors_find(&response->outputs, "outlier");
	double found = 0, right = 0;
	for (size_t i = 0; outlier && i < 2000; i++) {
		found += gnp_tensor_get(outlier, i);
		right += i % 40 ? 0 : gnp_tensor_get(outlier, i);
	}
	CHECK(right >= 45 && found - right < 0.1 * 1950);
	return found;
}

/* auto is the model that judges every point itself; others are told to leave outliers out, and say that they were. */
static void what_was_done_the_parameters_repeat(void)
{
	struct gnp_response chosen = {0}, repeated = {0}, left_out = {0}, kept = {0};
	run_spoilt("weights=auto quantities=normals,outlier", &chosen);
	run_spoilt("weights=any quantities=normals,outlier", &repeated);
	run_spoilt("weights=fit_noise_70k outliers=left_out", &left_out);
	run_spoilt("weights=fit_noise_70k", &kept);
	CHECK_STRING(text(&chosen, "weights"), "any");
	CHECK(number(&chosen, "outliers_found") == check_outliers(&chosen));
	CHECK(!gnp_values_find(&chosen.parameters, "k") && !gnp_values_find(&chosen.parameters, "outliers"));
	CHECK(same_outputs(&repeated, &chosen) && number(&repeated, "outliers_found") == number(&chosen, "outliers_found"));
	CHECK_STRING(text(&left_out, "outliers"), "left_out");
	CHECK_NEAR(number(&left_out, "outliers_left_out"), 50, 2);
	CHECK(!same_outputs(&kept, &left_out) && !gnp_values_find(&kept.parameters, "outliers"));
	gnp_response_clear(&chosen);
	gnp_response_clear(&left_out);
	gnp_response_clear(&repeated);
	gnp_response_clear(&kept);
}

/* ---- There and back ---- */

static void add_some(struct gnp_values *values, size_t warnings)
{
	struct gnp_buffer joined = {0};
	CHECK(gnp_values_add_string(values, "estimator", "gnp", NULL) == GNP_OK);
	CHECK(gnp_values_add_bool(values, "normals_estimated", true, NULL) == GNP_OK);
	CHECK(gnp_values_add_integer(values, "k", 30, NULL) == GNP_OK);
	CHECK(gnp_values_add_number(values, "residual", 0.1, NULL) == GNP_OK);
	for (size_t w = 0; w < warnings; w++)
		CHECK(gnp_buffer_printf(&joined, NULL, "%skind%zu: %0250d of it", w ? "; " : "", w, 7) == GNP_OK);
	if (warnings)
		CHECK(gnp_values_add_string(values, GNP_WARNINGS_NAME, (const char *)joined.data, NULL) == GNP_OK);
	gnp_buffer_clear(&joined);
}

static void add_rows(struct gnp_tensors *tensors)
{
	size_t shape[] = {4, 3};
	struct gnp_tensor *points;
	CHECK(gnp_tensors_add(tensors, "points", GNP_FP64, 2, shape, &points, NULL) == GNP_OK);
	for (size_t i = 0; i < 12; i++)
		((double *)points->data)[i] = (double)i;
}

static void warnings_are_taken_apart_as_they_were_joined(void)
{
	struct gnp_warnings warnings = {0};
	struct gnp_values report = {0};
	gnp_warnings_add(&warnings, GNP_WARNING_HEAT, "a; b: c");
	gnp_warnings_add(&warnings, GNP_WARNING_PRECISION, "first");
	CHECK(gnp_warnings_report(&warnings, &report, NULL) == GNP_OK);
	const char *joined = gnp_warnings_of(&report), *text;
	size_t length;
	CHECK(gnp_warnings_joined_count(joined) == gnp_warnings_count(&warnings));
	CHECK(gnp_warnings_next(&joined, &text, &length) && length == 16 && strncmp(text, "precision: first", length) == 0);
	CHECK(gnp_warnings_next(&joined, &text, &length) && length == 13 && strncmp(text, "heat: a, b: c", length) == 0);
	CHECK(!gnp_warnings_next(&joined, &text, &length));
	gnp_values_clear(&report);
	CHECK_STRING(gnp_warnings_of(&report), "");
	CHECK(gnp_warnings_joined_count("") == 0);
}

/* Of comments the numbers come back as texts. */
static void files_say_what_they_were_told(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_values told = {0};
	const struct gnp_format *f;
	add_rows(&tensors);
	add_some(&told, 13);
	for (size_t i = 0; (f = gnp_format_at(i)); i++) {
		struct gnp_buffer file = {0};
		struct gnp_values read = {0};
		if (!gnp_format_writable(f) || f == &gnp_format_mtx)
			continue;
		CHECK(gnp_file_encode(f, &tensors, &told, &file, NULL) == GNP_OK);
		CHECK(gnp_file_parameters(f, file.data, file.size, &read, NULL) == GNP_OK);
		CHECK(read.count == (has_place(f) ? told.count : 0));
		if (has_place(f))
			CHECK_STRING(gnp_warnings_of(&read), gnp_warnings_of(&told));
		gnp_values_clear(&read);
		gnp_buffer_clear(&file);
	}
	gnp_values_clear(&told);
	gnp_tensors_clear(&tensors);
}

static size_t longest_line(const struct gnp_buffer *file)
{
	size_t longest = 0, length = 0;
	for (size_t i = 0; i < file->size; i++) {
		length = file->data[i] == '\n' ? 0 : length + 1;
		longest = length > longest ? length : longest;
	}
	return longest;
}

/* Readers of PLY take lines of 1,023 bytes and less. */
static void comments_have_a_line_for_each_warning(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_values told = {0};
	struct gnp_buffer file = {0};
	add_rows(&tensors);
	add_some(&told, 13);
	CHECK(gnp_file_encode(&gnp_format_xyz, &tensors, &told, &file, NULL) == GNP_OK);
	CHECK_AT_MOST((double)longest_line(&file), 400);
	CHECK(gnp_buffer_append(&file, "", 1, NULL) == GNP_OK);
	CHECK_CONTAINS((const char *)file.data, "\n# warnings kind12: 0");
	gnp_buffer_clear(&file);
	gnp_values_clear(&told);
	gnp_tensors_clear(&tensors);
}

static void archives_go_back_in(void)
{
	struct gnp_tensors tensors = {0}, back = {0};
	struct gnp_values told = {0};
	struct gnp_buffer file = {0};
	add_rows(&tensors);
	add_some(&told, 1);
	CHECK(gnp_file_encode(&gnp_format_npz, &tensors, &told, &file, NULL) == GNP_OK);
	CHECK(gnp_file_decode(&gnp_format_npz, file.data, file.size, NULL, &back, NULL) == GNP_OK);
	CHECK(back.count == 1);
	gnp_tensors_clear(&back);
	CHECK(gnp_file_decode_all(&gnp_format_npz, file.data, file.size, &back, NULL) == GNP_OK);
	CHECK(back.count == 1);
	gnp_tensors_clear(&back);
	gnp_buffer_clear(&file);
	gnp_values_clear(&told);
	gnp_tensors_clear(&tensors);
}

/* An array of numbers that happens to have the name is one. */
static void somebody_elses_parameters_are_an_array(void)
{
	struct gnp_tensors tensors = {0}, back = {0};
	struct gnp_values read = {0};
	struct gnp_buffer file = {0};
	struct gnp_tensor *mine;
	size_t count = 5;
	add_rows(&tensors);
	CHECK(gnp_tensors_add(&tensors, GNP_PARAMETERS_NAME, GNP_FP64, 1, &count, &mine, NULL) == GNP_OK);
	memset(mine->data, 0, mine->size);
	CHECK(gnp_file_encode(&gnp_format_npz, &tensors, NULL, &file, NULL) == GNP_OK);
	CHECK(gnp_file_decode_all(&gnp_format_npz, file.data, file.size, &back, NULL) == GNP_OK);
	CHECK(back.count == 2);
	CHECK(gnp_file_parameters(&gnp_format_npz, file.data, file.size, &read, NULL) == GNP_OK && read.count == 0);
	gnp_tensors_clear(&back);
	gnp_buffer_clear(&file);
	gnp_tensors_clear(&tensors);
}

static void comments_of_others_are_shown(void)
{
	static const char xyz[] = "# made by hand\n# x y z\n1 2 3\n  # not at the start\n", ply[] = "ply\nformat ascii 1.0\ncomment by  me\r\n"
	                          "comment\nelement vertex 0\nend_header\ncomment no more\n";
	static const char vtk[] = "# vtk DataFile Version 3.0\nA title\nASCII\n", mtx[] = "%%MatrixMarket matrix\n% a b\n1 1 0\n% c d\n";
	const struct {
		const struct gnp_format *format;
		const char *text, *name, *value;
	} files[] = {{&gnp_format_xyz, xyz, "made", "by hand"}, {&gnp_format_ply, ply, "by", "me"}, {&gnp_format_vtk, vtk, "A", "title"},
	             {&gnp_format_mtx, mtx, "a", "b"}};
	for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
		struct gnp_values read = {0};
		CHECK(gnp_file_parameters(files[i].format, (const unsigned char *)files[i].text, strlen(files[i].text), &read, NULL) == GNP_OK);
		CHECK(read.count == 1 && is_text(&read, files[i].name, files[i].value));
		gnp_values_clear(&read);
	}
}

/* ---- The header ---- */

static void headers_are_one_line_of_ascii(void)
{
	struct gnp_values told = {0}, read = {0};
	struct gnp_buffer header = {0};
	const char *text = "Gau\xc3\x9f \xe2\x82\xac \xf0\x9f\x98\x80\r\nX: y";
	CHECK(gnp_values_add_string(&told, "reason", text, NULL) == GNP_OK);
	CHECK(gnp_parameters_write_short(&told, &header, NULL) == GNP_OK);
	for (size_t i = 0; i < header.size; i++)
		CHECK(header.data[i] >= 0x20 && header.data[i] < 0x7f);
	CHECK(gnp_parameters_read((const char *)header.data, header.size, &read, NULL) == GNP_OK);
	CHECK(is_text(&read, "reason", text));
	CHECK(gnp_buffer_append(&header, "", 1, NULL) == GNP_OK);
	CHECK_CONTAINS((const char *)header.data, "\\u00df \\u20ac \\ud83d\\ude00");
	gnp_values_clear(&told);
	gnp_values_clear(&read);
	gnp_buffer_clear(&header);
}

static void long_headers_have_the_kinds_alone(void)
{
	struct gnp_values told = {0}, read = {0};
	struct gnp_buffer header = {0};
	add_some(&told, 13);
	CHECK(gnp_parameters_write_short(&told, &header, NULL) == GNP_OK);
	CHECK(header.size && header.size <= GNP_PARAMETERS_HEADER_MAX);
	CHECK(gnp_parameters_read((const char *)header.data, header.size, &read, NULL) == GNP_OK);
	CHECK(gnp_warnings_joined_count(gnp_warnings_of(&read)) == 13);
	CHECK(strncmp(gnp_warnings_of(&read), "kind0; kind1; kind2; ", 21) == 0);
	CHECK(gnp_warnings_joined_count(gnp_warnings_of(&told)) == 13 && strlen(gnp_warnings_of(&told)) > 13 * 250);
	gnp_values_clear(&told);
	gnp_values_clear(&read);
	gnp_buffer_clear(&header);
}

static void headers_that_stay_too_long_are_left_out(void)
{
	struct gnp_values told = {0};
	struct gnp_buffer header = {0};
	char text[GNP_PARAMETERS_HEADER_MAX];
	memset(text, 'a', sizeof text - 1);
	text[sizeof text - 1] = '\0';
	add_some(&told, 2);
	CHECK(gnp_values_add_string(&told, "reason", text, NULL) == GNP_OK);
	CHECK(gnp_parameters_write_short(&told, &header, NULL) == GNP_OK);
	CHECK(header.size == 0);
	gnp_values_clear(&told);
	gnp_buffer_clear(&header);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(every_answer_names_its_estimator_and_weights), TEST(what_was_done_the_parameters_repeat),
		TEST(warnings_are_taken_apart_as_they_were_joined), TEST(files_say_what_they_were_told), TEST(comments_have_a_line_for_each_warning),
		TEST(archives_go_back_in), TEST(somebody_elses_parameters_are_an_array), TEST(comments_of_others_are_shown),
		TEST(headers_are_one_line_of_ascii), TEST(long_headers_have_the_kinds_alone), TEST(headers_that_stay_too_long_are_left_out)};
	struct gnp_error error = {0};
	if (gnp_models_load("weights", &models, &error) != GNP_OK || gnp_pool_create(2, &pool, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		return 1;
	}
	int code = RUN_TESTS(tests);
	gnp_pool_free(pool);
	gnp_models_release(models);
	return code;
}
