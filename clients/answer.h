/* Reads what a server answers in JSON, by jansson: its one user among the clients. Nodes belong to the answer. */
#ifndef GNP_CLIENTS_ANSWER_H
#define GNP_CLIENTS_ANSWER_H

#include <stddef.h>

#include "proto/tensor/message.h"

struct json_t;

/* NULL when the body is no JSON; freed by gnp_answer_free, which takes NULL too. */
struct json_t *gnp_answer_parse(const struct gnp_buffer *body);
void gnp_answer_free(struct json_t *answer);

/* A member of an object, an element of an array; NULL where there is none. The node may be NULL. */
const struct json_t *gnp_answer_member(const struct json_t *node, const char *key);
const struct json_t *gnp_answer_at(const struct json_t *node, size_t i);

/* A member's text on one line: control characters become blanks, so that no answer moves a terminal's cursor; what does not fit size bytes
 * with the NUL is cut after a whole character. Empty where the member is no string. */
void gnp_answer_string(const struct json_t *node, const char *key, char *value, size_t size);
/* A member's number; 0 where it is none. */
double gnp_answer_number(const struct json_t *node, const char *key);

#endif
