/* What an answer says of itself as lines of comments: written by the formats that have such lines, and read back. */
#ifndef GNP_PROTO_COMMENTS_H
#define GNP_PROTO_COMMENTS_H

#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"

/* Appends "<prefix>name value\n" for every comment, and one for each warning; line ends within become spaces.
 * comments may be NULL. */
gnp_status gnp_comments_write(const struct gnp_values *comments, const char *prefix, struct gnp_buffer *buffer,
                              struct gnp_error *error);

/* Adds what lines say that begin with `mark`, up to the line that begins with `last`, or to the end where that is
 * NULL; "": to the first other line. */
gnp_status gnp_comments_read(const unsigned char *body, size_t size, const char *mark, const char *last,
                             struct gnp_values *values, struct gnp_error *error);
/* Adds one, without what marks it as one: its first word is taken for the name. The names of columns are none, nor
 * is the first line of Matrix Market. Warnings, one a line, become one text again. */
gnp_status gnp_comments_add(const char *p, const char *end, struct gnp_values *values, struct gnp_error *error);

#endif
