#include "core/base/warning.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const names[GNP_WARNING_KINDS] = {
#define GNP_WARNING_NAME(id, name, help) [id] = name,
	GNP_WARNING_TABLE(GNP_WARNING_NAME)
#undef GNP_WARNING_NAME
};

const char *gnp_warning_name(enum gnp_warning_kind kind)
{
	return (unsigned)kind < GNP_WARNING_KINDS ? names[kind] : NULL;
}

static void cut_at_word(char *text)
{
	char *end = strrchr(text, ' ');
	if (end)
		*end = '\0';
}

void gnp_warnings_add(struct gnp_warnings *warnings, enum gnp_warning_kind kind, const char *format, ...)
{
	if (!warnings || warnings->text[kind][0])
		return;
	char *text = warnings->text[kind];
	int length = snprintf(text, GNP_WARNING_TEXT_MAX, "%s: ", names[kind]);
	va_list arguments;
	va_start(arguments, format);
	int more = vsnprintf(text + length, (size_t)(GNP_WARNING_TEXT_MAX - length), format, arguments);
	va_end(arguments);
	if (more >= GNP_WARNING_TEXT_MAX - length)
		cut_at_word(text + length);
	for (char *at = text; (at = strstr(at, "; ")) != NULL;)
		*at = ',';
}

void gnp_warnings_merge(struct gnp_warnings *to, const struct gnp_warnings *from)
{
	for (int kind = 0; to && from && kind < GNP_WARNING_KINDS; kind++)
		if (!to->text[kind][0])
			memcpy(to->text[kind], from->text[kind], sizeof to->text[kind]);
}

size_t gnp_warnings_count(const struct gnp_warnings *warnings)
{
	size_t count = 0;
	for (int kind = 0; warnings && kind < GNP_WARNING_KINDS; kind++)
		count += warnings->text[kind][0] != '\0';
	return count;
}
