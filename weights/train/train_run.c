#include "weights/train/train_run.h"

#include <math.h>
#include <string.h>

#include "weights/train/sgemm_rate.h"
#include "weights/train/train_files.h"
#include "weights/train/train_watch.h"

struct running {
	const struct gnp_train_run_options *options;
	const struct gnp_trainable *network;
	struct gnp_pool *pool;
	FILE *lines;
	struct gnp_train_files files;
	struct gnp_train *train;
	struct gnp_train_watch *watch;
	struct gnp_train_log log;
	double sgemm; /* operations a second of all workers */
	/* Since the last row: sums of the reports, and when it was. */
	struct gnp_train_report sums;
	uint64_t steps;
	double row_at, watch_at, save_at; /* by the clock */
};

struct gnp_train_run_options gnp_train_run_defaults(void)
{
	return (struct gnp_train_run_options){.train = gnp_train_defaults(), .watch_shapes = 8, .watch_centres = 200,
	                                      .line_seconds = 10, .watch_seconds = 120, .save_seconds = 60};
}

/* ---- Rows ---- */

static void add_report(const struct gnp_train_report *report, double scale, struct gnp_train_report *sums)
{
	sums->loss += scale * report->loss;
	sums->norm += scale * report->norm;
	sums->operations += scale * report->operations;
	sums->data_seconds += scale * report->data_seconds;
	for (int t = 0; t < GNP_LOSS_TERMS; t++) {
		sums->terms.patch[t] += scale * report->terms.patch[t];
		sums->terms.centre[t] += scale * report->terms.centre[t];
		sums->terms.cell[t] += scale * report->terms.cell[t];
		sums->terms.near[t] += scale * report->terms.near[t];
	}
	sums->rate = report->rate;
}

static struct gnp_train_row make_row(const struct running *running, double now)
{
	const struct gnp_train_state *state = gnp_train_state(running->train);
	struct gnp_train_row row = {.step = state->step, .seconds = state->seconds};
	double patches = (double)running->steps * (double)running->options->train.batch;
	add_report(&running->sums, 1 / (double)running->steps, &row.report);
	row.report.operations /= (double)running->options->train.batch;
	row.patches_per_second = patches / (now - running->row_at);
	for (int s = 0; s < GNP_SCORES; s++)
		row.watched[s] = NAN;
	return row;
}

static void print_terms(FILE *lines, const char *name, const double *terms, const struct gnp_loss_rule *rule)
{
	if (gnp_loss_rule_asks(rule))
		fprintf(lines, "; %s", name);
	for (int t = 0; t < GNP_LOSS_TERMS; t++)
		if (rule->lambda[t] > 0)
			fprintf(lines, " %s %.3g", gnp_loss_name((enum gnp_loss_term)t), terms[t]);
}

static double seconds_left(const struct running *running, const struct gnp_train_row *row)
{
	const struct gnp_train_options *options = &running->options->train;
	if (!options->steps)
		return fmax(options->seconds - row->seconds, 0);
	return (double)(options->steps - row->step) * (double)options->batch / row->patches_per_second;
}

static void print_row(const struct running *running, const struct gnp_train_row *row, double now)
{
	const struct gnp_loss_options *loss = &running->options->train.loss;
	FILE *lines = running->lines;
	double busy = (now - running->row_at) * gnp_pool_workers(running->pool);
	if (!lines)
		return;
	fprintf(lines, "step %llu: loss %.4g", (unsigned long long)row->step, row->report.loss);
	print_terms(lines, "patch", row->report.terms.patch, &loss->patch);
	print_terms(lines, "centre", row->report.terms.centre, &loss->centre);
	print_terms(lines, "cell", row->report.terms.cell, &loss->cell);
	fprintf(lines, "; gradient %.2g, rate %.2g; %.0f patches/s", row->report.norm, row->report.rate, row->patches_per_second);
	if (row->report.operations > 0)
		fprintf(lines, ", %.0f%% of sgemm's %.0f GFLOP/s", 100 * row->report.operations * row->patches_per_second / running->sgemm,
		        running->sgemm / 1e9);
	fprintf(lines, ", data %.0f%%; %.1f min left\n", 100 * running->sums.data_seconds / busy, seconds_left(running, row) / 60);
	if (!isnan(row->watched[0])) {
		fprintf(lines, "watched");
		for (int s = 0; s < GNP_SCORES; s++)
			fprintf(lines, "%s %s %.3g", s ? "," : ":", gnp_score_heading((enum gnp_score)s), row->watched[s]);
		fprintf(lines, "\n");
	}
	fflush(lines);
}

static gnp_status write_row(struct running *running, bool watch, struct gnp_error *error)
{
	double now = gnp_clock();
	struct gnp_train_row row = make_row(running, now);
	gnp_status status = GNP_OK;
	if (watch && running->watch)
		status = gnp_train_watch_run(running->watch, gnp_train_state(running->train)->average, row.watched, error);
	if (watch && status == GNP_OK) /* others use this machine too: the yardstick changes */
		status = gnp_sgemm_rate(running->pool, &running->sgemm, error);
	if (status != GNP_OK)
		return status;
	print_row(running, &row, now);
	running->sums = (struct gnp_train_report){0};
	running->steps = 0;
	running->row_at = gnp_clock();
	if (watch)
		running->watch_at = running->row_at;
	status = gnp_train_log_add(&running->log, &row, error);
	return status == GNP_OK ? gnp_train_log_save(&running->log, running->files.history, error) : status;
}

static gnp_status save(struct running *running, struct gnp_error *error)
{
	running->save_at = gnp_clock();
	return gnp_train_save(running->train, running->files.checkpoint, error);
}

/* ---- The run ---- */

/* Whatever is due after a step. */
static gnp_status keep_up(struct running *running, bool end, struct gnp_error *error)
{
	const struct gnp_train_run_options *options = running->options;
	double now = gnp_clock();
	bool watch = end || now - running->watch_at >= options->watch_seconds;
	gnp_status status = GNP_OK;
	if (watch || now - running->row_at >= options->line_seconds)
		status = write_row(running, watch, error);
	if (status == GNP_OK && (end || now - running->save_at >= options->save_seconds))
		status = save(running, error);
	return status;
}

static gnp_status take_steps(struct running *running, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	running->row_at = running->watch_at = running->save_at = gnp_clock();
	while (status == GNP_OK && gnp_train_fraction(running->train) < 1) {
		struct gnp_train_report report;
		status = gnp_task_check(task, error);
		if (status != GNP_OK) {
			save(running, NULL);
			return status;
		}
		status = gnp_train_step(running->train, &report, error);
		if (status != GNP_OK)
			return status;
		add_report(&report, 1, &running->sums);
		running->steps++;
		status = keep_up(running, gnp_train_fraction(running->train) >= 1, error);
	}
	return status;
}

static gnp_status open_all(struct running *running, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_train_run_options *options = running->options;
	gnp_status status = gnp_train_files_name(options->folder, &running->files, error);
	if (status == GNP_OK)
		status = gnp_train_data_ensure(&options->train.data, options->watch_shapes, running->pool, task, error);
	if (status == GNP_OK)
		status = gnp_sgemm_rate(running->pool, &running->sgemm, error);
	if (status == GNP_OK)
		status = gnp_train_open(&options->train, running->network, options->resume ? running->files.checkpoint : NULL,
		                        running->pool, &running->train, error);
	if (status == GNP_OK && options->watch_shapes)
		status = gnp_train_watch_open(&options->train.data, &options->train.recipe, options->watch_shapes, options->watch_centres,
		                              running->network, running->pool, &running->watch, error);
	if (status == GNP_OK && options->resume)
		status = gnp_train_log_load(running->files.history, gnp_train_state(running->train)->step, &running->log,
		                            error);
	return status;
}

gnp_status gnp_train_run(const struct gnp_train_run_options *options, const struct gnp_trainable *network,
                         struct gnp_pool *pool, struct gnp_task *task, FILE *lines, float *parameters, struct gnp_train_row *last,
                         struct gnp_error *error)
{
	struct running running = {.options = options, .network = network, .pool = pool, .lines = lines};
	char title[96];
	gnp_status status = open_all(&running, task, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK && lines)
		fprintf(lines, "seed %llu; shapes' seeds 0..%zu, watched ones' from %llu; %u workers\n",
		        (unsigned long long)options->train.data.seed, options->train.data.shapes - 1, (unsigned long long)GNP_SEED_WATCH,
		        gnp_pool_workers(pool));
	if (status == GNP_OK)
		status = take_steps(&running, task, error);
	snprintf(title, sizeof title, "%s: %.50s", gnp_regime_info(options->train.data.regime)->name, network->name);
	if (status == GNP_OK)
		status = gnp_train_log_draw(&running.log, title, running.files.curve, error);
	if (status == GNP_OK) {
		memcpy(parameters, gnp_train_state(running.train)->average, network->parameter_count * sizeof *parameters);
		*last = running.log.count ? running.log.rows[running.log.count - 1] : (struct gnp_train_row){0};
	}
	gnp_train_watch_close(running.watch);
	gnp_train_close(running.train);
	gnp_train_log_clear(&running.log);
	return status;
}
