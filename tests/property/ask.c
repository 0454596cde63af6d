#include "tests/property/ask.h"

#include <curl/curl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/http_client.h"
#include "proto/file/file.h"
#include "proto/file/formats.h"
#include "proto/file/result.h"
#include "proto/oip/oip.h"

static CURL *curl; /* one connection a process */

void ask_close(void)
{
	curl_easy_cleanup(curl);
	curl = NULL;
}

struct answer {
	long code;
	size_t head; /* bytes of JSON; GNP_OIP_NO_HEADER */
	struct gnp_buffer body;
};

static size_t on_body(char *data, size_t size, size_t count, void *context)
{
	return gnp_buffer_append(&((struct answer *)context)->body, data, size * count, NULL) == GNP_OK ? size * count : 0;
}

static size_t on_header(char *line, size_t size, size_t count, void *context)
{
	static const char name[] = "inference-header-content-length:";
	char text[80];
	snprintf(text, sizeof text, "%.*s", (int)(size * count < 79 ? size * count : 79), line);
	if (strncasecmp(text, name, sizeof name - 1) == 0)
		((struct answer *)context)->head = strtoul(text + sizeof name - 1, NULL, 10);
	return size * count;
}

static bool post(const char *url, const struct gnp_buffer *body, size_t head, struct answer *answer, char why[JUDGE_TEXT])
{
	char length[80];
	struct curl_slist *headers = curl_slist_append(NULL, "Expect:");
	snprintf(length, sizeof length, "Inference-Header-Content-Length: %zu", head);
	headers = curl_slist_append(headers, head == GNP_OIP_NO_HEADER ? "Content-Type: application/x-npz" : "Content-Type: application/octet-stream");
	if (head != GNP_OIP_NO_HEADER)
		headers = curl_slist_append(headers, length);
	curl = curl ? curl : curl_easy_init();
	curl_easy_reset(curl);
	curl_easy_setopt(curl, CURLOPT_URL, url);
	curl_easy_setopt(curl, CURLOPT_NOPROXY, "*");
	curl_easy_setopt(curl, CURLOPT_POSTFIELDS, body->data);
	curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)body->size);
	curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
	curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, on_body);
	curl_easy_setopt(curl, CURLOPT_WRITEDATA, answer);
	curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, on_header);
	curl_easy_setopt(curl, CURLOPT_HEADERDATA, answer);
	curl_easy_setopt(curl, CURLOPT_TIMEOUT, 120L);
	CURLcode result = curl_easy_perform(curl);
	curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &answer->code);
	curl_slist_free_all(headers);
	if (result != CURLE_OK)
		snprintf(why, JUDGE_TEXT, "no answer: %s", curl_easy_strerror(result));
	return result == CURLE_OK;
}

static bool judge_code(long got, int wanted, const struct answer *answer, char why[JUDGE_TEXT])
{
	if (got != wanted)
		snprintf(why, JUDGE_TEXT, "%ld, need %d: %.*s", got, wanted, answer->body.size < 200 && got != 200 ? (int)answer->body.size : 0,
		         (const char *)answer->body.data);
	return got == wanted;
}

static bool same_outputs(const struct gnp_response *here, const struct gnp_response *there, char why[JUDGE_TEXT])
{
	for (size_t i = 0; i < here->outputs.count; i++) {
		const struct gnp_tensor *one = &here->outputs.items[i], *other = gnp_tensors_find(&there->outputs, one->name);
		bool timed = strcmp(one->name, "record") == 0;
		if (!other || one->size != other->size || (!timed && memcmp(one->data, other->data, one->size) != 0)) {
			snprintf(why, JUDGE_TEXT, "%s: %s", one->name, other ? "other bytes" : "missing");
			return false;
		}
	}
	return true;
}

static bool ask_v2(const struct ask *ask, char why[JUDGE_TEXT])
{
	char url[200];
	struct answer answer = {.head = GNP_OIP_NO_HEADER};
	struct gnp_buffer body = {0};
	struct gnp_response there = {0};
	struct gnp_error error = {0};
	size_t head = 0;
	snprintf(url, sizeof url, "%s/v2/models/%s/infer", ask->url, spec_get(ask->spec, "op", ""));
	bool good = gnp_oip_encode_request(ask->request, &body, &head, &error) == GNP_OK && post(url, &body, head, &answer, why) &&
	            judge_code(answer.code, gnp_status_http(ask->status), &answer, why);
	if (good && ask->status == GNP_OK) {
		good = gnp_oip_decode_response(answer.body.data, answer.body.size, answer.head, &there, &error) == GNP_OK;
		if (!good)
			snprintf(why, JUDGE_TEXT, "an answer that cannot be read: %.200s", error.text);
		good = good && same_outputs(ask->response, &there, why);
	}
	gnp_response_clear(&there);
	gnp_buffer_clear(&answer.body);
	gnp_buffer_clear(&body);
	return good;
}

static bool write_query(const struct ask *ask, struct gnp_buffer *url)
{
	bool good = gnp_buffer_printf(url, NULL, "%s/v1/%s?format=%s", ask->url, spec_get(ask->spec, "op", ""), spec_get(ask->spec, "format", "npz")) == GNP_OK;
	for (size_t i = 0; i < ask->spec->count && good; i++)
		if (!spec_is_own(ask->spec->word[i].name))
			good = gnp_buffer_printf(url, NULL, "&%s=", ask->spec->word[i].name) == GNP_OK &&
			       gnp_http_escape(ask->spec->word[i].value, url, NULL) == GNP_OK;
	return good && gnp_buffer_append(url, "", 1, NULL) == GNP_OK;
}

/* Status of the whole: a format that cannot be is refused before the work. */
static gnp_status expected(const struct ask *ask, bool *open)
{
	const struct gnp_format *format;
	bool known = gnp_format_by_name(spec_get(ask->spec, "format", "npz"), &format) && gnp_format_writable(format);
	*open = ask->status != GNP_OK || !known;
	if (*open)
		return ask->status;
	gnp_status status = gnp_result_check(format, ask->call, NULL);
	struct gnp_buffer buffer = {0};
	if (status == GNP_OK)
		status = gnp_result_encode(format, ask->request, ask->response, &buffer, NULL);
	gnp_buffer_clear(&buffer);
	return status;
}

static bool ask_v1(const struct ask *ask, char why[JUDGE_TEXT])
{
	struct answer answer = {.head = GNP_OIP_NO_HEADER};
	struct gnp_buffer body = {0}, url = {0};
	bool open;
	gnp_status status = expected(ask, &open);
	bool good = gnp_file_encode(&gnp_format_npz, &ask->request->inputs, &(struct gnp_values){0}, &body, NULL) != GNP_OK || /* not a file */
	            (write_query(ask, &url) && post((const char *)url.data, &body, GNP_OIP_NO_HEADER, &answer, why) &&
	             (open ? answer.code >= 400 && answer.code < 500 : judge_code(answer.code, gnp_status_http(status), &answer, why)));
	if (!good && open)
		snprintf(why, JUDGE_TEXT, "%ld where it is refused here: %.150s", answer.code, ask->error->text);
	gnp_buffer_clear(&answer.body);
	gnp_buffer_clear(&body);
	gnp_buffer_clear(&url);
	return good;
}

bool ask_daemon(const struct ask *ask, char why[JUDGE_TEXT])
{
	bool files = strcmp(spec_get(ask->spec, "via", "v2"), "v1") == 0 && !spec_get(ask->spec, "out", NULL);
	snprintf(why, JUDGE_TEXT, "the request could not be written");
	return files ? ask_v1(ask, why) : ask_v2(ask, why);
}
