#include "clients/http_client.h"

#include <curl/curl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/answer.h"

enum { KEY_MAX = 512 };

struct exchange {
	struct gnp_progress *progress;
	struct gnp_buffer body;
	gnp_status status;
};

static size_t take_body(char *data, size_t size, size_t count, void *context)
{
	struct exchange *exchange = context;
	exchange->status = gnp_buffer_append(&exchange->body, data, size * count, NULL);
	return exchange->status == GNP_OK ? size * count : 0;
}

/* Shows the larger of the two transfers under way. */
static int show_transfer(void *context, curl_off_t down_total, curl_off_t down, curl_off_t up_total, curl_off_t up)
{
	struct exchange *exchange = context;
	struct gnp_task *task = exchange->progress->task;
	bool sending = up < up_total;
	const char *phase = sending ? "send" : down > 0 ? "receive" : "server";
	atomic_store(&exchange->progress->phase, phase);
	atomic_store(&task->total, (size_t)(sending ? up_total : down_total));
	atomic_store(&task->done, (size_t)(sending ? up : down));
	return 0;
}

static gnp_status escape_byte(unsigned char byte, struct gnp_buffer *buffer, struct gnp_error *error)
{
	bool plain = (byte >= '0' && byte <= '9') || (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') ||
	             (byte && strchr("-._~,", byte));
	return gnp_buffer_printf(buffer, error, plain ? "%c" : "%%%02X", byte);
}

gnp_status gnp_http_escape(const char *text, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (; *text && status == GNP_OK; text++)
		status = escape_byte((unsigned char)*text, buffer, error);
	return status;
}

gnp_status gnp_http_status_of(const char *code)
{
	for (int i = 0; i < GNP_STATUS_COUNT; i++)
		if (strcmp(gnp_status_name((gnp_status)i), code) == 0)
			return (gnp_status)i;
	return GNP_INTERNAL;
}

static gnp_status status_of(const char *code, long http)
{
	return *code || http != 404 ? gnp_http_status_of(code) : GNP_NOT_FOUND;
}

gnp_status gnp_http_failure(const char *url, long code, const struct gnp_buffer *body, struct gnp_error *error)
{
	char text[GNP_ERROR_TEXT - 96], name[48], id[64], quoted[120];
	struct json_t *answer = gnp_answer_parse(body);
	gnp_answer_string(answer, "error", text, sizeof text);
	gnp_answer_string(answer, "code", name, sizeof name);
	gnp_answer_string(answer, "request_id", id, sizeof id);
	gnp_answer_free(answer);
	if (text[0])
		return gnp_error_set(error, status_of(name, code), "%s (HTTP %ld%s%s)", text, code, id[0] ? ", request " : "", id);
	size_t length = body->size < sizeof quoted - 1 ? body->size : sizeof quoted - 1;
	for (size_t i = 0; i < length; i++)
		quoted[i] = (char)(body->data[i] < ' ' || body->data[i] > '~' ? ' ' : body->data[i]);
	quoted[length] = 0;
	return gnp_error_set(error, GNP_INTERNAL, "%.120s: answered HTTP %ld: %s", url, code, quoted);
}

/* Runs the transfer in short waits so that a cancelled task ends it. */
static CURLcode perform(CURLM *multi, CURL *easy, const struct gnp_task *task)
{
	enum { WAIT_MILLISECONDS = 50 };
	int running = 1, left;
	if (curl_multi_add_handle(multi, easy) != CURLM_OK)
		return CURLE_OUT_OF_MEMORY;
	while (running && gnp_task_check(task, NULL) == GNP_OK) {
		if (curl_multi_perform(multi, &running) != CURLM_OK)
			break;
		if (running)
			curl_multi_poll(multi, NULL, 0, WAIT_MILLISECONDS, NULL);
	}
	CURLMsg *message = curl_multi_info_read(multi, &left);
	CURLcode result = message && message->msg == CURLMSG_DONE ? message->data.result : CURLE_ABORTED_BY_CALLBACK;
	curl_multi_remove_handle(multi, easy);
	return result;
}

gnp_status gnp_http_check_key(const char *key, struct gnp_error *error)
{
	size_t length = 0;
	while (key[length] > ' ' && key[length] < 127)
		length++;
	if (length == 0 || length > KEY_MAX || key[length])
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "key: need 1..%d characters without blanks", KEY_MAX);
	return GNP_OK;
}

/* Appends "name: value", or nothing where there is no value; false when memory is exhausted. */
static bool add_header(struct curl_slist **headers, const char *name, const char *value)
{
	char line[KEY_MAX + 64];
	if (!value)
		return true;
	snprintf(line, sizeof line, "%s:%s%s", name, *value ? " " : "", value);
	struct curl_slist *more = curl_slist_append(*headers, line);
	if (more)
		*headers = more;
	return more != NULL;
}

/* Waiting for "100 Continue" would cost up to a second with a server that does not send it. */
static struct curl_slist *headers_of(const struct gnp_http_request *request)
{
	char bearer[KEY_MAX + 8];
	struct curl_slist *headers = NULL;
	bool keyed = request->key && *request->key;
	snprintf(bearer, sizeof bearer, "Bearer %s", keyed ? request->key : "");
	if (add_header(&headers, "Expect", "") && add_header(&headers, "Content-Type", request->content_type) &&
	    add_header(&headers, "Accept", request->accept) && add_header(&headers, "Authorization", keyed ? bearer : NULL))
		return headers;
	curl_slist_free_all(headers);
	return NULL;
}

static void set_options(CURL *easy, const struct gnp_http_request *request, struct exchange *exchange, char *reason)
{
	curl_easy_setopt(easy, CURLOPT_URL, request->url);
	curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
	curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
	curl_easy_setopt(easy, CURLOPT_SSLVERSION, (long)CURL_SSLVERSION_TLSv1_2);
	if (request->cacert)
		curl_easy_setopt(easy, CURLOPT_CAINFO, request->cacert);
	curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, reason);
	curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT, 10L);
	curl_easy_setopt(easy, CURLOPT_TIMEOUT_MS, (long)(1000 * request->timeout));
	if (request->method) {
		curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request->method);
	} else {
		curl_easy_setopt(easy, CURLOPT_POST, 1L);
		curl_easy_setopt(easy, CURLOPT_POSTFIELDS, request->body);
		curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)request->size);
	}
	curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, take_body);
	curl_easy_setopt(easy, CURLOPT_WRITEDATA, exchange);
	curl_easy_setopt(easy, CURLOPT_NOPROGRESS, 0L);
	curl_easy_setopt(easy, CURLOPT_XFERINFOFUNCTION, show_transfer);
	curl_easy_setopt(easy, CURLOPT_XFERINFODATA, exchange);
}

static gnp_status judge(CURL *easy, CURLcode result, const struct gnp_http_request *request,
                        const struct exchange *exchange, const char *reason, struct gnp_error *error)
{
	long code = 0;
	gnp_status status = gnp_task_check(exchange->progress->task, error);
	if (status != GNP_OK)
		return status;
	if (exchange->status != GNP_OK)
		return gnp_error_set(error, exchange->status, "answer: no memory for more than %zu bytes", exchange->body.size);
	curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &code);
	if (result == CURLE_OK && code / 100 == 2)
		return GNP_OK;
	/* A server may answer, for example 413, before it has read everything: the answer counts, not the broken pipe. */
	if (code && code / 100 != 2)
		return gnp_http_failure(request->url, code, &exchange->body, error);
	if (result == CURLE_OPERATION_TIMEDOUT)
		return gnp_error_set(error, GNP_DEADLINE, "%.120s: %s", request->url, reason[0] ? reason : curl_easy_strerror(result));
	return gnp_error_set(error, GNP_IO, "%.120s: %s", request->url, reason[0] ? reason : curl_easy_strerror(result));
}

static gnp_status take_parameters(CURL *easy, struct gnp_buffer *parameters, struct gnp_error *error)
{
	struct curl_header *header;
	if (!parameters || curl_easy_header(easy, "X-Gnpd-Parameters", 0, CURLH_HEADER, -1, &header) != CURLHE_OK)
		return GNP_OK;
	return gnp_buffer_append(parameters, header->value, strlen(header->value), error);
}

gnp_status gnp_http_post(const struct gnp_http_request *request, struct gnp_progress *progress,
                         struct gnp_buffer *response, struct gnp_error *error)
{
	char reason[CURL_ERROR_SIZE] = "";
	struct exchange exchange = {.progress = progress};
	struct curl_slist *headers = headers_of(request);
	CURL *easy = curl_easy_init();
	CURLM *multi = curl_multi_init();
	gnp_status status;
	if (!headers || !easy || !multi) {
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "http: no memory for a connection");
		goto done;
	}
	set_options(easy, request, &exchange, reason);
	curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers);
	CURLcode result = perform(multi, easy, progress->task);
	status = judge(easy, result, request, &exchange, reason, error);
	if (status == GNP_OK)
		status = take_parameters(easy, request->parameters, error);
	if (status == GNP_OK) {
		*response = exchange.body;
		exchange.body = (struct gnp_buffer){0};
	}
done:
	gnp_buffer_clear(&exchange.body);
	curl_multi_cleanup(multi);
	curl_easy_cleanup(easy);
	curl_slist_free_all(headers);
	return status;
}
