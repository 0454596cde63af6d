#include "target.h"

#include <stdlib.h>
#include <string.h>

static int hex(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	c |= 0x20;
	return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* In place. False for a bad escape or an encoded NUL. */
static bool percent_decode(char *text, bool plus_is_space)
{
	char *out = text;
	for (; *text; text++) {
		char c = *text;
		if (c == '+' && plus_is_space) {
			c = ' ';
		} else if (c == '%') {
			int high = hex(text[1]), low = high < 0 ? -1 : hex(text[2]);
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

static void split_path(struct gnpd_target *target)
{
	char *save = NULL;
	target->valid = target->decoded[0] == '/';
	for (char *part = strtok_r(target->decoded, "/", &save); part; part = strtok_r(NULL, "/", &save)) {
		if (target->count == GNPD_SEGMENTS_MAX || !percent_decode(part, false)) {
			target->valid = false;
			return;
		}
		target->segments[target->count++] = part;
	}
}

gnp_status gnpd_target_parse(const char *uri, struct gnpd_target *target)
{
	memset(target, 0, sizeof *target);
	size_t length = strcspn(uri, "?");
	target->path = strndup(uri, length);
	target->decoded = strndup(uri, length);
	if (uri[length] == '?')
		target->query = strdup(uri + length + 1);
	if (!target->path || !target->decoded || (uri[length] == '?' && !target->query)) {
		gnpd_target_clear(target);
		return GNP_OUT_OF_MEMORY;
	}
	split_path(target);
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
	free(target->decoded);
	free(target->query);
	memset(target, 0, sizeof *target);
}

static gnp_status add_pair(char *pair, struct gnp_values *values, struct gnp_error *error)
{
	char *equals = strchr(pair, '=');
	if (!equals)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: got \"%.100s\", need name=value", pair);
	*equals = '\0';
	if (!percent_decode(pair, true) || !percent_decode(equals + 1, true))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: bad percent escape in \"%.100s\"", pair);
	if (gnp_values_find(values, pair))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: \"%.100s\" is given twice", pair);
	if (values->count >= GNPD_QUERY_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "query: more than %d parameters", GNPD_QUERY_MAX);
	return gnp_values_add_string(values, pair, equals + 1, error);
}

gnp_status gnpd_query_parse(const char *query, struct gnp_values *values, struct gnp_error *error)
{
	if (!query)
		return GNP_OK;
	char *copy = strdup(query), *save = NULL;
	if (!copy)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "query: no memory");
	gnp_status status = GNP_OK;
	for (char *pair = strtok_r(copy, "&", &save); pair && status == GNP_OK; pair = strtok_r(NULL, "&", &save))
		status = add_pair(pair, values, error);
	free(copy);
	return status;
}
