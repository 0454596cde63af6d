#include "proto/tensor/warnings.h"

#include <string.h>

static const char separator[] = "; ";

gnp_status gnp_warnings_report(const struct gnp_warnings *warnings, struct gnp_values *report, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	gnp_status status = GNP_OK;
	for (int kind = 0; kind < GNP_WARNING_KINDS && status == GNP_OK; kind++)
		if (warnings->text[kind][0])
			status = gnp_buffer_printf(&text, error, "%s%s", text.size ? separator : "", warnings->text[kind]);
	if (status == GNP_OK && text.size)
		status = gnp_values_add_string(report, GNP_WARNINGS_NAME, (const char *)text.data, error);
	gnp_buffer_clear(&text);
	return status;
}

const char *gnp_warnings_of(const struct gnp_values *report)
{
	const struct gnp_value *value = gnp_values_find(report, GNP_WARNINGS_NAME);
	return value && value->type == GNP_VALUE_STRING ? value->string : "";
}

bool gnp_warnings_next(const char **joined, const char **text, size_t *length)
{
	if (!**joined)
		return false;
	const char *end = strstr(*joined, separator);
	*text = *joined;
	*length = end ? (size_t)(end - *joined) : strlen(*joined);
	*joined += *length + (end ? sizeof separator - 1 : 0);
	return true;
}

size_t gnp_warnings_joined_count(const char *joined)
{
	const char *text;
	size_t length, count = 0;
	while (gnp_warnings_next(&joined, &text, &length))
		count++;
	return count;
}
