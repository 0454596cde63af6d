#include "server/parse/range.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>

/* Reads digits; a number too large to hold is as large as can be. False without any. */
static bool read_number(const char **text, size_t *number)
{
	const char *begin = *text;
	size_t value = 0;
	for (; **text >= '0' && **text <= '9'; ++*text) {
		size_t digit = (size_t)(**text - '0');
		value = value > (SIZE_MAX - digit) / 10 ? SIZE_MAX : 10 * value + digit;
	}
	*number = value;
	return *text != begin;
}

enum gnpd_range gnpd_range_parse(const char *text, size_t size, size_t *first, size_t *count)
{
	static const char unit[] = "bytes=";
	size_t low, high;
	if (!text || strncasecmp(text, unit, sizeof unit - 1) != 0)
		return GNPD_RANGE_WHOLE;
	text += sizeof unit - 1;
	bool has_low = read_number(&text, &low);
	if (*text++ != '-')
		return GNPD_RANGE_WHOLE;
	bool has_high = read_number(&text, &high);
	if (*text || (!has_low && !has_high) || (has_low && has_high && high < low))
		return GNPD_RANGE_WHOLE;
	if (!has_low) { /* the last so many */
		low = high < size ? size - high : 0;
		high = high ? SIZE_MAX : 0;
		if (!high)
			return GNPD_RANGE_OUTSIDE;
	}
	if (low >= size)
		return GNPD_RANGE_OUTSIDE;
	if (!has_high || high >= size)
		high = size - 1;
	*first = low;
	*count = high - low + 1;
	return GNPD_RANGE_PART;
}
