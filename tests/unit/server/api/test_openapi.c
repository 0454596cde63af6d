/* The OpenAPI document in the tree is the one that the tables write. */
#include "tests/unit/test.h"

#include "server/api/openapi.h"

static void the_openapi_document_in_the_tree_is_current(void)
{
	struct gnp_buffer buffer = {0};
	CHECK(gnpd_openapi_write(&buffer, NULL) == GNP_OK && gnp_buffer_append(&buffer, "", 1, NULL) == GNP_OK);
	buffer.size--;
	CHECK_CONTAINS((const char *)buffer.data, "dt: {oneOf: [{type: number, minimum: 0, exclusiveMinimum: true, maximum: 1.0e+200}, "
	                                          "{type: string, enum: [auto]}], default: 'auto'}");
	CHECK_CONTAINS((const char *)buffer.data, "- `record` (s, 10) FP64: ");
	FILE *file = fopen("server/openapi.yaml", "rb");
	CHECK(file != NULL); /* the tests run from the top of the tree */
	char *text = calloc(1, buffer.size + 2);
	size_t size = file ? fread(text, 1, buffer.size + 1, file) : 0;
	if (size != buffer.size || memcmp(text, buffer.data, size) != 0)
		CHECK_STRING("server/openapi.yaml is out of date", "run `make openapi`");
	free(text);
	if (file)
		fclose(file);
	gnp_buffer_clear(&buffer);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(the_openapi_document_in_the_tree_is_current)};
	return RUN_TESTS(tests);
}
