#include "server/parse/target.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/parse/hex.h"

/* Escapes are written with digits of either case. */
static int escape_digit(char c)
{
	return gnpd_hex_digit((char)tolower((unsigned char)c));
}

/* In place, '+' read as space. False for a bad escape or an encoded NUL. */
static bool decode(char *text)
{
	char *out = text;
	for (; *text; text++) {
		char c = *text;
		if (c == '+') {
			c = ' ';
		} else if (c == '%') {
			int high = escape_digit(text[1]), low = high < 0 ? -1 : escape_digit(text[2]);
			if (low < 0 || (high | low) == 0)
				return false;
			c = (char)(high << 4 | low);
			text += 2;
		}
		*out++ = c;
	}
	*out = '\0';
	return true;
}

/* "/" has no segments. */
static bool split_path(struct gnpd_target *target)
{
	char *at = target->split;
	if (*at != '/' || strchr(at, '%'))
		return false;
	while (at && at[1]) {
		if (target->count == GNPD_SEGMENTS_MAX)
			return false;
		target->segments[target->count++] = at + 1;
		*at = '\0';
		at = strchr(at + 1, '/');
	}
	for (unsigned i = 0; i < target->count; i++)
		if (!*target->segments[i])
			return false;
	return !at || target->count == 0;
}

/* Bytes of "http://" or "https://" at the begin; 0: none. */
static size_t scheme_size(const char *uri)
{
	static const char *const schemes[] = {"http://", "https://"};
	for (size_t i = 0; i < sizeof schemes / sizeof schemes[0]; i++)
		if (strncasecmp(uri, schemes[i], strlen(schemes[i])) == 0)
			return strlen(schemes[i]);
	return 0;
}

gnp_status gnpd_target_parse(const char *uri, struct gnpd_target *target)
{
	memset(target, 0, sizeof *target);
	size_t scheme = scheme_size(uri), authority = scheme ? strcspn(uri + scheme, "/?") : 0;
	if (scheme)
		target->authority = strndup(uri + scheme, authority);
	uri += scheme + authority;
	size_t length = strcspn(uri, "?");
	const char *path = scheme && length == 0 ? "/" : uri; /* "http://host" is the root */
	target->path = strndup(path, path == uri ? length : 1);
	target->split = strndup(path, path == uri ? length : 1);
	if (uri[length] == '?')
		target->query = strdup(uri + length + 1);
	if (!target->path || !target->split || (scheme && !target->authority) || (uri[length] == '?' && !target->query)) {
		gnpd_target_clear(target);
		return GNP_OUT_OF_MEMORY;
	}
	target->whole = strcmp(target->path, "*") == 0;
	target->valid = split_path(target);
	return GNP_OK;
}

size_t gnpd_query_count(const char *query)
{
	size_t count = query && *query;
	for (const char *c = query; c && *c; c++)
		count += *c == '&';
	return count;
}

void gnpd_target_clear(struct gnpd_target *target)
{
	free(target->path);
	free(target->authority);
	free(target->split);
	free(target->query);
	memset(target, 0, sizeof *target);
}

static gnp_status add_pair(char *pair, struct gnp_values *values, struct gnp_error *error)
{
	char *equals = strchr(pair, '=');
	if (!equals)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: got \"%.100s\", need name=value", pair);
	*equals = '\0';
	if (!decode(pair) || !decode(equals + 1))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: bad percent escape in \"%.100s\"", pair);
	if (gnp_values_find(values, pair))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: \"%.100s\" is given twice", pair);
	if (values->count >= GNPD_QUERY_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: more than %d parameters", GNPD_QUERY_MAX);
	return gnp_values_add_string(values, pair, equals + 1, error);
}

gnp_status gnpd_query_parse(const char *query, struct gnp_values *values, struct gnp_error *error)
{
	if (!query || !*query)
		return GNP_OK;
	char *copy = strdup(query), *rest = copy;
	if (!copy)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "query: no memory");
	gnp_status status = GNP_OK;
	while (rest && status == GNP_OK)
		status = add_pair(strsep(&rest, "&"), values, error);
	free(copy);
	return status;
}
