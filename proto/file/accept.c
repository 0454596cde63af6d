#include "proto/file/accept.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

#include "proto/file/formats.h"

/* One entry of the header: a type or a range, and its q. */
struct entry {
	const char *type;
	size_t length;
	double quality; /* 0: not to be had */
};

/* 0 to 1 with at most three decimals. */
static bool read_quality(const char *p, size_t length, double *quality)
{
	double value = *p - '0', unit = 0.1;
	if (length < 1 || length > 5 || (*p != '0' && *p != '1') || (length > 1 && p[1] != '.'))
		return false;
	for (size_t i = 2; i < length; i++, unit /= 10) {
		if (!isdigit((unsigned char)p[i]))
			return false;
		value += unit * (p[i] - '0');
	}
	*quality = value;
	return value <= 1;
}

/* q of the parameters that follow a type, 1 when there is none; false when it is malformed. */
static bool find_quality(const char *p, const char *end, double *quality)
{
	*quality = 1;
	while (p < end) {
		p += strspn(p, "; \t");
		size_t length = strcspn(p, "; \t,");
		if (length > 1 && (*p == 'q' || *p == 'Q') && p[1] == '=')
			return read_quality(p + 2, length - 2, quality);
		p += length + (p + length < end && length == 0);
	}
	return true;
}

/* The next entry whose q is well-formed; false at the end. */
static bool next_entry(const char **accept, struct entry *entry)
{
	while (**accept) {
		*accept += strspn(*accept, " \t,");
		const char *end = *accept + strcspn(*accept, ",");
		entry->type = *accept;
		entry->length = strcspn(*accept, ",; \t");
		*accept = end;
		if (entry->length && find_quality(entry->type + entry->length, end, &entry->quality))
			return true;
	}
	return false;
}

static bool is_entry(const struct entry *entry, const char *text)
{
	return strlen(text) == entry->length && strncasecmp(entry->type, text, entry->length) == 0;
}

/* Whether an entry is a range that covers a media type. */
static bool covers(const struct entry *entry, const char *media_type)
{
	if (is_entry(entry, "*/*") || is_entry(entry, gnp_format_generic_media_type))
		return true;
	size_t stem = entry->length ? entry->length - 1 : 0;
	bool range = stem > 1 && entry->type[stem] == '*' && entry->type[stem - 1] == '/';
	return range && strncasecmp(entry->type, media_type, stem) == 0;
}

/* Whether the header names a format with q=0. */
static bool is_refused(const char *accept, const struct gnp_format *format)
{
	struct entry entry;
	const char *media_type;
	const struct gnp_format *named;
	while (next_entry(&accept, &entry))
		if (entry.quality == 0 && gnp_format_find_media_type(entry.type, entry.length, &named, &media_type) &&
		    named == format)
			return true;
	return false;
}

/* Whether the answer to a request may have this media type of a format. */
static bool can_answer(const struct gnp_format *format, const char *media_type)
{
	for (size_t i = 0; format->body_media_types && format->body_media_types[i]; i++)
		if (media_type == format->body_media_types[i])
			return false;
	return gnp_format_writable(format);
}

static bool allows(const struct entry *entry, const char *accept, const struct gnp_format *format)
{
	return covers(entry, format->media_type) && !is_refused(accept, format);
}

/* What an entry makes of the choice; false when there is nothing of its kind that can be written. */
static bool choose(const struct entry *entry, const char *accept, struct gnp_format_choice *choice)
{
	const struct gnp_format *named, *found = NULL, *each;
	if (gnp_format_find_media_type(entry->type, entry->length, &named, &choice->media_type)) {
		choice->format = named;
		choice->asked = true;
		return can_answer(named, choice->media_type);
	}
	if (!allows(entry, accept, choice->format)) {
		for (size_t i = 0; !found && (each = gnp_format_at(i)); i++)
			found = gnp_format_writable(each) && allows(entry, accept, each) ? each : NULL;
		if (!found)
			return false;
		choice->format = found;
		choice->asked = false;
	}
	if (!allows(entry, accept, &gnp_format_npz))
		choice->asked = true; /* what would take its place is not acceptable */
	bool bytes = is_entry(entry, gnp_format_generic_media_type);
	choice->media_type = bytes ? gnp_format_generic_media_type : choice->format->media_type;
	return true;
}

bool gnp_format_by_accept(const char *accept, struct gnp_format_choice *choice)
{
	struct gnp_format_choice best = *choice;
	struct entry entry;
	double quality = 0;
	for (const char *rest = accept; next_entry(&rest, &entry);) {
		struct gnp_format_choice candidate = *choice;
		if (entry.quality > quality && choose(&entry, accept, &candidate)) {
			quality = entry.quality;
			best = candidate;
		}
	}
	*choice = best;
	return quality > 0;
}
