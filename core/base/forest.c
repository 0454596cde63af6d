#include "core/base/forest.h"

#include <stdlib.h>

#include "core/base/memory.h"

bool gnp_forest_init(struct gnp_forest *forest, size_t count)
{
	*forest = (struct gnp_forest){.count = count};
	forest->parent = gnp_array_new(count, sizeof *forest->parent);
	forest->size = gnp_array_new(count, sizeof *forest->size);
	if (!forest->parent || !forest->size)
		return false;
	for (size_t i = 0; i < count; i++) {
		forest->parent[i] = (uint32_t)i << 1;
		forest->size[i] = 1;
	}
	return true;
}

void gnp_forest_clear(struct gnp_forest *forest)
{
	free(forest->parent);
	free(forest->size);
	*forest = (struct gnp_forest){0};
}

uint32_t gnp_forest_find(struct gnp_forest *forest, uint32_t point, bool *flipped)
{
	uint32_t *parent = forest->parent, flip = 0;
	while (parent[point] >> 1 != point) {
		/* Path halving: hang the point on its grandparent. */
		uint32_t above = parent[parent[point] >> 1];
		parent[point] = above ^ (parent[point] & 1);
		flip ^= parent[point] & 1;
		point = parent[point] >> 1;
	}
	*flipped = flip;
	return point;
}

bool gnp_forest_join(struct gnp_forest *forest, uint32_t a, uint32_t b, bool opposite, size_t most)
{
	bool flip_a, flip_b;
	uint32_t root_a = gnp_forest_find(forest, a, &flip_a), root_b = gnp_forest_find(forest, b, &flip_b);
	if (root_a == root_b)
		return false;
	if (forest->size[root_a] < forest->size[root_b]) {
		uint32_t swap = root_a;
		root_a = root_b;
		root_b = swap;
	}
	if (forest->size[root_b] > most)
		return false;
	forest->parent[root_b] = root_a << 1 | (uint32_t)(flip_a ^ flip_b ^ opposite);
	forest->size[root_a] += forest->size[root_b];
	return true;
}
