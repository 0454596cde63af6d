#include "server/parse/framing.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>

/* A second one of these would be read by some and not by others. */
static const char *const once[GNPD_STRICT_ONCE] = {
	[GNPD_STRICT_LENGTH] = "Content-Length", [GNPD_STRICT_TRANSFER] = "Transfer-Encoding", "Host", "Inference-Header-Content-Length",
	"Content-Type", "Content-Encoding", "Idempotency-Key", "Range", "If-Range", "Origin", "Sec-Fetch-Site", "Last-Event-ID"};

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

/* Which of those that may come once it is; GNPD_STRICT_ONCE: none. */
static unsigned count_header(struct gnpd_strict *strict, const char *name)
{
	unsigned which = 0;
	while (which < GNPD_STRICT_ONCE && strcasecmp(name, once[which]) != 0)
		which++;
	if (which < GNPD_STRICT_ONCE && ++strict->seen[which] > 1)
		gnp_error_set(&strict->error, GNP_INVALID_ARGUMENT, "%s: got %u headers, need at most 1", once[which], strict->seen[which]);
	return which;
}

void gnpd_strict_header(struct gnpd_strict *strict, const char *name, const char *value)
{
	if (value)
		strict->bytes += (size_t)((uintptr_t)value - (uintptr_t)name) + strlen(value) + strlen("\r\n");
	else
		value = "";
	if (!is_token(name))
		fault(strict, "header name is not a token", name);
	unsigned which = count_header(strict, name);
	if (which == GNPD_STRICT_LENGTH && !is_number(value))
		fault(strict, "Content-Length is not a number", value);
	else if (which == GNPD_STRICT_TRANSFER && strcasecmp(value, "chunked") != 0)
		fault(strict, "Transfer-Encoding other than chunked", value);
}

void gnpd_strict_size(struct gnpd_strict *strict, size_t first_line, size_t whole)
{
	size_t plain = first_line + strict->bytes + strlen("\r\n");
	if (whole && whole != plain)
		gnp_error_set(&strict->error, GNP_INVALID_ARGUMENT, "headers: %zu bytes are not lines of \"name: value\" that end in CRLF", whole);
}

gnp_status gnpd_strict_finish(struct gnpd_strict *strict, const char *version, struct gnp_error *error)
{
	if (strict->seen[GNPD_STRICT_LENGTH] && strict->seen[GNPD_STRICT_TRANSFER])
		gnp_error_set(&strict->error, GNP_INVALID_ARGUMENT, "got both Content-Length and Transfer-Encoding, need one");
	if (strict->seen[GNPD_STRICT_TRANSFER] && strcmp(version, "HTTP/1.1") != 0)
		fault(strict, "Transfer-Encoding needs HTTP/1.1", version);
	if (strict->error.status != GNP_OK)
		gnp_error_set(error, strict->error.status, "%s", strict->error.text);
	return strict->error.status;
}
