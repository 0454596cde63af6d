#include "core/cloud/distinct.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

static uint64_t hash(const double p[3])
{
	uint64_t h = 0;
	for (int c = 0; c < 3; c++) {
		double x = p[c] + 0.0; /* -0 and 0 are one place */
		uint64_t bits;
		memcpy(&bits, &x, sizeof bits);
		h = (h ^ bits) * 0x9e3779b97f4a7c15u;
		h ^= h >> 29;
	}
	return h * 0xbf58476d1ce4e5b9u >> 20;
}

static bool equal(const double a[3], const double b[3])
{
	return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

gnp_status gnp_distinct_find(const double *points, size_t count, struct gnp_task *task, uint32_t *which, uint32_t *first,
                             size_t *places, struct gnp_error *error)
{
	enum { CHECK_EVERY = 8192 };
	size_t slots = 16, used = 0;
	while (slots < 2 * count)
		slots *= 2;
	uint32_t *table = gnp_array_zero(slots, sizeof *table); /* place + 1, 0: free */
	if (!table)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "points: no memory to compare %zu", count);
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < count; i++) {
		if (i % CHECK_EVERY == 0 && (status = gnp_task_check(task, error)) != GNP_OK)
			break;
		const double *p = points + 3 * i;
		size_t slot = hash(p) & (slots - 1);
		while (table[slot] && !equal(p, points + 3 * (size_t)first[table[slot] - 1]))
			slot = (slot + 1) & (slots - 1);
		if (!table[slot]) {
			first[used] = (uint32_t)i;
			table[slot] = (uint32_t)++used;
		}
		which[i] = table[slot] - 1;
	}
	free(table);
	if (status == GNP_OK)
		*places = used;
	return status;
}
