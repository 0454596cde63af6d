#include "json_memory.h"

#include <jansson.h>
#include <stdlib.h>

/* jansson hands its allocator no context, so that what it saw can only be kept by thread. */
static _Thread_local bool failed;

static void *allocate(size_t size)
{
	void *piece = malloc(size);
	failed = failed || !piece;
	return piece;
}

void gnp_json_memory_init(void)
{
	json_set_alloc_funcs(allocate, free);
}

void gnp_json_memory_begin(void)
{
	failed = false;
}

bool gnp_json_memory_failed(void)
{
	return failed;
}
