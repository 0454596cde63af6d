/* The loop that trains the model for every cloud: workers, resuming, what it learns, and the run around it with its
 * files. */
#include <unistd.h>

#include "core/linear/linalg.h"
#include "core/model/model.h"
#include "tests/unit/test.h"
#include "weights/protocol/protocol.h"
#include "weights/train/any/any_model.h"
#include "weights/train/any/any_plan.h"
#include "weights/train/train_plan.h"

enum { FILE_BYTES = 1 << 18 };

static char folder[64], checkpoint[96];

static struct gnp_any_options options_of(uint64_t steps)
{
	struct gnp_any_options options = gnp_any_train_defaults();
	struct gnp_architecture *a = &options.architecture;
	a->width = a->neurons = a->head_width = a->node_width = a->frame_width = 8;
	a->layers = 1;
	options.recipe.least = 1000;
	options.recipe.most = 1200;
	options.window = 2;
	options.frame_visit = 2;
	options.visit = 3;
	options.frame_steps = 3;
	options.frame_batch = 64;
	options.steps = steps;
	options.batch = 16;
	options.micro = 8;
	options.seed = 5;
	return options;
}

static struct gnp_any_train *open_train(const struct gnp_any_options *options, const char *resume,
                                        struct gnp_pool *pool)
{
	struct gnp_any_train *train;
	struct gnp_error error = {0};
	if (gnp_any_train_open(options, resume, pool, &train, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return train;
}

static struct gnp_pool *make_pool(unsigned workers)
{
	struct gnp_pool *pool;
	if (gnp_pool_create(workers, &pool, NULL) != GNP_OK)
		exit(1);
	return pool;
}

/* Takes steps, resuming a checkpoint or not, leaves one, and gives back its bytes but for the seconds and so the
 * digest. */
static size_t run(unsigned workers, uint64_t steps, bool resume, unsigned char bytes[FILE_BYTES])
{
	const struct gnp_any_options options = options_of(4);
	struct gnp_pool *pool = make_pool(workers);
	struct gnp_any_train *train = open_train(&options, resume ? checkpoint : NULL, pool);
	struct gnp_any_report report;
	for (uint64_t i = 0; i < steps; i++)
		CHECK(gnp_any_train_step(train, &report, NULL) == GNP_OK);
	CHECK(gnp_any_train_save(train, checkpoint, NULL) == GNP_OK);
	gnp_any_train_close(train);
	gnp_pool_free(pool);
	FILE *file = fopen(checkpoint, "rb");
	size_t size = fread(bytes, 1, FILE_BYTES, file);
	fclose(file);
	CHECK(size > 1000 && size < FILE_BYTES);
	memset(bytes + size - sizeof(double), 0, sizeof(double));
	memset(strstr((char *)bytes, " sha256 "), 0, 72);
	return size;
}

static void the_number_of_workers_does_not_matter(void)
{
	static unsigned char one[FILE_BYTES], three[FILE_BYTES];
	size_t size = run(1, 6, false, one);
	CHECK(run(3, 6, false, three) == size && memcmp(one, three, size) == 0);
}

/* Stopped within the first phase, at its end, and within the second. */
static void going_on_is_as_never_having_stopped(void)
{
	static unsigned char straight[FILE_BYTES], parts[FILE_BYTES];
	size_t size = run(2, 7, false, straight);
	run(2, 2, false, parts);
	run(2, 1, true, parts);
	run(2, 2, true, parts);
	CHECK(memcmp(straight, parts, size) != 0);
	CHECK(run(2, 2, true, parts) == size && memcmp(straight, parts, size) == 0);
}

static void phases_train_what_is_theirs(void)
{
	const struct gnp_any_options options = options_of(2);
	struct gnp_pool *pool = make_pool(2);
	struct gnp_any_train *train = open_train(&options, NULL, pool);
	const struct gnp_train_state *state = gnp_any_train_state(train);
	struct gnp_layout layout;
	struct gnp_any_report report;
	CHECK(gnp_architecture_layout(&options.architecture, &layout, NULL) == GNP_OK);
	size_t frames = gnp_layout_find(&layout, "frame.mean")->offset; /* the last tensors are frames' */
	float *before = malloc(layout.total * sizeof *before);
	memcpy(before, state->parameters, layout.total * sizeof *before);
	for (int i = 0; i < 3; i++)
		CHECK(gnp_any_train_in_frames(train) && gnp_any_train_step(train, &report, NULL) == GNP_OK && report.frames);
	CHECK(memcmp(before, state->parameters, frames * sizeof *before) == 0);
	CHECK(memcmp(before + frames, state->parameters + frames, (layout.total - frames) * sizeof *before) != 0);
	memcpy(before, state->parameters, layout.total * sizeof *before);
	CHECK_NEAR(gnp_any_train_fraction(train), 0, 0);
	for (int i = 0; i < 2; i++)
		CHECK(!gnp_any_train_in_frames(train) && gnp_any_train_step(train, &report, NULL) == GNP_OK && !report.frames);
	CHECK(memcmp(before, state->parameters, frames * sizeof *before) != 0);
	CHECK(memcmp(before + frames, state->parameters + frames, (layout.total - frames) * sizeof *before) == 0);
	CHECK_NEAR(gnp_any_train_fraction(train), 1, 0);
	free(before);
	gnp_any_train_close(train);
	gnp_pool_free(pool);
}

/* Means of the loss over the first and the last fifth of a phase. */
static void train_on(struct gnp_any_train *train, int steps, double *first, double *last)
{
	struct gnp_any_report report;
	*first = *last = 0;
	for (int i = 0; i < steps; i++) {
		CHECK(gnp_any_train_step(train, &report, NULL) == GNP_OK);
		*first += i < steps / 5 ? report.loss / (steps / 5) : 0;
		*last += i >= steps - steps / 5 ? report.loss / (steps / 5) : 0;
	}
}

static void both_phases_learn(void)
{
	enum { FRAMES = 40, STEPS = 40 };
	struct gnp_any_options options = options_of(STEPS);
	struct gnp_pool *pool = make_pool(2);
	double first, last;
	options.recipe.group = GNP_ANY_SOLID;
	options.recipe.noise = options.recipe.outliers = 0;
	options.frame_steps = FRAMES;
	options.frame_visit = options.visit = 1000;
	options.frame_rate = options.rate = 1e-2;
	options.warm = options.frame_warm = 5;
	struct gnp_any_train *train = open_train(&options, NULL, pool);
	train_on(train, FRAMES, &first, &last);
	CHECK_AT_MOST(last, 0.8 * first);
	train_on(train, STEPS, &first, &last);
	CHECK_AT_MOST(last, first - 0.3); /* a logarithm in the main */
	gnp_any_train_close(train);
	gnp_pool_free(pool);
}

static void other_trainings_and_bad_options_are_refused(void)
{
	static unsigned char bytes[FILE_BYTES];
	struct gnp_any_options options = options_of(4), other = options_of(4);
	struct gnp_pool *pool = make_pool(1);
	struct gnp_any_train *train;
	struct gnp_error odd = {0}, judged = {0}, stranger = {0};
	options.micro = 6;
	CHECK(gnp_any_train_open(&options, NULL, pool, &train, &odd) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(odd.text, "batch: got 16 of micro-batches of 6, need a multiple of these");
	options = options_of(4);
	options.seed = GNP_SEED_WATCH;
	CHECK(gnp_any_train_open(&options, NULL, pool, &train, &judged) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(judged.text, "training seed: got 2251799813685248");
	run(1, 1, false, bytes);
	other.frame_steps = 4;
	CHECK(gnp_any_train_open(&other, checkpoint, pool, &train, &stranger) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(stranger.text, "regime any frame-steps 4 width 8");
	gnp_pool_free(pool);
}

/* ---- The command line ---- */

static gnp_status parse(const char *const *words, int count, struct gnp_any_plan *plan, struct gnp_error *error)
{
	static struct gnp_arguments arguments;
	char *argv[16];
	for (int i = 0; i < count; i++)
		argv[i] = (char *)(uintptr_t)words[i];
	CHECK(gnp_arguments_parse(count, argv, gnp_train_plan_options, gnp_train_plan_option_count(), 0, &arguments,
	                          error) == GNP_OK);
	CHECK(gnp_any_plan_asked(&arguments));
	return gnp_any_plan_parse(&arguments, plan, error);
}

static void plans_follow_the_command_line(void)
{
	const char *good[] = {"--regime",       "any", "-o",       "any.safetensors", "--steps", "7", "--frame-steps=5",
	                      "--node-width=16", "--normal-noise", "0.5", "--rate=1e-3"};
	const char *shells[] = {"--regime", "any", "-o", "any.safetensors", "--shells", "30"};
	const char *head[] = {"--regime", "any", "-o", "any.safetensors", "--head", "pooled"};
	const char *none[] = {"--regime", "any"};
	struct gnp_any_plan plan;
	struct gnp_error error[3] = {{0}};
	CHECK(parse(good, 11, &plan, NULL) == GNP_OK);
	CHECK(plan.run.train.steps == 7 && plan.run.train.frame_steps == 5 && plan.run.train.architecture.node_width == 16);
	CHECK_NEAR(plan.run.train.recipe.normal_noise, 0.5, 0);
	CHECK_NEAR(plan.run.train.rate, 1e-3, 0);
	CHECK_STRING(plan.run.folder, "build-training/any");
	CHECK(parse(shells, 6, &plan, &error[0]) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error[0].text, "--shells: given with --regime any, which has no use for it");
	CHECK(parse(head, 6, &plan, &error[1]) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error[1].text, "got 'pooled', 'separable', need weighted, separable");
	CHECK(parse(none, 2, &plan, &error[2]) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error[2].text, "--output: not given, need a file");
}

/* ---- A run and its files ---- */

static void check_history(const char *path, int rows)
{
	char line[2048];
	FILE *file = fopen(path, "r");
	int lines = 0;
	while (file && fgets(line, sizeof line, file))
		lines++;
	CHECK(lines == rows + 1);
	CHECK(strncmp(line, "7,", 2) == 0 && !strstr(line, "nan,nan,nan"));
	if (file)
		fclose(file);
}

static void check_model(const char *path, const float *parameters)
{
	struct gnp_model *model;
	struct gnp_error error = {0};
	CHECK(gnp_model_load(path, &model, &error) == GNP_OK);
	if (error.text[0]) {
		fprintf(stderr, "%s\n", error.text);
		return;
	}
	CHECK_STRING(model->name, "any");
	CHECK_STRING(model->regime, "any");
	CHECK(model->architecture.head == GNP_HEAD_WEIGHTED && model->architecture.node_width == 8);
	CHECK(memcmp(model->network->parameters, parameters, model->parameter_count * sizeof *parameters) == 0);
	CHECK_STRING(gnp_safetensors_metadata_find(model->file, "training_steps"), "4, after 3 for frames");
	CHECK_STRING(gnp_safetensors_metadata_find(model->file, "training_patches"), "64");
	CHECK_CONTAINS(gnp_safetensors_metadata_find(model->file, "training_watched"), "ratio ");
	gnp_model_free(model);
}

static void a_run_leaves_a_model(void)
{
	char history[96], curve[96], output[96];
	struct gnp_any_plan plan = {.run = gnp_any_run_defaults(), .output = output};
	struct gnp_pool *pool = make_pool(2);
	struct gnp_task task;
	struct gnp_any_end end, again;
	snprintf(output, sizeof output, "%s/any.safetensors", folder);
	snprintf(history, sizeof history, "%s/history.csv", folder);
	snprintf(curve, sizeof curve, "%s/curve.png", folder);
	plan.run.train = options_of(4);
	plan.run.folder = folder;
	plan.run.watch_clouds = 3;
	plan.run.watch_centres = 30;
	float *parameters = malloc(1 << 20);
	gnp_task_init(&task);
	CHECK(gnp_any_run(&plan.run, pool, &task, NULL, parameters, &end, NULL) == GNP_OK);
	CHECK(end.step == 7 && end.watched[GNP_ANY_RATIO] > 0 && end.watched[GNP_ANY_ANGLE] > 0);
	CHECK(end.watched[GNP_ANY_INSIDE_1] <= end.watched[GNP_ANY_INSIDE_2] && end.watched[GNP_ANY_FRAME] > 0);
	CHECK(gnp_any_model_write(&plan, parameters, &end, NULL) == GNP_OK);
	CHECK(access(curve, R_OK) == 0);
	check_history(history, 2); /* the end of either phase */
	check_model(output, parameters);
	plan.run.resume = true; /* what is over stays so */
	CHECK(gnp_any_run(&plan.run, pool, &task, NULL, parameters, &again, NULL) == GNP_OK);
	CHECK(again.step == 7 &&
	      fabs(again.watched[GNP_ANY_RATIO] - end.watched[GNP_ANY_RATIO]) < 1e-5 * end.watched[GNP_ANY_RATIO]);
	check_model(output, parameters);
	free(parameters);
	gnp_pool_free(pool);
}

static void a_cancelled_run_can_go_on(void)
{
	struct gnp_any_run_options options = gnp_any_run_defaults();
	struct gnp_pool *pool = make_pool(1);
	struct gnp_task task;
	struct gnp_any_end end;
	float *parameters = malloc(1 << 20);
	options.train = options_of(1);
	options.folder = folder;
	options.watch_clouds = 0;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(unlink(checkpoint) == 0);
	CHECK(gnp_any_run(&options, pool, &task, NULL, parameters, &end, NULL) == GNP_CANCELLED);
	options.resume = true;
	gnp_task_init(&task);
	CHECK(gnp_any_run(&options, pool, &task, NULL, parameters, &end, NULL) == GNP_OK);
	CHECK(end.step == 4 && isnan(end.watched[GNP_ANY_RATIO]));
	free(parameters);
	gnp_pool_free(pool);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(the_number_of_workers_does_not_matter),
		TEST(going_on_is_as_never_having_stopped),
		TEST(phases_train_what_is_theirs),
		TEST(both_phases_learn),
		TEST(other_trainings_and_bad_options_are_refused),
		TEST(plans_follow_the_command_line),
		TEST(a_run_leaves_a_model),
		TEST(a_cancelled_run_can_go_on),
	};
	char command[96];
	gnp_linalg_init();
	snprintf(folder, sizeof folder, "/tmp/gnp-train-any-XXXXXX");
	if (!mkdtemp(folder))
		return 1;
	snprintf(checkpoint, sizeof checkpoint, "%s/checkpoint", folder);
	int result = RUN_TESTS(tests);
	snprintf(command, sizeof command, "rm -r %s", folder);
	return system(command) == 0 ? result : 1;
}
