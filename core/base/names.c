#include "core/base/names.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum { TAIL = GNP_NAME_TEXT + 24 + 24 }; /* kept for "and N more" and the hint */

void gnp_names_begin(struct gnp_names *names, const char *given, size_t size)
{
	*names = (struct gnp_names){.distance = GNP_NAME_TEXT};
	if (size < GNP_NAME_TEXT)
		memcpy(names->given, given, size);
}

static unsigned plain(char letter)
{
	return letter == '-' ? '_' : (unsigned)tolower((unsigned char)letter);
}

static size_t least(size_t a, size_t b)
{
	return a < b ? a : b;
}

/* Letters to change, insert, leave out or swap with the next to make b of a. */
static size_t distance(const char *a, const char *b)
{
	size_t n = strlen(a), m = strlen(b);
	size_t step[GNP_NAME_TEXT][GNP_NAME_TEXT]; /* from the first i letters of a to the first j of b */
	for (size_t i = 0; i <= n; i++)
		for (size_t j = 0; j <= m; j++) {
			if (i == 0 || j == 0) {
				step[i][j] = i + j;
				continue;
			}
			size_t change = step[i - 1][j - 1] + (plain(a[i - 1]) != plain(b[j - 1]));
			step[i][j] = least(change, 1 + least(step[i - 1][j], step[i][j - 1]));
			if (i > 1 && j > 1 && plain(a[i - 1]) == plain(b[j - 2]) && plain(a[i - 2]) == plain(b[j - 1]))
				step[i][j] = least(step[i][j], 1 + step[i - 2][j - 2]);
		}
	return step[n][m];
}

static void compare(struct gnp_names *names, const char *name)
{
	size_t length = strlen(name);
	if (!names->given[0] || length >= GNP_NAME_TEXT)
		return;
	size_t far = distance(names->given, name);
	if (far >= names->distance)
		return;
	names->distance = far;
	memcpy(names->nearest, name, length + 1);
}

void gnp_names_add(struct gnp_names *names, const char *name)
{
	size_t needed = strlen(name) + (names->length ? 2 : 0);
	compare(names, name);
	if (names->left_out || names->length + needed >= GNP_NAMES_TEXT - TAIL) {
		names->left_out++;
		return;
	}
	names->length += (size_t)sprintf(names->text + names->length, "%s%s", names->length ? ", " : "", name);
}

const char *gnp_names_hint(struct gnp_names *names)
{
	size_t most = strlen(names->given) / 3;
	if (names->nearest[0] && names->distance <= (most ? most : 1) && names->distance < strlen(names->nearest))
		snprintf(names->hint, sizeof names->hint, "; did you mean \"%s\"?", names->nearest);
	return names->hint;
}

const char *gnp_names_end(struct gnp_names *names)
{
	char *end = names->text + names->length;
	size_t room = sizeof names->text - names->length;
	if (names->left_out)
		snprintf(end, room, "%s%zu more%s", names->length ? " and " : "", names->left_out, gnp_names_hint(names));
	else
		snprintf(end, room, "%s%s", names->length ? "" : "none", gnp_names_hint(names));
	return names->text;
}
