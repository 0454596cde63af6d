/* Tells the user what an answer says of itself: warnings on standard error, parameters as lines or as a file. */
#ifndef GNP_CLIENTS_NOTICES_H
#define GNP_CLIENTS_NOTICES_H

#include "clients/options.h"
#include "proto/codec/parameters.h"
#include "proto/format/format.h"
#include "proto/tensor/message.h"

/* A line on standard error for each warning, "gnp: warning: precision: ...", unless --quiet was given. */
void gnp_notices_warn(const struct gnp_values *parameters, const struct gnp_arguments *arguments);

/* Reads what an answer of a server says of itself: from its body where the format has a place for it, else from its header. What cannot be
 * read is passed over: the answer itself is there. */
void gnp_notices_of_answer(const struct gnp_format *format, const struct gnp_buffer *answer, const struct gnp_buffer *header,
                           struct gnp_values *parameters);

/* A line on standard output for each parameter and each warning. Control characters, which a file of anybody's may have, become spaces. */
void gnp_notices_print(const struct gnp_values *parameters);

#endif
