#include "proto/format/format.h"

#include <string.h>

const char gnp_format_generic_media_type[] = "application/octet-stream";

const char *gnp_format_name(const struct gnp_format *format)
{
	return format ? format->name : "unknown";
}

const char *gnp_format_media_type(const struct gnp_format *format)
{
	return format ? format->media_type : gnp_format_generic_media_type;
}

bool gnp_format_readable(const struct gnp_format *format)
{
	return format && format->decode;
}

bool gnp_format_writable(const struct gnp_format *format)
{
	return format && format->encode;
}

bool gnp_format_of_rows(const struct gnp_format *format)
{
	return format && format->holds == GNP_HOLDS_ROWS;
}

bool gnp_format_begins(const char *text, const char *end, const char *word)
{
	size_t length = strlen(word);
	return (size_t)(end - text) >= length && memcmp(text, word, length) == 0;
}
