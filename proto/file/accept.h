/* Chooses the format of an answer by the Accept header of its request. */
#ifndef GNP_PROTO_ACCEPT_H
#define GNP_PROTO_ACCEPT_H

#include <stdbool.h>

#include "proto/format/format.h"

/* The format of an answer, and what it is called. */
struct gnp_format_choice {
	const struct gnp_format *format;
	const char *media_type; /* static */
	bool asked;             /* the client named it, so that no other may take its place */
};

/* Changes the choice to what an Accept header (RFC 9110) likes best of what can be written: the type with the
 * highest q, the first of several. A range, and application/octet-stream, mean the format chosen before where they
 * cover it, else the first they cover; a type with q=0 is none of a range's. Entries whose q is not 0 to 1 with at
 * most three decimals are passed over. False, and the choice unchanged, when nothing is left. */
bool gnp_format_by_accept(const char *accept, struct gnp_format_choice *choice);

#endif
