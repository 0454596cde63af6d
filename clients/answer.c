#include "clients/answer.h"

#include <jansson.h>

struct json_t *gnp_answer_parse(const struct gnp_buffer *body)
{
	return body->size ? json_loadb((const char *)body->data, body->size, JSON_REJECT_DUPLICATES, NULL) : NULL;
}

void gnp_answer_free(struct json_t *answer)
{
	json_decref(answer);
}

const struct json_t *gnp_answer_member(const struct json_t *node, const char *key)
{
	return json_object_get(node, key);
}

const struct json_t *gnp_answer_at(const struct json_t *node, size_t i)
{
	return json_array_get(node, i);
}

void gnp_answer_string(const struct json_t *node, const char *key, char *value, size_t size)
{
	const json_t *member = json_object_get(node, key);
	const char *text = json_is_string(member) ? json_string_value(member) : "";
	size_t length = 0;
	for (; text[length] && length + 1 < size; length++)
		value[length] = (unsigned char)text[length] < ' ' || text[length] == 0x7f ? ' ' : text[length];
	while (length && (text[length] & 0xc0) == 0x80) /* in the middle of a character of UTF-8 */
		length--;
	value[length] = 0;
}

double gnp_answer_number(const struct json_t *node, const char *key)
{
	return json_number_value(json_object_get(node, key));
}
