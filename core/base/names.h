/* Writes the list of known names into errors about an unknown one: "points, normals and 3 more; did you mean
 * \"normals\"?".
 *
 * A list is whole as far as it fits: no name is cut, those left out are counted, and the one nearest to what was given
 * is looked for among all. */
#ifndef GNP_CORE_NAMES_H
#define GNP_CORE_NAMES_H

#include <stddef.h>

enum {
	GNP_NAMES_TEXT = 560, /* with the NUL, as are these: */
	GNP_NAME_TEXT = 64    /* longer ones are listed, but never suggested nor compared */
};

struct gnp_names {
	char given[GNP_NAME_TEXT]; /* "": nothing is suggested */
	char nearest[GNP_NAME_TEXT];
	char text[GNP_NAMES_TEXT], hint[GNP_NAME_TEXT + 24];
	size_t length, left_out, distance; /* of text; names; of the nearest name */
};

/* given: size bytes, what is not among the names that follow. */
void gnp_names_begin(struct gnp_names *names, const char *given, size_t size);
void gnp_names_add(struct gnp_names *names, const char *name);

/* "; did you mean \"degree\"?", or "" where no name is near: a letter in three may be another, swapped, missing or too many, case apart. */
const char *gnp_names_hint(struct gnp_names *names);
/* The list and the hint; "none" without names. Nothing is added afterwards. Both texts are of names. */
const char *gnp_names_end(struct gnp_names *names);

#endif
