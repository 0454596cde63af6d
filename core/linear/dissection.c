#include "core/linear/dissection.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

enum { LEAF = 48, SHARED_LEVELS = 6 };
enum { SEPARATED = 2 }; /* sides are 0 and 1 */

/* A set of points that only separators join to others: member[begin, end). */
struct part {
	size_t begin, end;
};

struct work {
	const struct gnp_csr *pattern;
	const double *points;
	uint32_t *member;    /* (n) the order in the making */
	unsigned char *side; /* (n) of its part's cut, or SEPARATED */
	struct part *parts;  /* those to cut now */
	struct part *halves; /* two of each */
};

struct key {
	double along;
	uint32_t point;
};

static bool before(struct key a, struct key b)
{
	return a.along != b.along ? a.along < b.along : a.point < b.point;
}

static void swap(struct key *a, struct key *b)
{
	struct key c = *a;
	*a = *b;
	*b = c;
}

/* Hoare's selection: the `half` smallest come first. */
static void select_first(struct key *keys, size_t count, size_t half)
{
	size_t low = 0, high = count - 1;
	while (low < high) {
		struct key pivot = keys[low + (high - low) / 2];
		size_t i = low, j = high;
		for (;; i++, j--) {
			while (before(keys[i], pivot))
				i++;
			while (before(pivot, keys[j]))
				j--;
			if (i >= j)
				break;
			swap(&keys[i], &keys[j]);
		}
		if (half <= j)
			high = j;
		else
			low = j + 1;
	}
}

static bool touches(const struct work *work, uint32_t point, int side)
{
	const struct gnp_csr *pattern = work->pattern;
	for (size_t e = pattern->row_offsets[point]; e < pattern->row_offsets[point + 1]; e++)
		if (work->side[pattern->column[e]] == side)
			return true;
	return false;
}

/* Halves the points along an axis; returns how many of the smaller shore there are and which side it is on. */
static size_t halve(const struct work *work, const struct part *part, int axis, struct key *keys, int *shore)
{
	size_t count = part->end - part->begin, half = count / 2, touching[2] = {0, 0};
	for (size_t i = 0; i < count; i++) {
		uint32_t point = work->member[part->begin + i];
		keys[i] = (struct key){work->points[3 * (size_t)point + axis], point};
	}
	select_first(keys, count, half);
	for (size_t i = 0; i < count; i++)
		work->side[keys[i].point] = i >= half;
	for (size_t i = 0; i < count; i++)
		touching[i >= half] += touches(work, keys[i].point, i < half);
	*shore = touching[1] < touching[0];
	return touching[*shore];
}

/* Members anew: one side, the other, and the shore between them, which is the separator. */
static void separate(struct work *work, const struct part *part, int shore, uint32_t *separator, struct part halves[2])
{
	size_t separated = 0, kept = part->begin;
	for (size_t i = part->begin; i < part->end; i++) {
		uint32_t point = work->member[i];
		if (work->side[point] == shore && touches(work, point, !shore))
			separator[separated++] = point;
		else
			work->member[kept++] = point;
	}
	memcpy(work->member + kept, separator, separated * sizeof *separator);
	for (size_t i = kept; i < part->end; i++)
		work->side[work->member[i]] = SEPARATED;
	size_t first = 0, second = 0;
	for (size_t i = part->begin; i < kept; i++) {
		uint32_t point = work->member[i];
		if (work->side[point])
			separator[second++] = point;
		else
			work->member[part->begin + first++] = point;
	}
	memcpy(work->member + part->begin + first, separator, second * sizeof *separator);
	halves[0] = (struct part){part->begin, part->begin + first};
	halves[1] = (struct part){part->begin + first, part->end - separated};
}

static gnp_status cut(struct work *work, const struct part *part, struct part halves[2], struct gnp_scratch *scratch,
                      struct gnp_error *error)
{
	size_t count = part->end - part->begin, fewest = count;
	halves[0] = halves[1] = (struct part){part->end, part->end};
	if (count <= LEAF)
		return GNP_OK;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct key *keys = gnp_scratch_take(scratch, count, sizeof *keys);
	uint32_t *moved = gnp_scratch_take(scratch, count, sizeof *moved);
	if (!keys || !moved)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "ordering: no memory for %zu unknowns", count);
	int best = 0, shore = 0;
	for (int axis = 0; axis < 3; axis++) {
		size_t touching = halve(work, part, axis, keys, &shore);
		if (touching < fewest) {
			fewest = touching;
			best = axis;
		}
	}
	halve(work, part, best, keys, &shore);
	separate(work, part, shore, moved, halves);
	gnp_scratch_release(scratch, mark);
	return GNP_OK;
}

static gnp_status cut_fully(struct work *work, const struct part *part, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	struct part halves[2];
	gnp_status status = cut(work, part, halves, scratch, error);
	for (int h = 0; h < 2 && status == GNP_OK; h++)
		if (halves[h].end > halves[h].begin)
			status = cut_fully(work, &halves[h], scratch, error);
	return status;
}

static gnp_status cut_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	struct work *work = context;
	gnp_status status = GNP_OK;
	for (size_t i = begin; i < end && status == GNP_OK; i++)
		status = cut(work, &work->parts[i], work->halves + 2 * i, scratch, error);
	return status;
}

static gnp_status finish_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	struct work *work = context;
	gnp_status status = GNP_OK;
	for (size_t i = begin; i < end && status == GNP_OK; i++)
		status = cut_fully(work, &work->parts[i], scratch, error);
	return status;
}

/* Level by level while the parts are few, then each on its own. */
static gnp_status dissect(struct work *work, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	size_t count = 1;
	for (int level = 0; level < SHARED_LEVELS && status == GNP_OK; level++, count *= 2) {
		status = gnp_pool_run(pool, NULL, count, 1, cut_chunk, work, error);
		memcpy(work->parts, work->halves, 2 * count * sizeof *work->parts);
		if (status == GNP_OK)
			status = gnp_task_check(task, error);
	}
	return status == GNP_OK ? gnp_pool_run(pool, NULL, count, 1, finish_chunk, work, error) : status;
}

gnp_status gnp_dissection_order(const struct gnp_csr *pattern, const double *points, struct gnp_pool *pool,
                                struct gnp_task *task, uint32_t *order, struct gnp_error *error)
{
	struct part parts[1 << SHARED_LEVELS], halves[2 << SHARED_LEVELS];
	unsigned char *side = gnp_array_zero(pattern->rows, 1);
	if (!side)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "ordering: no memory for %zu unknowns", pattern->rows);
	for (size_t i = 0; i < pattern->rows; i++)
		order[i] = (uint32_t)i;
	struct work work = {pattern, points, order, side, parts, halves};
	parts[0] = (struct part){0, pattern->rows};
	gnp_status status = dissect(&work, pool, task, error);
	free(side);
	return status;
}
