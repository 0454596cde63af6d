/* Flows that are stopped and taken up: the result is that of a flow that was never interrupted, and what is kept may be damaged. */
#include "tests/unit/test.h"

#include "core/base/checkpoint.h"
#include "core/base/random.h"
#include "core/base/sha256.h"
#include "core/flow/flow.h"
#include "core/linear/linalg.h"

enum { POINTS = 600, STEPS = 12 };

static struct gnp_pool *pool;
static double sphere[3 * POINTS];

/* An egg, so that the flow is no mere scaling; its points are regular enough to be thinned as it shrinks. */
static void make_sphere(void)
{
	for (size_t i = 0; i < POINTS; i++) {
		double z = 1 - (2 * (double)i + 1) / POINTS, r = sqrt(1 - z * z), turn = 2.399963229728653 * (double)i;
		sphere[3 * i] = r * cos(turn);
		sphere[3 * i + 1] = r * sin(turn);
		sphere[3 * i + 2] = 1.3 * z + 0.1 * z * z;
	}
}

/* What a process leaves: the bytes kept last. It is stopped at the save number stop_at. */
struct keeper {
	unsigned char *bytes;
	size_t size;
	int saves, stop_at;
	struct gnp_task *task;
	bool resumed; /* it began from what an earlier run kept */
};

static gnp_status save(void *context, const struct gnp_piece *pieces, size_t count, struct gnp_error *error)
{
	struct keeper *keeper = context;
	(void)error;
	keeper->size = 0;
	for (size_t i = 0; i < count; i++) {
		keeper->bytes = realloc(keeper->bytes, keeper->size + pieces[i].size + 1);
		if (pieces[i].size)
			memcpy(keeper->bytes + keeper->size, pieces[i].data, pieces[i].size);
		keeper->size += pieces[i].size;
	}
	CHECK(!keeper->task || (atomic_load(&keeper->task->skipped) > 0) == keeper->resumed);
	if (++keeper->saves == keeper->stop_at)
		gnp_task_stop(keeper->task, GNP_DRAINING);
	return GNP_OK;
}

static gnp_status refuse(void *context, const struct gnp_piece *pieces, size_t count, struct gnp_error *error)
{
	(void)pieces, (void)count;
	++*(int *)context;
	return gnp_error_set(error, GNP_NO_SPACE, "the disk is full");
}

static struct gnp_flow_options options_of(int scheme)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = scheme;
	options.steps = STEPS;
	options.snapshot_every = 3;
	options.tangential = scheme == GNP_FLOW_EXPLICIT ? 0.3 : 0;
	options.volume = scheme == GNP_FLOW_SEMI_IMPLICIT ? GNP_FLOW_VOLUME_PRESERVE : GNP_FLOW_VOLUME_NONE;
	return options;
}

static gnp_status run(const struct gnp_flow_options *options, const struct gnp_checkpoint *checkpoint, struct gnp_task *task,
                      struct gnp_flow *flow)
{
	const struct gnp_cloud cloud = {POINTS, sphere, NULL};
	struct gnp_error error = {0};
	*flow = (struct gnp_flow){0};
	gnp_status status = gnp_flow_run_kept(&cloud, NULL, options, checkpoint, pool, task, flow, &error);
	if (status != GNP_OK && status != GNP_DRAINING)
		CHECK_STRING(error.text, "");
	return status;
}

static void check_same(const struct gnp_flow *a, const struct gnp_flow *b)
{
	const struct gnp_flow_snapshots *s = &a->snapshots, *t = &b->snapshots;
	CHECK(a->count == b->count && a->steps == b->steps && a->stop == b->stop && s->count == t->count);
	CHECK_STRING(a->reason, b->reason);
	if (a->count != b->count || a->steps != b->steps || s->count != t->count || s->start[s->count] != t->start[t->count])
		return;
	size_t rows = s->start[s->count];
	CHECK(memcmp(a->points, b->points, 3 * a->count * sizeof(double)) == 0);
	CHECK(memcmp(a->normals, b->normals, 3 * a->count * sizeof(double)) == 0);
	CHECK(memcmp(a->mean_curvature, b->mean_curvature, a->count * sizeof(double)) == 0);
	CHECK(memcmp(a->index, b->index, a->count * sizeof *a->index) == 0);
	for (size_t i = 0; i <= a->steps; i++)
		CHECK(memcmp(&a->records[i], &b->records[i], offsetof(struct gnp_flow_record, seconds)) == 0);
	CHECK(memcmp(s->start, t->start, (s->count + 1) * sizeof *s->start) == 0 && memcmp(s->step, t->step, s->count * sizeof *s->step) == 0);
	CHECK(memcmp(s->points, t->points, 3 * rows * sizeof(double)) == 0 && memcmp(s->normals, t->normals, 3 * rows * sizeof(double)) == 0);
	CHECK(memcmp(s->mean_curvature, t->mean_curvature, rows * sizeof(double)) == 0);
}

/* Runs it to its end, stopping after the save number stop_at of every run; the last has nothing to stop it. */
static struct gnp_flow run_in_parts(const struct gnp_flow_options *options, int stop_at, int *parts)
{
	struct keeper keeper = {.stop_at = stop_at};
	struct gnp_flow flow;
	gnp_status status = GNP_DRAINING;
	for (*parts = 0; status == GNP_DRAINING && *parts < 2 * STEPS; ++*parts) {
		struct gnp_task task;
		gnp_task_init(&task);
		unsigned char *kept = keeper.bytes;
		struct gnp_checkpoint checkpoint = {.save = save, .context = &keeper, .kept = kept, .size = keeper.size};
		keeper = (struct keeper){.stop_at = stop_at, .task = &task, .resumed = kept != NULL, .size = keeper.size};
		status = run(options, &checkpoint, &task, &flow);
		CHECK(status == GNP_OK || keeper.bytes);
		free(kept);
	}
	free(keeper.bytes);
	CHECK(status == GNP_OK);
	return flow;
}

static void interrupted_flows_end_as_others(void)
{
	for (int scheme = GNP_FLOW_EXPLICIT; scheme <= GNP_FLOW_CONFORMAL; scheme++) {
		struct gnp_flow_options options = options_of(scheme);
		struct gnp_flow whole, resumed;
		int parts;
		CHECK(run(&options, NULL, NULL, &whole) == GNP_OK);
		CHECK(whole.steps == STEPS && whole.snapshots.count == STEPS / 3 + 1);
		for (int stop_at = 1; stop_at <= 2; stop_at++) {
			resumed = run_in_parts(&options, stop_at, &parts);
			CHECK(parts > 2);
			check_same(&resumed, &whole);
			gnp_flow_clear(&resumed);
		}
		gnp_flow_clear(&whole);
	}
}

/* One run's bytes, kept at some step before its end. */
static void keep_some(const struct gnp_flow_options *options, struct keeper *keeper)
{
	struct gnp_task task;
	struct gnp_flow flow;
	gnp_task_init(&task);
	*keeper = (struct keeper){.stop_at = 2, .task = &task};
	struct gnp_checkpoint checkpoint = {.save = save, .context = keeper};
	CHECK(run(options, &checkpoint, &task, &flow) == GNP_DRAINING);
	CHECK(keeper->bytes && keeper->size > POINTS * 100);
}

static void go_on_from(const struct gnp_flow_options *options, const unsigned char *bytes, size_t size, const struct gnp_flow *whole)
{
	struct keeper rest = {0};
	struct gnp_flow flow;
	struct gnp_checkpoint checkpoint = {.seconds = 1e9, .save = save, .context = &rest, .kept = bytes, .size = size};
	if (run(options, &checkpoint, NULL, &flow) != GNP_OK) {
		CHECK(!whole);
		return;
	}
	if (whole)
		check_same(&flow, whole);
	CHECK(rest.saves == 0);
	gnp_flow_clear(&flow);
}

static void damaged_bytes_begin_anew(void)
{
	struct gnp_flow_options options = options_of(GNP_FLOW_EXPLICIT);
	struct gnp_flow whole;
	struct keeper keeper;
	CHECK(run(&options, NULL, NULL, &whole) == GNP_OK);
	keep_some(&options, &keeper);
	for (size_t size = 0; size < keeper.size; size += keeper.size / 5)
		go_on_from(&options, keeper.bytes, size, &whole);
	for (size_t at = 5; at < keeper.size; at += keeper.size / 5) {
		keeper.bytes[at] ^= 4;
		go_on_from(&options, keeper.bytes, keeper.size, &whole);
		keeper.bytes[at] ^= 4;
	}
	free(keeper.bytes);
	gnp_flow_clear(&whole);
}

static void another_flow_begins_anew(void)
{
	struct gnp_flow_options options = options_of(GNP_FLOW_EXPLICIT), other = options;
	struct gnp_flow whole;
	struct keeper keeper;
	other.estimate.k = 40;
	keep_some(&options, &keeper);
	CHECK(run(&other, NULL, NULL, &whole) == GNP_OK);
	go_on_from(&other, keeper.bytes, keeper.size, &whole);
	gnp_flow_clear(&whole);
	other = options;
	other.scheme = GNP_FLOW_CONFORMAL;
	other.tangential = 0;
	CHECK(run(&other, NULL, NULL, &whole) == GNP_OK);
	go_on_from(&other, keeper.bytes, keeper.size, &whole);
	gnp_flow_clear(&whole);
	free(keeper.bytes);
}

/* A flow's task, and the steps that were taken before it began, 0 where it began anew. */
struct watch {
	struct gnp_task task;
	size_t skipped;
};

static gnp_status look(void *context, const struct gnp_piece *pieces, size_t count, struct gnp_error *error)
{
	struct watch *watch = context;
	(void)pieces, (void)count, (void)error;
	watch->skipped = atomic_load(&watch->task.skipped);
	return GNP_OK;
}

/* The step at which a flow of these options goes on from the bytes of another. */
static size_t taken_up_at(const struct gnp_cloud *cloud, const unsigned char *fixed, const struct gnp_flow_options *options,
                          const struct keeper *kept)
{
	struct watch watch = {.skipped = SIZE_MAX};
	struct gnp_flow flow = {0};
	struct gnp_checkpoint checkpoint = {.save = look, .context = &watch, .kept = kept->bytes, .size = kept->size};
	struct gnp_error error = {0};
	gnp_task_init(&watch.task);
	CHECK(gnp_flow_run_kept(cloud, fixed, options, &checkpoint, pool, &watch.task, &flow, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	gnp_flow_clear(&flow);
	return watch.skipped;
}

/* Only the first record, the steps and the shape of the state were held to one another: a flow of another dt or projection went on. */
static void every_option_tells_flows_apart(void)
{
	struct gnp_flow_options options = options_of(GNP_FLOW_EXPLICIT), other[14];
	struct gnp_cloud cloud = {POINTS, sphere, NULL};
	unsigned char fixed[POINTS] = {0};
	struct keeper keeper;
	options.steps = 5;
	keep_some(&options, &keeper);
	for (size_t i = 0; i < sizeof other / sizeof other[0]; i++)
		other[i] = options;
	other[0].dt = 1e-4;
	other[1].projection = 0.2;
	other[2].singularity = 0.6;
	other[3].spacing_limit = 5;
	other[4].smoothing_radius = 0;
	other[5].spacing = 0;
	other[6].insertion = 0;
	other[7].tangential = 0.2;
	other[8].steps = 6;
	other[9].snapshot_every = 2;
	other[10].volume = GNP_FLOW_VOLUME_PRESERVE;
	other[11].estimate.degree = 2;
	other[12].estimate.basis = GNP_BASIS_TOTAL;
	other[13].estimate.weight = GNP_WEIGHT_LINEAR;
	CHECK(taken_up_at(&cloud, NULL, &options, &keeper) == 2);
	for (size_t i = 0; i < sizeof other / sizeof other[0]; i++)
		CHECK(taken_up_at(&cloud, NULL, &other[i], &keeper) == 0);
	CHECK(taken_up_at(&cloud, fixed, &options, &keeper) == 0);
	sphere[300] += 1e-13;
	CHECK(taken_up_at(&cloud, NULL, &options, &keeper) == 0);
	make_sphere();
	options.dt = -NAN; /* as open as it was */
	CHECK(taken_up_at(&cloud, NULL, &options, &keeper) == 2);
	free(keeper.bytes);
}

/* Sizes, indices and figures out of any range under a checksum that is right: read without a fault, whatever becomes of the flow. */
static void forged_bytes_do_no_harm(void)
{
	enum { HASH_AT = 11, BODY_AT = HASH_AT + 64, ROUNDS = 120, HEAD = 144 };
	struct gnp_flow_options options = options_of(GNP_FLOW_EXPLICIT);
	struct gnp_random random;
	struct keeper keeper;
	options.steps = 3;
	options.snapshot_every = 1;
	keep_some(&options, &keeper);
	gnp_random_seed(&random, 5, 0);
	for (int round = 0; round < ROUNDS; round++) {
		size_t body = keeper.size - BODY_AT, span = round % 2 ? body : HEAD;
		unsigned char *forged = malloc(keeper.size);
		char hash[GNP_SHA256_TEXT];
		memcpy(forged, keeper.bytes, keeper.size);
		for (int change = 0; change <= round % 3; change++)
			forged[BODY_AT + (size_t)gnp_random_below(&random, span)] = (unsigned char)gnp_random_below(&random, 256);
		gnp_sha256_text((const void *const[]){forged + BODY_AT}, &body, 1, hash);
		memcpy(forged + HASH_AT, hash, 64);
		struct keeper rest = {0};
		struct gnp_flow flow = {0};
		struct gnp_checkpoint checkpoint = {.seconds = 1e9, .save = save, .context = &rest, .kept = forged, .size = keeper.size};
		const struct gnp_cloud cloud = {POINTS, sphere, NULL};
		gnp_flow_run_kept(&cloud, NULL, &options, &checkpoint, pool, NULL, &flow, NULL);
		CHECK(flow.steps <= 3);
		gnp_flow_clear(&flow);
		free(forged);
	}
	free(keeper.bytes);
}

static void a_flow_that_cannot_be_kept_goes_on(void)
{
	struct gnp_flow_options options = options_of(GNP_FLOW_EXPLICIT);
	struct gnp_flow whole, flow;
	int asked = 0;
	struct gnp_checkpoint checkpoint = {.save = refuse, .context = &asked};
	CHECK(run(&options, NULL, NULL, &whole) == GNP_OK && run(&options, &checkpoint, NULL, &flow) == GNP_OK);
	check_same(&flow, &whole);
	CHECK(asked > 0);
	gnp_flow_clear(&whole);
	gnp_flow_clear(&flow);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(interrupted_flows_end_as_others), TEST(damaged_bytes_begin_anew), TEST(another_flow_begins_anew),
		TEST(every_option_tells_flows_apart),
		TEST(forged_bytes_do_no_harm),         TEST(a_flow_that_cannot_be_kept_goes_on),
	};
	gnp_linalg_init();
	make_sphere();
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
