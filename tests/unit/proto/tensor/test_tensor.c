#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/tensor/message.h"
#include "proto/tensor/tensor.h"

static void sizes_and_names_of_datatypes(void)
{
	enum gnp_datatype datatype;
	CHECK(gnp_datatype_size(GNP_FP16) == 2 && gnp_datatype_size(GNP_INT64) == 8 && gnp_datatype_size(GNP_BYTES) == 0);
	CHECK_STRING(gnp_datatype_name(GNP_FP64), "FP64");
	CHECK(gnp_datatype_find("UINT16", &datatype) && datatype == GNP_UINT16);
	CHECK(!gnp_datatype_find("fp32", &datatype));
}

static void a_shape_that_overflows_is_refused(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	size_t shape[] = {SIZE_MAX / 2, 3}, elements;
	CHECK(!gnp_tensor_elements(2, shape, &elements));
	CHECK(gnp_tensors_add(&tensors, "points", GNP_FP32, 2, shape, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "\"points\": the shape's product overflows");
	size_t bytes[] = {SIZE_MAX / 4, 1}; /* the elements fit, their bytes do not */
	CHECK(gnp_tensors_add(&tensors, "p", GNP_FP64, 2, bytes, NULL, NULL) == GNP_INVALID_ARGUMENT);
	CHECK(gnp_tensors_add(&tensors, "p", GNP_FP32, 9, bytes, NULL, NULL) == GNP_INVALID_ARGUMENT);
	CHECK(gnp_tensors_add(&tensors, "p", GNP_BYTES, 1, bytes + 1, NULL, NULL) == GNP_INVALID_ARGUMENT);
	CHECK(tensors.count == 0);
	gnp_tensors_clear(&tensors);
}

static void a_name_too_long_is_refused(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	size_t shape[] = {1};
	char name[100];
	memset(name, 'n', 99);
	name[99] = '\0';
	CHECK(gnp_tensors_add(&tensors, name, GNP_FP32, 1, shape, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "99 bytes, need at most 63");
}

static void elements_of_every_type_read_as_doubles(void)
{
	unsigned char bytes[] = {0x00, 0xfe};
	static const struct {
		enum gnp_datatype datatype;
		double want;
	} cases[] = {{GNP_UINT8, 0}, {GNP_UINT16, 65024}, {GNP_INT16, -512}};
	for (size_t i = 0; i < 3; i++) {
		struct gnp_tensor tensor = {.datatype = cases[i].datatype, .rank = 1, .shape = {1}, .data = bytes, .size = 2};
		CHECK_NEAR(gnp_tensor_get(&tensor, 0), cases[i].want, 0);
	}
	uint16_t halves[] = {0x3c00, 0xc000, 0x7bff, 0x0001, 0x7c00, 0x3555}; /* by IEEE 754-2008 */
	struct gnp_tensor half = {.datatype = GNP_FP16, .rank = 1, .shape = {6}, .data = halves, .size = sizeof halves};
	double *values = gnp_tensor_to_double(&half);
	CHECK_NEAR(values[0], 1, 0);
	CHECK_NEAR(values[1], -2, 0);
	CHECK_NEAR(values[2], 65504, 0);
	CHECK_NEAR(values[3], 5.9604644775390625e-08, 0);
	CHECK(isinf(values[4]));
	CHECK_NEAR(values[5], 0.333251953125, 0);
	free(values);
	bool flags[] = {true, false};
	struct gnp_tensor boolean = {.datatype = GNP_BOOL, .rank = 1, .shape = {2}, .data = flags, .size = 2};
	CHECK_NEAR(gnp_tensor_get(&boolean, 0), 1, 0);
	CHECK_NEAR(gnp_tensor_get(&boolean, 1), 0, 0);
}

static void borrowed_data_is_not_freed(void)
{
	struct gnp_tensors tensors = {0};
	float data[6] = {1, 2, 3, 4, 5, 6};
	size_t shape[] = {2, 3};
	for (int i = 0; i < 10; i++) {
		char name[8];
		snprintf(name, sizeof name, "t%d", i);
		CHECK(gnp_tensors_add_data(&tensors, name, GNP_FP32, 2, shape, data, false, NULL, NULL) == GNP_OK);
	}
	const struct gnp_tensor *found = gnp_tensors_find(&tensors, "t7");
	CHECK(found && found->data == data && found->size == sizeof data);
	CHECK(!gnp_tensors_find(&tensors, "t77"));
	gnp_tensors_clear(&tensors);
	CHECK(tensors.count == 0 && data[5] == 6);
}

static void values_keep_their_types(void)
{
	struct gnp_values values = {0};
	CHECK(gnp_values_add_string(&values, "s", "text", NULL) == GNP_OK);
	CHECK(gnp_values_add_integer(&values, "i", INT64_MIN, NULL) == GNP_OK);
	CHECK(gnp_values_add_number(&values, "n", 0.5, NULL) == GNP_OK);
	CHECK(gnp_values_add_bool(&values, "b", true, NULL) == GNP_OK);
	CHECK_STRING(gnp_values_find(&values, "s")->string, "text");
	CHECK(gnp_values_find(&values, "i")->integer == INT64_MIN);
	CHECK(gnp_values_find(&values, "b")->boolean && gnp_values_find(&values, "b")->type == GNP_VALUE_BOOL);
	CHECK(!gnp_values_find(&values, "x"));
	gnp_values_clear(&values);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(sizes_and_names_of_datatypes),           TEST(a_shape_that_overflows_is_refused),
	                                    TEST(a_name_too_long_is_refused),             TEST(elements_of_every_type_read_as_doubles),
	                                    TEST(borrowed_data_is_not_freed),             TEST(values_keep_their_types)};
	return RUN_TESTS(tests);
}
