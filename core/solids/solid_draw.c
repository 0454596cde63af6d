#include "core/solids/solid_draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/solids/solid_kinds.h"

/* Streams of the seed; the number of the draw or of the attempt is in the low bits. */
static const uint64_t STREAM_DRAW = UINT64_C(0x35) << 56, STREAM_PATTERN = UINT64_C(0x36) << 56;
static const uint64_t STREAM_SURVEY = UINT64_C(0x37) << 56;

enum { BATCH = 1024, TRIAL = 2048 };

/* How draws are placed and thinned out. */
struct pattern {
	int sampling;
	double direction[2][3]; /* across rows, [1] for faces normal to [0]; density changes along [0] */
	double phase[2];        /* of rows and stripes, in periods */
	double period;          /* of rows and stripes */
	double low, extent;     /* of the body along the direction */
	double least;           /* density, as a part of the greatest */
};

struct drawing {
	const struct gnp_solid_body *body;
	uint64_t seed, stream;
	struct pattern pattern;
	size_t count;
	struct gnp_solid_draw *draw; /* (count) side 0: refused */
};

bool gnp_solid_draws_are_spread(int sampling)
{
	return sampling == GNP_SOLID_EVEN || sampling == GNP_SOLID_LINES;
}

void gnp_solid_draws_clear(struct gnp_solid_draws *draws)
{
	free(draws->draw);
	*draws = (struct gnp_solid_draws){0};
}

/* ---- Scan rows ---- */

/* Moves a point of the surface to the plane direction . x = place along the surface. */
static bool row_reach(const struct gnp_solid_face *face, const double direction[3], double place, double x[3])
{
	for (int step = 0; step < 16; step++) {
		double g[3], u = gnp_solid_face_level(face, x, g), v = gnp_dot(direction, x) - place;
		double gg = gnp_dot(g, g), gd = gnp_dot(g, direction), determinant = gg - gd * gd;
		if (fabs(u) + fabs(v) < 1e-12)
			return true;
		if (!(determinant > 1e-3 * gg))
			return false;
		double s = (u - v * gd) / determinant, t = (v * gg - u * gd) / determinant;
		for (int i = 0; i < 3; i++)
			x[i] -= s * g[i] + t * direction[i];
	}
	return false;
}

/* Moves the draw to the nearest row; the second direction's where the first looks along the normal. */
static bool row_move(const struct pattern *pattern, const struct gnp_solid_face *face, struct gnp_solid_draw *draw)
{
	static const double ALONG = 0.8, FAR = 1.5;
	double normal[3], start[3], moved = 0;
	gnp_solid_face_level(face, draw->x, normal);
	double cosine = gnp_dot(normal, pattern->direction[0]) / sqrt(gnp_dot(normal, normal));
	int way = fabs(cosine) > ALONG;
	double row = round(gnp_dot(pattern->direction[way], draw->x) / pattern->period - pattern->phase[way]);
	memcpy(start, draw->x, sizeof start);
	if (!row_reach(face, pattern->direction[way], (row + pattern->phase[way]) * pattern->period, draw->x) ||
	    !gnp_solid_face_locate(face, draw->x, draw->p))
		return false;
	gnp_solid_face_point(face, draw->p, draw->x);
	draw->row = 2 * row + way;
	draw->along = gnp_dot(pattern->direction[!way], draw->x);
	for (int i = 0; i < 3; i++)
		moved += (draw->x[i] - start[i]) * (draw->x[i] - start[i]);
	return moved <= FAR * FAR * pattern->period * pattern->period;
}

static int draw_compare(const void *a, const void *b)
{
	const struct gnp_solid_draw *p = a, *q = b;
	if (p->row != q->row)
		return p->row < q->row ? -1 : 1;
	return gnp_double_compare(&p->along, &q->along);
}

/* Walks along the rows and leaves out what is nearer than step to one of its row taken before; returns how many are
 * taken. A step along a row is no shorter than what it adds to `along`. */
static size_t rows_walk(const struct gnp_solid_draws *draws, double step, uint32_t *taken)
{
	size_t made = 0;
	for (size_t i = 0; i < draws->count; i++) {
		const struct gnp_solid_draw *here = &draws->draw[i];
		bool free_place = true;
		for (size_t t = made; free_place && t-- > 0;) {
			const struct gnp_solid_draw *other = &draws->draw[taken[t]];
			const double d[3] = {here->x[0] - other->x[0], here->x[1] - other->x[1], here->x[2] - other->x[2]};
			if (other->row != here->row || here->along - other->along >= step)
				break;
			free_place = gnp_dot(d, d) >= step * step;
		}
		if (free_place)
			taken[made++] = (uint32_t)i;
	}
	return made;
}

/* The longest step that leaves enough, by bisection; what is too many is left out evenly. */
gnp_status gnp_solid_draws_thin_rows(struct gnp_solid_draws *draws, size_t wanted, uint32_t *chosen,
                                     struct gnp_error *error)
{
	enum { HALVINGS = 20 };
	double low = 0, high = 0;
	uint32_t *taken = gnp_array_new(draws->count, sizeof *taken);
	if (!taken)
		return gnp_no_memory("solid", draws->count, "candidates", error);
	qsort(draws->draw, draws->count, sizeof *draws->draw, draw_compare);
	for (size_t i = 1; i < draws->count; i++)
		high = fmax(high, fabs(draws->draw[i].along - draws->draw[i - 1].along));
	for (int i = 0; i < HALVINGS && rows_walk(draws, high, taken) >= wanted; i++)
		high *= 2;
	for (int i = 0; i < HALVINGS; i++) {
		double middle = (low + high) / 2;
		if (rows_walk(draws, middle, taken) >= wanted)
			low = middle;
		else
			high = middle;
	}
	size_t made = rows_walk(draws, low, taken);
	for (size_t i = 0, kept = 0; i < made; i++)
		if ((i + 1) * wanted / made > kept)
			chosen[kept++] = taken[i];
	free(taken);
	return GNP_OK;
}

/* ---- Density ---- */

/* Of the greatest; how likely a draw at x stays. */
static double density_at(const struct pattern *pattern, const double x[3])
{
	double along = gnp_dot(pattern->direction[0], x);
	if (pattern->sampling == GNP_SOLID_GRADIENT)
		return pow(pattern->least, fmin(1, fmax(0, (along - pattern->low) / pattern->extent)));
	if (pattern->sampling == GNP_SOLID_STRIPES) {
		double place = along / pattern->period + pattern->phase[0];
		return place - floor(place) < 0.5 ? 1 : pattern->least;
	}
	return 1;
}

/* ---- Draws ---- */

static bool draw_make(const struct drawing *drawing, size_t i, struct gnp_solid_draw *draw)
{
	const struct gnp_solid_body *body = drawing->body;
	const struct pattern *pattern = &drawing->pattern;
	struct gnp_random random;
	gnp_random_seed(&random, drawing->seed, drawing->stream | i);
	double t = gnp_random_uniform(&random);
	if (gnp_solid_draws_are_spread(pattern->sampling))
		t = ((double)i + t) / (double)drawing->count;
	draw->face = gnp_solid_body_pick(body, t);
	const struct gnp_solid_face *face = &body->face[draw->face];
	if (!gnp_solid_face_draw(face, &random, draw->p))
		return false;
	gnp_solid_face_point(face, draw->p, draw->x);
	if (pattern->sampling == GNP_SOLID_LINES && !row_move(pattern, face, draw))
		return false;
	draw->side = gnp_solid_body_side(body, face, draw->x);
	return draw->side && gnp_random_uniform(&random) < density_at(pattern, draw->x);
}

static gnp_status draws_make(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	struct drawing *drawing = context;
	(void)scratch;
	(void)error;
	for (size_t i = begin; i < end; i++)
		if (!draw_make(drawing, i, &drawing->draw[i]))
			drawing->draw[i].side = 0;
	return GNP_OK;
}

/* The share of draws that stay, by a trial. */
static double share_try(struct drawing *drawing)
{
	struct gnp_solid_draw draw;
	size_t kept = 0;
	drawing->stream = STREAM_SURVEY;
	drawing->count = TRIAL;
	for (size_t i = 0; i < TRIAL; i++)
		kept += draw_make(drawing, i, &draw);
	return (double)kept / TRIAL;
}

void gnp_solid_draws_survey(const struct gnp_solid_body *body, uint64_t seed, struct gnp_solid_survey *survey)
{
	enum { DRAWS = 16384 };
	const struct drawing drawing = {
		.body = body, .seed = seed, .stream = STREAM_SURVEY, .pattern = {.sampling = GNP_SOLID_EVEN}, .count = DRAWS};
	size_t kept = 0;
	for (int c = 0; c < 3; c++) {
		survey->low[c] = INFINITY;
		survey->high[c] = -INFINITY;
	}
	for (size_t i = 0; i < DRAWS; i++) {
		struct gnp_solid_draw draw;
		if (!draw_make(&drawing, i, &draw))
			continue;
		kept++;
		for (int c = 0; c < 3; c++) {
			survey->low[c] = fmin(survey->low[c], draw.x[c]);
			survey->high[c] = fmax(survey->high[c], draw.x[c]);
		}
	}
	survey->share = (double)kept / DRAWS;
	survey->area = survey->share * body->area[body->faces];
}

/* ---- Patterns ---- */

static void directions_draw(struct pattern *pattern, const struct gnp_solid_survey *survey, struct gnp_random *random)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_random(random);
	memcpy(pattern->direction, frame.axis, sizeof pattern->direction);
	const double *along = pattern->direction[0];
	pattern->low = pattern->extent = 0;
	for (int c = 0; c < 3; c++) {
		pattern->low += fmin(along[c] * survey->low[c], along[c] * survey->high[c]);
		pattern->extent += fabs(along[c]) * (survey->high[c] - survey->low[c]);
	}
	for (int way = 0; way < 2; way++)
		pattern->phase[way] = gnp_random_uniform(random);
}

/* A body may slip between the rows, as a thin tube may: then other directions are tried, and rows less far from each
 * other. */
static void rows_draw(struct drawing *drawing, const struct gnp_solid_survey *survey, double spacing,
                      struct gnp_random *random)
{
	enum { ATTEMPTS = 12 };
	double ratio = gnp_solid_scale(random, 2, 10), best = -1;
	struct pattern chosen = drawing->pattern;
	for (int attempt = 0; attempt < ATTEMPTS && best < 0.5 * survey->share; attempt++) {
		struct pattern *pattern = &drawing->pattern;
		directions_draw(pattern, survey, random);
		pattern->period = spacing * sqrt(ratio);
		double share = share_try(drawing);
		if (share > best) {
			best = share;
			chosen = *pattern;
		}
		if (attempt >= 3)
			ratio = fmax(2, ratio / 1.3);
	}
	drawing->pattern = chosen;
}

static void pattern_draw(struct drawing *drawing, int sampling, const struct gnp_solid_survey *survey, double spacing)
{
	struct pattern *pattern = &drawing->pattern;
	struct gnp_random random;
	gnp_random_seed(&random, drawing->seed, STREAM_PATTERN | (uint64_t)sampling);
	*pattern = (struct pattern){.sampling = sampling};
	directions_draw(pattern, survey, &random);
	bool gradient = sampling == GNP_SOLID_GRADIENT;
	pattern->least = gnp_solid_scale(&random, gradient ? 0.05 : 0.1, gradient ? 0.25 : 0.33);
	pattern->period = spacing * gnp_solid_scale(&random, 6, 40);
	if (sampling == GNP_SOLID_LINES)
		rows_draw(drawing, survey, spacing, &random);
}

/* ---- All ---- */

/* Draws so many; *kept: how many stay, moved to the front. */
static gnp_status drawing_run(struct drawing *drawing, size_t count, struct gnp_pool *pool, struct gnp_task *task,
                              size_t *kept, struct gnp_error *error)
{
	free(drawing->draw);
	drawing->count = count;
	drawing->stream = STREAM_DRAW;
	drawing->draw = gnp_array_new(count, sizeof *drawing->draw);
	if (!drawing->draw)
		return gnp_no_memory("solid", count, "candidates", error);
	gnp_status status = gnp_pool_run(pool, task, count, BATCH, draws_make, drawing, error);
	*kept = 0;
	for (size_t i = 0; status == GNP_OK && i < count; i++)
		if (drawing->draw[i].side)
			drawing->draw[(*kept)++] = drawing->draw[i];
	return status;
}

gnp_status gnp_solid_draws_create(const struct gnp_solid_body *body, const struct gnp_solid_options *options,
                                  const struct gnp_solid_survey *survey, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_solid_draws *out, struct gnp_error *error)
{
	enum { ATTEMPTS = 6 };
	struct drawing drawing = {.body = body, .seed = options->seed};
	bool spread = gnp_solid_draws_are_spread(options->sampling);
	size_t wanted = spread ? 4 * options->count : options->count, kept = 0;
	pattern_draw(&drawing, options->sampling, survey, sqrt(survey->area / (double)options->count));
	double draws = 1.05 * (double)wanted / fmax(share_try(&drawing), 0.01) + 256;
	gnp_status status = GNP_OK;
	for (int attempt = 0; status == GNP_OK && attempt < ATTEMPTS && kept < options->count; attempt++, draws *= 2)
		status = drawing_run(&drawing, (size_t)draws, pool, task, &kept, error);
	if (status == GNP_OK && kept < options->count)
		status = gnp_error_set(error, GNP_INTERNAL, "solid: %zu of %.0f draws are on the body, need %zu", kept,
		                       draws / 2, options->count);
	if (status != GNP_OK) {
		free(drawing.draw);
		return status;
	}
	*out = (struct gnp_solid_draws){kept, drawing.draw};
	return GNP_OK;
}
