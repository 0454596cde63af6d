#include "strict.h"

#include <stdbool.h>
#include <string.h>
#include <strings.h>

static bool is_token(const char *name)
{
	static const char marks[] = "!#$%&'*+-.^_`|~"
	                            "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
	return *name && name[strspn(name, marks)] == '\0';
}

static bool is_number(const char *text)
{
	return *text && text[strspn(text, "0123456789")] == '\0';
}

static void fault(struct gnpd_strict *strict, const char *what, const char *value)
{
	gnp_error_set(&strict->error, GNP_INVALID_ARGUMENT, "%s: got \"%.100s\"", what, value);
}

static void seen(struct gnpd_strict *strict, unsigned *times, const char *name)
{
	if (++*times > 1)
		gnp_error_set(&strict->error, GNP_INVALID_ARGUMENT, "%s: got %u headers, need at most 1", name, *times);
}

void gnpd_strict_header(struct gnpd_strict *strict, const char *name, const char *value)
{
	if (!value)
		value = "";
	if (!is_token(name)) {
		fault(strict, "header name is not a token", name);
	} else if (strcasecmp(name, "Content-Length") == 0) {
		seen(strict, &strict->content_length, "Content-Length");
		if (!is_number(value))
			fault(strict, "Content-Length is not a number", value);
	} else if (strcasecmp(name, "Transfer-Encoding") == 0) {
		seen(strict, &strict->transfer_encoding, "Transfer-Encoding");
		if (strcasecmp(value, "chunked") != 0)
			fault(strict, "Transfer-Encoding other than chunked", value);
	} else if (strcasecmp(name, "Host") == 0) {
		seen(strict, &strict->host, "Host");
	} else if (strcasecmp(name, "Inference-Header-Content-Length") == 0) {
		seen(strict, &strict->inference_length, "Inference-Header-Content-Length");
	}
}

gnp_status gnpd_strict_finish(struct gnpd_strict *strict, const char *version, struct gnp_error *error)
{
	if (strict->content_length && strict->transfer_encoding)
		gnp_error_set(&strict->error, GNP_INVALID_ARGUMENT, "got both Content-Length and Transfer-Encoding, need one");
	if (strict->transfer_encoding && strcmp(version, "HTTP/1.1") != 0)
		fault(strict, "Transfer-Encoding needs HTTP/1.1", version);
	if (strict->error.status != GNP_OK)
		gnp_error_set(error, strict->error.status, "%s", strict->error.text);
	return strict->error.status;
}
