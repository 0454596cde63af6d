#include "weights/train/train_plan.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/network/projection.h"
#include "weights/train/loss_rule.h"

const struct gnp_option gnp_train_plan_options[] = {
	{"regime", 0, "NAME", "what to train for: clean-30, clean-50, outlier-50, noise-70, or any cloud: any"},
	{"output", 'o', "FILE", "the weights to write, a .safetensors"},
	{"minutes", 0, "N", "how long to train (20)"},
	{"steps", 0, "N", "or how many steps; then training repeats to the byte"},
	{"prepare", 0, NULL, "only sample the shapes into the cache"},
	{"from", 0, "FILE", "a model of the same network, to train on from"},
	{"trunk", 0, "NAME", "edge, separable or, with the head projection, none (none; with pooled and any separable)"},
	{"head", 0, "NAME", "pooled or projection (projection); any: weighted"},
	{"width", 0, "N", "values a node (64; projection 32)"},
	{"channels", 0, "N", "blocks of the kernel's values (16, 4)"},
	{"neurons", 0, "N", "of the kernel's hidden layers (96, 32)"},
	{"layers", 0, "N", "blocks of the trunk (6, 2)"},
	{"quadrature", 0, "N", "sources of the edge trunk's integrals (64, 32)"},
	{"head-width", 0, "N", "of the head's hidden layers (128, 64)"},
	{"node-width", 0, "N", "any: of the hidden layer that weighs nodes (32)"},
	{"frame-width", 0, "N", "any: of the one that chooses frames (48)"},
	{"shells", 0, "LIST", "projection: nearest points in each nested support, ascending, with commas between"},
	{"k", 0, "N", "neighbours that set a patch's radius (the regime's)"},
	{"buffer", 0, "X", "nodes out to X times that radius (1.25; pooled under noise 1.5)"},
	{"delta0-ratio", 0, "X",
     "smallest height scale in units of that radius (pooled 1e-3, 0.05 under noise; 0.13 at k = 30, 0.1, 0.5)"},
	{"patch", 0, "LIST", "loss over a patch: NAME=FACTOR with commas between, and floor, focus, most"},
	{"centre", 0, "LIST", "loss at its centre, the same way"},
	{"cell", 0, "LIST", "loss of a micro-batch's centres together, the same way, by its logarithm"},
	{"near", 0, "LIST", "and of further points of its patches"},
	{"near-points", 0, "N", "so many of each; 1: near the centre (pooled 12, 1)"},
	{"only", 0, "NAME", "train this tensor alone, such as head.4.bias: the same outputs for every patch"},
	{"step", 0, "NAME", "of matrices: adam or muon (pooled muon, adam)"},
	{"average", 0, "N", "steps that the weights are averaged over (pooled 1000, 1)"},
	{"rate", 0, "X", "the largest rate (pooled 1e-2, 1e-3)"},
	{"last-rate", 0, "X", "what is left of it in the end, as a share (1e-3)"},
	{"warm", 0, "N", "steps the rate takes to rise (200)"},
	{"clip", 0, "X", "largest norm of a gradient (1)"},
	{"batch", 0, "N", "patches a step (pooled 1024, 64)"},
	{"micro", 0, "N", "patches a worker takes at a time, of one cloud (pooled 32, 8)"},
	{"shapes", 0, "N", "shapes to train on (320)"},
	{"points", 0, "N", "points a shape (100000)"},
	{"least-noise", 0, "X",
     "with --most-noise: every other visit has noise between them (projection under noise 1e-4 and 4e-3)"},
	{"most-noise", 0, "X", "0: all have the regime's"},
	{"normal-noise", 0, "X", "any: share of noisy clouds whose noise is along the normals (0.4)"},
	{"frame-steps", 0, "N", "any: steps for frames before all others (4000)"},
	{"frame-rate", 0, "X", "any: the largest rate of these (3e-3)"},
	{"window", 0, "N", "clouds at hand (pooled 32, 16)"},
	{"visit", 0, "N", "steps before one of them is replaced (pooled 8, 32)"},
	{"seed", 0, "N", "of parameters, noise and patches (1)"},
	{"cache", 0, "DIR", "where shapes are kept (build-training/shapes)"},
	{"checkpoint", 0, "DIR", "where checkpoint, history.csv and curve.png go (build-training/REGIME-HEAD)"},
	{"resume", 0, NULL, "go on from the checkpoint there; give the same options again"},
	{"watch-shapes", 0, "N", "shapes to watch progress by, none of those trained on (8)"},
	{"watch-centres", 0, "N", "patches of each (200)"},
	{"watch-minutes", 0, "X", "between looks at them (2)"},
	{"workers", 0, "N", "threads (as many as there are cores)"},
	{"help", 0, NULL, "this text"},
};

size_t gnp_train_plan_option_count(void)
{
	return sizeof gnp_train_plan_options / sizeof gnp_train_plan_options[0];
}

static gnp_status unknown_name(const char *option, const char *got, const char *known, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: got '%s', need one of %s", option, got ? got : "", known);
}

static gnp_status parse_names(const struct gnp_arguments *arguments, struct gnp_train_plan *plan,
                              struct gnp_error *error)
{
	const char *regime = gnp_arguments_get(arguments, "regime", NULL), *trunk;
	const char *head = gnp_arguments_get(arguments, "head", "projection");
	int r = 0, t = 0, h = 0;
	while (regime && r < GNP_REGIMES && strcmp(regime, gnp_regime_info((enum gnp_regime)r)->name) != 0)
		r++;
	trunk = gnp_arguments_get(arguments, "trunk", strcmp(head, "projection") == 0 ? "none" : "separable");
	while (t < GNP_TRUNKS && strcmp(trunk, gnp_trunk_name((enum gnp_trunk_kind)t)) != 0)
		t++;
	while (h < GNP_HEADS && strcmp(head, gnp_head_name((enum gnp_head_kind)h)) != 0)
		h++;
	if ((!regime && !plan->prepare) || r == GNP_REGIMES)
		return unknown_name("regime", regime, "clean-30, clean-50, outlier-50, noise-70, any", error);
	if (t == GNP_TRUNKS)
		return unknown_name("trunk", trunk, "edge, separable, none", error);
	if (h == GNP_HEADS || h == GNP_HEAD_WEIGHTED)
		return unknown_name("head", head, "pooled, projection", error);
	plan->run.train.data.regime = (enum gnp_regime)r;
	plan->architecture.trunk = (enum gnp_trunk_kind)t;
	plan->architecture.head = (enum gnp_head_kind)h;
	return GNP_OK;
}

/* As the table judges: by the root mean squares of many patches' centres, and a part as much of further points. */
static void set_loss(bool projection, struct gnp_loss_options *loss)
{
	double *cell = loss->cell.lambda, *near = loss->near.lambda;
	memset(loss->patch.lambda, 0, sizeof loss->patch.lambda);
	memset(loss->centre.lambda, 0, sizeof loss->centre.lambda);
	cell[GNP_LOSS_NORMAL] = projection ? 0.2 : 0;
	cell[GNP_LOSS_ANGLE] = projection ? 0 : 0.5;
	cell[GNP_LOSS_INVERSE_METRIC] = projection ? 0.2 : 0.1;
	cell[GNP_LOSS_SECOND_FORM] = cell[GNP_LOSS_GAUSSIAN] = cell[GNP_LOSS_MEAN] = projection ? 0.5 : 1;
	for (int t = 0; t < GNP_LOSS_TERMS; t++)
		near[t] = cell[t] * (projection ? 1.0 / 3 : 0.3);
	near[GNP_LOSS_HEIGHT] = projection ? 0 : 0.2;
	loss->points = projection ? 1 : 12;
}

/* Sizes of the network; what a trunk `none` has not is 0. */
static void set_architecture(enum gnp_regime regime, struct gnp_architecture *a)
{
	static const unsigned shells[GNP_REGIMES][5] = {
		{36, 44, 56, 80, 120}, {36, 44, 56, 80, 120}, {36, 48, 64, 96, 144}, {90, 180, 360, 720, 1440}};
	bool projection = a->head == GNP_HEAD_PROJECTION;
	if (a->trunk != GNP_TRUNK_NONE) {
		a->features = projection ? 4 : 3;
		a->width = projection ? 32 : 64;
		a->channels = projection ? 4 : 16;
		a->neurons = projection ? 32 : 96;
		a->layers = projection ? 2 : 6;
		a->quadrature = projection ? 32 : 64;
	}
	a->head_width = projection ? 64 : 128;
	a->outputs = 16;
	if (projection) {
		a->ridge = gnp_regime_info(regime)->noise > 0 ? 2e-5 : 1e-12;
		a->shells = 5;
		memcpy(a->shell, shells[regime], sizeof shells[regime]);
	}
}

/* What depends on the names. */
static void set_defaults(struct gnp_train_plan *plan)
{
	struct gnp_train_options *train = &plan->run.train;
	struct gnp_architecture *a = &plan->architecture;
	const struct gnp_regime_info *info = gnp_regime_info(train->data.regime);
	bool projection = a->head == GNP_HEAD_PROJECTION, noisy = info->noise > 0;
	double delta0 = noisy ? 0.5 : info->k == 30 ? 0.13 : 0.1;
	set_architecture(train->data.regime, a);
	set_loss(projection, &train->loss);
	if (projection && noisy) {
		train->data.least_noise = 1e-4;
		train->data.most_noise = 4e-3;
	}
	train->recipe = (struct gnp_train_recipe){.k = (size_t)info->k, .delta0_ratio = delta0, .buffer = 1.25};
	if (!projection) {
		train->recipe.delta0_ratio = noisy ? 0.05 : 1e-3;
		train->recipe.buffer = noisy ? 1.5 : 1.25;
		train->batch = 1024;
		train->micro = 32;
		train->window = 32;
		train->visit = 8;
		train->rate = 1e-2;
		train->orthogonal = true;
		train->average = 1000;
	}
	snprintf(plan->folder, sizeof plan->folder, "build-training/%s-%s", info->name, gnp_head_name(a->head));
}

static gnp_status parse_architecture(const struct gnp_arguments *arguments, struct gnp_train_plan *plan,
                                     struct gnp_error *error)
{
	struct gnp_architecture *a = &plan->architecture;
	struct {
		const char *name;
		unsigned *value;
	} sizes[] = {{"width", &a->width},   {"channels", &a->channels},     {"neurons", &a->neurons},
	             {"layers", &a->layers}, {"quadrature", &a->quadrature}, {"head-width", &a->head_width}};
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		uint64_t value = *sizes[i].value;
		gnp_status status = gnp_arguments_integer(arguments, sizes[i].name, 1, 4096, &value, error);
		if (status != GNP_OK)
			return status;
		*sizes[i].value = (unsigned)value;
	}
	const char *list = gnp_arguments_get(arguments, "shells", NULL);
	for (a->shells = list ? 0 : a->shells; list; list = *list == ',' ? list + 1 : NULL) {
		char *end;
		unsigned long value = strtoul(list, &end, 10);
		if (end == list || (*end && *end != ',') || value > 4096 || a->shells == GNP_SHELLS_MAX)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "--shells: got '%s', need 1..%d numbers with commas between",
			                     gnp_arguments_get(arguments, "shells", ""), GNP_SHELLS_MAX);
		a->shell[a->shells++] = (unsigned)value;
		list = end;
	}
	if (a->head == GNP_HEAD_PROJECTION)
		a->outputs = (unsigned)gnp_projection_outputs(a);
	return GNP_OK;
}

static gnp_status parse_integers(const struct gnp_arguments *arguments, struct gnp_train_plan *plan,
                                 struct gnp_error *error)
{
	struct gnp_train_options *train = &plan->run.train;
	uint64_t k = train->recipe.k, batch = train->batch, micro = train->micro, shapes = train->data.shapes;
	uint64_t points = train->data.points, window = train->window, near = train->loss.points,
			 watch = plan->run.watch_shapes, centres = plan->run.watch_centres;
	const struct {
		const char *name;
		uint64_t least, most, *value;
	} rows[] = {{"steps", 1, UINT64_C(1) << 40, &train->steps},
	            {"k", 12, 500, &k},
	            {"warm", 0, UINT64_C(1) << 40, &train->warm},
	            {"batch", 1, 65536, &batch},
	            {"micro", 1, 1024, &micro},
	            {"shapes", 1, 1000000, &shapes},
	            {"points", 1000, 10000000, &points},
	            {"window", 1, 1000, &window},
	            {"near-points", 1, 1000, &near},
	            {"average", 1, UINT64_C(1) << 40, &train->average},
	            {"visit", 1, UINT64_C(1) << 40, &train->visit},
	            {"seed", 0, UINT64_MAX, &train->data.seed},
	            {"watch-shapes", 0, 1000, &watch},
	            {"watch-centres", 1, 100000, &centres},
	            {"workers", 1, 1024, &plan->workers}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		gnp_status status = gnp_arguments_integer(arguments, rows[i].name, rows[i].least, rows[i].most, rows[i].value, error);
		if (status != GNP_OK)
			return status;
	}
	train->recipe.k = k;
	train->batch = batch;
	train->micro = micro;
	train->data.shapes = shapes;
	train->data.points = points;
	train->window = window;
	train->loss.points = near;
	plan->run.watch_shapes = watch;
	plan->run.watch_centres = centres;
	return GNP_OK;
}

static gnp_status parse_numbers(const struct gnp_arguments *arguments, struct gnp_train_plan *plan,
                                struct gnp_error *error)
{
	struct gnp_train_options *train = &plan->run.train;
	double minutes = train->seconds / 60, watch = plan->run.watch_seconds / 60;
	const struct {
		const char *name;
		double least, most, *value;
	} rows[] = {{"minutes", 0.01, 1e6, &minutes},
	            {"buffer", 1, 4, &train->recipe.buffer},
	            {"delta0-ratio", 1e-6, 100, &train->recipe.delta0_ratio},
	            {"least-noise", 0, 1, &train->data.least_noise},
	            {"most-noise", 0, 1, &train->data.most_noise},
	            {"rate", 0, 1e3, &train->rate},
	            {"last-rate", 0, 1, &train->last},
	            {"clip", 1e-9, 1e9, &train->clip},
	            {"watch-minutes", 0, 1e6, &watch}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		gnp_status status = gnp_arguments_number(arguments, rows[i].name, rows[i].least, rows[i].most, rows[i].value, error);
		if (status != GNP_OK)
			return status;
	}
	if (!(train->data.most_noise > 0))
		train->data.least_noise = 0;
	train->seconds = 60 * minutes;
	plan->run.watch_seconds = 60 * watch;
	return GNP_OK;
}

static gnp_status parse_loss(const struct gnp_arguments *arguments, struct gnp_loss_options *loss,
                             struct gnp_error *error)
{
	struct {
		const char *name, *what;
		struct gnp_loss_rule *rule;
	} rows[] = {{"patch", "--patch", &loss->patch},
	            {"centre", "--centre", &loss->centre},
	            {"cell", "--cell", &loss->cell},
	            {"near", "--near", &loss->near}};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof rows / sizeof *rows && status == GNP_OK; i++) {
		const char *text = gnp_arguments_get(arguments, rows[i].name, NULL);
		status = text ? gnp_loss_rule_parse(text, rows[i].what, rows[i].rule, error) : GNP_OK;
	}
	return status;
}

static gnp_status parse_step(const struct gnp_arguments *arguments, struct gnp_train_options *train,
                             struct gnp_error *error)
{
	const char *name = gnp_arguments_get(arguments, "step", train->orthogonal ? "muon" : "adam");
	train->only = gnp_arguments_get(arguments, "only", NULL);
	train->orthogonal = strcmp(name, "muon") == 0;
	return train->orthogonal || strcmp(name, "adam") == 0 ? GNP_OK : unknown_name("step", name, "adam, muon", error);
}

gnp_status gnp_train_plan_check_output(const char *path, struct gnp_error *error)
{
	const char *slash = path ? strrchr(path, '/') : NULL;
	char folder[512];
	if (!path)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--output: not given, need a file");
	snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path + 1) : 2, slash ? path : "./");
	if (access(folder, W_OK) == 0)
		return GNP_OK;
	return gnp_error_set(error, GNP_IO,
	                     "--output: got '%s', need a folder that can be written: %s", path, strerror(errno));
}

gnp_status gnp_train_plan_parse(const struct gnp_arguments *arguments, struct gnp_train_plan *plan,
                                struct gnp_error *error)
{
	*plan = (struct gnp_train_plan){.run = gnp_train_run_defaults()};
	plan->prepare = gnp_arguments_has(arguments, "prepare");
	plan->output = gnp_arguments_get(arguments, "output", NULL);
	plan->from = gnp_arguments_get(arguments, "from", NULL);
	if (gnp_arguments_has(arguments, "minutes") && gnp_arguments_has(arguments, "steps"))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--minutes: given with --steps, need one of them");
	gnp_status status = plan->output || !plan->prepare ? gnp_train_plan_check_output(plan->output, error) : GNP_OK;
	if (status == GNP_OK)
		status = parse_names(arguments, plan, error);
	if (status != GNP_OK)
		return status;
	set_defaults(plan);
	status = parse_architecture(arguments, plan, error);
	if (status == GNP_OK)
		status = parse_integers(arguments, plan, error);
	if (status == GNP_OK)
		status = parse_numbers(arguments, plan, error);
	if (status == GNP_OK)
		status = parse_loss(arguments, &plan->run.train.loss, error);
	if (status == GNP_OK)
		status = parse_step(arguments, &plan->run.train, error);
	if (plan->architecture.shells)
		plan->run.train.recipe.reach = gnp_projection_reach(&plan->architecture);
	plan->run.train.data.folder = gnp_arguments_get(arguments, "cache", "build-training/shapes");
	plan->run.folder = gnp_arguments_get(arguments, "checkpoint", plan->folder);
	plan->run.resume = gnp_arguments_has(arguments, "resume");
	return status;
}
