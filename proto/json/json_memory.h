/* Gives jansson its memory, because jansson cannot cope with a failing allocation: in the middle of a text it drops
 * characters without a word, or fails an assertion. A parse therefore takes all it may need at once, beforehand. */
#ifndef GNP_PROTO_JSON_MEMORY_H
#define GNP_PROTO_JSON_MEMORY_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* Has jansson allocate through here, in all threads. Before it has allocated anything and before there are threads; until then
 * the function below takes jansson's memory as it comes. */
void gnp_json_memory_init(void);

/* Bytes that a text of `size` may need. */
size_t gnp_json_memory_size(size_t size);

/* json_loadb, duplicates refused. *memory: what the tree lives in, for free() after the tree. NULL for a bad text, with *reason filled;
 * *exhausted: for want of memory. */
json_t *gnp_json_memory_load(const char *text, size_t size, void **memory, bool *exhausted, json_error_t *reason);

#endif
