#include "weights/train/any/any_run.h"

#include <math.h>
#include <string.h>

#include "weights/protocol/protocol.h"
#include "weights/train/history.h"
#include "weights/train/train_files.h"

/* Columns of the history: means since the row before, and what the watched clouds say. */
enum {
	SECONDS, PACE, RATE, NORM, LOSS, SURFACE, CREASE, OUTLIER, NODES, ERRORS, ANGLE, WATCHED,
	COLUMNS = WATCHED + GNP_ANY_FIGURES
};

static void column_name(size_t column, char *name, size_t size)
{
	static const char *const names[WATCHED] = {
		"seconds", "supports_per_second", "rate", "gradient_norm", "loss", "surface", "crease", "outlier", "nodes",
		"errors", "angle"};
	if (column < WATCHED)
		snprintf(name, size, "%s", names[column]);
	else
		snprintf(name, size, "watched_%s", gnp_any_figure_name((enum gnp_any_figure)(column - WATCHED)));
}

static const struct gnp_history_columns columns = {COLUMNS, column_name};

struct running {
	const struct gnp_any_run_options *options;
	struct gnp_pool *pool;
	FILE *lines;
	struct gnp_train_files files;
	struct gnp_any_train *train;
	struct gnp_any_watch *watch;
	struct gnp_history history;
	/* Since the last row: sums of the reports, and when it was. */
	bool frames; /* they are of the first phase */
	struct gnp_any_report sums;
	uint64_t steps;
	double row_at, watch_at, save_at; /* by the clock */
};

struct gnp_any_run_options gnp_any_run_defaults(void)
{
	return (struct gnp_any_run_options){.train = gnp_any_train_defaults(), .watch_clouds = 36, .watch_centres = 200,
	                                    .line_seconds = 10, .watch_seconds = 120, .save_seconds = 60};
}

/* ---- Rows ---- */

static void add_report(const struct gnp_any_report *report, struct running *running)
{
	const struct gnp_any_terms *from = &report->terms;
	struct gnp_any_terms *to = &running->sums.terms;
	running->sums.loss += report->loss;
	running->sums.norm += report->norm;
	running->sums.rate = report->rate;
	to->surface += from->surface;
	to->crease += from->crease;
	to->outlier += from->outlier;
	to->nodes += from->nodes;
	to->errors += from->errors;
	to->angle += from->angle;
	running->frames = report->frames;
	running->steps++;
}

static void make_row(const struct running *running, double now, double row[COLUMNS])
{
	const struct gnp_any_options *options = &running->options->train;
	const struct gnp_any_report *sums = &running->sums;
	double steps = (double)running->steps, each = (double)(running->frames ? options->frame_batch : options->batch);
	row[SECONDS] = gnp_any_train_state(running->train)->seconds;
	row[PACE] = steps * each / (now - running->row_at);
	row[RATE] = sums->rate;
	row[NORM] = sums->norm / steps;
	row[LOSS] = sums->loss / steps;
	row[SURFACE] = sums->terms.surface / steps;
	row[CREASE] = sums->terms.crease / steps;
	row[OUTLIER] = sums->terms.outlier / steps;
	row[NODES] = sums->terms.nodes / steps;
	row[ERRORS] = sums->terms.errors / steps;
	row[ANGLE] = 180 / M_PI * sqrt(sums->terms.angle / steps);
	for (int f = 0; f < GNP_ANY_FIGURES; f++)
		row[WATCHED + f] = NAN;
}

/* Of the phase under way. */
static double minutes_left(const struct running *running, const double row[COLUMNS])
{
	const struct gnp_any_options *options = &running->options->train;
	uint64_t step = gnp_any_train_state(running->train)->step, last = options->frame_steps + options->steps;
	double each = (double)(running->frames ? options->frame_batch : options->batch);
	if (running->frames)
		return (double)(options->frame_steps - step) * each / row[PACE] / 60;
	return options->steps ? (double)(last - step) * each / row[PACE] / 60
	                      : fmax(options->seconds - row[SECONDS], 0) / 60;
}

static void print_row(const struct running *running, const double row[COLUMNS])
{
	FILE *lines = running->lines;
	unsigned long long step = gnp_any_train_state(running->train)->step;
	if (!lines)
		return;
	fprintf(lines, "step %llu: %s %.4g", step, running->frames ? "frames' cost" : "loss", row[LOSS]);
	if (!running->frames)
		fprintf(lines, " (surface %.3g, crease %.3g, outlier %.3g, nodes %.3g; errors %.3g), angle %.3g", row[SURFACE],
		        row[CREASE], row[OUTLIER], row[NODES], row[ERRORS], row[ANGLE]);
	fprintf(lines, "; gradient %.2g, rate %.2g; %.0f %s/s; %.1f min left\n", row[NORM], row[RATE], row[PACE],
	        running->frames ? "frames" : "supports", minutes_left(running, row));
	for (int f = 0; f < GNP_ANY_FIGURES && !isnan(row[WATCHED]); f++)
		fprintf(lines, "%s %s %.3g%s", f ? "," : "watched:", gnp_any_figure_name((enum gnp_any_figure)f),
		        row[WATCHED + f], f == GNP_ANY_FIGURES - 1 ? "\n" : "");
	fflush(lines);
}

static gnp_status look(struct running *running, double figures[GNP_ANY_FIGURES], struct gnp_error *error)
{
	struct gnp_network *network;
	gnp_status status = gnp_network_create(&running->options->train.architecture,
	                                       gnp_any_train_state(running->train)->parameters, &network, error);
	if (status != GNP_OK)
		return status;
	status = gnp_any_watch_run(running->watch, network, figures, error);
	gnp_network_free(network);
	return status;
}

static gnp_status write_row(struct running *running, bool watch, struct gnp_error *error)
{
	double row[COLUMNS];
	make_row(running, gnp_clock(), row);
	gnp_status status = watch && running->watch ? look(running, row + WATCHED, error) : GNP_OK;
	if (status != GNP_OK)
		return status;
	print_row(running, row);
	running->sums = (struct gnp_any_report){0};
	running->steps = 0;
	running->row_at = gnp_clock();
	if (watch)
		running->watch_at = running->row_at;
	status = gnp_history_add(&running->history, gnp_any_train_state(running->train)->step, row, error);
	return status == GNP_OK ? gnp_history_save(&running->history, running->files.history, error) : status;
}

static gnp_status save(struct running *running, struct gnp_error *error)
{
	running->save_at = gnp_clock();
	return gnp_any_train_save(running->train, running->files.checkpoint, error);
}

/* ---- The run ---- */

static bool at_end(const struct running *running)
{
	return !gnp_any_train_in_frames(running->train) && gnp_any_train_fraction(running->train) >= 1;
}

/* Whatever is due after a step. Frames are not watched: there is nothing to fit with yet. */
static gnp_status keep_up(struct running *running, struct gnp_error *error)
{
	const struct gnp_any_run_options *options = running->options;
	double now = gnp_clock();
	bool end = at_end(running), turn = running->frames && !gnp_any_train_in_frames(running->train);
	bool watch = end || (!running->frames && now - running->watch_at >= options->watch_seconds);
	gnp_status status = GNP_OK;
	if (turn)
		running->watch_at = now;
	if (watch || turn || now - running->row_at >= options->line_seconds)
		status = write_row(running, watch, error);
	if (status == GNP_OK && (end || turn || now - running->save_at >= options->save_seconds))
		status = save(running, error);
	return status;
}

static gnp_status take_steps(struct running *running, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	running->row_at = running->watch_at = running->save_at = gnp_clock();
	while (status == GNP_OK && !at_end(running)) {
		struct gnp_any_report report;
		status = gnp_task_check(task, error);
		if (status != GNP_OK) {
			save(running, NULL);
			return status;
		}
		status = gnp_any_train_step(running->train, &report, error);
		if (status != GNP_OK)
			return status;
		add_report(&report, running);
		status = keep_up(running, error);
	}
	return status;
}

static gnp_status open_all(struct running *running, struct gnp_error *error)
{
	const struct gnp_any_run_options *options = running->options;
	gnp_status status = gnp_train_files_name(options->folder, &running->files, error);
	if (status == GNP_OK)
		status = gnp_any_train_open(&options->train, options->resume ? running->files.checkpoint : NULL, running->pool,
		                            &running->train, error);
	if (status == GNP_OK && options->watch_clouds)
		status = gnp_any_watch_open(&options->train.recipe, options->watch_clouds, options->watch_centres,
		                            running->pool, &running->watch, error);
	if (status == GNP_OK && options->resume)
		status = gnp_history_load(running->files.history, gnp_any_train_state(running->train)->step, &running->history,
		                          error);
	return status;
}

static gnp_status draw(const struct running *running, struct gnp_error *error)
{
	static const struct gnp_history_curve curves[] = {{"loss", {150, 150, 150}, LOSS},
	                                                  {"angle", {200, 120, 20}, WATCHED + GNP_ANY_ANGLE},
	                                                  {"ratio", {190, 30, 45}, WATCHED + GNP_ANY_RATIO},
	                                                  {"curvature", {30, 90, 180}, WATCHED + GNP_ANY_CURVATURE}};
	return gnp_history_draw(&running->history, curves, sizeof curves / sizeof *curves, "any", running->files.curve,
	                        error);
}

/* A training that was over when it was resumed has its last row from before. */
static void fill_end(const struct running *running, struct gnp_any_end *end)
{
	const struct gnp_train_state *state = gnp_any_train_state(running->train);
	const struct gnp_history *history = &running->history;
	*end = (struct gnp_any_end){.step = state->step, .seconds = state->seconds};
	for (int f = 0; f < GNP_ANY_FIGURES; f++)
		end->watched[f] = history->count ? history->values[(history->count - 1) * COLUMNS + WATCHED + (size_t)f] : NAN;
}

gnp_status gnp_any_run(const struct gnp_any_run_options *options, struct gnp_pool *pool, struct gnp_task *task,
                       FILE *lines, float *parameters, struct gnp_any_end *end, struct gnp_error *error)
{
	struct running running = {.options = options, .pool = pool, .lines = lines, .history = {.columns = &columns}};
	gnp_status status = open_all(&running, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK && lines)
		fprintf(lines, "seed %llu; watched clouds' from %llu; %u workers\n", (unsigned long long)options->train.seed,
		        (unsigned long long)GNP_SEED_WATCH, gnp_pool_workers(pool));
	if (status == GNP_OK)
		status = take_steps(&running, task, error);
	if (status == GNP_OK)
		status = draw(&running, error);
	if (status == GNP_OK) {
		const struct gnp_train_state *state = gnp_any_train_state(running.train);
		memcpy(parameters, state->parameters, state->adam.count * sizeof *parameters);
		fill_end(&running, end);
	}
	gnp_any_watch_close(running.watch);
	gnp_any_train_close(running.train);
	gnp_history_clear(&running.history);
	return status;
}
