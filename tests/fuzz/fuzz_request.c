/* A request's line and headers. The input is text: METHOD TARGET VERSION, then a header a line. What http.c does with them before it
 * reads the body is done here, then the query becomes parameters of the operation, and an error is answered. */
#include <jansson.h>

#include "proto/file/accept.h"
#include "proto/file/formats.h"
#include "proto/oip/oip.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"
#include "server/api/request.h"
#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/config/config.h"
#include "server/parse/duration.h"
#include "server/parse/framing.h"
#include "server/parse/range.h"
#include "tests/fuzz/fuzz.h"

struct head {
	struct gnpd_framing framing;
	struct gnpd_request *request;
	const char *id;
};

static void take_header(struct head *head, char *line)
{
	char *colon = strchr(line, ':');
	const char *value = NULL;
	if (colon) {
		*colon = '\0';
		value = colon + 1 + strspn(colon + 1, " \t");
	}
	gnpd_framing_header(&head->framing, line, value);
	if (!value)
		return;
	if (strcasecmp(line, "Content-Type") == 0)
		head->request->work.content_type = value;
	else if (strcasecmp(line, "Accept") == 0)
		head->request->work.accept = value;
	else if (strcasecmp(line, "Inference-Header-Content-Length") == 0)
		head->request->work.inference_length = value;
	else if (strcasecmp(line, "Range") == 0)
		head->request->range = value;
	else if (strcasecmp(line, "Host") == 0)
		head->request->site.host = value;
	else if (strcasecmp(line, "Origin") == 0)
		head->request->site.origin = value;
	else if (strcasecmp(line, "Sec-Fetch-Site") == 0)
		head->request->site.fetch = value;
	else if (strcasecmp(line, "X-Request-Id") == 0)
		head->id = value;
}

/* Whatever is answered is JSON with the three members, for any text a client has a say in. */
static void check_error(struct gnpd_request *request, const struct gnp_error *error)
{
	gnpd_reply_error(request, error);
	const struct gnp_buffer *body = &request->reply.body;
	json_t *root = json_loadb((const char *)body->data, body->size, JSON_REJECT_DUPLICATES, NULL);
	FUZZ_REQUIRE(json_is_string(json_object_get(root, "error")) && json_is_string(json_object_get(root, "code")));
	FUZZ_REQUIRE(strcmp(json_string_value(json_object_get(root, "request_id")), request->id) == 0);
	FUZZ_REQUIRE(request->reply.code >= 400);
	json_decref(root);
}

static void check_headers(const struct gnpd_request *request)
{
	const struct gnp_format *format = &gnp_format_ply;
	struct gnp_format_choice choice = {format, gnp_format_media_type(format), false};
	size_t length;
	if (request->work.content_type && gnp_format_by_media_type(request->work.content_type, &format))
		FUZZ_REQUIRE(format != NULL);
	if (request->work.accept && gnp_format_by_accept(request->work.accept, &choice))
		FUZZ_REQUIRE(gnp_format_writable(choice.format) && strchr(choice.media_type, '/'));
	if (request->work.inference_length && gnp_oip_header_length(request->work.inference_length, 100, &length, NULL) == GNP_OK)
		FUZZ_REQUIRE(length <= 100);
	size_t first, count;
	if (gnpd_range_parse(request->range, 100, &first, &count) == GNPD_RANGE_PART)
		FUZZ_REQUIRE(count > 0 && first < 100 && count <= 100 - first);
}

/* The target's name counts before Host's. A name that passes without being allowed passes any list, and an origin that is no URL is
 * nobody's. */
static gnp_status check_site(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_site *site = &request->site;
	if (request->target.authority)
		site->host = request->target.authority;
	gnp_status status = gnpd_site_check_host(site, "", NULL);
	FUZZ_REQUIRE(status != GNP_OK || gnpd_site_check_host(site, "gnp.example.org", NULL) == GNP_OK);
	FUZZ_REQUIRE((status == GNP_INVALID_ARGUMENT) == (gnpd_site_check_host(site, "*", NULL) != GNP_OK));
	if (site->host && gnpd_site_check_list(site->host, NULL) == GNP_OK && !strpbrk(site->host, ", \t") && *site->host)
		FUZZ_REQUIRE(gnpd_site_check_host(site, site->host, NULL) != GNP_FORBIDDEN);
	if (!site->fetch && site->origin && !strstr(site->origin, "://"))
		FUZZ_REQUIRE(gnpd_site_check_origin(site, "*", NULL) == GNP_FORBIDDEN);
	status = gnpd_site_check_host(site, "gnp.example.org", error);
	return status == GNP_OK ? gnpd_site_check_origin(site, "gnp.example.org", error) : status;
}

/* Segments are not empty and lie in the path as they came. */
static void check_target(const struct gnpd_target *target)
{
	size_t size = 0;
	for (unsigned i = 0; target->valid && i < target->count; i++) {
		FUZZ_REQUIRE(*target->segments[i] && !strpbrk(target->segments[i], "/%?"));
		size += 1 + strlen(target->segments[i]);
	}
	FUZZ_REQUIRE(!target->valid || strlen(target->path) == (size ? size : 1));
}

/* ?wait= and ?timeout= are lengths of time. */
static void check_durations(const struct gnp_values *parameters)
{
	double seconds;
	for (size_t i = 0; i < parameters->count; i++)
		if (parameters->items[i].string && gnpd_duration_parse("wait", parameters->items[i].string, &seconds, NULL) == GNP_OK)
			FUZZ_REQUIRE(seconds >= 0 && seconds < 1e300);
}

/* The query as parameters of the operation the path names, on a cloud of zeros. */
static gnp_status check_query(struct gnpd_request *request, struct gnp_error *error)
{
	const size_t shape[] = {2200, 3}; /* enough for whatever is asked for */
	struct gnp_tensor *points;
	const struct gnp_operation *operation = request->model ? gnp_operation_find(request->model) : NULL;
	gnp_status status = gnpd_query_parse(request->target.query, &request->work.message.parameters, error);
	FUZZ_REQUIRE(request->work.message.parameters.count <= GNPD_QUERY_MAX);
	check_durations(&request->work.message.parameters);
	if (status != GNP_OK || !operation)
		return status;
	FUZZ_REQUIRE(gnp_tensors_add(&request->work.message.inputs, "points", GNP_FP32, 2, shape, &points, NULL) == GNP_OK);
	memset(points->data, 0, points->size);
	return gnp_call_prepare(operation, &request->work.message, NULL, &request->work.call, error);
}

static void handle(struct gnpd_request *request, char *line, char *rest, struct gnp_error *error)
{
	struct head head = {.request = request};
	char *save = NULL, *method = strtok_r(line, " ", &save), *target = strtok_r(NULL, " ", &save);
	const char *version = strtok_r(NULL, " ", &save);
	if (!method || !target || gnpd_target_parse(target, &request->target) != GNP_OK)
		return;
	strncpy(request->method, method, sizeof request->method - 1);
	for (char *header = strtok_r(rest, "\n", &save); header; header = strtok_r(NULL, "\n", &save))
		take_header(&head, header);
	gnpd_request_set_id(request, head.id);
	gnp_status status = gnpd_framing_finish(&head.framing, version ? version : "HTTP/1.1", error);
	check_headers(request);
	check_target(&request->target);
	if (status == GNP_OK)
		status = check_site(request, error);
	if (status == GNP_OK)
		status = gnpd_routes_match(request, error);
	if (status == GNP_OK)
		status = check_query(request, error);
	FUZZ_REQUIRE(status == GNP_OK || error->text[0]);
	if (status != GNP_OK)
		check_error(request, error);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct gnpd_config config;
	struct gnpd_server server = {.engine.config = &config};
	struct gnpd_request request = {.server = &server};
	struct gnp_error error = {0};
	char *text = fuzz_text(data, size), *end = strchr(text, '\n');
	gnpd_config_defaults(&config);
	if (end)
		*end = '\0';
	handle(&request, text, end ? end + 1 : text + strlen(text), &error);
	gnp_buffer_clear(&request.reply.body);
	gnp_request_clear(&request.work.message);
	gnpd_target_clear(&request.target);
	free(text);
	return 0;
}
