#include "core/solids/solid_crease.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"

enum { CHUNK = 4096 };
static const uint64_t STREAM = UINT64_C(0x31) << 56;

/* ---- Lists of strokes ---- */

struct list {
	size_t count, capacity;
	struct gnp_solid_stroke *stroke;
};

static gnp_status list_add(struct list *list, const double middle[3], const double half[3], struct gnp_error *error)
{
	if (list->count == list->capacity) {
		size_t capacity = list->capacity ? 2 * list->capacity : 64, bytes;
		struct gnp_solid_stroke *stroke = NULL;
		if (gnp_size_multiply(capacity, sizeof *stroke, &bytes))
			stroke = realloc(list->stroke, bytes);
		if (!stroke)
			return gnp_no_memory("solid", capacity, "strokes", error);
		list->stroke = stroke;
		list->capacity = capacity;
	}
	struct gnp_solid_stroke *stroke = &list->stroke[list->count++];
	memcpy(stroke->middle, middle, sizeof stroke->middle);
	memcpy(stroke->half, half, sizeof stroke->half);
	return GNP_OK;
}

/* ---- Along curves ---- */

static void curve_point(const struct gnp_solid_body *body, const struct gnp_solid_curve *curve, double t, double x[3])
{
	double p[2] = {curve->p[0] + t * (curve->q[0] - curve->p[0]), curve->p[1] + t * (curve->q[1] - curve->p[1])};
	if (curve->circle) {
		p[0] = curve->p[0] + curve->q[0] * cos(2 * M_PI * t);
		p[1] = curve->p[1] + curve->q[0] * sin(2 * M_PI * t);
	}
	gnp_solid_face_point(&body->face[curve->face], p, x);
}

static void middle_and_half(const double a[3], const double b[3], double middle[3], double half[3])
{
	for (int i = 0; i < 3; i++) {
		middle[i] = (a[i] + b[i]) / 2;
		half[i] = (b[i] - a[i]) / 2;
	}
}

static double curve_length(const struct gnp_solid_body *body, const struct gnp_solid_curve *curve)
{
	enum { PIECES = 256 };
	double length = 0, last[3], next[3], middle[3], half[3];
	curve_point(body, curve, 0, last);
	for (int i = 1; i <= PIECES; i++) {
		curve_point(body, curve, (double)i / PIECES, next);
		middle_and_half(last, next, middle, half);
		length += 2 * sqrt(gnp_dot(half, half));
		memcpy(last, next, sizeof last);
	}
	return length;
}

/* Eight strokes a spacing. */
static gnp_status curve_cover(const struct gnp_solid_body *body, const struct gnp_solid_curve *curve, double spacing,
                              struct list *list, struct gnp_error *error)
{
	size_t pieces = (size_t)fmin(1e7, ceil(8 * curve_length(body, curve) / spacing)) + 1;
	const struct gnp_solid_face *face = &body->face[curve->face];
	double last[3], next[3], middle[3], half[3];
	gnp_status status = GNP_OK;
	curve_point(body, curve, 0, last);
	for (size_t i = 1; status == GNP_OK && i <= pieces; i++) {
		curve_point(body, curve, (double)i / (double)pieces, next);
		middle_and_half(last, next, middle, half);
		if (gnp_solid_body_side(body, face, middle))
			status = list_add(list, middle, half, error);
		memcpy(last, next, sizeof last);
	}
	return status;
}

/* ---- Where faces of primitives cross ---- */

struct search {
	const struct gnp_solid_body *body;
	double spacing;
	uint64_t seed;
	size_t draws;
	struct list *lists; /* one a chunk */
};

static const double NEAR = 1.5, REACH = 0.2; /* in spacings: where points are pulled from; half a stroke's length */

/* Moves x by the shortest step to where both levels vanish to first order. False where the surfaces are nearly
 * tangent. */
static bool pull_step(const struct gnp_solid_face *a, const struct gnp_solid_face *b, double x[3], double g[3],
                      double h[3], double *miss)
{
	double u = gnp_solid_face_level(a, x, g), v = gnp_solid_face_level(b, x, h);
	double gg = gnp_dot(g, g), gh = gnp_dot(g, h), hh = gnp_dot(h, h), determinant = gg * hh - gh * gh;
	*miss = fabs(u) + fabs(v);
	if (!(determinant > 1e-4 * gg * hh))
		return false;
	double s = (u * hh - v * gh) / determinant, t = (v * gg - u * gh) / determinant;
	for (int i = 0; i < 3; i++)
		x[i] -= s * g[i] + t * h[i];
	return true;
}

static bool pull(const struct gnp_solid_face *a, const struct gnp_solid_face *b, double x[3], double g[3], double h[3])
{
	double miss;
	for (int step = 0; step < 12; step++) {
		if (!pull_step(a, b, x, g, h, &miss))
			return false;
		if (miss < 1e-11)
			return true;
	}
	return false;
}

static gnp_status pair_try(const struct search *search, const struct gnp_solid_face *a, const struct gnp_solid_face *b,
                           const double start[3], struct list *list, struct gnp_error *error)
{
	double x[3] = {start[0], start[1], start[2]}, g[3], h[3], along[3];
	if (!pull(a, b, x, g, h) || !gnp_solid_body_creased(search->body, a, b, x, g, h))
		return GNP_OK;
	gnp_cross(g, h, along);
	double length = sqrt(gnp_dot(along, along));
	for (int i = 0; i < 3; i++)
		along[i] *= REACH * search->spacing / length;
	return list_add(list, x, along, error);
}

static gnp_status draw_try(const struct search *search, size_t i, struct list *list, struct gnp_error *error)
{
	const struct gnp_solid_body *body = search->body;
	struct gnp_random random;
	double p[2], x[3], gradient[3];
	gnp_status status = GNP_OK;
	gnp_random_seed(&random, search->seed, STREAM | i);
	const struct gnp_solid_face *face =
		&body->face[gnp_solid_body_pick(body, ((double)i + gnp_random_uniform(&random)) / (double)search->draws)];
	if (face->primitive < 0 || !gnp_solid_face_draw(face, &random, p))
		return GNP_OK;
	gnp_solid_face_point(face, p, x);
	for (int q = 0; q < body->primitives; q++)
		for (int h = 0; status == GNP_OK && h < body->primitive[q].halves; h++) {
			const struct gnp_solid_face *other = &body->face[body->primitive[q].half[h]];
			bool itself = q == face->primitive && h == face->half;
			if (!itself && fabs(gnp_solid_face_level(other, x, gradient)) <= NEAR * search->spacing)
				status = pair_try(search, face, other, x, list, error);
		}
	return status;
}

static gnp_status draws_try(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	const struct search *search = context;
	gnp_status status = GNP_OK;
	(void)scratch;
	for (size_t i = begin; status == GNP_OK && i < end; i++)
		status = draw_try(search, i, &search->lists[begin / CHUNK], error);
	return status;
}

static gnp_status lists_join(struct list *lists, size_t count, struct list *all, struct gnp_error *error)
{
	size_t sum = all->count;
	for (size_t l = 0; l < count; l++)
		sum += lists[l].count;
	struct gnp_solid_stroke *stroke = gnp_array_new(sum, sizeof *stroke);
	if (!stroke)
		return gnp_no_memory("solid", sum, "strokes", error);
	if (all->count)
		memcpy(stroke, all->stroke, all->count * sizeof *stroke);
	for (size_t l = 0, made = all->count; l < count; made += lists[l++].count)
		if (lists[l].count)
			memcpy(stroke + made, lists[l].stroke, lists[l].count * sizeof *stroke);
	free(all->stroke);
	*all = (struct list){sum, sum, stroke};
	return GNP_OK;
}

/* Four draws for the area of a point: 12 to 24 strokes a spacing of crease. */
static gnp_status crossings_cover(const struct gnp_solid_body *body, double spacing, uint64_t seed,
                                  struct gnp_pool *pool, struct gnp_task *task, struct list *all,
                                  struct gnp_error *error)
{
	double draws = fmin(1e9, ceil(4 * body->area[body->faces] / (spacing * spacing)) + 256);
	struct search search = {.body = body, .spacing = spacing, .seed = seed, .draws = (size_t)draws};
	size_t chunks = (search.draws + CHUNK - 1) / CHUNK;
	search.lists = gnp_array_zero(chunks, sizeof *search.lists);
	if (!search.lists)
		return gnp_no_memory("solid", chunks, "lists", error);
	gnp_status status = gnp_pool_run(pool, task, search.draws, CHUNK, draws_try, &search, error);
	if (status == GNP_OK)
		status = lists_join(search.lists, chunks, all, error);
	for (size_t l = 0; l < chunks; l++)
		free(search.lists[l].stroke);
	free(search.lists);
	return status;
}

/* ---- The tree ---- */

/* Bounds of whole strokes, which the middle one of them gets; the axis along which they reach farthest. */
static int bound(struct gnp_solid_stroke *stroke, size_t count)
{
	int widest = 0;
	double width[3];
	for (int c = 0; c < 3; c++) {
		double low = INFINITY, high = -INFINITY;
		for (size_t i = 0; i < count; i++) {
			low = fmin(low, stroke[i].middle[c] - fabs(stroke[i].half[c]));
			high = fmax(high, stroke[i].middle[c] + fabs(stroke[i].half[c]));
		}
		stroke[count / 2].low[c] = low;
		stroke[count / 2].high[c] = high;
		width[c] = high - low;
		widest = width[c] > width[widest] ? c : widest;
	}
	return widest;
}

static void stroke_swap(struct gnp_solid_stroke *a, struct gnp_solid_stroke *b)
{
	struct gnp_solid_stroke c = *a;
	*a = *b;
	*b = c;
}

/* Reorders so that stroke k has what is not above it before and what is not below it after. */
static void split_at(struct gnp_solid_stroke *stroke, size_t count, size_t k, int axis)
{
	size_t low = 0, high = count - 1;
	while (low < high) {
		double pivot = stroke[low + (high - low) / 2].middle[axis];
		size_t i = low, j = high;
		for (;;) {
			while (stroke[i].middle[axis] < pivot)
				i++;
			while (stroke[j].middle[axis] > pivot)
				j--;
			if (i >= j)
				break;
			stroke_swap(&stroke[i++], &stroke[j--]);
		}
		/* [low, i) is at most the pivot, (j, high] at least; where both stop at one item, it is the pivot */
		if (k <= j)
			high = j;
		else
			low = j + 1;
	}
}

enum { LEAF = 6 };

/* The middle stroke carries the bounds of all; what is before and after it is split further. */
static void tree_make(struct gnp_solid_stroke *stroke, size_t count)
{
	while (count > LEAF) {
		size_t middle = count / 2;
		split_at(stroke, count, middle, bound(stroke, count));
		bound(stroke, count);
		tree_make(stroke, middle);
		stroke += middle + 1;
		count -= middle + 1;
	}
	if (count)
		bound(stroke, count);
}

/* Squared. */
static double stroke_distance(const struct gnp_solid_stroke *stroke, const double x[3])
{
	double d[3] = {x[0] - stroke->middle[0], x[1] - stroke->middle[1], x[2] - stroke->middle[2]};
	double square = gnp_dot(stroke->half, stroke->half), t = square > 0 ? gnp_dot(d, stroke->half) / square : 0;
	t = fmin(1, fmax(-1, t));
	for (int i = 0; i < 3; i++)
		d[i] -= t * stroke->half[i];
	return gnp_dot(d, d);
}

/* Squared, to the bounds of count strokes. */
static double bounds_distance(const struct gnp_solid_stroke *stroke, size_t count, const double x[3])
{
	double sum = 0;
	if (!count)
		return INFINITY;
	stroke += count / 2;
	for (int c = 0; c < 3; c++) {
		double d = fmax(0, fmax(stroke->low[c] - x[c], x[c] - stroke->high[c]));
		sum += d * d;
	}
	return sum;
}

/* best: squared. */
static void nearest(const struct gnp_solid_stroke *stroke, size_t count, const double x[3], double *best)
{
	if (count <= LEAF) {
		for (size_t i = 0; i < count; i++)
			*best = fmin(*best, stroke_distance(&stroke[i], x));
		return;
	}
	size_t before = count / 2, after = count - before - 1;
	double near = bounds_distance(stroke, before, x), far = bounds_distance(stroke + before + 1, after, x);
	bool swapped = far < near;
	*best = fmin(*best, stroke_distance(&stroke[before], x));
	for (int turn = 0; turn < 2; turn++) {
		bool second = swapped != (turn == 1);
		if ((second ? far : near) < *best)
			nearest(second ? stroke + before + 1 : stroke, second ? after : before, x, best);
	}
}

/* ---- All ---- */

gnp_status gnp_solid_creases_create(const struct gnp_solid_body *body, double spacing, uint64_t seed,
                                    struct gnp_pool *pool, struct gnp_task *task, struct gnp_solid_creases *out,
                                    struct gnp_error *error)
{
	struct list all = {0};
	gnp_status status = GNP_OK;
	for (int c = 0; status == GNP_OK && c < body->curves; c++)
		status = curve_cover(body, &body->curve[c], spacing, &all, error);
	if (status == GNP_OK && body->primitives)
		status = crossings_cover(body, spacing, seed, pool, task, &all, error);
	if (status != GNP_OK) {
		free(all.stroke);
		return status;
	}
	tree_make(all.stroke, all.count);
	*out = (struct gnp_solid_creases){.count = all.count, .stroke = all.stroke};
	return GNP_OK;
}

void gnp_solid_creases_clear(struct gnp_solid_creases *creases)
{
	free(creases->stroke);
	*creases = (struct gnp_solid_creases){0};
}

double gnp_solid_creases_distance(const struct gnp_solid_creases *creases, const double x[3])
{
	double best = INFINITY;
	nearest(creases->stroke, creases->count, x, &best);
	return sqrt(best);
}
