/* The OpenAPI document in the tree is the one that the tables write; it shows the defaults that help and metadata
 * show. */
#include "tests/unit/test.h"

#include "proto/oip/oip.h"
#include "proto/operation/operations.h"
#include "proto/operation/parameter.h"
#include "proto/operation/usage.h"
#include "server/api/openapi.h"

static void the_openapi_document_in_the_tree_is_current(void)
{
	struct gnp_buffer buffer = {0};
	CHECK(gnpd_openapi_write(&buffer, NULL) == GNP_OK && gnp_buffer_append(&buffer, "", 1, NULL) == GNP_OK);
	buffer.size--;
	CHECK_CONTAINS((const char *)buffer.data,
	               "dt: {oneOf: [{type: number, minimum: 0, exclusiveMinimum: true, maximum: 1.0e+200}, "
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

/* What the document says from `path` on of the parameter, up to its default. */
static void check_document(const char *document, const char *path, const char *name, const char *text)
{
	char line[160], plain[GNP_PARAMETER_DEFAULT_MAX + 16], quoted[GNP_PARAMETER_DEFAULT_MAX + 16];
	snprintf(line, sizeof line, "        - name: %s\n", name);
	snprintf(plain, sizeof plain, ", default: %s}", text);
	snprintf(quoted, sizeof quoted, ", default: '%s'}", text);
	const char *at = strstr(document, path), *parameter = at ? strstr(at, line) : NULL;
	const char *schema = parameter ? strstr(parameter, "\n          schema: ") : NULL;
	const char *end = schema ? strchr(schema + 1, '\n') : NULL;
	CHECK(end != NULL);
	char *shown = strndup(schema, (size_t)(end - schema)), *number = strstr(shown, ", default: ");
	double value = number ? strtod(number + strlen(", default: "), NULL) : NAN; /* 1.0e-08 is YAML's for 1e-08 */
	CHECK(strstr(shown, plain) || strstr(shown, quoted) || value == strtod(text, NULL));
	free(shown);
}

static void the_default_is_the_same_everywhere(void)
{
	struct gnp_buffer document = {0};
	const struct gnp_operation *operation;
	CHECK(gnpd_openapi_write(&document, NULL) == GNP_OK && gnp_buffer_append(&document, "", 1, NULL) == GNP_OK);
	for (size_t o = 0; (operation = gnp_operation_at(o)) != NULL; o++) {
		struct gnp_buffer usage = {0}, metadata = {0};
		char path[80], member[80], text[GNP_PARAMETER_DEFAULT_MAX], want[2 * GNP_PARAMETER_DEFAULT_MAX];
		snprintf(path, sizeof path, "\n  /v1/%s:\n", operation->name);
		CHECK(gnp_operation_usage(operation, &usage, NULL) == GNP_OK &&
		      gnp_buffer_append(&usage, "", 1, NULL) == GNP_OK);
		CHECK(gnp_oip_model_metadata(operation, NULL, &metadata, NULL) == GNP_OK &&
		      gnp_buffer_append(&metadata, "", 1, NULL) == GNP_OK);
		for (size_t i = 0; i < operation->parameter_count; i++) {
			const struct gnp_parameter *p = &operation->parameters[i];
			gnp_parameter_default(operation, p, text);
			snprintf(want, sizeof want, "        %s (default %s)\n", p->help, text);
			CHECK_CONTAINS((const char *)usage.data, want);
			snprintf(want, sizeof want, "\"default\":\"%s\"", text);
			const char *named = strstr((const char *)metadata.data, "\"parameters\":[");
			snprintf(member, sizeof member, "{\"name\":\"%s\"", p->name);
			named = named ? strstr(named, member) : NULL;
			CHECK(named && strstr(named, want) && strstr(named, want) < strchr(named, '}'));
			check_document((const char *)document.data, path, p->name, text);
		}
		gnp_buffer_clear(&usage);
		gnp_buffer_clear(&metadata);
	}
	gnp_buffer_clear(&document);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(the_openapi_document_in_the_tree_is_current),
	                                    TEST(the_default_is_the_same_everywhere)};
	return RUN_TESTS(tests);
}
