#include "core/solids/solid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/shapes/eliminate.h"
#include "core/solids/solid_crease.h"
#include "core/solids/solid_draw.h"
#include "core/solids/solid_kinds.h"

/* Streams of the seed; the number of the attempt or draw is in the low bits. */
static const uint64_t STREAM_BODY = UINT64_C(0x32) << 56, STREAM_POSE = UINT64_C(0x33) << 56;

enum { BATCH = 1024 };

/* From body coordinates to the sample's: scaled, turned about the middle. */
struct pose {
	double scale, middle[3];
	struct gnp_solid_frame frame;
};

struct making {
	const struct gnp_solid_options *options;
	struct gnp_solid_body body;
	double area;
	struct pose pose;
	struct gnp_solid_draws draws;
	uint32_t *chosen; /* (count) of the draws */
	struct gnp_solid_creases creases;
	struct gnp_solid_sample sample;
};

/* ---- Names and options ---- */

const char *gnp_solid_kind_name(int kind)
{
#define NAME(id, name) name,
	static const char *const names[] = {GNP_SOLID_KINDS(NAME)};
	return kind >= 0 && kind < GNP_SOLID_KIND_COUNT ? names[kind] : NULL;
}

const char *gnp_solid_sampling_name(int sampling)
{
	static const char *const names[] = {GNP_SOLID_SAMPLINGS(NAME)};
#undef NAME
	return sampling >= 0 && sampling < GNP_SOLID_SAMPLING_COUNT ? names[sampling] : NULL;
}

static gnp_status check_options(const struct gnp_solid_options *options, struct gnp_error *error)
{
	static const size_t LEAST = 16, MOST = 1000000;
	if (options->count < LEAST || options->count > MOST)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "count: got %zu, need %zu..%zu", options->count, LEAST, MOST);
	gnp_status status = gnp_check_integer("kind", options->kind, 0, GNP_SOLID_KIND_COUNT - 1, error);
	if (status == GNP_OK)
		status = gnp_check_integer("sampling", options->sampling, 0, GNP_SOLID_SAMPLING_COUNT - 1, error);
	return status;
}

/* ---- The body ---- */

/* Draws bodies until boolean operations leave enough of one; without them the first is good. */
static void body_make(struct making *making, struct gnp_solid_survey *survey)
{
	static const double ENOUGH = 0.25;
	const struct gnp_solid_options *options = making->options;
	struct gnp_solid_body *body = &making->body;
	struct gnp_random random;
	for (uint64_t attempt = 0;; attempt++) {
		gnp_random_seed(&random, options->seed, STREAM_BODY | attempt);
		gnp_solid_kinds_build(options->kind, body, &random, (double)options->count);
		for (int p = 0; attempt >= 64 && p < body->primitives; p++)
			body->primitive[p].operation = GNP_SOLID_UNION;
		gnp_solid_draws_survey(body, options->seed, survey);
		if (survey->share >= ENOUGH || attempt > 64)
			return;
	}
}

static void pose_make(const struct gnp_solid_options *options, const struct gnp_solid_survey *survey, struct pose *pose)
{
	struct gnp_random random;
	double square = 0;
	gnp_random_seed(&random, options->seed, STREAM_POSE);
	for (int c = 0; c < 3; c++) {
		pose->middle[c] = (survey->low[c] + survey->high[c]) / 2;
		square += (survey->high[c] - survey->low[c]) * (survey->high[c] - survey->low[c]);
	}
	pose->scale = (1 + gnp_random_uniform(&random)) / sqrt(square);
	pose->frame = gnp_solid_frame_random(&random);
}

/* ---- The choice among the draws ---- */

/* Blue noise. */
static gnp_status choose_even(struct making *making, struct gnp_pool *pool, struct gnp_task *task,
                              struct gnp_error *error)
{
	const struct gnp_solid_draws *draws = &making->draws;
	float *places = gnp_array_new(draws->count, 3 * sizeof *places);
	if (!places)
		return gnp_no_memory("solid", draws->count, "candidates", error);
	for (size_t i = 0; i < draws->count; i++)
		for (int c = 0; c < 3; c++)
			places[3 * i + (size_t)c] = (float)draws->draw[i].x[c];
	gnp_status status =
		gnp_eliminate(places, draws->count, making->options->count, making->area, pool, task, making->chosen, error);
	free(places);
	return status;
}

static gnp_status choose(struct making *making, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	size_t count = making->options->count;
	making->chosen = gnp_array_new(count, sizeof *making->chosen);
	if (!making->chosen)
		return gnp_no_memory("solid", count, "points", error);
	if (making->options->sampling == GNP_SOLID_EVEN)
		return choose_even(making, pool, task, error);
	if (making->options->sampling == GNP_SOLID_LINES)
		return gnp_solid_draws_thin_rows(&making->draws, count, making->chosen, error);
	for (size_t i = 0; i < count; i++) /* they are independent of each other */
		making->chosen[i] = (uint32_t)i;
	return GNP_OK;
}

/* ---- The sample ---- */

static gnp_status sample_reserve(struct gnp_solid_sample *sample, size_t count, struct gnp_error *error)
{
	size_t row = sizeof(double);
	sample->count = count;
	sample->points = gnp_array_new(count, 3 * row);
	sample->normals = gnp_array_new(count, 3 * row);
	sample->second_form = gnp_array_new(count, 9 * row);
	sample->piece = gnp_array_new(count, sizeof *sample->piece);
	sample->edge = gnp_array_new(count, row);
	if (sample->points && sample->normals && sample->second_form && sample->piece && sample->edge)
		return GNP_OK;
	return gnp_no_memory("solid", count, "points", error);
}

void gnp_solid_sample_clear(struct gnp_solid_sample *sample)
{
	free(sample->points);
	free(sample->normals);
	free(sample->second_form);
	free(sample->piece);
	free(sample->edge);
	memset(sample, 0, sizeof *sample);
}

static void turn(const struct gnp_solid_frame *frame, const double y[3], double x[3])
{
	for (int i = 0; i < 3; i++)
		x[i] = frame->axis[0][i] * y[0] + frame->axis[1][i] * y[1] + frame->axis[2][i] * y[2];
}

/* out = sign / scale R form R^T */
static void turn_form(const struct pose *pose, const double form[9], double factor, double out[9])
{
	double half[9], row[3];
	for (int i = 0; i < 3; i++)
		turn(&pose->frame, form + 3 * i, half + 3 * i); /* form R^T */
	for (int j = 0; j < 3; j++) {
		turn(&pose->frame, (double[3]){half[j], half[3 + j], half[6 + j]}, row);
		for (int i = 0; i < 3; i++)
			out[3 * i + j] = factor * row[i];
	}
}

static void point_make(struct making *making, size_t i)
{
	const struct gnp_solid_draw *draw = &making->draws.draw[making->chosen[i]];
	const struct gnp_solid_face *face = &making->body.face[draw->face];
	const struct pose *pose = &making->pose;
	struct gnp_solid_sample *sample = &making->sample;
	struct gnp_solid_geometry geometry;
	double local[3], normal[3];
	gnp_solid_face_evaluate(face, draw->p, &geometry);
	for (int c = 0; c < 3; c++) {
		local[c] = pose->scale * (geometry.point[c] - pose->middle[c]);
		normal[c] = draw->side * geometry.normal[c];
	}
	turn(&pose->frame, local, sample->points + 3 * i);
	turn(&pose->frame, normal, sample->normals + 3 * i);
	turn_form(pose, geometry.form, draw->side / pose->scale, sample->second_form + 9 * i);
	sample->piece[i] = face->piece;
	sample->edge[i] = pose->scale * gnp_solid_creases_distance(&making->creases, geometry.point);
}

static gnp_status points_make(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct making *making = context;
	(void)scratch;
	(void)error;
	for (size_t i = begin; i < end; i++)
		point_make(making, i);
	return GNP_OK;
}

static gnp_status make(struct making *making, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_solid_options *options = making->options;
	struct gnp_solid_survey survey;
	body_make(making, &survey);
	pose_make(options, &survey, &making->pose);
	making->area = survey.area;
	gnp_status status = gnp_solid_draws_create(&making->body, options, &survey, pool, task, &making->draws, error);
	double spacing = sqrt(survey.area / (double)options->count);
	if (status == GNP_OK)
		status = choose(making, pool, task, error);
	if (status == GNP_OK)
		status = gnp_solid_creases_create(&making->body, spacing, options->seed, pool, task, &making->creases, error);
	if (status == GNP_OK)
		status = sample_reserve(&making->sample, options->count, error);
	if (status != GNP_OK)
		return status;
	making->sample.spacing = making->pose.scale * spacing;
	return gnp_pool_run(pool, task, options->count, BATCH, points_make, making, error);
}

gnp_status gnp_solid_sample_create(const struct gnp_solid_options *options, struct gnp_pool *pool,
                                   struct gnp_task *task, struct gnp_solid_sample *out, struct gnp_error *error)
{
	gnp_status status = check_options(options, error);
	if (status != GNP_OK)
		return status;
	struct making *making = gnp_array_zero(1, sizeof *making);
	if (!making)
		return gnp_no_memory("solid", 1, "body", error);
	making->options = options;
	status = make(making, pool, task, error);
	gnp_solid_draws_clear(&making->draws);
	gnp_solid_creases_clear(&making->creases);
	free(making->chosen);
	if (status == GNP_OK)
		*out = making->sample;
	else
		gnp_solid_sample_clear(&making->sample);
	free(making);
	return status;
}
