/* Whether jansson ran out of memory: what it then says of a text is that the text is wrong, in words that depend on where it was. */
#ifndef GNP_PROTO_JSON_MEMORY_H
#define GNP_PROTO_JSON_MEMORY_H

#include <stdbool.h>

/* Has jansson allocate through here. Before there are threads; without it the functions below see nothing. */
void gnp_json_memory_init(void);

/* Begins to watch the calling thread; whether an allocation of it has failed since. */
void gnp_json_memory_begin(void);
bool gnp_json_memory_failed(void);

#endif
