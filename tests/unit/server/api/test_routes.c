/* The tables of routes and the OpenAPI document name the same paths and methods. */
#include "tests/unit/test.h"

#include <ctype.h>
#include <strings.h>

#include "proto/operation/operations.h"
#include "server/api/openapi.h"
#include "server/api/routes.h"

static struct gnp_buffer document;

/* Whether the document has the method under the path. */
static bool is_described(const char *path, const char *method)
{
	char line[160], verb[16];
	snprintf(line, sizeof line, "\n  %s:\n", path);
	snprintf(verb, sizeof verb, "\n    %s:", method);
	for (char *c = verb; *c; c++)
		*c = (char)tolower(*c);
	const char *at = strstr((const char *)document.data, line);
	const char *end = at ? strstr(at + 1, "\n  /") : NULL, *found = at ? strstr(at + 1, verb) : NULL;
	return found && (!end || found < end);
}

/* The text with `what` replaced; as it is where that is not in it. */
static void replace(const char *text, const char *what, const char *with, char *out, size_t size)
{
	const char *at = strstr(text, what);
	snprintf(out, size, "%.*s%s%s", (int)(at ? at - text : (long)strlen(text)), text, at ? with : "", at ? at + strlen(what) : "");
}

static void check_route(const struct gnpd_route *route)
{
	char general[160], path[160];
	replace(route->path, "{job}", "{id}", general, sizeof general);
	for (size_t i = 0; gnp_operation_at(i); i++) {
		replace(general, "{model}", gnp_operation_at(i)->name, path, sizeof path);
		if (!is_described(path, route->method))
			fprintf(stderr, "%s %s\n", route->method, path);
		CHECK(is_described(path, route->method));
	}
}

/* Versions of a model are other names of the same, and `*` is no path. */
static void every_route_is_described(void)
{
	size_t count = 0;
	for (int admin = 0; admin < 2; admin++)
		for (size_t i = 0; gnpd_routes_at(admin, i); i++)
			if (!strstr(gnpd_routes_at(admin, i)->path, "{version}") && gnpd_routes_at(admin, i)->path[0] == '/') {
				check_route(gnpd_routes_at(admin, i));
				count++;
			}
	CHECK(count > 20);
}

static bool is_route(const char *path, const char *method)
{
	for (int admin = 0; admin < 2; admin++)
		for (size_t i = 0; gnpd_routes_at(admin, i); i++) {
			const struct gnpd_route *route = gnpd_routes_at(admin, i);
			char general[160], own[160];
			replace(route->path, "{job}", "{id}", general, sizeof general);
			for (size_t k = 0; gnp_operation_at(k); k++) {
				replace(general, "{model}", gnp_operation_at(k)->name, own, sizeof own);
				if (strcmp(own, path) == 0 && strcasecmp(route->method, method) == 0)
					return true;
			}
		}
	return false;
}

static void every_path_of_the_document_is_a_route(void)
{
	static const char *const methods[] = {"get", "post", "put", "delete"};
	size_t count = 0;
	for (const char *at = (const char *)document.data; (at = strstr(at, "\n  /")) != NULL; at++) {
		char path[160];
		snprintf(path, sizeof path, "%.*s", (int)strcspn(at + 3, ":"), at + 3);
		for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
			if (is_described(path, methods[m])) {
				if (!is_route(path, methods[m]))
					fprintf(stderr, "%s %s\n", methods[m], path);
				CHECK(is_route(path, methods[m]));
				count++;
			}
	}
	CHECK(count > 60);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(every_route_is_described), TEST(every_path_of_the_document_is_a_route)};
	if (gnpd_openapi_write(&document, NULL) != GNP_OK || gnp_buffer_append(&document, "", 1, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_buffer_clear(&document);
	return status;
}
