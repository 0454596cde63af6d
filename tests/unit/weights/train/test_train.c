/* The training loop, on a network small enough to see through: coefficients = M (moments of the heights). */
#include <unistd.h>

#include "core/linear/linalg.h"
#include "tests/unit/test.h"
#include "weights/train/loss_rule.h"
#include "weights/train/train.h"
#include "weights/train/train_fit.h"
#include "weights/train/train_log.h"
#include "weights/train/train_run.h"
#include "weights/train/train_watch.h"

enum { POINTS = 4000, DEGREE = 3, SIZE = 10, PARAMETERS = SIZE * SIZE, FILE_BYTES = 8192 };

static char folder[64], checkpoint[96];

/* ---- Adam ---- */

static void adam_follows_its_definition(void)
{
	struct gnp_adam adam;
	float x[2] = {1, -2};
	double y[2] = {1, -2}, m[2] = {0}, v[2] = {0};
	CHECK(gnp_adam_create(2, &adam, NULL) == GNP_OK);
	for (int t = 1; t <= 50; t++) {
		const float gradient[2] = {2 * x[0], (float)sin(t)};
		gnp_adam_update(&adam, 0.01, gradient, x);
		for (int i = 0; i < 2; i++) {
			m[i] = 0.9 * m[i] + 0.1 * (double)gradient[i];
			v[i] = 0.999 * v[i] + 0.001 * (double)gradient[i] * (double)gradient[i];
			y[i] -= 0.01 * (m[i] / (1 - pow(0.9, t))) / (sqrt(v[i] / (1 - pow(0.999, t))) + 1e-8);
			CHECK_NEAR(x[i], y[i], 2e-5);
		}
	}
	gnp_adam_clear(&adam);
}

static void gradients_are_clipped_by_their_norm(void)
{
	float gradient[3] = {3, 0, -4}, broken[2] = {1, NAN};
	CHECK_NEAR(gnp_gradient_clip(gradient, 3, 10), 5, 1e-12);
	CHECK(gradient[0] == 3 && gradient[2] == -4);
	CHECK_NEAR(gnp_gradient_clip(gradient, 3, 1), 5, 1e-12);
	CHECK_NEAR(gradient[0], 0.6, 1e-7);
	CHECK_NEAR(gradient[2], -0.8, 1e-7);
	CHECK(isnan(gnp_gradient_clip(broken, 2, 1)));
	CHECK(broken[0] == 0 && broken[1] == 0);
}

static void rate_rises_and_falls(void)
{
	CHECK_NEAR(gnp_rate_factor(0, 9, 0, 0.1), 0.1, 1e-12);
	CHECK_NEAR(gnp_rate_factor(4, 9, 0, 0.1), 0.5, 1e-12);
	CHECK_NEAR(gnp_rate_factor(9, 9, 0, 0.1), 1, 1e-12);
	CHECK_NEAR(gnp_rate_factor(1000, 9, 0.5, 0.1), 0.55, 1e-12);
	CHECK_NEAR(gnp_rate_factor(1000, 9, 1, 0.1), 0.1, 1e-12);
}

/* ---- A network ---- */

struct toy {
	const float *matrix; /* (SIZE, SIZE) */
};

static void moments_of(const struct gnp_train_patches *patches, size_t p, double moments[SIZE])
{
	memset(moments, 0, SIZE * sizeof *moments);
	for (size_t i = 0; i < patches->inner[p]; i++) {
		const float *node = patches->nodes + 3 * (patches->start[p] + i);
		double u = node[0], v = node[1], phi[16];
		gnp_basis_rows((struct gnp_basis){GNP_BASIS_TOTAL, DEGREE}, &u, &v, 1, 16, phi);
		for (int b = 0; b < SIZE; b++)
			moments[b] += phi[b] * node[2] / (double)patches->inner[p];
	}
}

static void toy_initialize(const void *state, uint64_t seed, float *parameters)
{
	struct gnp_random random;
	(void)state;
	gnp_random_seed(&random, seed, 0);
	for (int i = 0; i < PARAMETERS; i++)
		parameters[i] = (float)(0.1 * gnp_random_normal(&random));
}

static gnp_status toy_load(void *state, const float *parameters, struct gnp_error *error)
{
	(void)error;
	((struct toy *)state)->matrix = parameters;
	return GNP_OK;
}

static gnp_status toy_forward(const void *state, const struct gnp_train_patches *patches, double *coefficients, void **tape,
                              struct gnp_scratch *scratch, struct gnp_error *error)
{
	const float *matrix = ((const struct toy *)state)->matrix;
	double *moments = gnp_scratch_take(scratch, patches->count, SIZE * sizeof *moments);
	(void)error;
	for (size_t p = 0; p < patches->count; p++) {
		moments_of(patches, p, moments + SIZE * p);
		for (int a = 0; a < SIZE; a++) {
			coefficients[SIZE * p + a] = 0;
			for (int b = 0; b < SIZE; b++)
				coefficients[SIZE * p + a] += matrix[SIZE * a + b] * moments[SIZE * p + b];
		}
	}
	if (tape)
		*tape = moments;
	return GNP_OK;
}

static gnp_status toy_backward(const void *state, const struct gnp_train_patches *patches, const void *tape,
                               const double *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	const double *moments = tape;
	(void)state;
	(void)scratch;
	(void)error;
	for (size_t p = 0; p < patches->count; p++)
		for (int a = 0; a < SIZE; a++)
			for (int b = 0; b < SIZE; b++)
				gradient[SIZE * a + b] += (float)(dcoefficients[SIZE * p + a] * moments[SIZE * p + b]);
	return GNP_OK;
}

static gnp_status toy_calibrate(const void *state, const struct gnp_train_patches *sets, size_t count, float *parameters,
                                struct gnp_scratch *scratch, struct gnp_error *error)
{
	(void)state;
	(void)scratch;
	(void)error;
	for (size_t i = 0; i < count; i++)
		parameters[0] += (float)sets[i].count;
	return GNP_OK;
}

static struct gnp_trainable network_of(struct toy *toy)
{
	return (struct gnp_trainable){.name = "toy", .parameter_count = PARAMETERS, .basis = {GNP_BASIS_TOTAL, DEGREE}, .state = toy,
	                                  .initialize = toy_initialize, .load = toy_load, .forward = toy_forward,
	                                  .backward = toy_backward};
}

static struct gnp_train_options options_of(uint64_t steps)
{
	struct gnp_train_options options = gnp_train_defaults();
	options.data = (struct gnp_train_data){.folder = folder, .shapes = 3, .points = POINTS, .regime = GNP_REGIME_NOISE_70, .seed = 5};
	options.recipe = (struct gnp_train_recipe){.k = 30, .delta0_ratio = 0.5, .buffer = 1.25};
	options.batch = 12;
	options.micro = 4;
	options.window = 2;
	options.visit = 2;
	options.steps = steps;
	options.warm = 5;
	options.rate = 0.03;
	return options;
}

static struct gnp_train *open_train(const struct gnp_train_options *options, const struct gnp_trainable *network,
                                    const char *resume, struct gnp_pool *pool)
{
	struct gnp_train *train;
	struct gnp_error error = {0};
	if (gnp_train_open(options, network, resume, pool, &train, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return train;
}

/* Takes steps, resuming a checkpoint or not, leaves one, and gives back its bytes but for the seconds and so the digest. */
static size_t run(unsigned workers, uint64_t steps, bool resume, unsigned char bytes[FILE_BYTES])
{
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_options options = options_of(6);
	struct gnp_pool *pool;
	CHECK(gnp_pool_create(workers, &pool, NULL) == GNP_OK);
	struct gnp_train *train = open_train(&options, &network, resume ? checkpoint : NULL, pool);
	for (uint64_t i = 0; i < steps; i++)
		CHECK(gnp_train_step(train, NULL, NULL) == GNP_OK);
	CHECK(gnp_train_save(train, checkpoint, NULL) == GNP_OK);
	gnp_train_close(train);
	gnp_pool_free(pool);
	FILE *file = fopen(checkpoint, "rb");
	size_t size = fread(bytes, 1, FILE_BYTES, file);
	fclose(file);
	memset(bytes + size - sizeof(double), 0, sizeof(double));
	memset(strstr((char *)bytes, " sha256 "), 0, 72);
	return size;
}

static void going_on_is_as_never_having_stopped(void)
{
	static unsigned char straight[FILE_BYTES], parts[FILE_BYTES];
	size_t size = run(2, 6, false, straight);
	run(2, 3, false, parts);
	CHECK(memcmp(straight, parts, size) != 0);
	CHECK(run(2, 3, true, parts) == size && memcmp(straight, parts, size) == 0);
}

static void the_number_of_workers_does_not_matter(void)
{
	static unsigned char one[FILE_BYTES], three[FILE_BYTES];
	size_t size = run(1, 4, false, one);
	CHECK(run(3, 4, false, three) == size && memcmp(one, three, size) == 0);
}

static void checkpoints_of_other_trainings_are_refused(void)
{
	unsigned char bytes[FILE_BYTES];
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_options options = options_of(6);
	struct gnp_pool *pool;
	struct gnp_train *train;
	struct gnp_error error = {0}, damaged = {0}, missing = {0};
	run(1, 1, false, bytes);
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	options.data.regime = GNP_REGIME_CLEAN_30;
	CHECK(gnp_train_open(&options, &network, checkpoint, pool, &train, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text,
	               "it is no file of \"gnp-train-checkpoint 2 parameters 100 regime clean-30 k 30 buffer 1.25 toy\"");
	options.data.regime = GNP_REGIME_NOISE_70;
	FILE *file = fopen(checkpoint, "r+b");
	CHECK(fseek(file, 700, SEEK_SET) == 0 && fputc(1, file) == 1 && fclose(file) == 0);
	CHECK(gnp_train_open(&options, &network, checkpoint, pool, &train, &damaged) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(damaged.text, "it is damaged");
	CHECK(truncate(checkpoint, 700) == 0);
	CHECK(gnp_train_open(&options, &network, checkpoint, pool, &train, NULL) == GNP_INVALID_ARGUMENT);
	CHECK(gnp_train_open(&options, &network, "/proc/none", pool, &train, &missing) == GNP_IO);
	gnp_pool_free(pool);
}

static void bad_options_are_named(void)
{
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_options options = options_of(6);
	struct gnp_train *train;
	struct gnp_error error = {0};
	options.batch = 13;
	CHECK(gnp_train_open(&options, &network, NULL, NULL, &train, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "batch: got 13, need a multiple of 4, the micro-batch, up to 4096 of them");
}

static void calibration_comes_before_the_first_step_only(void)
{
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_options options = options_of(6);
	struct gnp_pool *pool;
	unsigned char bytes[FILE_BYTES];
	network.calibrate = toy_calibrate;
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	struct gnp_train *train = open_train(&options, &network, NULL, pool);
	CHECK(gnp_train_state(train)->parameters[0] > 250);
	gnp_train_close(train);
	run(1, 1, false, bytes);
	train = open_train(&options, &network, checkpoint, pool);
	CHECK(gnp_train_state(train)->parameters[0] < 1);
	gnp_train_close(train);
	gnp_pool_free(pool);
}

/* Its surface is the patch's plane. */
static void a_network_that_sees_nothing_errs_by_all_there_is(void)
{
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_options options = options_of(6);
	struct gnp_pool *pool;
	struct gnp_train_watch *watch;
	float nothing[PARAMETERS] = {0};
	double errors[GNP_SCORES], again[GNP_SCORES];
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	CHECK(gnp_train_watch_open(&options.data, &options.recipe, 2, 21, &network, pool, &watch, NULL) == GNP_OK);
	CHECK(gnp_train_watch_run(watch, nothing, errors, NULL) == GNP_OK);
	CHECK_NEAR(errors[GNP_SCORE_SECOND_FORM], 1, 1e-12);
	CHECK_NEAR(errors[GNP_SCORE_GAUSSIAN], 1, 1e-12);
	CHECK_NEAR(errors[GNP_SCORE_MEAN], 1, 1e-12);
	CHECK(errors[GNP_SCORE_NORMAL] > 0 && errors[GNP_SCORE_NORMAL] < 0.1);
	CHECK(gnp_train_watch_run(watch, nothing, again, NULL) == GNP_OK);
	CHECK(memcmp(errors, again, sizeof errors) == 0);
	gnp_train_watch_close(watch);
	gnp_train_watch_close(NULL);
	gnp_pool_free(pool);
}

static void histories_are_read_back_up_to_a_step(void)
{
	struct gnp_train_log log = {0}, read = {0}, none = {0};
	char path[96], picture[96];
	snprintf(path, sizeof path, "%s/history.csv", folder);
	snprintf(picture, sizeof picture, "%s/history.png", folder);
	for (uint64_t i = 1; i <= 70; i++) {
		struct gnp_train_row row = {.step = 10 * i, .seconds = 0.5 * (double)i, .report = {.loss = 1 / (double)i}};
		row.report.terms.centre[GNP_LOSS_MEAN] = (double)i;
		row.report.terms.near[GNP_LOSS_HEIGHT] = 2 * (double)i;
		row.watched[GNP_SCORE_GAUSSIAN] = i % 10 ? NAN : 0.5;
		CHECK(gnp_train_log_add(&log, &row, NULL) == GNP_OK);
	}
	CHECK(gnp_train_log_save(&log, path, NULL) == GNP_OK);
	CHECK(gnp_train_log_load(path, 305, &read, NULL) == GNP_OK);
	CHECK(read.count == 30 && read.rows[29].step == 300 && isnan(read.rows[28].watched[GNP_SCORE_GAUSSIAN]));
	CHECK_NEAR(read.rows[29].report.loss, 1.0 / 30, 1e-6);
	CHECK(read.rows[29].report.terms.centre[GNP_LOSS_MEAN] == 30 && read.rows[29].watched[GNP_SCORE_GAUSSIAN] == 0.5);
	CHECK(read.rows[29].report.terms.near[GNP_LOSS_HEIGHT] == 60 &&
	      read.rows[29].report.terms.cell[GNP_LOSS_HEIGHT] == 0);
	CHECK(gnp_train_log_draw(&log, "clean-30", picture, NULL) == GNP_OK);
	CHECK(gnp_train_log_draw(&none, "nothing yet", picture, NULL) == GNP_OK);
	CHECK(gnp_train_log_load("/proc/none", 1, &none, NULL) == GNP_OK && none.count == 0);
	struct gnp_error error = {0};
	CHECK(gnp_train_log_load(picture, 1, &none, &error) == GNP_INVALID_ARGUMENT);
	gnp_train_log_clear(&log);
	gnp_train_log_clear(&read);
	gnp_train_log_clear(&none);
}

/* A run that is cancelled and resumed ends with the history of all its steps. */
static void runs_are_resumed(void)
{
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_run_options options = gnp_train_run_defaults();
	struct gnp_pool *pool;
	struct gnp_task task;
	struct gnp_train_row last;
	float parameters[PARAMETERS];
	char path[128];
	snprintf(path, sizeof path, "%s/run", folder);
	options.train = options_of(6);
	options.folder = path;
	options.watch_shapes = 1;
	options.watch_centres = 10;
	options.line_seconds = 0;
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	gnp_task_init(&task);
	CHECK(gnp_train_run(&options, &network, pool, &task, NULL, parameters, &last, NULL) == GNP_OK);
	CHECK(last.step == 6 && !isnan(last.watched[GNP_SCORE_MEAN]));

	options.train.steps = 3;
	CHECK(gnp_train_run(&options, &network, pool, &task, NULL, parameters, &last, NULL) == GNP_OK);
	options.train.steps = 6;
	options.resume = true;
	gnp_task_cancel(&task);
	CHECK(gnp_train_run(&options, &network, pool, &task, NULL, parameters, &last, NULL) == GNP_CANCELLED);
	gnp_task_init(&task);
	CHECK(gnp_train_run(&options, &network, pool, &task, NULL, parameters, &last, NULL) == GNP_OK);
	struct gnp_train_log log = {0};
	snprintf(path + strlen(path), sizeof path - strlen(path), "/history.csv");
	CHECK(gnp_train_log_load(path, 6, &log, NULL) == GNP_OK);
	CHECK(log.count == 6 && log.rows[5].step == 6 && log.rows[5].patches_per_second > 0);
	gnp_train_log_clear(&log);
	gnp_pool_free(pool);
}

static void rules_of_the_loss_are_read(void)
{
	struct gnp_loss_rule rule = gnp_loss_defaults().patch;
	struct gnp_error error = {0};
	char text[200];
	CHECK(gnp_loss_rule_parse("normal=0,mean_curvature=2,floor=0.25", "--patch", &rule, NULL) == GNP_OK);
	gnp_loss_rule_print(&rule, text, sizeof text);
	CHECK_STRING(text, "height=1,inverse_metric=0.5,second_form=0.5,gaussian_curvature=0.5,mean_curvature=2,floor=0.25,most=5");
	static const char *const bad[] = {"", "height", "height=", "height=x", "height=1,", "heigh=1", "height=-1", "height=nan",
	                                  "height=1;normal=1", "most=0", "=1"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		CHECK(gnp_loss_rule_parse(bad[i], "--patch", &rule, NULL) == GNP_INVALID_ARGUMENT);
	CHECK(gnp_loss_rule_parse("normal=1,hight=1", "--patch", &rule, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "--patch: got 'hight=1', need NAME=NUMBER");
	CHECK(rule.lambda[GNP_LOSS_NORMAL] == 0);
}

/* Of the parameters after each of the last steps, which is all of them while those are few. */
static void the_result_is_the_average_of_the_last_steps(void)
{
	enum { STEPS = 6 };
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_options options = options_of(STEPS);
	struct gnp_pool *pool;
	double sum[PARAMETERS] = {0}, running[PARAMETERS] = {0};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	for (uint64_t average = 1; average <= 100; average *= 10) {
		options.average = average == 10 ? 2 : average;
		memset(sum, 0, sizeof sum);
		struct gnp_train *train = open_train(&options, &network, NULL, pool);
		CHECK(memcmp(gnp_train_state(train)->average, gnp_train_state(train)->parameters, PARAMETERS * sizeof(float)) ==
		      0);
		for (int step = 1; step <= STEPS; step++) {
			CHECK(gnp_train_step(train, NULL, NULL) == GNP_OK);
			const struct gnp_train_state *state = gnp_train_state(train);
			for (int i = 0; i < PARAMETERS; i++) {
				sum[i] += (double)state->parameters[i];
				running[i] =
					step == 1 ? (double)state->parameters[i] : 0.5 * (running[i] + (double)state->parameters[i]);
				CHECK_NEAR(state->average[i],
				           average == 1    ? (double)state->parameters[i]
				           : average == 10 ? running[i]
				                           : sum[i] / step,
				           1e-6);
			}
		}
		gnp_train_close(train);
	}
	gnp_pool_free(pool);
}

static void training_learns(void)
{
	struct toy toy;
	struct gnp_trainable network = network_of(&toy);
	struct gnp_train_options options = options_of(300);
	struct gnp_pool *pool;
	double early = 0, late = 0;
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	struct gnp_train *train = open_train(&options, &network, NULL, pool);
	for (int i = 0; i < 300; i++) {
		struct gnp_train_report report;
		CHECK(gnp_train_step(train, &report, NULL) == GNP_OK);
		early += i < 20 ? report.terms.patch[GNP_LOSS_HEIGHT] / 20 : 0;
		late += i >= 280 ? report.terms.patch[GNP_LOSS_HEIGHT] / 20 : 0;
	}
	CHECK(gnp_train_fraction(train) == 1);
	CHECK_AT_MOST(late, 0.7 * early);
	gnp_train_close(train);
	gnp_pool_free(pool);
}

/* The loss through coefficients and jets, by differences. */
static void gradients_reach_the_coefficients(void)
{
	const struct gnp_basis basis = {GNP_BASIS_TENSOR, 3};
	struct gnp_patch patch = {.scale_xy = 0.05, .scale_w = 0.01};
	double c[16], gradient[16] = {0}, rows[6 * GNP_BASIS_MAX], step = 1e-6;
	for (int i = 0; i < 16; i++)
		c[i] = sin(i + 1.0);
	struct gnp_jet at = gnp_train_fit_jet(basis, c, &patch, 0.3, -0.2, rows);
	struct gnp_jet want = gnp_basis_jet(basis, c, 0.3, -0.2), pull = {1, 0.5, -0.3, 0.02, 0.03, -0.01};
	CHECK_NEAR(at.f, 0.01 * want.f, 1e-15);
	CHECK_NEAR(at.v, 0.2 * want.v, 1e-14);
	CHECK_NEAR(at.uv, 4 * want.uv, 1e-12);
	gnp_train_fit_back(basis, rows, &pull, gradient);
	for (int i = 0; i < 16; i++) {
		double sum[2], keep = c[i];
		for (int side = 0; side < 2; side++) {
			double other[6 * GNP_BASIS_MAX];
			c[i] = keep + (side ? step : -step);
			struct gnp_jet jet = gnp_train_fit_jet(basis, c, &patch, 0.3, -0.2, other);
			sum[side] = jet.f + 0.5 * jet.u - 0.3 * jet.v + 0.02 * jet.uu + 0.03 * jet.uv - 0.01 * jet.vv;
		}
		c[i] = keep;
		CHECK_NEAR(gradient[i], (sum[1] - sum[0]) / (2 * step), 1e-7);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(adam_follows_its_definition),
		TEST(gradients_are_clipped_by_their_norm),
		TEST(rate_rises_and_falls),
		TEST(gradients_reach_the_coefficients),
		TEST(going_on_is_as_never_having_stopped),
		TEST(the_number_of_workers_does_not_matter),
		TEST(checkpoints_of_other_trainings_are_refused),
		TEST(bad_options_are_named),
		TEST(calibration_comes_before_the_first_step_only),
		TEST(a_network_that_sees_nothing_errs_by_all_there_is),
		TEST(histories_are_read_back_up_to_a_step),
		TEST(runs_are_resumed),
		TEST(rules_of_the_loss_are_read),
		TEST(the_result_is_the_average_of_the_last_steps),
		TEST(training_learns),
	};
	gnp_linalg_init();
	snprintf(folder, sizeof folder, "/tmp/gnp-train-XXXXXX");
	if (!mkdtemp(folder))
		return 1;
	snprintf(checkpoint, sizeof checkpoint, "%s/checkpoint", folder);
	int failed = RUN_TESTS(tests);
	char command[96];
	snprintf(command, sizeof command, "rm -r %s", folder);
	return system(command) != 0 || failed;
}
