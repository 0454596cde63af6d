#include "core/base/status.h"

#include <stdarg.h>
#include <stdio.h>

static const struct {
	const char *name;
	int http;
	const char *text;
} status_table[GNP_STATUS_COUNT] = {
#define GNP_STATUS_ROW(id, name, http, text) [id] = {name, http, text},
	GNP_STATUS_TABLE(GNP_STATUS_ROW)
#undef GNP_STATUS_ROW
};

static gnp_status known(gnp_status status)
{
	return (unsigned)status < GNP_STATUS_COUNT ? status : GNP_INTERNAL;
}

gnp_status gnp_error_set(struct gnp_error *error, gnp_status status, const char *format, ...)
{
	if (!error || error->status != GNP_OK)
		return status;
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(error->text, sizeof error->text, format, arguments);
	va_end(arguments);
	error->status = status;
	return status;
}

gnp_status gnp_no_memory(const char *what, size_t count, const char *things, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%.120s: no memory for %zu %s", what, count, things);
}

const char *gnp_status_name(gnp_status status)
{
	return status_table[known(status)].name;
}

int gnp_status_http(gnp_status status)
{
	return status_table[known(status)].http;
}

const char *gnp_status_text(gnp_status status)
{
	return status_table[known(status)].text;
}
