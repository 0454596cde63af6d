#include "proto/file/sniff.h"

#include <ctype.h>
#include <string.h>

#include "proto/file/formats.h"

enum { LOOKED_AT = 65536 }; /* bytes */

static const char *skip_blank(const char *p, const char *end)
{
	while (p < end && isspace((unsigned char)*p))
		p++;
	return p;
}

/* Past lines that begin with '#'. */
static const char *skip_comments(const char *p, const char *end)
{
	for (p = skip_blank(p, end); p < end && *p == '#'; p = skip_blank(p, end)) {
		const char *line = memchr(p, '\n', (size_t)(end - p));
		p = line ? line : end;
	}
	return p;
}

static bool has_magic(const struct gnp_format *format, const char *p, const char *end)
{
	for (size_t i = 0; format->magic && format->magic[i]; i++)
		if (gnp_format_begins(p, end, format->magic[i]))
			return true;
	return false;
}

bool gnp_format_by_magic(const unsigned char *data, size_t size, const struct gnp_format **format)
{
	const char *p = (const char *)data, *end = p + (size < LOOKED_AT ? size : LOOKED_AT), *text = skip_comments(p, end);
	const struct gnp_format *found = NULL, *each;
	for (size_t i = 0; !found && (each = gnp_format_at(i)); i++)
		found = has_magic(each, p, end) ? each : NULL;
	for (size_t i = 0; !found && (each = gnp_format_at(i)); i++)
		found = each->begins && each->begins(text, end) ? each : NULL;
	if (found)
		*format = found;
	return found;
}
