#include "proto/json/json_memory.h"

#include <stdint.h>
#include <stdlib.h>

/* What stands before each piece: whether free() has to do with it. */
union header {
	bool separate;
	max_align_t align;
};

/* An empty object is the dearest thing to be written in the fewest characters: 2 and a comma for about 300 bytes. The rest is for
 * jansson's buffer of the token it reads, which doubles. */
enum { BYTES_A_CHARACTER = 128, BYTES_FOR_ALL = 8192 };

struct arena {
	size_t size, used;
	max_align_t bytes[];
};

static bool installed;

/* jansson hands its allocator no context: what it is to take from can only be kept by thread. */
static _Thread_local struct arena *current;
static _Thread_local bool failed;

static void *allocate(size_t size)
{
	const size_t unit = sizeof(union header);
	struct arena *arena = current;
	union header *header;
	if (size > SIZE_MAX / 2)
		return NULL;
	size = (size + unit - 1) / unit * unit + unit;
	bool fits = arena && size <= arena->size - arena->used;
	if (fits) {
		header = (union header *)((char *)arena->bytes + arena->used);
		arena->used += size;
	} else {
		header = malloc(size);
		failed = failed || !header;
		if (!header)
			return NULL;
	}
	header->separate = !fits;
	return header + 1;
}

static void release(void *piece)
{
	union header *header = piece;
	if (piece && header[-1].separate)
		free(header - 1);
}

void gnp_json_memory_init(void)
{
	json_set_alloc_funcs(allocate, release);
	installed = true;
}

size_t gnp_json_memory_size(size_t size)
{
	return BYTES_FOR_ALL + BYTES_A_CHARACTER * size;
}

json_t *gnp_json_memory_load(const char *text, size_t size, void **memory, bool *exhausted, json_error_t *reason)
{
	struct arena *arena = NULL;
	json_t *root = NULL;
	*memory = NULL;
	*exhausted = false;
	if (installed) {
		size_t bytes = gnp_json_memory_size(size);
		arena = malloc(sizeof *arena + bytes);
		*exhausted = !arena;
		if (!arena)
			return NULL;
		arena->size = bytes;
		arena->used = 0;
	}
	current = arena;
	failed = false;
	root = json_loadb(text, size, JSON_REJECT_DUPLICATES, reason);
	current = NULL;
	if (failed) {
		json_decref(root);
		root = NULL;
		*exhausted = true;
	}
	if (root)
		*memory = arena;
	else
		free(arena);
	return root;
}
