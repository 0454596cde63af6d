#include "core/cloud/cover.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cloud/patch.h"

enum { BLOCK = 2048, NOT_SERVED = 0, SERVED = 1 };

void gnp_cover_clear(struct gnp_cover *cover)
{
	free(cover->centre);
	free(cover->start);
	free(cover->member);
	*cover = (struct gnp_cover){0};
}

static gnp_status allocate(size_t points, struct gnp_cover *cover, struct gnp_error *error)
{
	*cover = (struct gnp_cover){.centre = gnp_array_new(points, sizeof *cover->centre),
	                            .start = gnp_array_new(points + 1, sizeof *cover->start),
	                            .member = gnp_array_new(points, sizeof *cover->member)};
	if (cover->centre && cover->start && cover->member)
		return GNP_OK;
	gnp_cover_clear(cover);
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "cover: no memory for %zu points", points);
}

gnp_status gnp_cover_all(size_t points, struct gnp_cover *out, struct gnp_error *error)
{
	struct gnp_cover cover;
	gnp_status status = allocate(points, &cover, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < points; i++) {
		cover.centre[i] = cover.member[i] = (uint32_t)i;
		cover.start[i] = i;
	}
	cover.start[points] = points;
	cover.count = points;
	*out = cover;
	return GNP_OK;
}

struct greedy {
	const struct gnp_neighbors *neighbors;
	const double *points;
	const struct gnp_cover_rule *rule;
	struct gnp_cover *cover;
	size_t *patches; /* (blocks) patches found in each; their rows stand at the block's first point */
};

static bool may_serve(const struct gnp_cover_rule *rule, size_t centre, size_t point)
{
	return !rule->normals || gnp_same_sheet(rule->normals + 3 * centre, rule->normals + 3 * point);
}

static gnp_status cover_block(void *context, size_t first, size_t last, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct greedy *greedy = context;
	struct gnp_cover *cover = greedy->cover;
	unsigned char *state = gnp_scratch_take(scratch, last - first, 1);
	uint32_t *index = gnp_scratch_take(scratch, greedy->rule->fixed, sizeof *index);
	double *distance = gnp_scratch_take(scratch, greedy->rule->fixed, sizeof *distance);
	if (!state || !index || !distance)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "cover: no memory for a block");
	memset(state, NOT_SERVED, last - first);
	size_t patches = 0, members = first;
	for (size_t i = first; i < last; i++) {
		if (state[i - first] == SERVED)
			continue;
		const struct gnp_cover_rule *rule = greedy->rule;
		size_t serve = rule->served ? rule->served(rule->context, (uint32_t)i) : rule->fixed;
		gnp_status status = GNP_OK;
		if (serve > 1)
			status = gnp_neighbors_knn(greedy->neighbors, greedy->points + 3 * i, 1, serve, index, distance, scratch, error);
		if (status != GNP_OK)
			return status;
		cover->centre[first + patches] = (uint32_t)i;
		cover->start[first + patches] = members;
		patches++;
		state[i - first] = SERVED;
		cover->member[members++] = (uint32_t)i;
		for (size_t j = 0; serve > 1 && j < serve; j++)
			if (index[j] >= first && index[j] < last && state[index[j] - first] == NOT_SERVED &&
			    may_serve(rule, i, index[j])) {
				state[index[j] - first] = SERVED;
				cover->member[members++] = index[j];
			}
	}
	greedy->patches[first / BLOCK] = patches;
	return GNP_OK;
}

gnp_status gnp_cover_greedy(const struct gnp_neighbors *neighbors, const double *points, size_t count,
                            const struct gnp_cover_rule *rule, struct gnp_pool *pool, struct gnp_task *task, struct gnp_cover *out, struct gnp_error *error)
{
	struct gnp_cover cover;
	size_t blocks = (count + BLOCK - 1) / BLOCK;
	gnp_status status = allocate(count, &cover, error);
	if (status != GNP_OK)
		return status;
	struct greedy greedy = {.neighbors = neighbors, .points = points, .rule = rule, .cover = &cover,
	                        .patches = gnp_array_zero(blocks, sizeof *greedy.patches)};
	status = greedy.patches ? gnp_pool_run(pool, task, count, BLOCK, cover_block, &greedy, error)
	                        : gnp_error_set(error, GNP_OUT_OF_MEMORY, "cover: no memory for %zu blocks", blocks);
	if (status != GNP_OK) {
		free(greedy.patches);
		gnp_cover_clear(&cover);
		return status;
	}
	for (size_t b = 0; b < blocks; b++) {
		memmove(cover.centre + cover.count, cover.centre + b * BLOCK, greedy.patches[b] * sizeof *cover.centre);
		memmove(cover.start + cover.count, cover.start + b * BLOCK, greedy.patches[b] * sizeof *cover.start);
		cover.count += greedy.patches[b];
	}
	cover.start[cover.count] = count;
	free(greedy.patches);
	*out = cover;
	return GNP_OK;
}
