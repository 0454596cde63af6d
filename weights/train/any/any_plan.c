#include "weights/train/any/any_plan.h"

#include <stdbool.h>
#include <string.h>

#include "weights/train/train_plan.h"

bool gnp_any_plan_asked(const struct gnp_arguments *arguments)
{
	return strcmp(gnp_arguments_get(arguments, "regime", ""), "any") == 0;
}

gnp_status gnp_any_plan_refuse(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	static const char *const own[] = {"frame-steps", "frame-rate", "frame-width", "node-width", "normal-noise"};
	for (size_t i = 0; i < sizeof own / sizeof *own; i++)
		if (gnp_arguments_has(arguments, own[i]))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: given without --regime any, which alone takes it",
			                     own[i]);
	return GNP_OK;
}

static bool is_taken(const char *name)
{
	static const char *const taken[] = {
		"regime", "output", "minutes", "steps", "trunk", "head", "width", "channels", "neurons", "layers", "head-width",
		"node-width", "frame-width", "rate", "last-rate", "warm", "clip", "batch", "micro", "window", "visit",
		"frame-steps", "frame-rate", "seed", "resume", "checkpoint", "workers", "help", "watch-shapes", "watch-centres",
		"watch-minutes", "normal-noise", "from"};
	for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
		if (strcmp(name, taken[i]) == 0)
			return true;
	return false;
}

static gnp_status refuse_foreign(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	const char *head = gnp_arguments_get(arguments, "head", "weighted");
	const char *trunk = gnp_arguments_get(arguments, "trunk", "separable");
	for (size_t i = 0; i < arguments->option_count; i++)
		if (!is_taken(arguments->options[i].option->name))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: given with --regime any, which has no use for it",
			                     arguments->options[i].option->name);
	if (strcmp(head, "weighted") != 0 || strcmp(trunk, "separable") != 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "--head, --trunk: got '%s', '%s', need weighted, separable with --regime any", head,
		                     trunk);
	if (gnp_arguments_has(arguments, "minutes") && gnp_arguments_has(arguments, "steps"))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--minutes: given with --steps, need one of them");
	return GNP_OK;
}

static gnp_status parse_sizes(const struct gnp_arguments *arguments, struct gnp_any_plan *plan, struct gnp_error *error)
{
	struct gnp_any_options *train = &plan->run.train;
	struct gnp_architecture *a = &train->architecture;
	struct {
		const char *name;
		unsigned *value;
	} widths[] = {{"width", &a->width},
	              {"channels", &a->channels},
	              {"neurons", &a->neurons},
	              {"layers", &a->layers},
	              {"head-width", &a->head_width},
	              {"node-width", &a->node_width},
	              {"frame-width", &a->frame_width}};
	struct {
		const char *name;
		uint64_t most;
		size_t *value;
	} sizes[] = {{"batch", 65536, &train->batch},
	             {"micro", 1024, &train->micro},
	             {"window", 1000, &train->window},
	             {"watch-shapes", 1000, &plan->run.watch_clouds},
	             {"watch-centres", 100000, &plan->run.watch_centres}};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof widths / sizeof *widths && status == GNP_OK; i++) {
		uint64_t value = *widths[i].value;
		status = gnp_arguments_integer(arguments, widths[i].name, 1, 4096, &value, error);
		*widths[i].value = (unsigned)value;
	}
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes && status == GNP_OK; i++) {
		uint64_t value = *sizes[i].value;
		status = gnp_arguments_integer(arguments, sizes[i].name, sizes[i].value != &plan->run.watch_clouds,
		                               sizes[i].most, &value, error);
		*sizes[i].value = value;
	}
	return status;
}

static gnp_status parse_counts(const struct gnp_arguments *arguments, struct gnp_any_plan *plan,
                               struct gnp_error *error)
{
	struct gnp_any_options *train = &plan->run.train;
	const uint64_t many = UINT64_C(1) << 40;
	const struct {
		const char *name;
		uint64_t least, most, *value;
	} rows[] = {{"steps", 1, many, &train->steps},     {"frame-steps", 1, many, &train->frame_steps},
	            {"warm", 0, many, &train->warm},       {"visit", 1, many, &train->visit},
	            {"seed", 0, UINT64_MAX, &train->seed}, {"workers", 1, 1024, &plan->workers}};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof rows / sizeof *rows && status == GNP_OK; i++)
		status = gnp_arguments_integer(arguments, rows[i].name, rows[i].least, rows[i].most, rows[i].value, error);
	return status;
}

static gnp_status parse_numbers(const struct gnp_arguments *arguments, struct gnp_any_plan *plan,
                                struct gnp_error *error)
{
	struct gnp_any_options *train = &plan->run.train;
	double minutes = train->seconds / 60, watch = plan->run.watch_seconds / 60;
	const struct {
		const char *name;
		double least, most, *value;
	} rows[] = {{"minutes", 0.01, 1e6, &minutes},           {"rate", 0, 1e3, &train->rate},
	            {"frame-rate", 0, 1e3, &train->frame_rate}, {"last-rate", 0, 1, &train->last},
	            {"clip", 1e-9, 1e9, &train->clip},          {"normal-noise", 0, 1, &train->recipe.normal_noise},
	            {"watch-minutes", 0, 1e6, &watch}};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof rows / sizeof *rows && status == GNP_OK; i++)
		status = gnp_arguments_number(arguments, rows[i].name, rows[i].least, rows[i].most, rows[i].value, error);
	train->seconds = 60 * minutes;
	plan->run.watch_seconds = 60 * watch;
	return status;
}

gnp_status gnp_any_plan_parse(const struct gnp_arguments *arguments, struct gnp_any_plan *plan, struct gnp_error *error)
{
	*plan =
		(struct gnp_any_plan){.run = gnp_any_run_defaults(), .output = gnp_arguments_get(arguments, "output", NULL)};
	gnp_status status = gnp_train_plan_check_output(plan->output, error);
	if (status == GNP_OK)
		status = refuse_foreign(arguments, error);
	if (status == GNP_OK)
		status = parse_sizes(arguments, plan, error);
	if (status == GNP_OK)
		status = parse_counts(arguments, plan, error);
	if (status == GNP_OK)
		status = parse_numbers(arguments, plan, error);
	plan->run.train.from = gnp_arguments_get(arguments, "from", NULL);
	plan->run.folder = gnp_arguments_get(arguments, "checkpoint", "build-training/any");
	plan->run.resume = gnp_arguments_has(arguments, "resume");
	return status;
}
