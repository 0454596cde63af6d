#include "server/work/reply.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void gnpd_reply_add(struct gnpd_reply *reply, const char *name, const char *format, ...)
{
	if (reply->header_count == GNPD_REPLY_HEADERS_MAX)
		return;
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(reply->headers[reply->header_count].value, sizeof reply->headers[0].value, format, arguments);
	va_end(arguments);
	reply->headers[reply->header_count++].name = name;
}

struct gnp_buffer *gnpd_reply_json(struct gnpd_reply *reply, int code)
{
	reply->code = code;
	reply->content_type = "application/json";
	return &reply->body;
}

bool gnpd_reply_retries(gnp_status status)
{
	int code = gnp_status_http(status);
	return code == 429 || (code == 503 && status != GNP_UNAVAILABLE) || status == GNP_IN_PROGRESS;
}

size_t gnpd_reply_size(const struct gnpd_reply *reply)
{
	size_t size = reply->body.size;
	for (size_t i = 0; i < reply->tail_count; i++)
		size += reply->tails[i]->size;
	return size + reply->file_size;
}

void gnpd_reply_clear(struct gnpd_reply *reply)
{
	if (reply->has_file)
		close(reply->file);
	gnp_buffer_clear(&reply->body);
	gnp_buffer_clear(&reply->parameters);
	free(reply->tails);
	memset(reply, 0, sizeof *reply);
}
