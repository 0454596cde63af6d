/* The bounded queue: both limits, order, removal, closing, and that every accepted job runs exactly once. */
#include "tests/unit/test.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <unistd.h>

#include "server/base/queue.h"

struct work {
	struct gnpd_queued job;
	atomic_int *running, *gate; /* waits until *gate is 1 */
	int *order, *place;
	int number;
	atomic_int runs;
};

static void run_work(struct gnpd_queued *job)
{
	struct work *work = (struct work *)((char *)job - offsetof(struct work, job));
	if (work->running)
		atomic_fetch_add(work->running, 1);
	while (work->gate && !atomic_load(work->gate))
		usleep(200);
	if (work->order)
		work->order[(*work->place)++] = work->number;
	atomic_fetch_add(&work->runs, 1);
}

static struct gnpd_queue *create(size_t runners, size_t count, size_t bytes)
{
	struct gnpd_queue *queue = NULL;
	struct gnp_error error = {0};
	CHECK(gnpd_queue_create(runners, count, bytes, &queue, &error) == GNP_OK);
	return queue;
}

static void wait_for(atomic_int *value, int want)
{
	while (atomic_load(value) < want)
		usleep(200);
}

static void jobs_run_once_in_order(void)
{
	enum { JOBS = 50 };
	struct work works[JOBS] = {0};
	int order[JOBS], place = 0;
	struct gnpd_queue *queue = create(1, JOBS, 1);
	for (int i = 0; i < JOBS; i++) {
		works[i] = (struct work){.job.run = run_work, .order = order, .place = &place, .number = i};
		CHECK(gnpd_queue_submit(queue, &works[i].job, NULL) == GNP_OK);
	}
	gnpd_queue_free(queue);
	CHECK(place == JOBS);
	for (int i = 0; i < JOBS; i++)
		CHECK(order[i] == i && works[i].runs == 1);
}

static void count_limit_names_itself(void)
{
	atomic_int running = 0, gate = 0;
	struct work works[4];
	struct gnp_error error = {0};
	struct gnpd_queue *queue = create(1, 2, 1);
	for (int i = 0; i < 4; i++)
		works[i] = (struct work){.job.run = run_work, .running = &running, .gate = &gate};
	CHECK(gnpd_queue_submit(queue, &works[0].job, NULL) == GNP_OK);
	wait_for(&running, 1);
	CHECK(gnpd_queue_submit(queue, &works[1].job, NULL) == GNP_OK);
	CHECK(gnpd_queue_check(queue, NULL) == GNP_OK);
	CHECK(gnpd_queue_submit(queue, &works[2].job, NULL) == GNP_OK);
	CHECK(gnpd_queue_check(queue, NULL) == GNP_OVERLOADED);
	CHECK(gnpd_queue_submit(queue, &works[3].job, &error) == GNP_OVERLOADED);
	CHECK_STRING(error.text, "queue: 2 requests wait, at most 2 may (queue-count)");
	struct gnpd_queue_state state = gnpd_queue_state(queue);
	CHECK(state.waiting == 2 && state.running == 1);

	CHECK(gnpd_queue_remove(queue, &works[1].job));
	CHECK(!gnpd_queue_remove(queue, &works[1].job));
	CHECK(!gnpd_queue_remove(queue, &works[0].job));
	CHECK(gnpd_queue_submit(queue, &works[3].job, NULL) == GNP_OK);
	atomic_store(&gate, 1);
	gnpd_queue_free(queue);
	CHECK(works[0].runs == 1 && works[1].runs == 0 && works[2].runs == 1 && works[3].runs == 1);
}

static void byte_limit_names_itself(void)
{
	struct gnp_error error = {0}, alone = {0};
	struct gnpd_queue *queue = create(1, 1, 1000);
	CHECK(gnpd_queue_reserve(queue, 0, 600, NULL) == GNP_OK);
	CHECK(gnpd_queue_reserve(queue, 0, 401, &error) == GNP_OVERLOADED);
	CHECK_STRING(error.text, "queue: requests hold 600 bytes and 401 more are needed, at most 1000 may be held (queue-bytes)");
	CHECK(gnpd_queue_reserve(queue, 600, 400, NULL) == GNP_OK);
	CHECK(gnpd_queue_state(queue).bytes == 1000);
	CHECK(gnpd_queue_reserve(queue, 0, SIZE_MAX, &alone) == GNP_TOO_LARGE);
	CHECK_CONTAINS(alone.text, "need at most 1000 in all (queue-bytes)");
	alone = (struct gnp_error){0};
	CHECK(gnpd_queue_reserve(queue, 600, 401, &alone) == GNP_TOO_LARGE);
	CHECK_CONTAINS(alone.text, "the request holds 600 bytes and needs 401 more");
	gnpd_queue_release(queue, 1000);
	CHECK(gnpd_queue_state(queue).bytes == 0);
	gnpd_queue_free(queue);
}

static void closed_queue_finishes_what_it_has(void)
{
	atomic_int running = 0, gate = 0;
	struct work first = {.job.run = run_work, .running = &running, .gate = &gate}, second = first, third = first;
	struct gnp_error error = {0};
	struct gnpd_queue *queue = create(1, 8, 1);
	CHECK(gnpd_queue_submit(queue, &first.job, NULL) == GNP_OK);
	CHECK(gnpd_queue_submit(queue, &second.job, NULL) == GNP_OK);
	gnpd_queue_close(queue);
	CHECK(gnpd_queue_submit(queue, &third.job, &error) == GNP_DRAINING);
	atomic_store(&gate, 1);
	gnpd_queue_free(queue);
	CHECK(first.runs == 1 && second.runs == 1 && third.runs == 0);
}

static void several_runners_run_side_by_side(void)
{
	atomic_int running = 0, gate = 0;
	struct work works[4];
	struct gnpd_queue *queue = create(4, 8, 1);
	for (int i = 0; i < 4; i++) {
		works[i] = (struct work){.job.run = run_work, .running = &running, .gate = &gate};
		CHECK(gnpd_queue_submit(queue, &works[i].job, NULL) == GNP_OK);
	}
	wait_for(&running, 4);
	atomic_store(&gate, 1);
	gnpd_queue_free(queue);
	CHECK(running == 4);
}

struct hammer {
	struct gnpd_queue *queue;
	struct work *works;
	int count, removed;
};

static void *submit_many(void *argument)
{
	struct hammer *hammer = argument;
	for (int i = 0; i < hammer->count; i++) {
		hammer->works[i].job.run = run_work;
		while (gnpd_queue_submit(hammer->queue, &hammer->works[i].job, NULL) != GNP_OK)
			usleep(50);
		if (i % 3 == 0 && gnpd_queue_remove(hammer->queue, &hammer->works[i].job)) {
			hammer->removed++;
			atomic_fetch_add(&hammer->works[i].runs, 1);
		}
	}
	return NULL;
}

static void every_job_runs_or_is_removed_once(void)
{
	enum { THREADS = 4, JOBS = 500 };
	static struct work works[THREADS][JOBS];
	struct hammer hammers[THREADS];
	pthread_t threads[THREADS];
	struct gnpd_queue *queue = create(3, 10, 1);
	for (int t = 0; t < THREADS; t++) {
		hammers[t] = (struct hammer){queue, works[t], JOBS, 0};
		pthread_create(&threads[t], NULL, submit_many, &hammers[t]);
	}
	for (int t = 0; t < THREADS; t++)
		pthread_join(threads[t], NULL);
	gnpd_queue_free(queue);
	for (int t = 0; t < THREADS; t++)
		for (int i = 0; i < JOBS; i++)
			CHECK(works[t][i].runs == 1);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(jobs_run_once_in_order),
		TEST(count_limit_names_itself),
		TEST(byte_limit_names_itself),
		TEST(closed_queue_finishes_what_it_has),
		TEST(several_runners_run_side_by_side),
		TEST(every_job_runs_or_is_removed_once),
	};
	return RUN_TESTS(tests);
}
