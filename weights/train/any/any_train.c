#include "weights/train/any/any_train.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/model.h"
#include "weights/protocol/protocol.h"
#include "weights/train/any/any_batch.h"
#include "weights/train/any/any_start.h"

/* Streams of the seed; in the low bits the visit, or the step times MICROS_MAX plus the micro-batch. */
static const uint64_t STREAM_CLOUD = UINT64_C(0x21) << 56, STREAM_FRAMES = UINT64_C(0x22) << 56;
static const uint64_t STREAM_SUPPORTS = UINT64_C(0x23) << 56, STREAM_SPREAD = UINT64_C(0x24) << 56;
enum { MICROS_MAX = 4096, PARAMETERS_A_CHUNK = 16384 };

/* What a micro-batch adds to the report. */
struct share {
	double frames;
	struct gnp_any_terms terms;
};

struct gnp_any_train {
	struct gnp_any_options options;
	struct gnp_pool *pool;
	struct gnp_layout layout;
	struct gnp_train_state state;
	struct gnp_network *network;  /* of the step's parameters; NULL between steps */
	struct gnp_any_cloud *clouds; /* (window) that of visit v at v % window */
	uint64_t visits;              /* made so far: the last `window` of them are there */
	size_t micros;                /* rows of: */
	float *gradients;             /* (micros, parameters); the first row becomes the sum */
	struct share *shares;         /* (micros) */
};

struct gnp_any_options gnp_any_train_defaults(void)
{
	return (struct gnp_any_options){
		.architecture = {.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_WEIGHTED, .features = GNP_SUPPORT_FEATURES,
	                     .width = 32, .channels = 4, .neurons = 32, .layers = 3, .quadrature = 64, .head_width = 64,
	                     .outputs = GNP_WEIGHTED_OUTPUTS, .node_width = 32, .frame_width = 48},
		.recipe = gnp_any_recipe_defaults(), .seed = 1, .window = 32, .frame_visit = 20, .visit = 60,
		.frame_steps = 4000, .frame_batch = 512, .seconds = 1200, .batch = 128, .micro = 16, .frame_rate = 3e-3,
		.rate = 2e-3, .last = 0.01, .frame_warm = 20, .warm = 200, .clip = 1};
}

bool gnp_any_train_in_frames(const struct gnp_any_train *train)
{
	return train->state.step < train->options.frame_steps;
}

/* ---- Clouds ---- */

static uint64_t first_visit(const struct gnp_any_options *options, uint64_t step)
{
	uint64_t frames = step < options->frame_steps ? step : options->frame_steps;
	return frames / options->frame_visit + (step - frames) / options->visit;
}

static gnp_status follow_visits(struct gnp_any_train *train, struct gnp_error *error)
{
	const struct gnp_any_options *options = &train->options;
	uint64_t first = first_visit(options, train->state.step), end = first + options->window;
	gnp_status status = GNP_OK;
	for (uint64_t v = train->visits > first ? train->visits : first; v < end && status == GNP_OK; v++) {
		struct gnp_any_cloud *at = &train->clouds[v % options->window];
		gnp_any_cloud_clear(at);
		status = gnp_any_cloud_create(&options->recipe, options->seed, STREAM_CLOUD | v, train->pool, at, error);
		train->visits = v + 1;
	}
	return status;
}

/* ---- A micro-batch ---- */

static gnp_status run_micro(struct gnp_any_train *train, size_t micro, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	const struct gnp_any_options *options = &train->options;
	const struct gnp_any_pick from = {train->clouds, options->window};
	struct share *share = &train->shares[micro];
	float *gradient = train->gradients + micro * train->layout.total;
	bool frames = gnp_any_train_in_frames(train);
	struct gnp_random random;
	*share = (struct share){0};
	memset(gradient, 0, train->layout.total * sizeof *gradient);
	gnp_random_seed(&random, options->seed,
	                (frames ? STREAM_FRAMES : STREAM_SUPPORTS) | (train->state.step * MICROS_MAX + micro));
	if (frames)
		return gnp_any_batch_frames(train->network, &from, options->frame_batch, &random, scratch, &share->frames,
		                            gradient, error);
	return gnp_any_batch_supports(train->network, &from, options->micro, options->batch, &random, scratch,
	                              &share->terms, gradient, error);
}

static gnp_status run_micros(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t micro = begin; micro < end && status == GNP_OK; micro++)
		status = run_micro(context, micro, scratch, error);
	return status;
}

static size_t micros_of(const struct gnp_any_options *options, bool frames)
{
	return frames ? options->frame_batch / GNP_ANY_BATCH_FRAMES : options->batch / options->micro;
}

static gnp_status add_gradients(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	struct gnp_any_train *train = context;
	size_t micros = micros_of(&train->options, gnp_any_train_in_frames(train));
	(void)scratch;
	(void)error;
	for (size_t m = 1; m < micros; m++) {
		const float *from = train->gradients + m * train->layout.total;
		for (size_t i = begin; i < end; i++)
			train->gradients[i] += from[i];
	}
	return GNP_OK;
}

/* ---- What is measured before a phase ---- */

/* Sets what follows from the clouds at hand; the second phase begins with fresh moments, since those of the first would
 * go on moving frames that are done. */
static gnp_status measure(struct gnp_any_train *train, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct gnp_train_state *state = &train->state;
	const struct gnp_any_pick from = {train->clouds, train->options.window};
	struct gnp_random random;
	gnp_random_seed(&random, train->options.seed, STREAM_SPREAD | state->step);
	if (state->step == 0)
		return gnp_any_batch_spread_looks(train->network, &from, &random, scratch, state->parameters, error);
	memset(state->adam.first, 0, state->adam.count * sizeof *state->adam.first);
	memset(state->adam.second, 0, state->adam.count * sizeof *state->adam.second);
	state->adam.step = 0;
	state->seconds = 0;
	return gnp_any_batch_spread_summaries(train->network, &from, &random, scratch, state->parameters, error);
}

static gnp_status load(struct gnp_any_train *train, struct gnp_error *error)
{
	gnp_network_free(train->network);
	train->network = NULL;
	return gnp_network_create(&train->options.architecture, train->state.parameters, &train->network, error);
}

static gnp_status begin_phase(struct gnp_any_train *train, struct gnp_error *error)
{
	if (train->options.from || (train->state.step != 0 && train->state.step != train->options.frame_steps))
		return GNP_OK;
	struct gnp_scratch *scratch = gnp_scratch_create();
	gnp_status status = scratch ? load(train, error) : gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory");
	if (status == GNP_OK)
		status = measure(train, scratch, error);
	gnp_scratch_free(scratch);
	return status;
}

/* ---- A step ---- */

double gnp_any_train_fraction(const struct gnp_any_train *train)
{
	const struct gnp_any_options *options = &train->options;
	const struct gnp_train_state *state = &train->state;
	if (gnp_any_train_in_frames(train))
		return (double)state->step / (double)options->frame_steps;
	if (state->step == options->frame_steps) /* the clock is still that of the first phase */
		return 0;
	uint64_t done = state->step - options->frame_steps;
	return fmin(1, options->steps ? (double)done / (double)options->steps : state->seconds / options->seconds);
}

static void fill_report(const struct gnp_any_train *train, struct gnp_any_report *report)
{
	struct gnp_any_terms *sum = &report->terms;
	for (size_t m = 0; m < micros_of(&train->options, report->frames); m++) {
		const struct gnp_any_terms *part = &train->shares[m].terms;
		report->loss += train->shares[m].frames;
		sum->surface += part->surface;
		sum->crease += part->crease;
		sum->outlier += part->outlier;
		sum->nodes += part->nodes;
		sum->errors += part->errors;
		sum->angle += part->angle;
		sum->judged += part->judged;
	}
	sum->angle /= fmax(sum->judged, 1);
	if (!report->frames)
		report->loss = gnp_any_loss_total(sum);
}

static void descend(struct gnp_any_train *train, struct gnp_any_report *report)
{
	const struct gnp_any_options *options = &train->options;
	struct gnp_train_state *state = &train->state;
	double fraction = gnp_any_train_fraction(train);
	report->norm = gnp_gradient_clip(train->gradients, train->layout.total, options->clip);
	if (report->frames)
		report->rate = options->frame_rate * gnp_rate_factor(state->step, options->frame_warm, fraction, options->last);
	else
		report->rate =
			options->rate * gnp_rate_factor(state->step - options->frame_steps, options->warm, fraction, options->last);
	gnp_adam_update(&state->adam, report->rate, train->gradients, state->parameters);
}

gnp_status gnp_any_train_step(struct gnp_any_train *train, struct gnp_any_report *report, struct gnp_error *error)
{
	double started = gnp_clock();
	*report = (struct gnp_any_report){.frames = gnp_any_train_in_frames(train)};
	gnp_status status = follow_visits(train, error);
	if (status == GNP_OK)
		status = begin_phase(train, error);
	if (status == GNP_OK)
		status = load(train, error);
	if (status == GNP_OK)
		status =
			gnp_pool_run(train->pool, NULL, micros_of(&train->options, report->frames), 1, run_micros, train, error);
	if (status == GNP_OK)
		status = gnp_pool_run(train->pool, NULL, train->layout.total, PARAMETERS_A_CHUNK, add_gradients, train, error);
	if (status != GNP_OK)
		return status;
	fill_report(train, report);
	descend(train, report);
	train->state.step++;
	train->state.seconds += gnp_clock() - started;
	return GNP_OK;
}

/* ---- Beginning and end ---- */

static gnp_status check_options(const struct gnp_any_options *options, struct gnp_error *error)
{
	size_t micros = options->micro ? options->batch / options->micro : 0;
	size_t groups = options->frame_batch / GNP_ANY_BATCH_FRAMES;
	if (options->architecture.head != GNP_HEAD_WEIGHTED)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "head: got %s, need %s",
		                     gnp_head_name(options->architecture.head), gnp_head_name(GNP_HEAD_WEIGHTED));
	if (options->micro % GNP_ANY_BATCH_CLOUDS || micros == 0 || micros > MICROS_MAX || options->batch % options->micro)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "batch: got %zu of micro-batches of %zu, need a multiple of these, up to %d of them, each "
		                     "a multiple of %d", options->batch, options->micro, MICROS_MAX, GNP_ANY_BATCH_CLOUDS);
	if (groups == 0 || groups > MICROS_MAX || options->frame_batch % GNP_ANY_BATCH_FRAMES)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "frame batch: got %zu, need a multiple of %d, up to %d of them", options->frame_batch,
		                     GNP_ANY_BATCH_FRAMES, MICROS_MAX);
	if (options->window == 0 || options->visit == 0 || options->frame_visit == 0 || options->frame_steps == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "window, visit, frame visit, frame steps: got %zu, %llu, %llu, %llu, need at least 1 each",
		                     options->window, (unsigned long long)options->visit,
		                     (unsigned long long)options->frame_visit, (unsigned long long)options->frame_steps);
	if (options->recipe.least < 1000 || options->recipe.most < options->recipe.least)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu to %zu, need 1000 or more, ascending",
		                     options->recipe.least, options->recipe.most);
	return gnp_seed_check_training(options->seed, error);
}

/* What a checkpoint must have been made by to be gone on from. */
static void describe(const struct gnp_any_train *train, char *text, size_t size)
{
	const struct gnp_architecture *a = &train->options.architecture;
	snprintf(text, size,
	         "regime any frame-steps %llu width %u channels %u neurons %u layers %u head %u node %u frame %u",
	         (unsigned long long)train->options.frame_steps, a->width, a->channels, a->neurons, a->layers,
	         a->head_width, a->node_width, a->frame_width);
}

static bool is_same(const struct gnp_architecture *a, const struct gnp_architecture *b)
{
	return a->head == b->head && a->width == b->width && a->channels == b->channels && a->neurons == b->neurons &&
	       a->layers == b->layers && a->head_width == b->head_width && a->node_width == b->node_width &&
	       a->frame_width == b->frame_width;
}

/* Its parameters, the spreads of its data among them, as if the first phase were over. */
static gnp_status take_model(struct gnp_any_train *train, struct gnp_error *error)
{
	struct gnp_model *model;
	gnp_status status = gnp_model_load(train->options.from, &model, error);
	if (status != GNP_OK)
		return status;
	if (is_same(&model->architecture, &train->options.architecture)) {
		memcpy(train->state.parameters, model->network->parameters, train->layout.total * sizeof(float));
		train->state.step = train->options.frame_steps;
	} else {
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "from: %.200s is of another network than is to be trained",
		                       train->options.from);
	}
	gnp_model_free(model);
	return status;
}

static gnp_status start(struct gnp_any_train *train, const char *resume, struct gnp_error *error)
{
	const struct gnp_any_options *options = &train->options;
	size_t total, frames = micros_of(options, true), supports = micros_of(options, false);
	char what[320];
	gnp_status status = gnp_architecture_layout(&options->architecture, &train->layout, error);
	if (status == GNP_OK)
		status = gnp_train_state_create(train->layout.total, &train->state, error);
	if (status != GNP_OK)
		return status;
	train->micros = frames > supports ? frames : supports;
	train->shares = gnp_array_zero(train->micros, sizeof *train->shares);
	train->clouds = gnp_array_zero(options->window, sizeof *train->clouds);
	if (gnp_size_multiply(train->micros, train->layout.total, &total))
		train->gradients = gnp_array_new(total, sizeof *train->gradients);
	if (!train->shares || !train->clouds || !train->gradients)
		return gnp_no_memory("training", train->micros, "gradients", error);
	describe(train, what, sizeof what);
	if (resume)
		return gnp_train_state_load(resume, what, &train->state, error);
	if (options->from)
		return take_model(train, error);
	gnp_any_start_parameters(&options->architecture, &train->layout, options->seed, train->state.parameters);
	return GNP_OK;
}

gnp_status gnp_any_train_open(const struct gnp_any_options *options, const char *resume, struct gnp_pool *pool,
                              struct gnp_any_train **out, struct gnp_error *error)
{
	gnp_status status = check_options(options, error);
	if (status != GNP_OK)
		return status;
	struct gnp_any_train *train = gnp_array_zero(1, sizeof *train);
	if (!train)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory");
	train->options = *options;
	train->pool = pool;
	status = start(train, resume, error);
	if (status == GNP_OK)
		*out = train;
	else
		gnp_any_train_close(train);
	return status;
}

void gnp_any_train_close(struct gnp_any_train *train)
{
	if (!train)
		return;
	for (size_t i = 0; train->clouds && i < train->options.window; i++)
		gnp_any_cloud_clear(&train->clouds[i]);
	gnp_network_free(train->network);
	gnp_train_state_clear(&train->state);
	free(train->clouds);
	free(train->gradients);
	free(train->shares);
	free(train);
}

const struct gnp_train_state *gnp_any_train_state(const struct gnp_any_train *train)
{
	return &train->state;
}

gnp_status gnp_any_train_save(const struct gnp_any_train *train, const char *path, struct gnp_error *error)
{
	char what[320];
	describe(train, what, sizeof what);
	return gnp_train_state_save(path, what, &train->state, error);
}
