/* The inference protocol: round trips, and what hostile or careless clients send. */
#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/oip/oip.h"
#include "proto/operation/operations.h"

#define POINTS "{\"inputs\":[{\"name\":\"points\",\"datatype\":\"FP32\","

static gnp_status decode(const char *text, struct gnp_request *request, struct gnp_error *error)
{
	/* A heap copy of the exact size lets the address sanitizer see reads past the end. */
	size_t size = strlen(text);
	unsigned char *body = malloc(size ? size : 1);
	memcpy(body, text, size);
	gnp_status status = gnp_oip_decode_request(body, size, GNP_OIP_NO_HEADER, request, error);
	free(body);
	return status;
}

static void check_refused(const char *text, const char *want)
{
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	CHECK(decode(text, &request, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, want);
	CHECK(request.inputs.count == 0 && !request.id);
}

static void check_binary_refused(const char *json, size_t extra, const char *want)
{
	size_t length = strlen(json);
	unsigned char *body = calloc(1, length + extra);
	memcpy(body, json, length);
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	CHECK(gnp_oip_decode_request(body, length + extra, length, &request, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, want);
	free(body);
}

static void header_lengths(void)
{
	size_t length = 7;
	struct gnp_error error = {0};
	CHECK(gnp_oip_header_length("0", 10, &length, NULL) == GNP_OK && length == 0);
	CHECK(gnp_oip_header_length("10", 10, &length, NULL) == GNP_OK && length == 10);
	static const char *const bad[] = {"", "-1", "+1", "1 2", "0x10", "ten", "1e2", " 1", "1.0"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		CHECK(gnp_oip_header_length(bad[i], 10, &length, NULL) == GNP_INVALID_ARGUMENT);
	static const char *const large[] = {"11", "99999999999", "18446744073709551615", "18446744073709551626",
	                                    "99999999999999999999999999999999999999999999"};
	for (size_t i = 0; i < sizeof large / sizeof large[0]; i++)
		CHECK(gnp_oip_header_length(large[i], 10, &length, NULL) == GNP_INVALID_ARGUMENT);
	CHECK(gnp_oip_header_length("99999999999", 10, &length, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "Inference-Header-Content-Length: got 99999999999, need at most the body's 10 bytes");
	CHECK(length == 10);
}

static void json_requests_decode(void)
{
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	const char *text = " { \"id\" : \"a\\u00e9\", \"parameters\": {\"k\": 40, \"x\": 0.5, \"s\":\"t\", \"binary_data_output\": true},\n"
	                   "\"inputs\" : [ {\"data\" : [ [1, 2.5,-3e0] ,\n[4,5,6]], \"name\":\"points\", \"shape\":[2,3], \"datatype\":\"FP32\"},"
	                   "{\"name\":\"normals\",\"shape\":[2,3],\"datatype\":\"INT64\",\"data\":[9223372036854775807,-9223372036854775808,0,1,2,3]}],"
	                   "\"outputs\":[{\"name\":\"metric\"},{\"name\":\"frame\",\"parameters\":{\"binary_data\":false}}]}";
	CHECK(decode(text, &request, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK_STRING(request.id, "a\xc3\xa9");
	CHECK(gnp_values_find(&request.parameters, "k")->integer == 40);
	CHECK(request.inputs.count == 2 && request.binary_default);
	const float *points = request.inputs.items[0].data;
	CHECK(points[1] == 2.5f && points[2] == -3 && points[5] == 6);
	const int64_t *wide = request.inputs.items[1].data;
	CHECK(wide[0] == INT64_MAX && wide[1] == INT64_MIN);
	CHECK(request.output_count == 2 && request.outputs[0].binary && !request.outputs[1].binary);
	gnp_request_clear(&request);
	CHECK(decode(POINTS "\"shape\":[0,3],\"data\":[]}]}", &request, NULL) == GNP_OK);
	CHECK(request.inputs.items[0].size == 0);
	gnp_request_clear(&request);
	CHECK(decode("{\"inputs\":[{\"name\":\"f\",\"datatype\":\"BOOL\",\"shape\":[3],\"data\":[true,false,1]}]}", &request, NULL) == GNP_OK);
	CHECK(memcmp(request.inputs.items[0].data, "\1\0\1", 3) == 0);
	gnp_request_clear(&request);
}

static void malformed_json_is_refused(void)
{
	check_refused("", "JSON: the text is empty");
	check_refused("{", "JSON:");
	check_refused("[]", "JSON: need an object");
	check_refused("{\"inputs\":[]} x", "JSON:");
	check_refused("{\"id\":\"a\",\"id\":\"b\",\"inputs\":[]}", "duplicate");
	check_refused("{}", "inputs: need an array");
	check_refused("{\"id\":5,\"inputs\":[]}", "id: need a string");
	check_refused("{\"parameters\":{\"k\":[1]},\"inputs\":[]}", "parameters: \"k\": need a string, number or boolean");
	check_refused("{\"parameters\":{\"binary_data_output\":1},\"inputs\":[]}", "binary_data_output: need true or false");
	check_refused("{\"inputs\":[5]}", "inputs[0]: need an object");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"shape\":[1 2],\"datatype\":\"FP32\",\"data\":[1]}]}", "JSON:");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"datatype\":\"FP31\",\"shape\":[1],\"data\":[1]}]}", "datatype: got FP31");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"datatype\":\"FP16\",\"shape\":[1],\"data\":[1]}]}", "FP16 has no JSON form");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"datatype\":\"BYTES\",\"shape\":[1],\"data\":[\"a\"]}]}", "BYTES");
	check_refused("{\"inputs\":[],\"outputs\":[{\"name\":\"a\"},{\"name\":\"a\"}]}", "outputs: \"a\" is asked for twice");
	check_refused("{\"inputs\":[],\"outputs\":[{\"name\":\"a\",\"parameters\":{\"classification\":3}}]}",
	              "unknown parameter \"classification\", known: binary_data");
}

static void deep_nesting_is_refused(void)
{
	char text[4096] = "{\"inputs\":";
	memset(text + 10, '[', 3000);
	check_refused(text, "nested deeper than 100");
	char data[4096] = POINTS "\"shape\":[1],\"data\":";
	memset(data + strlen(data), '[', 3000);
	check_refused(data, "nested deeper than 100");
	char objects[4096] = "";
	for (int i = 0; i < 200; i++)
		strcat(objects, "{\"a\":");
	check_refused(objects, "nested deeper than 100");
}

static void large_envelopes_are_refused(void)
{
	enum { SIZE = 3 << 20 };
	char *text = malloc(SIZE + 1);
	memset(text, '1', SIZE);
	memcpy(text, "{\"id\":\"", 7);
	text[SIZE] = '\0';
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	CHECK(decode(text, &request, &error) == GNP_TOO_LARGE);
	CHECK_CONTAINS(error.text, "more than 1048576 bytes besides the data arrays");
	free(text);
}

static void shapes_are_checked(void)
{
	check_refused(POINTS "\"shape\":[-1,3],\"data\":[1,2,3]}]}", "shape[0]: need an integer of at least 0");
	check_refused(POINTS "\"shape\":[1.5,3],\"data\":[1,2,3]}]}", "shape[0]: need an integer");
	check_refused(POINTS "\"shape\":3,\"data\":[1,2,3]}]}", "shape: need an array");
	check_refused(POINTS "\"shape\":[1,1,1,1,1,1,1,1,3],\"data\":[1,2,3]}]}", "rank 9, need at most 8");
	check_refused(POINTS "\"shape\":[9223372036854775807,3],\"data\":[1,2,3]}]}", "the shape's product overflows");
	check_refused(POINTS "\"shape\":[4611686018427387904,3],\"data\":[1,2,3]}]}", "data has fewer");
	check_refused(POINTS "\"shape\":[99999999999999999999,3],\"data\":[1,2,3]}]}", "JSON:");
	check_refused(POINTS "\"shape\":[1000000000,3],\"data\":[1,2,3]}]}", "asks for 3000000000 elements, data has fewer");
	check_refused(POINTS "\"shape\":[1,3],\"data\":[1.0,2.0]}]}", "data has 2 elements, need the shape's 3");
	check_refused(POINTS "\"shape\":[1,3],\"data\":[1,2,3,4]}]}", "more than the shape's 3 elements");
	check_refused(POINTS "\"shape\":[2,3],\"data\":[[1,2],[3,4],[5,6]]}]}", "a row of 2 at depth 2, need the shape's 3");
	check_refused(POINTS "\"shape\":[2,3],\"data\":[[1,2,3],4,5,6]}]}", "a number beside an array");
	check_refused(POINTS "\"shape\":[2,3],\"data\":[[[1,2,3],[4,5,6]]]}]}", "nested deeper than the shape's rank 2");
	check_refused(POINTS "\"shape\":[2,3]}]}", "need an array data or the parameter binary_data_size");
	check_refused(POINTS "\"shape\":[2,3],\"data\":7}]}", "need an array data");
	check_refused(POINTS "\"shape\":[2,3],\"d\\u0061ta\":[99]}]}", "need an array data");
}

static void numbers_are_checked(void)
{
	check_refused(POINTS "\"shape\":[1],\"data\":[null]}]}", "data[0]: got null, need a number (NaN and infinity have no JSON form");
	check_refused(POINTS "\"shape\":[1],\"data\":[NaN]}]}", "got NaN");
	check_refused(POINTS "\"shape\":[1],\"data\":[1e39]}]}", "got 1e39, need FP32");
	check_refused(POINTS "\"shape\":[1],\"data\":[1e999]}]}", "got 1e999, need FP32");
	check_refused(POINTS "\"shape\":[1],\"data\":[\"1\"]}]}", "got \"1\"");
	check_refused(POINTS "\"shape\":[2],\"data\":[1,]}]}", "not a JSON array of numbers");
	check_refused(POINTS "\"shape\":[2],\"data\":[,1]}]}", "data[0]");
	check_refused(POINTS "\"shape\":[2],\"data\":[1 2]}]}", "not a JSON array of numbers");
	check_refused(POINTS "\"shape\":[2],\"data\":[1,2}}]}", "tensor \"points\"");
	check_refused(POINTS "\"shape\":[2],\"data\":[1,2", "JSON:");
	check_refused(POINTS "\"shape\":[2],\"data\":[01,2]}]}", "got 01");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"datatype\":\"UINT8\",\"shape\":[1],\"data\":[256]}]}", "got 256, need UINT8");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"datatype\":\"UINT64\",\"shape\":[1],\"data\":[-1]}]}", "got -1, need UINT64");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"datatype\":\"INT32\",\"shape\":[1],\"data\":[1.5]}]}", "got 1.5, need an integer");
	check_refused("{\"inputs\":[{\"name\":\"p\",\"datatype\":\"UINT64\",\"shape\":[1],\"data\":[18446744073709551616]}]}", "need UINT64");
}

static void binary_sizes_are_checked(void)
{
#define BINARY(shape, size) POINTS "\"shape\":" shape ",\"parameters\":{\"binary_data_size\":" size "}}]}"
	check_binary_refused(BINARY("[2,3]", "23"), 24, "binary_data_size: got 23, need 24 as the shape");
	check_binary_refused(BINARY("[2,3]", "24"), 23, "binary_data_size: got 24, the body has 23 left");
	check_binary_refused(BINARY("[2,3]", "24"), 25, "body: 1 bytes after the last tensor's");
	check_binary_refused(BINARY("[2,3]", "-24"), 24, "binary_data_size: need an integer of at least 0");
	check_binary_refused(BINARY("[2,3]", "\"24\""), 24, "binary_data_size: need an integer");
	check_binary_refused(BINARY("[9223372036854775807,9223372036854775807]", "24"), 24, "the shape's product overflows");
	check_binary_refused(BINARY("[6148914691236517206,3]", "8"), 8, "overflows"); /* 3 times it is 2 mod 2^64 */
	check_binary_refused("{\"inputs\":[{\"name\":\"b\",\"datatype\":\"BYTES\",\"shape\":[1],\"parameters\":{\"binary_data_size\":4}}]}", 4,
	                     "BYTES is not supported");
	check_refused(BINARY("[2,3]", "24"), "binary data needs the header Inference-Header-Content-Length");
	check_binary_refused(POINTS "\"shape\":[1,3],\"data\":[1,2,3],\"parameters\":{\"binary_data_size\":12}}]}", 12,
	                     "both data and binary_data_size");
	check_binary_refused(POINTS "\"shape\":[1],\"data\":[1]},{\"name\":\"points\",\"datatype\":\"FP32\",\"shape\":[1],\"data\":[1]}]}", 0,
	                     "inputs: \"points\" is given twice");
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	CHECK(gnp_oip_decode_request((const unsigned char *)"{}", 2, 3, &request, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "got 3, need at most the body's 2 bytes");
}

static void raw_points_decode(void)
{
	_Alignas(8) unsigned char body[32];
	float point[] = {1, 2, 3, 4, 5, 6};
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	for (size_t shift = 0; shift < 2; shift++) { /* in place, and copied where misaligned */
		memcpy(body + shift, point, sizeof point);
		CHECK(gnp_oip_decode_request(body + shift, 24, 0, &request, NULL) == GNP_OK);
		const struct gnp_tensor *tensor = gnp_tensors_find(&request.inputs, "points");
		CHECK(tensor && tensor->shape[0] == 2 && tensor->shape[1] == 3 && gnp_tensor_get(tensor, 5) == 6);
		CHECK(tensor->owned == (shift == 1) && request.binary_default);
		gnp_request_clear(&request);
	}
	CHECK(gnp_oip_decode_request(body, 25, 0, &request, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "got 25 bytes, raw FP32 points [n,3] need a multiple of 12");
}

/* Encodes what the command line sends and decodes it at any alignment. */
static void requests_round_trip(void)
{
	struct gnp_request request = {0}, back = {0};
	struct gnp_buffer body = {0};
	size_t shape[] = {2, 3}, header;
	double points[] = {0.1, 0.2, 0.3, 1e300, -5, NAN};
	struct gnp_output_choice choices[] = {{"normals", true}, {"metric", false}};
	gnp_tensors_add_data(&request.inputs, "points", GNP_FP64, 2, shape, points, false, NULL, NULL);
	gnp_values_add_integer(&request.parameters, "k", 44, NULL);
	gnp_values_add_string(&request.parameters, "s", "q\"\\\n\x01", NULL);
	request.outputs = choices;
	request.output_count = 2;
	request.binary_default = true;
	for (size_t shift = 0; shift < 8; shift++) {
		body.size = 0;
		gnp_buffer_append(&body, "12345678", shift, NULL);
		CHECK(gnp_oip_encode_request(&request, &body, &header, NULL) == GNP_OK);
		CHECK(header + shift + sizeof points == body.size);
		struct gnp_error error = {0};
		CHECK(gnp_oip_decode_request(body.data + shift, body.size - shift, header, &back, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		CHECK(back.inputs.count == 1 && memcmp(back.inputs.items[0].data, points, sizeof points) == 0);
		CHECK((uintptr_t)back.inputs.items[0].data % 8 == 0);
		CHECK_STRING(gnp_values_find(&back.parameters, "s")->string, "q\"\\\n\x01");
		CHECK(back.output_count == 2 && back.outputs[0].binary && !back.outputs[1].binary && back.binary_default);
		gnp_request_clear(&back);
	}
	gnp_tensors_clear(&request.inputs);
	gnp_values_clear(&request.parameters);
	gnp_buffer_clear(&body);
}

static void make_response(struct gnp_response *response, float last)
{
	size_t shape[] = {2, 3}, rows = 2;
	struct gnp_tensor *tensor;
	gnp_tensors_add(&response->outputs, "normals", GNP_FP32, 2, shape, &tensor, NULL);
	memcpy(tensor->data, (float[]){1, 0.1f, -2.5e-8f, 3e20f, 0, 1}, 24);
	gnp_tensors_add(&response->outputs, "mean_curvature", GNP_FP64, 1, &rows, &tensor, NULL);
	memcpy(tensor->data, (double[]){0.1, (double)last}, 16);
	gnp_values_add_string(&response->parameters, "estimator", "gmls", NULL);
	gnp_values_add_number(&response->parameters, "seconds", 0.25, NULL);
}

static void responses_round_trip(void)
{
	struct gnp_response response = {0}, back = {0};
	struct gnp_output_choice choices[] = {{"mean_curvature", true}, {"normals", false}};
	struct gnp_request request = {.id = "id-7", .outputs = choices, .output_count = 2};
	struct gnp_buffer head = {0};
	const struct gnp_tensor **tails = NULL;
	size_t count = 0;
	make_response(&response, NAN); /* fine in binary */
	CHECK(gnp_oip_encode_response(gnp_operation_find("estimate"), &request, &response, &head, &tails, &count, NULL) == GNP_OK);
	CHECK(count == 1 && tails[0] == &response.outputs.items[1]);
	size_t header = head.size;
	gnp_buffer_append(&head, tails[0]->data, tails[0]->size, NULL);
	struct gnp_error error = {0};
	CHECK(gnp_oip_decode_response(head.data, head.size, header, &back, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(back.outputs.count == 2 && memcmp(back.outputs.items[0].data, response.outputs.items[1].data, 16) == 0);
	CHECK(memcmp(back.outputs.items[1].data, response.outputs.items[0].data, 24) == 0);
	CHECK_NEAR(gnp_values_find(&back.parameters, "seconds")->number, 0.25, 0);
	gnp_buffer_append(&head, "", 1, NULL);
	CHECK_CONTAINS((char *)head.data, "{\"model_name\":\"estimate\",\"model_version\":\"1\",\"id\":\"id-7\",\"parameters\":{");
	free(tails);
	gnp_buffer_clear(&head);
	gnp_response_clear(&response);
	gnp_response_clear(&back);
}

static void what_json_cannot_say_is_not_acceptable(void)
{
	struct gnp_response response = {0};
	struct gnp_request request = {0};
	struct gnp_buffer head = {0};
	const struct gnp_tensor **tails = NULL;
	size_t count = 0;
	struct gnp_error error = {0};
	make_response(&response, INFINITY);
	CHECK(gnp_oip_encode_response(gnp_operation_find("estimate"), &request, &response, &head, &tails, &count, &error) ==
	      GNP_NOT_ACCEPTABLE);
	CHECK_CONTAINS(error.text, "output \"mean_curvature\": element 1 is NaN or infinite");
	CHECK_CONTAINS(error.text, "binary");
	CHECK(head.size == 0 && !tails);
	gnp_buffer_clear(&head);
	gnp_response_clear(&response);
}

static void metadata_is_json_of_every_parameter(void)
{
	struct gnp_buffer buffer = {0};
	CHECK(gnp_oip_model_metadata(gnp_operation_find("estimate"), NULL, &buffer, NULL) == GNP_OK);
	gnp_buffer_append(&buffer, "", 1, NULL);
	CHECK_CONTAINS((char *)buffer.data, "{\"name\":\"points\",\"datatype\":\"FP32\",\"shape\":[-1,3],\"optional\":false");
	CHECK_CONTAINS((char *)buffer.data, "{\"name\":\"surface_coefficients\",\"datatype\":\"FP32\",\"shape\":[-1,-1]");
	CHECK_CONTAINS((char *)buffer.data, "{\"name\":\"k\",\"type\":\"integer\",\"default\":\"30\",\"minimum\":12,\"maximum\":500");
	CHECK_CONTAINS((char *)buffer.data, "{\"name\":\"weights\",\"type\":\"model\",\"default\":\"auto\",");
	CHECK_CONTAINS((char *)buffer.data, "],\"weights\":[]}");
	gnp_buffer_clear(&buffer);
}

static void error_bodies_are_valid_whatever_the_text(void)
{
	struct gnp_buffer buffer = {0};
	CHECK(gnp_oip_error_body(GNP_NOT_FOUND, "no \"x\"\n\xff\xc3", "r-1", &buffer) == GNP_OK);
	gnp_buffer_append(&buffer, "", 1, NULL);
	CHECK_STRING((char *)buffer.data, "{\"error\":\"no \\\"x\\\"\\u000a\xef\xbf\xbd\xef\xbf\xbd\",\"code\":\"not_found\",\"request_id\":\"r-1\"}");
	buffer.size = 0;
	CHECK(gnp_oip_error_body(GNP_CANCELLED, "", NULL, &buffer) == GNP_OK);
	gnp_buffer_append(&buffer, "", 1, NULL);
	CHECK_STRING((char *)buffer.data, "{\"error\":\"the work was cancelled\",\"code\":\"cancelled\"}");
	gnp_buffer_clear(&buffer);
}

static bool is_request(const char *text)
{
	return gnp_oip_is_request((const unsigned char *)text, strlen(text));
}

static void requests_are_told_from_clouds(void)
{
	CHECK(is_request("{\"inputs\":[]}") && is_request(" {\"id\" : \"a\", \"inputs\"\n: 3"));
	CHECK(is_request("{\"parameters\":{\"a\":[1,{}]},\"inputs\":[]}"));
	static const char *const clouds[] = {"", "{", "[\"inputs\"]", "\"inputs\"", "{\"points\":[[1,2,3]]}", "{\"a\":{\"inputs\":1}}",
	                                     "{\"a\":\"inputs\"}", "{\"a\":\"\\\"inputs\\\":\"}", "{\"inputs", "{\"inputs\"", "{}{\"inputs\":1}",
	                                     "}{\"inputs\":1}", "{\"a\\"};
	for (size_t i = 0; i < sizeof clouds / sizeof clouds[0]; i++)
		CHECK(!is_request(clouds[i]));
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(header_lengths),
	                                    TEST(requests_are_told_from_clouds),
	                                    TEST(json_requests_decode),
	                                    TEST(malformed_json_is_refused),
	                                    TEST(deep_nesting_is_refused),
	                                    TEST(large_envelopes_are_refused),
	                                    TEST(shapes_are_checked),
	                                    TEST(numbers_are_checked),
	                                    TEST(binary_sizes_are_checked),
	                                    TEST(raw_points_decode),
	                                    TEST(requests_round_trip),
	                                    TEST(responses_round_trip),
	                                    TEST(what_json_cannot_say_is_not_acceptable),
	                                    TEST(metadata_is_json_of_every_parameter),
	                                    TEST(error_bodies_are_valid_whatever_the_text)};
	return RUN_TESTS(tests);
}
