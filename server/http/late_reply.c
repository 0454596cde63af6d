#include "server/http/late_reply.h"

#include <stdio.h>

#include "proto/oip/oip.h"
#include "server/api/request.h"

static const char *phrase(int code)
{
	switch (code) {
	case 400: return "Bad Request";
	case 408: return "Request Timeout";
	case 413: return "Content Too Large";
	case 429: return "Too Many Requests";
	case 503: return "Service Unavailable";
	default: return code < 500 ? "Client Error" : "Server Error";
	}
}

gnp_status gnpd_late_reply(const struct gnp_error *error, const char *id, double retry_after, struct gnp_buffer *answer)
{
	struct gnp_buffer body = {0};
	char retry[48] = "", echo[GNPD_ID_MAX + 24] = "";
	int code = gnp_status_http(error->status);
	gnp_status status = gnp_oip_error_body(error->status, error->text, id, &body);
	if (*id)
		snprintf(echo, sizeof echo, "X-Request-Id: %s\r\n", id);
	if (gnpd_reply_retries(error->status))
		snprintf(retry, sizeof retry, "Retry-After: %.0f\r\n", retry_after);
	if (status == GNP_OK)
		status = gnp_buffer_printf(answer, NULL, "HTTP/1.1 %d %s\r\nContent-Type: application/json\r\n%s%s"
		                           "Content-Length: %zu\r\nConnection: close\r\n\r\n", code, phrase(code), echo, retry, body.size);
	if (status == GNP_OK)
		status = gnp_buffer_append(answer, body.data, body.size, NULL);
	gnp_buffer_clear(&body);
	return status;
}
