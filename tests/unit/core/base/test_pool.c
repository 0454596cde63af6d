#include "core/base/pool.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <time.h>

#include "tests/unit/test.h"

static void sleep_a_little(void)
{
	nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
}

static struct gnp_pool *make_pool(unsigned workers)
{
	struct gnp_pool *pool = NULL;
	CHECK(gnp_pool_create(workers, &pool, NULL) == GNP_OK);
	return pool;
}

/* --- coverage --- */

struct visits {
	unsigned char *seen; /* (count) */
	size_t count, chunk;
	atomic_int odd_chunks; /* those whose bounds are not multiples of chunk */
};

static gnp_status visit(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct visits *visits = context;
	(void)error;
	if (begin % visits->chunk != 0 || (end != begin + visits->chunk && end != visits->count) || !scratch)
		atomic_fetch_add(&visits->odd_chunks, 1);
	for (size_t i = begin; i < end; i++)
		visits->seen[i]++;
	return GNP_OK;
}

static void every_item_runs_once_in_fixed_chunks(void)
{
	static const size_t counts[] = {0, 1, 2, 7, 64, 1000, 1001}, chunks[] = {1, 3, 64, 5000};
	for (unsigned workers = 1; workers <= 4; workers++) {
		struct gnp_pool *pool = make_pool(workers);
		CHECK(gnp_pool_workers(pool) == workers);
		for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
			for (size_t j = 0; j < sizeof chunks / sizeof *chunks; j++) {
				struct visits visits = {calloc(counts[i] + 1, 1), counts[i], chunks[j], 0};
				struct gnp_task task;
				size_t once = 0;
				gnp_task_init(&task);
				CHECK(gnp_pool_run(pool, &task, counts[i], chunks[j], visit, &visits, NULL) == GNP_OK);
				for (size_t n = 0; n < counts[i]; n++)
					once += visits.seen[n] == 1;
				CHECK(once == counts[i]);
				CHECK(atomic_load(&visits.odd_chunks) == 0);
				CHECK(atomic_load(&task.done) == counts[i]);
				free(visits.seen);
			}
		gnp_pool_free(pool);
	}
}

static void pool_sizes_are_checked(void)
{
	struct gnp_pool *pool = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_pool_create(1025, &pool, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "workers: got 1025, need at most 1024");
	CHECK(!pool);
	pool = make_pool(0);
	CHECK(gnp_pool_workers(pool) >= 1);
	struct visits visits = {calloc(5, 1), 5, 1, 0}; /* a chunk of 0 items is one of 1 */
	CHECK(gnp_pool_run(pool, NULL, 5, 0, visit, &visits, NULL) == GNP_OK);
	CHECK(memcmp(visits.seen, "\1\1\1\1\1", 5) == 0);
	free(visits.seen);
	gnp_pool_free(pool);
	gnp_pool_free(NULL);
}

/* --- fairness --- */

struct job {
	struct gnp_pool *pool;
	size_t chunks;
	char name;
	struct diary *diary;
	struct gnp_task *task; /* NULL: without */
};

struct diary {
	atomic_size_t used;
	char lines[4096];
	atomic_bool enough; /* the long job may stop */
};

static gnp_status write_diary(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct job *job = context;
	(void)begin, (void)end, (void)scratch, (void)error;
	size_t at = atomic_fetch_add(&job->diary->used, 1);
	if (at < sizeof job->diary->lines)
		job->diary->lines[at] = job->name;
	if (!atomic_load(&job->diary->enough))
		sleep_a_little();
	return GNP_OK;
}

static void *run_job(void *argument)
{
	struct job *job = argument;
	CHECK(gnp_pool_run(job->pool, job->task, job->chunks, 1, write_diary, job, NULL) == GNP_OK);
	return NULL;
}

/* While the short job runs, one worker gives the long one a chunk for each of its own, not more. */
static void a_short_job_takes_turns_with_a_long_one(void)
{
	static struct diary diary;
	enum { SHORT = 20 };
	struct gnp_pool *pool = make_pool(1);
	struct job long_job = {pool, 4000, 'l', &diary, NULL}, short_job = {pool, SHORT, 's', &diary, NULL};
	pthread_t thread;
	CHECK(pthread_create(&thread, NULL, run_job, &long_job) == 0);
	while (atomic_load(&diary.used) < 3)
		sleep_a_little();
	run_job(&short_job);
	size_t finished = atomic_load(&diary.used);
	atomic_store(&diary.enough, true);
	pthread_join(thread, NULL);
	CHECK(atomic_load(&diary.used) == 4000 + SHORT);
	const char *first = memchr(diary.lines, 's', finished);
	CHECK(first && first - diary.lines >= 3);
	for (int i = 0; first && i < SHORT; i++) {
		CHECK(first[2 * i] == 's');
		CHECK(i == SHORT - 1 || first[2 * i + 1] == 'l');
	}
	CHECK(finished < 2000); /* the long one is far from done */
	gnp_pool_free(pool);
}

/* Two tasks that have had much and one that has had nothing, which gets three chunks of four. */
static void young_tasks_go_first_and_old_ones_go_on(void)
{
	static struct diary diary;
	enum { SHORT = 30, LONG = 1000 };
	struct gnp_pool *pool = make_pool(1);
	struct gnp_task old[2], part, young;
	pthread_t threads[2];
	struct job jobs[2], short_job = {pool, SHORT, 's', &diary, &young};
	gnp_task_init(&young);
	for (int i = 0; i < 2; i++) {
		gnp_task_init(&old[i]);
		gnp_task_serve(&old[i], 1000000000);
		jobs[i] = (struct job){pool, LONG, (char)('a' + i), &diary, &old[i]};
	}
	gnp_task_init_part(&part, &old[1]);
	jobs[1].task = &part; /* a part is as old as the whole */
	CHECK(gnp_task_served(&part) == 1000000000);
	for (int i = 0; i < 2; i++)
		CHECK(pthread_create(&threads[i], NULL, run_job, &jobs[i]) == 0);
	while (gnp_task_served(&old[0]) == 1000000000 || gnp_task_served(&old[1]) == 1000000000)
		sleep_a_little();
	run_job(&short_job);
	size_t finished = atomic_load(&diary.used), counts[2] = {0, 0};
	atomic_store(&diary.enough, true);
	for (int i = 0; i < 2; i++)
		pthread_join(threads[i], NULL);
	const char *first = memchr(diary.lines, 's', finished);
	CHECK(first != NULL);
	const char *last = memrchr(diary.lines, 's', finished);
	for (const char *line = first; line && line < last; line++)
		if (*line != 's')
			counts[*line - 'a']++;
	CHECK(counts[0] + counts[1] >= SHORT / 3 - 1 && counts[0] + counts[1] <= SHORT / 3 + 1);
	CHECK(counts[0] >= 3 && counts[1] >= 3); /* neither keeps the other from going on */
	CHECK(gnp_task_served(&young) > 0 && gnp_task_served(&old[1]) > 1000000000);
	gnp_pool_free(pool);
}

/* --- failure and cancelling --- */

struct trouble {
	struct gnp_task *task;
	atomic_size_t ran;
	atomic_size_t failed;
};

static gnp_status cancel_in_chunk_5(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                    struct gnp_error *error)
{
	struct trouble *trouble = context;
	(void)end, (void)scratch, (void)error;
	atomic_fetch_add(&trouble->ran, 1);
	if (begin == 5)
		gnp_task_stop(trouble->task, GNP_DEADLINE);
	return GNP_OK;
}

static void no_chunk_starts_after_a_cancel(void)
{
	for (unsigned workers = 1; workers <= 4; workers++) {
		struct gnp_pool *pool = make_pool(workers);
		struct gnp_task task;
		struct trouble trouble = {.task = &task};
		struct gnp_error error = {0};
		gnp_task_init(&task);
		CHECK(gnp_pool_run(pool, &task, 100000, 1, cancel_in_chunk_5, &trouble, &error) == GNP_DEADLINE);
		CHECK_STRING(error.text, "the work took longer than its time limit");
		if (workers == 1)
			CHECK(atomic_load(&trouble.ran) == 6);
		CHECK(atomic_load(&trouble.ran) < 100000);
		size_t before = atomic_load(&trouble.ran);
		CHECK(gnp_pool_run(pool, &task, 10, 1, cancel_in_chunk_5, &trouble, NULL) == GNP_DEADLINE);
		CHECK(atomic_load(&trouble.ran) == before);
		gnp_pool_free(pool);
	}
}

enum { FAILING = 4 };

/* Chunks 0 .. 3 are all under way before any fails; the highest fails first. */
static gnp_status fail_in_reverse(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                  struct gnp_error *error)
{
	struct trouble *trouble = context;
	(void)end, (void)scratch;
	atomic_fetch_add(&trouble->ran, 1);
	while (atomic_load(&trouble->ran) < FAILING || atomic_load(&trouble->failed) < FAILING - 1 - begin)
		sleep_a_little();
	atomic_fetch_add(&trouble->failed, 1);
	return gnp_error_set(error, GNP_SINGULAR, "chunk %zu", begin);
}

static void the_lowest_failed_chunk_is_reported(void)
{
	struct gnp_pool *pool = make_pool(FAILING);
	for (int repeat = 0; repeat < 20; repeat++) {
		struct trouble trouble = {0};
		struct gnp_error error = {0};
		CHECK(gnp_pool_run(pool, NULL, FAILING, 1, fail_in_reverse, &trouble, &error) == GNP_SINGULAR);
		CHECK_STRING(error.text, "chunk 0");
		CHECK(error.status == GNP_SINGULAR);
	}
	gnp_pool_free(pool);
}

static gnp_status fail_without_words(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                     struct gnp_error *error)
{
	(void)context, (void)begin, (void)end, (void)scratch, (void)error;
	return GNP_OUT_OF_MEMORY;
}

static void a_failure_without_text_gets_that_of_its_status(void)
{
	struct gnp_pool *pool = make_pool(2);
	struct gnp_error error = {0};
	CHECK(gnp_pool_run(pool, NULL, 9, 2, fail_without_words, NULL, &error) == GNP_OUT_OF_MEMORY);
	CHECK_STRING(error.text, "memory is exhausted");
	gnp_pool_free(pool);
}

/* --- many coordinators --- */

static gnp_status add_up(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t *items = gnp_scratch_take(scratch, end - begin, sizeof *items), sum = 0;
	(void)error;
	for (size_t i = begin; i < end; i++)
		items[i - begin] = i;
	for (size_t i = begin; i < end; i++)
		sum += items[i - begin];
	atomic_fetch_add((atomic_size_t *)context, sum);
	return GNP_OK;
}

struct coordinator {
	struct gnp_pool *pool;
	size_t wrong;
};

static void *coordinate(void *argument)
{
	struct coordinator *coordinator = argument;
	for (size_t run = 1; run <= 40; run++) {
		atomic_size_t sum = 0;
		size_t count = run * 37;
		gnp_status status = gnp_pool_run(coordinator->pool, NULL, count, 10, add_up, &sum, NULL);
		coordinator->wrong += status != GNP_OK || atomic_load(&sum) != count * (count - 1) / 2;
	}
	return NULL;
}

static void many_coordinators_share_one_pool(void)
{
	enum { THREADS = 8 };
	struct gnp_pool *pool = make_pool(3);
	struct coordinator coordinators[THREADS];
	pthread_t threads[THREADS];
	for (int t = 0; t < THREADS; t++) {
		coordinators[t] = (struct coordinator){pool, 0};
		CHECK(pthread_create(&threads[t], NULL, coordinate, &coordinators[t]) == 0);
	}
	for (int t = 0; t < THREADS; t++) {
		pthread_join(threads[t], NULL);
		CHECK(coordinators[t].wrong == 0);
	}
	gnp_pool_free(pool);
}

/* --- scratch --- */

static void scratch_is_aligned_and_never_overlaps(void)
{
	enum { TAKES = 200 };
	struct gnp_scratch *scratch = gnp_scratch_create();
	for (int round = 0; round < 3; round++) {
		unsigned char *taken[TAKES];
		for (size_t t = 0; t < TAKES; t++) {
			size_t bytes = t * t * 7 % 90000;
			taken[t] = gnp_scratch_take(scratch, bytes, 1);
			CHECK(taken[t] && (uintptr_t)taken[t] % 64 == 0);
			memset(taken[t], (int)t, bytes);
		}
		for (size_t t = 0; t < TAKES; t++) {
			size_t bytes = t * t * 7 % 90000, same = 0;
			for (size_t b = 0; b < bytes; b++)
				same += taken[t][b] == (unsigned char)t;
			CHECK(same == bytes);
		}
		gnp_scratch_release(scratch, (struct gnp_scratch_mark){0, 0});
	}
	gnp_scratch_free(scratch);
	gnp_scratch_free(NULL);
}

static void scratch_gives_back_to_a_mark_and_reuses_it(void)
{
	struct gnp_scratch *scratch = gnp_scratch_create();
	char *kept = gnp_scratch_take(scratch, 100, 1);
	strcpy(kept, "kept");
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	void *small = gnp_scratch_take(scratch, 10, 8);
	void *large = gnp_scratch_take(scratch, 30, 1 << 20);
	CHECK(large != NULL);
	memset(large, 1, 30 << 20);
	gnp_scratch_release(scratch, mark);
	CHECK(gnp_scratch_take(scratch, 10, 8) == small);
	CHECK(gnp_scratch_take(scratch, 30, 1 << 20) == large);
	CHECK_STRING(kept, "kept");
	gnp_scratch_free(scratch);
}

static void scratch_refuses_what_does_not_fit_in_memory(void)
{
	struct gnp_scratch *scratch = gnp_scratch_create();
	CHECK(!gnp_scratch_take(scratch, SIZE_MAX / 2, 3));
	CHECK(!gnp_scratch_take(scratch, SIZE_MAX, 1));
	CHECK(!gnp_scratch_take(scratch, (size_t)1 << 62, 1));
	CHECK(gnp_scratch_take(scratch, 8, 8) != NULL);
	gnp_scratch_free(scratch);
}

/* --- task and status --- */

static void a_task_shows_stage_progress_and_seconds(void)
{
	struct gnp_task task;
	gnp_task_init(&task);
	CHECK(gnp_task_current(&task) == GNP_STAGE_WAITING);
	CHECK_NEAR(gnp_task_fraction(&task), 0, 0);
	gnp_task_stage(&task, GNP_STAGE_ORDER, 200);
	gnp_task_advance(&task, 50);
	CHECK_NEAR(gnp_task_fraction(&task), 0.25, 0);
	gnp_task_advance(&task, 500);
	CHECK_NEAR(gnp_task_fraction(&task), 1, 0);
	double begun = gnp_clock();
	while (gnp_clock() - begun < 0.01)
		sleep_a_little();
	gnp_task_stage(&task, GNP_STAGE_DONE, 0);
	CHECK(task.seconds[GNP_STAGE_ORDER] >= 0.01);
	CHECK(task.seconds[GNP_STAGE_ESTIMATE] == 0);
	CHECK_STRING(gnp_stage_name(gnp_task_current(&task)), "done");
	CHECK_STRING(gnp_stage_name(GNP_STAGE_NEIGHBORS), "neighbors");
	CHECK_STRING(gnp_stage_name((enum gnp_stage)99), "unknown");
	gnp_task_rebook(&task, GNP_STAGE_ORDER, GNP_STAGE_ESTIMATE, 0.005);
	CHECK_NEAR(task.seconds[GNP_STAGE_ESTIMATE], 0.005, 1e-15);
	CHECK(task.seconds[GNP_STAGE_ORDER] >= 0.0049);
	gnp_task_stage(NULL, GNP_STAGE_ORDER, 1);
	gnp_task_advance(NULL, 1);
	CHECK(gnp_task_check(NULL, NULL) == GNP_OK);
}

static void the_first_reason_to_stop_wins(void)
{
	struct gnp_task task;
	struct gnp_error error = {0};
	gnp_task_init(&task);
	CHECK(gnp_task_check(&task, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	gnp_task_cancel(&task);
	gnp_task_stop(&task, GNP_DEADLINE);
	CHECK(gnp_task_check(&task, &error) == GNP_CANCELLED);
	CHECK_STRING(error.text, "the work was cancelled");
}

static void the_first_error_wins_and_long_text_is_cut(void)
{
	struct gnp_error error = {0};
	CHECK(gnp_error_set(&error, GNP_DEGENERATE, "points: got %d, need at least %d", 3, 16) == GNP_DEGENERATE);
	CHECK(gnp_error_set(&error, GNP_INTERNAL, "later") == GNP_INTERNAL);
	CHECK(error.status == GNP_DEGENERATE);
	CHECK_STRING(error.text, "points: got 3, need at least 16");
	CHECK(gnp_error_set(NULL, GNP_IO, "nobody listens") == GNP_IO);
	error = (struct gnp_error){0};
	gnp_error_set(&error, GNP_IO, "%01000d", 1);
	CHECK(strlen(error.text) == sizeof error.text - 1);
}

static void every_status_has_name_code_and_text(void)
{
	for (int s = 0; s < GNP_STATUS_COUNT; s++) {
		int http = gnp_status_http((gnp_status)s);
		CHECK(strlen(gnp_status_name((gnp_status)s)) > 1 && strlen(gnp_status_text((gnp_status)s)) > 1);
		CHECK(s == GNP_OK ? http == 200 : http >= 400 && http < 600);
		for (int t = 0; t < s; t++)
			CHECK(strcmp(gnp_status_name((gnp_status)s), gnp_status_name((gnp_status)t)) != 0);
	}
	CHECK_STRING(gnp_status_name((gnp_status)-1), "internal");
	CHECK(gnp_status_http((gnp_status)GNP_STATUS_COUNT) == 500);
	CHECK_STRING(gnp_status_text((gnp_status)1000), "an internal error");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(every_item_runs_once_in_fixed_chunks),
		TEST(pool_sizes_are_checked),
		TEST(a_short_job_takes_turns_with_a_long_one),
		TEST(young_tasks_go_first_and_old_ones_go_on),
		TEST(no_chunk_starts_after_a_cancel),
		TEST(the_lowest_failed_chunk_is_reported),
		TEST(a_failure_without_text_gets_that_of_its_status),
		TEST(many_coordinators_share_one_pool),
		TEST(scratch_is_aligned_and_never_overlaps),
		TEST(scratch_gives_back_to_a_mark_and_reuses_it),
		TEST(scratch_refuses_what_does_not_fit_in_memory),
		TEST(a_task_shows_stage_progress_and_seconds),
		TEST(the_first_reason_to_stop_wins),
		TEST(the_first_error_wins_and_long_text_is_cut),
		TEST(every_status_has_name_code_and_text),
	};
	return RUN_TESTS(tests);
}
