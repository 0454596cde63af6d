#include "core/flow/flow_checkpoint.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/model.h"

static const char magic[] = "gnp-flow 3 ";

struct figures {
	uint64_t count, cloud_count, steps, unsorted, arrays /* a bit for each that is there */, shots, shot_rows;
	double time, dt;
	double total_area, volume, spread, dense, overshoot, curvature, resolution, nearest, unresolved; /* of the state */
	char request[GNP_SHA256_TEXT - 1];
};

enum { MAGIC = sizeof magic - 1, HEAD = MAGIC + GNP_SHA256_TEXT - 1 };

/* The arrays of a state: bytes a point. */
#define ARRAY(name, width) {offsetof(struct gnp_flow_state, name), (width) * sizeof *((struct gnp_flow_state *)0)->name}
static const struct {
	size_t offset, width;
} arrays[] = {
	ARRAY(points, 3), ARRAY(normals, 3), ARRAY(index, 1), ARRAY(fixed, 1), ARRAY(before, 1), ARRAY(mean_curvature, 1),
	ARRAY(smooth, 1), ARRAY(principal, 2), ARRAY(area, 1), /* these all states have */
	ARRAY(directions, 6), ARRAY(apart, 1), ARRAY(gap, 1), ARRAY(corner, 3), ARRAY(lift, 1), ARRAY(shift, 3),
	ARRAY(neighbor, GNP_FLOW_EDGES), ARRAY(weight, GNP_FLOW_EDGES), ARRAY(rough, 1),
};
enum { ARRAYS = sizeof arrays / sizeof arrays[0], COMMON = 9, PIECES = ARRAYS + 9 };

static void *array_of(const struct gnp_flow_state *state, size_t a)
{
	void *array;
	memcpy(&array, (const char *)state + arrays[a].offset, sizeof array);
	return array;
}

static void set_array(struct gnp_flow_state *state, size_t a, void *array)
{
	memcpy((char *)state + arrays[a].offset, &array, sizeof array);
}

static uint64_t arrays_there(const struct gnp_flow_state *state)
{
	uint64_t bits = 0;
	for (size_t a = 0; a < ARRAYS; a++)
		bits |= (uint64_t)(array_of(state, a) != NULL) << a;
	return bits;
}

/* ---- Whose it is ---- */

/* One value for each meaning: any NaN leaves a length open. */
static double settled(double value)
{
	return isnan(value) ? NAN : value;
}

void gnp_flow_checkpoint_request(const struct gnp_cloud *cloud, const unsigned char *fixed,
                                 const struct gnp_flow_options *options, const struct gnp_model *model,
                                 char request[GNP_SHA256_TEXT])
{
	const struct gnp_estimate_options *estimate = &options->estimate;
	const int integers[] = {options->scheme, options->volume, options->steps, options->snapshot_every, estimate->estimator, estimate->cover,
	                        estimate->k, estimate->degree, estimate->basis, estimate->weight, cloud->normals != NULL, fixed != NULL};
	const double numbers[] = {settled(options->dt), settled(options->smoothing_radius), settled(options->spacing),
	                          settled(options->insertion), options->tangential, options->projection,
	                          settled(options->singularity),
	                          options->spacing_limit};
	size_t vectors = 3 * cloud->count * sizeof(double);
	const void *const data[] = {integers, numbers, model ? model->sha256 : NULL, cloud->points, cloud->normals, fixed};
	const size_t size[] = {sizeof integers, sizeof numbers, model ? strlen(model->sha256) : 0, vectors, cloud->normals ? vectors : 0,
	                       fixed ? cloud->count : 0};
	gnp_sha256_text(data, size, sizeof size / sizeof *size, request);
}

/* ---- Saving ---- */

gnp_status gnp_flow_checkpoint_save(const struct gnp_flow_middle *middle, const struct gnp_checkpoint *checkpoint,
                                    struct gnp_error *error)
{
	const struct gnp_flow_state *now = middle->now;
	const struct gnp_flow_snapshots *shots = &middle->result->snapshots;
	struct figures figures = {
		.count = now->count, .cloud_count = middle->cloud_count, .steps = middle->result->steps, .unsorted = *middle->unsorted,
		.arrays = arrays_there(now), .shots = shots->count, .shot_rows = shots->count ? shots->start[shots->count] : 0,
		.time = *middle->time, .dt = *middle->dt, .total_area = now->total_area, .volume = now->volume, .spread = now->spread,
		.dense = now->dense, .overshoot = now->overshoot, .curvature = now->curvature, .resolution = now->resolution,
		.nearest = now->nearest, .unresolved = now->unresolved};
	memcpy(figures.request, middle->request, sizeof figures.request);
	char head[HEAD + 1];
	struct gnp_piece pieces[PIECES];
	size_t count = 0, rows = figures.shot_rows;
	pieces[count++] = (struct gnp_piece){head, HEAD};
	pieces[count++] = (struct gnp_piece){&figures, sizeof figures};
	for (size_t a = 0; a < ARRAYS; a++)
		if (array_of(now, a))
			pieces[count++] = (struct gnp_piece){array_of(now, a), now->count * arrays[a].width};
	pieces[count++] = (struct gnp_piece){middle->result->records, (figures.steps + 1) * sizeof *middle->result->records};
	if (shots->count) {
		pieces[count++] = (struct gnp_piece){shots->start, (shots->count + 1) * sizeof *shots->start};
		pieces[count++] = (struct gnp_piece){shots->step, shots->count * sizeof *shots->step};
		pieces[count++] = (struct gnp_piece){shots->time, shots->count * sizeof *shots->time};
		pieces[count++] = (struct gnp_piece){shots->points, rows * 3 * sizeof(double)};
		pieces[count++] = (struct gnp_piece){shots->normals, rows * 3 * sizeof(double)};
		pieces[count++] = (struct gnp_piece){shots->mean_curvature, rows * sizeof(double)};
	}
	const void *data[PIECES];
	size_t size[PIECES];
	for (size_t i = 1; i < count; i++) {
		data[i - 1] = pieces[i].data;
		size[i - 1] = pieces[i].size;
	}
	memcpy(head, magic, MAGIC);
	gnp_sha256_text(data, size, count - 1, head + MAGIC);
	return checkpoint->save(checkpoint->context, pieces, count, error);
}

/* ---- Loading ---- */

struct reader {
	const unsigned char *at;
	size_t left;
	bool short_of; /* of bytes, or of memory for them */
};

/* A copy of count items; NULL when they are not there. */
static void *take(struct reader *reader, size_t count, size_t width)
{
	size_t bytes;
	void *array = NULL;
	if (!reader->short_of && gnp_size_multiply(count, width, &bytes) && bytes <= reader->left)
		array = gnp_array_new(count, width);
	if (!array) {
		reader->short_of = true;
		return NULL;
	}
	memcpy(array, reader->at, bytes);
	reader->at += bytes;
	reader->left -= bytes;
	return array;
}

static gnp_status refuse(const char *why, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "checkpoint: %s", why);
}

static void take_state(struct reader *reader, const struct figures *figures, struct gnp_flow_state *state)
{
	*state = (struct gnp_flow_state){.count = figures->count, .total_area = figures->total_area, .volume = figures->volume,
	                                 .spread = figures->spread, .dense = figures->dense, .overshoot = figures->overshoot,
	                                 .curvature = figures->curvature, .resolution = figures->resolution,
	                                 .nearest = figures->nearest,
	                                 .unresolved = figures->unresolved};
	for (size_t a = 0; a < ARRAYS; a++)
		if (figures->arrays >> a & 1)
			set_array(state, a, take(reader, figures->count, arrays[a].width));
}

static void take_result(struct reader *reader, const struct figures *figures, struct gnp_flow *result)
{
	struct gnp_flow_snapshots *shots = &result->snapshots;
	*result = (struct gnp_flow){.steps = figures->steps};
	result->records = take(reader, figures->steps + 1, sizeof *result->records);
	if (!figures->shots)
		return;
	shots->start = take(reader, figures->shots + 1, sizeof *shots->start);
	shots->step = take(reader, figures->shots, sizeof *shots->step);
	shots->time = take(reader, figures->shots, sizeof *shots->time);
	shots->points = take(reader, figures->shot_rows, 3 * sizeof(double));
	shots->normals = take(reader, figures->shot_rows, 3 * sizeof(double));
	shots->mean_curvature = take(reader, figures->shot_rows, sizeof(double));
	shots->count = figures->shots;
}

/* Places are those of a cloud, indices lead nowhere they must not, and none of the cloud's points is there twice. */
static gnp_status check_state(const struct gnp_flow_state *state, size_t cloud_count, struct gnp_error *error)
{
	unsigned char *seen = gnp_array_zero(cloud_count, 1);
	if (!seen)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "checkpoint: no memory for %zu points", cloud_count);
	bool good = true;
	for (size_t i = 0; i < 3 * state->count && good; i++)
		good = fabs(state->points[i]) <= GNP_COORDINATE_MAX && isfinite(state->normals[i]);
	for (size_t i = 0; i < state->count && good; i++) {
		int64_t index = state->index[i];
		good = index >= -1 && (index < 0 || ((uint64_t)index < cloud_count && !seen[index]++)) && state->fixed[i] <= 1;
	}
	for (size_t i = 0; state->neighbor && i < GNP_FLOW_EDGES * state->count && good; i++)
		good = state->neighbor[i] < state->count;
	free(seen);
	return good ? GNP_OK : refuse("places or indices that lead nowhere", error);
}

static gnp_status check_result(const struct gnp_flow *result, const struct figures *figures, struct gnp_error *error)
{
	const struct gnp_flow_snapshots *shots = &result->snapshots;
	for (size_t i = 0; i <= result->steps; i++)
		if (result->records[i].step != (double)i)
			return refuse("records out of order", error);
	for (size_t i = 0; i < shots->count; i++)
		if (shots->start[i] > shots->start[i + 1] || shots->step[i] > result->steps)
			return refuse("snapshots out of order", error);
	if (shots->count && (shots->start[0] != 0 || shots->start[shots->count] != figures->shot_rows))
		return refuse("snapshots out of order", error);
	return GNP_OK;
}

/* The seconds of a record are those of its run. */
static bool same_start(const struct gnp_flow_record *a, const struct gnp_flow_record *b)
{
	return memcmp(a, b, offsetof(struct gnp_flow_record, seconds)) == 0;
}

static gnp_status check_figures(const struct gnp_flow_middle *middle, const struct figures *figures,
                                struct gnp_error *error)
{
	uint64_t common = (UINT64_C(1) << COMMON) - 1;
	uint64_t wanted = middle->conformal ? common : arrays_there(middle->now);
	if (figures->cloud_count != middle->cloud_count || (middle->conformal && figures->count != middle->now->count))
		return refuse("of another cloud", error);
	if (figures->arrays != wanted || figures->steps < 1 || figures->steps > middle->steps_most || figures->count < 1 ||
	    figures->count > UINT32_MAX || figures->shots > figures->steps + 1 || figures->shot_rows > SIZE_MAX / 64 ||
	    (figures->shots > 0) != (middle->result->snapshots.count > 0) ||
	    memcmp(figures->request, middle->request, sizeof figures->request) != 0)
		return refuse("of another flow", error);
	return GNP_OK;
}

static gnp_status load(const struct gnp_flow_middle *middle, struct reader *reader, const struct figures *figures,
                       struct gnp_flow_state *state, struct gnp_flow *result, struct gnp_error *error)
{
	take_state(reader, figures, state);
	take_result(reader, figures, result);
	if (reader->short_of || reader->left)
		return refuse("of another size than it says", error);
	if (!same_start(&result->records[0], &middle->result->records[0]))
		return refuse("of a flow with another start", error);
	gnp_status status = check_state(state, middle->cloud_count, error);
	return status == GNP_OK ? check_result(result, figures, error) : status;
}

gnp_status gnp_flow_checkpoint_load(const struct gnp_flow_middle *middle, const unsigned char *bytes, size_t size,
                                    struct gnp_error *error)
{
	struct figures figures;
	struct gnp_flow_state state;
	struct gnp_flow result;
	char hash[GNP_SHA256_TEXT];
	if (size < HEAD + sizeof figures || memcmp(bytes, magic, MAGIC) != 0)
		return refuse("of another form", error);
	struct reader reader = {bytes + HEAD, size - HEAD, false};
	gnp_sha256_text((const void *const[]){reader.at}, &reader.left, 1, hash);
	if (memcmp(bytes + MAGIC, hash, GNP_SHA256_TEXT - 1) != 0)
		return refuse("damaged: the checksum is wrong", error);
	memcpy(&figures, reader.at, sizeof figures);
	reader.at += sizeof figures;
	reader.left -= sizeof figures;
	gnp_status status = check_figures(middle, &figures, error);
	if (status != GNP_OK)
		return status;
	status = load(middle, &reader, &figures, &state, &result, error);
	if (status != GNP_OK) {
		gnp_flow_state_clear(&state);
		gnp_flow_clear(&result);
		return status;
	}
	gnp_flow_state_clear(middle->now);
	*middle->now = state;
	struct gnp_flow old = *middle->result;
	middle->result->records = result.records;
	middle->result->snapshots = result.snapshots;
	middle->result->steps = result.steps;
	result.records = old.records;
	result.snapshots = old.snapshots;
	gnp_flow_clear(&result);
	*middle->time = figures.time;
	*middle->dt = figures.dt;
	*middle->unsorted = figures.unsorted;
	return GNP_OK;
}
