#include "core/shapes/eliminate.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

/* A candidate, sorted by row (a square of the (y, z) plane, as wide as the reach), then by x. */
struct entry {
	float x[3];
	uint32_t index; /* the caller's */
};

struct elimination {
	size_t count, wanted;
	const float *points;
	float reach;    /* 2 r_max: candidates further apart do not see each other */
	float shortest; /* 2 r_min: closer ones count as this far */
	float low[3];
	size_t rows[2];        /* along y, z */
	size_t *row_start;     /* (rows[0] rows[1] + 1) */
	struct entry *entries; /* (count) */
	struct list *lists;    /* (count / LIST rounded up) */
	float *weight;         /* (count) -INFINITY once eliminated */
	size_t slabs;
	struct slab *slab;     /* (slabs) */
	float threshold;       /* of the sweep under way */
};

enum { LIST = 4096 };

/* Neighbours of LIST consecutive entries. */
struct list {
	uint32_t start[LIST + 1];
	uint32_t *neighbor; /* (start[LIST]) positions in entries */
};

/* Entries [begin, end) of a few neighbouring layers of rows. */
struct slab {
	size_t begin, end;
	size_t heavy;  /* those that reach the threshold */
	float largest; /* weight, of those left */
};

static void elimination_clear(struct elimination *e)
{
	free(e->row_start);
	free(e->entries);
	for (size_t l = 0; e->lists && l * LIST < e->count; l++)
		free(e->lists[l].neighbor);
	free(e->lists);
	free(e->weight);
	free(e->slab);
}

/* ---- Rows ---- */

static size_t row_of(const struct elimination *e, const float *x, size_t axis)
{
	size_t row = (size_t)((x[axis] - e->low[axis]) / e->reach);
	return row < e->rows[axis - 1] ? row : e->rows[axis - 1] - 1;
}

static size_t row_index(const struct elimination *e, const float *x)
{
	return row_of(e, x, 2) * e->rows[0] + row_of(e, x, 1);
}

static int entry_compare(const void *a, const void *b)
{
	const struct entry *p = a, *q = b;
	if (p->x[0] != q->x[0])
		return p->x[0] < q->x[0] ? -1 : 1;
	return p->index < q->index ? -1 : p->index > q->index;
}

static gnp_status rows_sort(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct elimination *e = context;
	(void)scratch;
	(void)error;
	for (size_t row = begin; row < end; row++)
		qsort(e->entries + e->row_start[row], e->row_start[row + 1] - e->row_start[row], sizeof *e->entries, entry_compare);
	return GNP_OK;
}

static void bounds_find(struct elimination *e)
{
	float high[3];
	for (int c = 0; c < 3; c++) {
		e->low[c] = high[c] = e->points[c];
		for (size_t i = 1; i < e->count; i++) {
			e->low[c] = fminf(e->low[c], e->points[3 * i + (size_t)c]);
			high[c] = fmaxf(high[c], e->points[3 * i + (size_t)c]);
		}
	}
	for (int c = 0; c < 2; c++)
		e->rows[c] = (size_t)((high[c + 1] - e->low[c + 1]) / e->reach) + 1;
}

/* Counting sort into rows, then each row by x. */
static gnp_status entries_order(struct elimination *e, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	bounds_find(e);
	size_t rows = e->rows[0] * e->rows[1];
	e->row_start = gnp_array_zero(rows + 1, sizeof *e->row_start);
	e->entries = gnp_array_new(e->count, sizeof *e->entries);
	if (!e->row_start || !e->entries)
		return gnp_no_memory("sample", e->count, "candidates", error);
	for (size_t i = 0; i < e->count; i++)
		e->row_start[row_index(e, e->points + 3 * i)]++;
	for (size_t row = 0, sum = 0; row <= rows; row++) {
		sum += e->row_start[row];
		e->row_start[row] = sum; /* the row's end; filling from the back turns it into its start */
	}
	for (size_t i = e->count; i-- > 0;) {
		struct entry *entry = &e->entries[--e->row_start[row_index(e, e->points + 3 * i)]];
		memcpy(entry->x, e->points + 3 * i, sizeof entry->x);
		entry->index = (uint32_t)i;
	}
	return gnp_pool_run(pool, task, rows, 64, rows_sort, e, error);
}

/* ---- Neighbours and weights ---- */

/* First entry of a row with x >= value. */
static size_t row_lower(const struct elimination *e, size_t row, float value)
{
	size_t low = e->row_start[row], high = e->row_start[row + 1];
	while (low < high) {
		size_t middle = low + (high - low) / 2;
		if (e->entries[middle].x[0] < value)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static float distance(const float *a, const float *b)
{
	float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	return sqrtf(x * x + y * y + z * z);
}

/* Neighbours of entry i, at most `most` of them written; returns how many there are. */
static size_t neighbors_find(const struct elimination *e, size_t i, uint32_t *neighbor, size_t most)
{
	const float *x = e->entries[i].x;
	size_t y = row_of(e, x, 1), z = row_of(e, x, 2), found = 0;
	for (size_t w = z ? z - 1 : 0; w <= z + 1 && w < e->rows[1]; w++)
		for (size_t v = y ? y - 1 : 0; v <= y + 1 && v < e->rows[0]; v++) {
			size_t row = w * e->rows[0] + v, end = e->row_start[row + 1];
			for (size_t j = row_lower(e, row, x[0] - e->reach); j < end && e->entries[j].x[0] <= x[0] + e->reach; j++) {
				if (j == i || distance(x, e->entries[j].x) >= e->reach)
					continue;
				if (found < most)
					neighbor[found] = (uint32_t)j;
				found++;
			}
		}
	return found;
}

/* (1 - d / 2 r_max)^8, symmetric in its points to the last bit. */
static float pair_weight(const struct elimination *e, size_t i, size_t j)
{
	float d = distance(e->entries[i].x, e->entries[j].x);
	float w = 1 - (d > e->shortest ? d : e->shortest) / e->reach;
	w = w > 0 ? w : 0;
	w *= w;
	w *= w;
	return w * w;
}

/* Room for `more` further neighbours after `used`. */
static bool list_reserve(struct list *list, size_t used, size_t more, size_t *capacity)
{
	if (used + more <= *capacity)
		return true;
	size_t larger = 2 * (used + more), bytes;
	uint32_t *neighbor = NULL;
	if (larger <= UINT32_MAX && gnp_size_multiply(larger, sizeof *neighbor, &bytes))
		neighbor = realloc(list->neighbor, bytes);
	if (!neighbor)
		return false;
	list->neighbor = neighbor;
	*capacity = larger;
	return true;
}

/* The neighbours of entries [begin, end) of one list, and their weights. */
static gnp_status neighbors_list(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	enum { USUAL = 32 };
	struct elimination *e = context;
	struct list *list = &e->lists[begin / LIST];
	size_t used = 0, capacity = 0;
	(void)scratch;
	list->start[0] = 0;
	for (size_t i = begin; i < end; i++) {
		if (!list_reserve(list, used, USUAL, &capacity))
			return gnp_no_memory("sample", e->count, "candidates", error);
		size_t found = neighbors_find(e, i, list->neighbor + used, capacity - used);
		if (found > capacity - used) {
			if (!list_reserve(list, used, found, &capacity))
				return gnp_no_memory("sample", e->count, "candidates", error);
			neighbors_find(e, i, list->neighbor + used, found);
		}
		float sum = 0;
		for (size_t n = used; n < used + found; n++)
			sum += pair_weight(e, i, list->neighbor[n]);
		e->weight[i] = sum;
		used += found;
		list->start[i - begin + 1] = (uint32_t)used;
	}
	return GNP_OK;
}

static gnp_status neighbors_make(struct elimination *e, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	e->lists = gnp_array_zero((e->count + LIST - 1) / LIST, sizeof *e->lists);
	e->weight = gnp_array_new(e->count, sizeof *e->weight);
	if (!e->lists || !e->weight)
		return gnp_no_memory("sample", e->count, "candidates", error);
	return gnp_pool_run(pool, task, e->count, LIST, neighbors_list, e, error);
}

/* ---- Sweeps: all entries of at least a threshold go in the order they lie in memory, then the threshold falls by a step.
 * Within a step this is not the order of weights, but memory is read as it lies; and a removal reaches no further than the
 * next layer of rows, so that every other slab may be swept at once. ---- */

/* Takes the entry away and relieves its neighbours. */
static void entry_remove(struct elimination *e, uint32_t i)
{
	const struct list *list = &e->lists[i / LIST];
	e->weight[i] = -INFINITY;
	for (size_t n = list->start[i % LIST]; n < list->start[i % LIST + 1]; n++) {
		uint32_t j = list->neighbor[n];
		if (e->weight[j] != -INFINITY)
			e->weight[j] -= pair_weight(e, i, j);
	}
}

static gnp_status slabs_make(struct elimination *e, struct gnp_error *error)
{
	enum { LAYERS = 4 }; /* two would keep the slabs on both sides apart */
	e->slabs = (e->rows[1] + LAYERS - 1) / LAYERS;
	e->slab = gnp_array_zero(e->slabs, sizeof *e->slab);
	if (!e->slab)
		return gnp_no_memory("sample", e->count, "candidates", error);
	for (size_t s = 0; s < e->slabs; s++) {
		size_t end = (s + 1) * LAYERS < e->rows[1] ? (s + 1) * LAYERS : e->rows[1];
		e->slab[s].begin = e->row_start[s * LAYERS * e->rows[0]];
		e->slab[s].end = e->row_start[end * e->rows[0]];
	}
	return GNP_OK;
}

static gnp_status slabs_survey(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct elimination *e = context;
	(void)scratch;
	(void)error;
	for (size_t s = begin; s < end; s++) {
		struct slab *slab = &e->slab[s];
		slab->heavy = 0;
		slab->largest = -INFINITY;
		for (size_t i = slab->begin; i < slab->end; i++) {
			slab->heavy += e->weight[i] >= e->threshold;
			slab->largest = e->weight[i] > slab->largest ? e->weight[i] : slab->largest;
		}
	}
	return GNP_OK;
}

/* Removes what reaches the threshold from [begin, end), at most `most` entries; returns how many. */
static size_t range_sweep(struct elimination *e, size_t begin, size_t end, size_t most)
{
	size_t removed = 0;
	for (size_t i = begin; i < end && removed < most; i++)
		if (e->weight[i] >= e->threshold) {
			entry_remove(e, (uint32_t)i);
			removed++;
		}
	return removed;
}

static gnp_status even_slabs_sweep(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                   struct gnp_error *error)
{
	struct elimination *e = context;
	(void)scratch;
	(void)error;
	for (size_t s = begin; s < end; s++)
		e->slab[2 * s].heavy = range_sweep(e, e->slab[2 * s].begin, e->slab[2 * s].end, SIZE_MAX);
	return GNP_OK;
}

static gnp_status odd_slabs_sweep(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                  struct gnp_error *error)
{
	struct elimination *e = context;
	(void)scratch;
	(void)error;
	for (size_t s = begin; s < end; s++)
		e->slab[2 * s + 1].heavy = range_sweep(e, e->slab[2 * s + 1].begin, e->slab[2 * s + 1].end, SIZE_MAX);
	return GNP_OK;
}

static size_t heavy_sum(const struct elimination *e)
{
	size_t sum = 0;
	for (size_t s = 0; s < e->slabs; s++)
		sum += e->slab[s].heavy;
	return sum;
}

/* The next threshold: a step down, or more where nothing weighs that much. */
static gnp_status threshold_lower(struct elimination *e, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	static const float step = 0.957603f; /* 2^(-1/16): half a hundredth in distance */
	float largest = -INFINITY;
	e->threshold *= step;
	gnp_status status = gnp_pool_run(pool, task, e->slabs, 1, slabs_survey, e, error);
	if (status != GNP_OK || heavy_sum(e))
		return status;
	for (size_t s = 0; s < e->slabs; s++)
		largest = e->slab[s].largest > largest ? e->slab[s].largest : largest;
	e->threshold = largest > 1e-30f ? largest * step : -FLT_MAX;
	return gnp_pool_run(pool, task, e->slabs, 1, slabs_survey, e, error);
}

/* Sweeps in parallel as long as the last one cannot take too many. */
static gnp_status eliminate(struct elimination *e, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	size_t alive = e->count;
	gnp_status status = slabs_make(e, error);
	e->threshold = FLT_MAX;
	while (status == GNP_OK && alive > e->wanted) {
		status = threshold_lower(e, pool, task, error);
		if (status == GNP_OK && alive - heavy_sum(e) < e->wanted) {
			alive -= range_sweep(e, 0, e->count, alive - e->wanted);
			continue;
		}
		if (status == GNP_OK)
			status = gnp_pool_run(pool, task, (e->slabs + 1) / 2, 1, even_slabs_sweep, e, error);
		if (status == GNP_OK)
			status = gnp_pool_run(pool, task, e->slabs / 2, 1, odd_slabs_sweep, e, error);
		if (status == GNP_OK)
			alive -= heavy_sum(e);
	}
	return status;
}

static int index_compare(const void *a, const void *b)
{
	uint32_t p = *(const uint32_t *)a, q = *(const uint32_t *)b;
	return p < q ? -1 : p > q;
}

static void kept_list(const struct elimination *e, uint32_t *kept)
{
	size_t made = 0;
	for (size_t i = 0; i < e->count; i++)
		if (e->weight[i] != -INFINITY)
			kept[made++] = e->entries[i].index;
	qsort(kept, made, sizeof *kept, index_compare);
}

gnp_status gnp_eliminate(const float *points, size_t count, size_t wanted, double area, struct gnp_pool *pool,
                         struct gnp_task *task, uint32_t *kept, struct gnp_error *error)
{
	struct elimination e = {.count = count, .wanted = wanted, .points = points};
	double r_max = sqrt(area / (2 * sqrt(3) * (double)wanted));
	double r_min = r_max * 0.65 * (1 - pow((double)wanted / (double)count, 1.5));
	e.reach = (float)(2 * r_max);
	e.shortest = (float)(2 * r_min);
	gnp_status status = entries_order(&e, pool, task, error);
	if (status == GNP_OK)
		status = neighbors_make(&e, pool, task, error);
	if (status == GNP_OK)
		status = eliminate(&e, pool, task, error);
	if (status == GNP_OK)
		kept_list(&e, kept);
	elimination_clear(&e);
	return status;
}
