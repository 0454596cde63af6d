/* The help of every operation, as the command line prints it. */
#include "tests/unit/test.h"

#include "proto/operation/operations.h"
#include "proto/operation/usage.h"

static void usage_names_every_parameter(void)
{
	const struct gnp_operation *operation;
	for (size_t o = 0; (operation = gnp_operation_at(o)) != NULL; o++) {
		struct gnp_buffer buffer = {0};
		CHECK(gnp_operation_usage(operation, &buffer, NULL) == GNP_OK);
		gnp_buffer_append(&buffer, "", 1, NULL);
		for (size_t i = 0; i < operation->parameter_count; i++)
			CHECK_CONTAINS((const char *)buffer.data, operation->parameters[i].name);
		CHECK_CONTAINS((const char *)buffer.data, "--k 12..500");
		CHECK_CONTAINS((const char *)buffer.data, "--cover cover|all");
		gnp_buffer_clear(&buffer);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(usage_names_every_parameter)};
	return RUN_TESTS(tests);
}
