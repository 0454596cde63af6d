/* Every type of parameter, of a table made for the purpose: from text, from typed values, in metadata and in usage. Masks. */
#include "tests/unit/test.h"

#include "proto/oip/oip.h"
#include "proto/operation/call.h"
#include "proto/operation/parameter.h"
#include "proto/operation/usage.h"

struct options {
	int count;
	double ratio, step;
	bool flag;
	int mode;
};

static const char *const modes[] = {"slow", "fast", NULL};

static const struct gnp_tensor_info inputs[] = {{"points", GNP_FP32, 2, {-1, 3}, false, "the cloud"},
                                                {"fixed", GNP_BOOL, 1, {-1}, true, "which"}};
static const struct gnp_tensor_info outputs[] = {{"keep", GNP_BOOL, 1, {-1}, false, "which"}};

static const struct gnp_parameter parameters[] = {
	{"count", GNP_PARAMETER_INTEGER, offsetof(struct options, count), 1, 1e6, NULL, "how many"},
	{"ratio", GNP_PARAMETER_NUMBER, offsetof(struct options, ratio), GNP_ABOVE_ZERO, 10, NULL, "how large"},
	{"step", GNP_PARAMETER_AUTO, offsetof(struct options, step), GNP_ABOVE_ZERO, 1e200, NULL, "how far"},
	{"flag", GNP_PARAMETER_BOOL, offsetof(struct options, flag), 0, 0, NULL, "whether"},
	{"mode", GNP_PARAMETER_CHOICE, offsetof(struct options, mode), 0, 0, modes, "which way"},
};

static void defaults(void *options)
{
	*(struct options *)options = (struct options){3, 0.1, NAN, true, 0};
}

static size_t memory(const struct gnp_call *call)
{
	return call->points;
}

static const struct gnp_operation operation = {
	.name = "toy", .help = "Nothing.", .inputs = inputs, .input_count = 2, .outputs = outputs, .output_count = 1,
	.parameters = parameters, .parameter_count = sizeof parameters / sizeof parameters[0], .defaults = defaults, .memory = memory};

static struct options parse(const char *name, const char *text, gnp_status want)
{
	struct options options;
	struct gnp_error error = {0};
	defaults(&options);
	CHECK(gnp_parameter_parse(&operation, &options, name, text, &error) == want);
	return options;
}

static void check_error(const char *name, const char *text, const char *want)
{
	struct options options;
	struct gnp_error error = {0};
	defaults(&options);
	CHECK(gnp_parameter_parse(&operation, &options, name, text, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, want);
}

static void auto_is_a_number_or_nan(void)
{
	CHECK(isnan(parse("step", "auto", GNP_OK).step));
	CHECK(parse("step", "1e-4", GNP_OK).step == 1e-4);
	CHECK(parse("step", "1e200", GNP_OK).step == 1e200);
	check_error("step", "0", "step: got 0, need auto or >0..1e+200");
	check_error("step", "-1", "step: got -1, need auto or >0..1e+200");
	check_error("step", "1e201", "step: got 1e+201, need auto or >0..1e+200");
	check_error("step", "nan", "step: got \"nan\", need auto or a number");
	check_error("step", "inf", "step: got \"inf\", need auto or a number");
	check_error("step", "Auto", "step: got \"Auto\", need auto or a number");
	check_error("step", "", "step: got \"\", need auto or a number");
	check_error("step", "1e-4x", "step: got \"1e-4x\", need auto or a number");
}

static void ranges_are_readable(void)
{
	check_error("ratio", "0", "ratio: got 0, need >0..10");
	check_error("ratio", "10.1", "ratio: got 10.1, need >0..10");
	check_error("ratio", "auto", "ratio: got \"auto\", need a number");
	check_error("count", "0", "count: got 0, need 1..1000000");
	check_error("count", "auto", "count: got \"auto\", need an integer");
	check_error("mode", "warp", "mode: got \"warp\", need one of slow, fast");
}

static void flags_are_true_or_false(void)
{
	CHECK(parse("flag", "true", GNP_OK).flag && parse("flag", "1", GNP_OK).flag);
	CHECK(!parse("flag", "false", GNP_OK).flag && !parse("flag", "0", GNP_OK).flag);
	check_error("flag", "", "flag: got \"\", need true or false");
	check_error("flag", "no", "flag: got \"no\", need true or false");
}

/* Prepares a request with the parameters, which are cleared. */
static gnp_status prepare(struct gnp_values *values, struct options *options, struct gnp_error *error)
{
	struct gnp_request request = {.parameters = *values};
	struct gnp_call call;
	size_t shape[] = {5, 3};
	CHECK(gnp_tensors_add(&request.inputs, "points", GNP_FP32, 2, shape, NULL, NULL) == GNP_OK);
	gnp_status status = gnp_call_prepare(&operation, &request, NULL, &call, error);
	if (status == GNP_OK)
		memcpy(options, call.options, sizeof *options);
	gnp_request_clear(&request);
	*values = (struct gnp_values){0};
	return status;
}

static void typed_values_are_taken(void)
{
	struct gnp_values values = {0};
	struct gnp_error error = {0};
	struct options options = {0};
	gnp_values_add_number(&values, "step", 0.25, NULL);
	gnp_values_add_integer(&values, "ratio", 2, NULL);
	gnp_values_add_bool(&values, "flag", false, NULL);
	CHECK(prepare(&values, &options, &error) == GNP_OK);
	CHECK(options.step == 0.25 && options.ratio == 2 && !options.flag && options.count == 3);
	gnp_values_add_string(&values, "step", "auto", NULL);
	gnp_values_add_integer(&values, "flag", 0, NULL);
	CHECK(prepare(&values, &options, &error) == GNP_OK);
	CHECK(isnan(options.step) && !options.flag);
	gnp_values_add_bool(&values, "step", true, NULL);
	CHECK(prepare(&values, &options, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "step: got \"true\", need auto or a number");
	gnp_values_add_number(&values, "step", NAN, NULL);
	error = (struct gnp_error){0};
	CHECK(prepare(&values, &options, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "step: got nan, need auto or >0..1e+200");
}

/* The text of what a mask of one type is refused for; "" when it is taken. */
static void check_mask(enum gnp_datatype datatype, const void *mask, size_t rows, const char *want)
{
	struct gnp_request request = {0};
	struct gnp_call call;
	struct gnp_error error = {0};
	size_t shape[] = {3, 3};
	CHECK(gnp_tensors_add(&request.inputs, "points", GNP_FP32, 2, shape, NULL, NULL) == GNP_OK);
	CHECK(gnp_tensors_add_data(&request.inputs, "fixed", datatype, 1, &rows, (void *)(uintptr_t)mask, false, NULL, NULL) == GNP_OK);
	gnp_status status = gnp_call_prepare(&operation, &request, NULL, &call, &error);
	CHECK(status == (*want ? GNP_INVALID_ARGUMENT : GNP_OK));
	CHECK_STRING(error.text, want);
	gnp_request_clear(&request);
}

static void masks_come_in_any_type(void)
{
	check_mask(GNP_BOOL, "\0\1\1", 3, "");
	check_mask(GNP_UINT8, "\0\1\1", 3, "");
	check_mask(GNP_FP64, (double[]){0, 1, -0.0}, 3, "");
	check_mask(GNP_FP32, (float[]){0, 1, 1}, 3, "");
	check_mask(GNP_INT64, (int64_t[]){0, 1, 1}, 3, "");
	check_mask(GNP_UINT8, "\0\1\3", 3, "fixed[2]: got 3, need 0 or 1");
	check_mask(GNP_BOOL, "\0\2\1", 3, "fixed[1]: got 2, need 0 or 1");
	check_mask(GNP_FP64, (double[]){0.5, 1, 1}, 3, "fixed[0]: got 0.5, need 0 or 1");
	check_mask(GNP_FP64, (double[]){0, NAN, 1}, 3, "fixed[1]: got nan, need 0 or 1");
	check_mask(GNP_INT64, (int64_t[]){0, 1, -1}, 3, "fixed[2]: got -1, need 0 or 1");
	check_mask(GNP_UINT8, "\0\1", 2, "input \"fixed\": 2 rows, need 3 as the input before it has");
}

static void metadata_and_usage_name_the_type(void)
{
	struct gnp_buffer buffer = {0};
	CHECK(gnp_oip_model_metadata(&operation, NULL, &buffer, NULL) == GNP_OK && gnp_buffer_append(&buffer, "", 1, NULL) == GNP_OK);
	CHECK_CONTAINS((const char *)buffer.data,
	               "{\"name\":\"step\",\"type\":\"number_or_auto\",\"default\":\"auto\",\"minimum\":1e-300,\"maximum\":1e+200,\"help\":\"how far\"}");
	CHECK_CONTAINS((const char *)buffer.data, "{\"name\":\"flag\",\"type\":\"boolean\",\"default\":\"true\",\"help\":\"whether\"}");
	buffer.size = 0;
	CHECK(gnp_operation_usage(&operation, &buffer, NULL) == GNP_OK && gnp_buffer_append(&buffer, "", 1, NULL) == GNP_OK);
	CHECK_STRING((const char *)buffer.data, "  --count 1..1000000\n        how many (default 3)\n"
	                                        "  --ratio >0..10\n        how large (default 0.1)\n"
	                                        "  --step auto|>0..1e+200\n        how far (default auto)\n"
	                                        "  --flag[=true|false]\n        whether (default true)\n"
	                                        "  --mode slow|fast\n        which way (default slow)\n");
	gnp_buffer_clear(&buffer);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(auto_is_a_number_or_nan), TEST(ranges_are_readable), TEST(flags_are_true_or_false),
	                                    TEST(typed_values_are_taken), TEST(masks_come_in_any_type), TEST(metadata_and_usage_name_the_type)};
	return RUN_TESTS(tests);
}
