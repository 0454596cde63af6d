#include "weights/train/train.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "weights/train/muon.h"
#include "weights/train/train_cells.h"
#include "weights/train/train_fit.h"

/* Stream of the seed that micro-batches draw from: the step times MICROS_MAX plus the micro-batch is in the low bits. */
static const uint64_t STREAM_BATCH = UINT64_C(0x13) << 56, STREAM_CALIBRATION = UINT64_C(0x14) << 56;
enum { MICROS_MAX = 4096, PARAMETERS_A_CHUNK = 16384, CALIBRATION_PATCHES = 128 };

/* A micro-batch's share of the report. */
struct share {
	double loss, operations, seconds;
	struct gnp_loss_terms terms;
};

struct gnp_train {
	struct gnp_train_options options;
	const struct gnp_trainable *network;
	struct gnp_pool *pool;
	struct gnp_train_window *window;
	struct gnp_train_state state;
	size_t micros;
	float *gradients;     /* (micros, parameters); the first row becomes the sum */
	struct share *shares; /* (micros) */
};

struct gnp_train_options gnp_train_defaults(void)
{
	return (struct gnp_train_options){
		.data = {.shapes = 320, .points = 100000, .seed = 1}, .loss = gnp_loss_defaults(), .seconds = 1200, .batch = 64,
		.micro = 8, .window = 16, .visit = 32, .rate = 1e-3, .last = 1e-3, .warm = 200, .clip = 1,
		.average = 1};
}

/* ---- A micro-batch ---- */

static void add_terms(double scale, const struct gnp_loss_terms *from, struct gnp_loss_terms *to)
{
	for (int t = 0; t < GNP_LOSS_TERMS; t++) {
		to->patch[t] += scale * from->patch[t];
		to->centre[t] += scale * from->centre[t];
		to->cell[t] += scale * from->cell[t];
		to->near[t] += scale * from->near[t];
	}
}

/* The loss of patch p: its share of the batch's, and its gradient by the coefficients. */
static gnp_status judge_patch(const struct gnp_train *train, const struct gnp_train_patches *patches, size_t p,
                              const double *coefficients, double *dcoefficients, struct share *share,
                              struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct gnp_basis basis = train->network->basis;
	size_t from = patches->truth_start[p], count = patches->truth_start[p + 1] - from, size = gnp_basis_size(basis);
	const struct gnp_truth *truth = patches->truth + from;
	const struct gnp_patch *patch = &patches->patches[p];
	double part = 1 / (double)train->options.batch;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct gnp_jet *jets = gnp_scratch_take(scratch, count, sizeof *jets), *gradient = gnp_scratch_take(scratch, count, sizeof *gradient);
	double *rows = gnp_scratch_take(scratch, count, 6 * GNP_BASIS_MAX * sizeof *rows);
	if (!jets || !gradient || !rows)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for a patch of %zu points", count);
	if (count) {
		for (size_t i = 0; i < count; i++)
			jets[i] = gnp_train_fit_jet(basis, coefficients, patch, truth[i].u, truth[i].v, rows + 6 * GNP_BASIS_MAX * i);
		struct gnp_loss_scale scale = gnp_loss_scale_of(patches->cloud, patch);
		struct gnp_loss_terms terms;
		share->loss += part * gnp_loss_patch(&train->options.loss, &scale, truth, jets, count, &terms, gradient);
		add_terms(part, &terms, &share->terms);
	}
	for (size_t i = 0; i < count; i++)
		gnp_train_fit_back(basis, rows + 6 * GNP_BASIS_MAX * i, &gradient[i], dcoefficients);
	for (size_t i = 0; i < size; i++)
		dcoefficients[i] *= part;
	gnp_scratch_release(scratch, mark);
	return GNP_OK;
}

static gnp_status draw_patches(struct gnp_train *train, size_t micro, struct gnp_scratch *scratch,
                               struct gnp_train_patches *patches, struct gnp_error *error)
{
	const struct gnp_train_options *options = &train->options;
	struct gnp_random random;
	uint64_t turn = train->state.step * train->micros + micro;
	gnp_random_seed(&random, options->data.seed, STREAM_BATCH | (train->state.step * MICROS_MAX + micro));
	const struct gnp_train_cloud *cloud = gnp_train_window_at(train->window, (size_t)(turn % options->window));
	return gnp_train_patches_draw(cloud, &options->recipe, options->micro, &random, scratch, patches, error);
}

static gnp_status run_micro(struct gnp_train *train, size_t micro, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_trainable *network = train->network;
	struct share *share = &train->shares[micro];
	struct gnp_train_patches patches;
	float *gradient = train->gradients + micro * network->parameter_count;
	size_t size = gnp_basis_size(network->basis), count = train->options.micro;
	double started = gnp_clock();
	void *tape;
	const struct gnp_train_cells cells = {&train->options.loss, network->basis, train->options.batch,
	                                      train->options.recipe.k};
	*share = (struct share){0};
	memset(gradient, 0, network->parameter_count * sizeof *gradient);
	gnp_status status = draw_patches(train, micro, scratch, &patches, error);
	if (status != GNP_OK)
		return status;
	share->seconds = gnp_clock() - started;
	double *coefficients = gnp_scratch_take(scratch, count, size * sizeof *coefficients);
	double *dcoefficients = gnp_scratch_take(scratch, count, size * sizeof *dcoefficients);
	if (!coefficients || !dcoefficients)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu patches", count);
	status = network->forward(network->state, &patches, coefficients, &tape, scratch, error);
	bool each = gnp_loss_rule_asks(&train->options.loss.patch) || gnp_loss_rule_asks(&train->options.loss.centre);
	memset(dcoefficients, 0, count * size * sizeof *dcoefficients);
	for (size_t p = 0; p < count && status == GNP_OK && each; p++)
		status = judge_patch(train, &patches, p, coefficients + p * size, dcoefficients + p * size, share, scratch, error);
	if (status == GNP_OK)
		status = gnp_train_cells_judge(&cells, &patches, coefficients, dcoefficients, &share->terms, &share->loss,
		                               scratch, error);
	if (status == GNP_OK && network->operations)
		share->operations = network->operations(network->state, &patches);
	return status == GNP_OK ? network->backward(network->state, &patches, tape, dcoefficients, gradient, scratch, error) : status;
}

static gnp_status run_micros(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t micro = begin; micro < end && status == GNP_OK; micro++)
		status = run_micro(context, micro, scratch, error);
	return status;
}

/* ---- A step ---- */

static gnp_status add_gradients(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct gnp_train *train = context;
	(void)scratch;
	(void)error;
	for (size_t m = 1; m < train->micros; m++) {
		const float *from = train->gradients + m * train->network->parameter_count;
		for (size_t i = begin; i < end; i++)
			train->gradients[i] += from[i];
	}
	return GNP_OK;
}

double gnp_train_fraction(const struct gnp_train *train)
{
	const struct gnp_train_options *options = &train->options;
	double fraction = options->steps ? (double)train->state.step / (double)options->steps : train->state.seconds / options->seconds;
	return fmin(fraction, 1);
}

static void fill_report(const struct gnp_train *train, struct gnp_train_report *report)
{
	for (size_t m = 0; m < train->micros; m++) {
		const struct share *share = &train->shares[m];
		report->loss += share->loss;
		report->operations += share->operations;
		report->data_seconds += share->seconds;
		add_terms(1, &share->terms, &report->terms);
	}
}

static gnp_status follow_visits(struct gnp_train *train, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	while (status == GNP_OK && gnp_train_window_first(train->window) < train->state.step / train->options.visit)
		status = gnp_train_window_advance(train->window, error);
	return status;
}

/* Leaves a gradient to the one tensor that is trained. */
static void keep_only(const struct gnp_train *train)
{
	const struct gnp_parameter_row *row = gnp_layout_find(train->network->layout, train->options.only);
	size_t end = row->offset + row->count;
	memset(train->gradients, 0, row->offset * sizeof(float));
	memset(train->gradients + end, 0, (train->network->parameter_count - end) * sizeof(float));
}

/* Parameters and their average a step on. The average's first steps weigh what those after them do. */
static gnp_status move(struct gnp_train *train, double rate, struct gnp_error *error)
{
	const struct gnp_train_options *options = &train->options;
	struct gnp_train_state *state = &train->state;
	gnp_status status = GNP_OK;
	if (options->orthogonal && train->network->layout)
		status = gnp_muon_update(train->network->layout, &state->adam, rate, train->gradients, state->parameters,
		                         train->pool, error);
	else
		gnp_adam_update(&state->adam, rate, train->gradients, state->parameters);
	state->step++;
	double share = 1 / (double)(state->step < options->average ? state->step : options->average);
	for (size_t i = 0; i < state->adam.count; i++)
		state->average[i] += (float)(share * ((double)state->parameters[i] - (double)state->average[i]));
	return status;
}

gnp_status gnp_train_step(struct gnp_train *train, struct gnp_train_report *report, struct gnp_error *error)
{
	const struct gnp_train_options *options = &train->options;
	struct gnp_train_state *state = &train->state;
	struct gnp_train_report done = {0};
	double started = gnp_clock();
	gnp_status status = follow_visits(train, error);
	if (status == GNP_OK)
		status = train->network->load(train->network->state, state->parameters, error);
	if (status == GNP_OK)
		status = gnp_pool_run(train->pool, NULL, train->micros, 1, run_micros, train, error);
	if (status == GNP_OK)
		status = gnp_pool_run(train->pool, NULL, train->network->parameter_count, PARAMETERS_A_CHUNK, add_gradients, train, error);
	if (status != GNP_OK)
		return status;
	if (options->only)
		keep_only(train);
	done.norm = gnp_gradient_clip(train->gradients, train->network->parameter_count, options->clip);
	done.rate = options->rate * gnp_rate_factor(state->step, options->warm, gnp_train_fraction(train), options->last);
	status = move(train, done.rate, error);
	if (status != GNP_OK)
		return status;
	state->seconds += gnp_clock() - started;
	fill_report(train, &done);
	if (report)
		*report = done;
	return GNP_OK;
}

/* ---- Beginning and end ---- */

static gnp_status check_options(const struct gnp_train_options *options, const struct gnp_trainable *network,
                                struct gnp_error *error)
{
	size_t micros = options->micro ? options->batch / options->micro : 0;
	if (micros == 0 || micros > MICROS_MAX || options->batch % options->micro)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "batch: got %zu, need a multiple of %zu, the micro-batch, up to %d of them",
		                     options->batch, options->micro, MICROS_MAX);
	if (options->data.shapes == 0 || options->window == 0 || options->visit == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "shapes, window, visit: got %zu, %zu, %llu, need at least 1 each",
		                     options->data.shapes, options->window, (unsigned long long)options->visit);
	size_t seen = options->recipe.reach > options->recipe.k ? options->recipe.reach : options->recipe.k;
	if (options->data.points <= 2 * seen)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need more than %zu", options->data.points, 2 * seen);
	if (options->only && (!network->layout || !gnp_layout_find(network->layout, options->only)))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "only: got '%.60s', need a tensor of the network",
		                     options->only);
	if (options->average == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "average: got 0 steps, need at least 1");
	if (!options->steps && !(options->seconds > 0))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "training: got no steps and no seconds, need one of them");
	return gnp_seed_check_training(options->data.shapes, error);
}

/* What a checkpoint must have been made by to be gone on from. */
static void describe(const struct gnp_train *train, char *text, size_t size)
{
	snprintf(text, size, "regime %s k %zu buffer %g %s", gnp_regime_info(train->options.data.regime)->name, train->options.recipe.k,
	         train->options.recipe.buffer, train->network->name);
}

/* What follows from data is set from patches of the first clouds. */
static gnp_status calibrate_by(struct gnp_train *train, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_trainable *network = train->network;
	size_t count = train->options.window;
	struct gnp_random random;
	struct gnp_train_patches *sets = gnp_scratch_take(scratch, count, sizeof *sets);
	gnp_status status = sets ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu sets of patches", count);
	gnp_random_seed(&random, train->options.data.seed, STREAM_CALIBRATION);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		status = gnp_train_patches_draw(gnp_train_window_at(train->window, i), &train->options.recipe, CALIBRATION_PATCHES, &random,
		                                scratch, &sets[i], error);
	if (status == GNP_OK)
		status = network->calibrate(network->state, sets, count, train->state.parameters, scratch, error);
	return status;
}

static gnp_status calibrate(struct gnp_train *train, struct gnp_error *error)
{
	struct gnp_scratch *scratch = gnp_scratch_create();
	if (!scratch)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory");
	gnp_status status = calibrate_by(train, scratch, error);
	gnp_scratch_free(scratch);
	return status;
}

static gnp_status start(struct gnp_train *train, const char *resume, struct gnp_error *error)
{
	size_t count = train->network->parameter_count, total;
	char what[320];
	gnp_status status = gnp_train_state_create(count, &train->state, error);
	if (status != GNP_OK)
		return status;
	train->shares = gnp_array_zero(train->micros, sizeof *train->shares);
	train->gradients = gnp_size_multiply(train->micros, count, &total) ? gnp_array_new(total, sizeof *train->gradients) : NULL;
	if (!train->shares || !train->gradients)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu gradients of %zu", train->micros, count);
	describe(train, what, sizeof what);
	if (resume)
		status = gnp_train_state_load(resume, what, &train->state, error);
	else
		train->network->initialize(train->network->state, train->options.data.seed, train->state.parameters);
	if (status == GNP_OK)
		status = gnp_train_window_open(&train->options.data, train->options.window, train->state.step / train->options.visit,
		                               train->pool, &train->window, error);
	if (status == GNP_OK && !resume && train->network->calibrate)
		status = calibrate(train, error);
	if (status == GNP_OK && !resume)
		memcpy(train->state.average, train->state.parameters, count * sizeof(float));
	return status;
}

gnp_status gnp_train_open(const struct gnp_train_options *options, const struct gnp_trainable *network, const char *resume,
                          struct gnp_pool *pool, struct gnp_train **out, struct gnp_error *error)
{
	gnp_status status = check_options(options, network, error);
	struct gnp_train *train = status == GNP_OK ? calloc(1, sizeof *train) : NULL;
	if (!train)
		return gnp_error_set(error, status == GNP_OK ? GNP_OUT_OF_MEMORY : status, "training: no memory");
	*train = (struct gnp_train){.options = *options, .network = network, .pool = pool, .micros = options->batch / options->micro};
	status = start(train, resume, error);
	if (status == GNP_OK)
		*out = train;
	else
		gnp_train_close(train);
	return status;
}

void gnp_train_close(struct gnp_train *train)
{
	if (!train)
		return;
	gnp_train_window_close(train->window);
	gnp_train_state_clear(&train->state);
	free(train->gradients);
	free(train->shares);
	free(train);
}

const struct gnp_train_state *gnp_train_state(const struct gnp_train *train)
{
	return &train->state;
}

gnp_status gnp_train_save(const struct gnp_train *train, const char *path, struct gnp_error *error)
{
	char what[320];
	describe(train, what, sizeof what);
	return gnp_train_state_save(path, what, &train->state, error);
}
