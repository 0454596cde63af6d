#include "core/base/scratch.h"

#include <stdlib.h>

#include "core/base/memory.h"

enum { ALIGNMENT = 64, BLOCKS_MAX = 40 };
static const size_t first_block = 256 * 1024;

/* Blocks double in size, so a handful serves any demand and none ever moves. */
struct gnp_scratch {
	size_t blocks; /* allocated */
	size_t block, used; /* the one being filled, and its bytes taken */
	struct {
		unsigned char *data;
		size_t size;
	} at[BLOCKS_MAX];
};

struct gnp_scratch *gnp_scratch_create(void)
{
	return calloc(1, sizeof(struct gnp_scratch));
}

void gnp_scratch_free(struct gnp_scratch *scratch)
{
	if (!scratch)
		return;
	for (size_t i = 0; i < scratch->blocks; i++)
		free(scratch->at[i].data);
	free(scratch);
}

static void *take_from_next_block(struct gnp_scratch *scratch, size_t bytes)
{
	size_t next = scratch->blocks ? scratch->block + 1 : 0;
	while (next < scratch->blocks && scratch->at[next].size < bytes)
		next++;
	if (next == scratch->blocks) {
		if (next == BLOCKS_MAX)
			return NULL;
		size_t size = next ? 2 * scratch->at[next - 1].size : first_block;
		if (size < bytes)
			size = bytes;
		unsigned char *data = aligned_alloc(ALIGNMENT, size);
		if (!data)
			return NULL;
		scratch->at[next].data = data;
		scratch->at[next].size = size;
		scratch->blocks++;
	}
	scratch->block = next;
	scratch->used = bytes;
	return scratch->at[next].data;
}

void *gnp_scratch_take(struct gnp_scratch *scratch, size_t count, size_t size)
{
	size_t bytes;
	if (!gnp_size_multiply(count, size, &bytes) || bytes > (size_t)1 << 46)
		return NULL;
	bytes = (bytes + ALIGNMENT) / ALIGNMENT * ALIGNMENT;
	if (scratch->blocks && scratch->at[scratch->block].size - scratch->used >= bytes) {
		void *data = scratch->at[scratch->block].data + scratch->used;
		scratch->used += bytes;
		return data;
	}
	return take_from_next_block(scratch, bytes);
}

struct gnp_scratch_mark gnp_scratch_mark(const struct gnp_scratch *scratch)
{
	return (struct gnp_scratch_mark){scratch->block, scratch->used};
}

void gnp_scratch_release(struct gnp_scratch *scratch, struct gnp_scratch_mark mark)
{
	scratch->block = mark.block;
	scratch->used = mark.used;
}
