/* JSON envelopes: jansson for the structure, with the number arrays cut out before it sees the text, and string
 * writing. */
#ifndef GNP_PROTO_JSON_TEXT_H
#define GNP_PROTO_JSON_TEXT_H

#include <jansson.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/budget.h"
#include "proto/tensor/message.h"
#include "proto/tensor/writer.h"

struct gnp_json_span {
	const char *text; /* borrowed from the parsed text */
	size_t size;
};

/* A parsed document in which number arrays were replaced by [i], their index in spans. */
struct gnp_json_document {
	json_t *root;
	void *memory; /* what root lives in */
	const struct gnp_budget *budget; /* holds `reserved` bytes for it */
	size_t reserved;
	struct gnp_json_span *spans;
	size_t count;
};

/* Parses an object. Arrays that are the value of `key` (NULL: any key) of an object at nesting `depth` (the root is
 * 1) are cut out. Nesting over 100, duplicate keys, bytes after the end: GNP_INVALID_ARGUMENT; what is left without
 * the arrays over 1 MiB: GNP_TOO_LARGE. The memory that the structure may need is reserved of budget (or NULL) until
 * gnp_json_clear. On failure *out is unchanged. */
gnp_status gnp_json_parse(const char *text, size_t size, unsigned depth, const char *key,
                          const struct gnp_budget *budget, struct gnp_json_document *out, struct gnp_error *error);
void gnp_json_clear(struct gnp_json_document *document);

/* The address past the string that begins at p; end where it never closes. */
const char *gnp_json_skip_string(const char *p, const char *end);

/* The span an object's member was replaced by; NULL when the member is absent or was no array. */
const struct gnp_json_span *gnp_json_member_span(const struct gnp_json_document *document, const json_t *member);

/* Appends text as a JSON string, escaped; bytes that are not UTF-8 become U+FFFD. */
gnp_status gnp_json_write_string(const char *text, struct gnp_buffer *buffer, struct gnp_error *error);
void gnp_json_put_string(struct gnp_writer *writer, const char *text);
/* Appends {"name":value,...}. */
gnp_status gnp_json_write_values(const struct gnp_values *values, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
