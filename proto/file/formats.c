#include "proto/file/formats.h"

#include <string.h>
#include <strings.h>

/* One row for each format, which is defined as gnp_format_NAME in a file of proto/format. Lists name them in this
 * order, and a range in an Accept header means the first that it covers. */
#define FORMATS(X) X(ply) X(npy) X(npz) X(xyz) X(csv) X(pcd) X(obj) X(vtk) X(mtx) X(json)

#define DECLARE(name) extern const struct gnp_format gnp_format_##name;
FORMATS(DECLARE)

#define ROW(name) &gnp_format_##name,
static const struct gnp_format *const formats[] = {FORMATS(ROW)};
enum { COUNT = sizeof formats / sizeof formats[0] };

const struct gnp_format *gnp_format_at(size_t i)
{
	return i < COUNT ? formats[i] : NULL;
}

/* The text of a NULL-terminated list (NULL: empty) that a word of `length` bytes is, whatever its case. */
static const char *find_word(const char *const *list, const char *word, size_t length)
{
	for (size_t i = 0; list && list[i]; i++)
		if (strlen(list[i]) == length && strncasecmp(word, list[i], length) == 0)
			return list[i];
	return NULL;
}

bool gnp_format_by_name(const char *name, const struct gnp_format **format)
{
	size_t length = strlen(name);
	for (size_t i = 0; i < COUNT; i++) {
		const char *const own[] = {formats[i]->name, formats[i]->extension, NULL};
		if (find_word(own, name, length) || find_word(formats[i]->other_names, name, length)) {
			*format = formats[i];
			return true;
		}
	}
	return false;
}

/* A media type of the format as it is spelled there, or NULL. */
static const char *find_type(const struct gnp_format *format, const char *type, size_t length)
{
	const char *const *const lists[] = {(const char *const[]){format->media_type, NULL}, format->other_media_types,
	                                    format->body_media_types};
	const char *found = NULL;
	for (size_t i = 0; i < sizeof lists / sizeof lists[0] && !found; i++)
		found = find_word(lists[i], type, length);
	return found;
}

bool gnp_format_find_media_type(const char *type, size_t length, const struct gnp_format **format, const char **spelled)
{
	for (size_t i = 0; i < COUNT; i++) {
		const char *found = find_type(formats[i], type, length);
		if (found) {
			*format = formats[i];
			*spelled = found;
			return true;
		}
	}
	return false;
}

bool gnp_format_by_media_type(const char *media_type, const struct gnp_format **format)
{
	const char *spelled;
	media_type += strspn(media_type, " \t");
	return gnp_format_find_media_type(media_type, strcspn(media_type, "; \t"), format, &spelled);
}

const char *gnp_format_media_type_spelled(const char *media_type)
{
	const struct gnp_format *format;
	const char *spelled = NULL;
	if (strcasecmp(media_type, gnp_format_generic_media_type) == 0)
		return gnp_format_generic_media_type;
	return gnp_format_find_media_type(media_type, strlen(media_type), &format, &spelled) ? spelled : NULL;
}
