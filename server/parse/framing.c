#include "server/parse/framing.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>

/* A second one of these would be read by some and not by others. */
static const char *const once[GNPD_FRAMING_ONCE] = {
	[GNPD_FRAMING_LENGTH] = "Content-Length", [GNPD_FRAMING_TRANSFER] = "Transfer-Encoding", "Host", "Inference-Header-Content-Length",
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

static void fault(struct gnpd_framing *framing, const char *what, const char *value)
{
	gnp_error_set(&framing->error, GNP_INVALID_ARGUMENT, "%s: got \"%.100s\"", what, value);
}

/* Which of those that may come once it is; GNPD_FRAMING_ONCE: none. */
static unsigned count_header(struct gnpd_framing *framing, const char *name)
{
	unsigned which = 0;
	while (which < GNPD_FRAMING_ONCE && strcasecmp(name, once[which]) != 0)
		which++;
	if (which < GNPD_FRAMING_ONCE && ++framing->seen[which] > 1)
		gnp_error_set(&framing->error, GNP_INVALID_ARGUMENT, "%s: got %u headers, need at most 1", once[which], framing->seen[which]);
	return which;
}

void gnpd_framing_header(struct gnpd_framing *framing, const char *name, const char *value)
{
	if (value)
		framing->bytes += (size_t)((uintptr_t)value - (uintptr_t)name) + strlen(value) + strlen("\r\n");
	else
		value = "";
	if (!is_token(name))
		fault(framing, "header name is not a token", name);
	unsigned which = count_header(framing, name);
	if (which == GNPD_FRAMING_LENGTH && !is_number(value))
		fault(framing, "Content-Length is not a number", value);
	else if (which == GNPD_FRAMING_TRANSFER && strcasecmp(value, "chunked") != 0)
		fault(framing, "Transfer-Encoding other than chunked", value);
}

void gnpd_framing_size(struct gnpd_framing *framing, size_t first_line, size_t whole)
{
	size_t plain = first_line + framing->bytes + strlen("\r\n");
	if (whole && whole != plain)
		gnp_error_set(&framing->error, GNP_INVALID_ARGUMENT, "headers: %zu bytes are not lines of \"name: value\" that end in CRLF", whole);
}

gnp_status gnpd_framing_finish(struct gnpd_framing *framing, const char *version, struct gnp_error *error)
{
	if (framing->seen[GNPD_FRAMING_LENGTH] && framing->seen[GNPD_FRAMING_TRANSFER])
		gnp_error_set(&framing->error, GNP_INVALID_ARGUMENT, "got both Content-Length and Transfer-Encoding, need one");
	if (framing->seen[GNPD_FRAMING_TRANSFER] && strcmp(version, "HTTP/1.1") != 0)
		fault(framing, "Transfer-Encoding needs HTTP/1.1", version);
	if (framing->error.status != GNP_OK)
		gnp_error_set(error, framing->error.status, "%s", framing->error.text);
	return framing->error.status;
}
