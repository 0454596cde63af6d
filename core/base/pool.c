#include "core/base/pool.h"

#include <pthread.h>
#include <sched.h>
#include <stdbool.h>
#include <stdlib.h>

/* A running loop, on its coordinator's stack, linked into the pool's ring of loops that still have chunks to give. */
struct loop {
	struct loop *previous, *next;
	struct gnp_task *task;
	size_t count, chunk, begin; /* begin: first item not handed out */
	size_t running;             /* chunks being worked on */
	gnp_chunk_fn fn;
	void *context;
	gnp_status status;
	size_t failed_at; /* begin of the lowest failed chunk */
	struct gnp_error error;
	pthread_cond_t finished;
};

struct worker {
	struct gnp_pool *pool;
	struct gnp_scratch *scratch;
	pthread_t thread;
};

struct gnp_pool {
	pthread_mutex_t lock;
	pthread_cond_t work;
	struct loop *turn; /* next loop to serve; NULL when the ring is empty */
	unsigned taken;    /* chunks handed out */
	bool stopping;
	unsigned count;
	struct worker workers[];
};

static void ring_add(struct gnp_pool *pool, struct loop *loop)
{
	struct loop *turn = pool->turn;
	if (!turn) {
		loop->previous = loop->next = loop;
		pool->turn = loop;
		return;
	}
	loop->next = turn;
	loop->previous = turn->previous;
	turn->previous->next = loop;
	turn->previous = loop;
}

static void ring_remove(struct gnp_pool *pool, struct loop *loop)
{
	if (!loop->next)
		return;
	if (pool->turn == loop)
		pool->turn = loop->next == loop ? NULL : loop->next;
	loop->previous->next = loop->next;
	loop->next->previous = loop->previous;
	loop->previous = loop->next = NULL;
}

/* Lock held. Loops without a task are pieces of work nobody keeps an account of. */
static bool is_young(const struct loop *loop)
{
	const uint64_t youth = 500000000; /* nanoseconds */
	return loop->task && gnp_task_served(loop->task) < youth;
}

/* Lock held. The next loop in turn, but for three chunks of four the next that is young. */
static struct loop *choose(struct gnp_pool *pool)
{
	struct loop *loop = pool->turn;
	if (pool->taken++ % 4 == 3)
		return loop;
	do {
		if (is_young(loop))
			return loop;
		loop = loop->next;
	} while (loop != pool->turn);
	return loop;
}

/* Lock held. The turn goes on; a loop that was served out of turn goes behind the others. */
static void pass_turn(struct gnp_pool *pool, struct loop *loop)
{
	if (pool->turn == loop) {
		pool->turn = loop->next;
	} else {
		ring_remove(pool, loop);
		ring_add(pool, loop);
	}
}

/* Lock held. */
static struct loop *take_chunk(struct gnp_pool *pool, size_t *begin, size_t *end)
{
	struct loop *loop = choose(pool);
	*begin = loop->begin;
	*end = loop->count - loop->begin > loop->chunk ? loop->begin + loop->chunk : loop->count;
	loop->begin = *end;
	loop->running++;
	pass_turn(pool, loop);
	if (loop->begin == loop->count)
		ring_remove(pool, loop);
	return loop;
}

static gnp_status run_chunk(struct loop *loop, size_t begin, size_t end, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	gnp_status status = gnp_task_check(loop->task, error);
	if (status != GNP_OK)
		return status;
	gnp_scratch_release(scratch, (struct gnp_scratch_mark){0, 0});
	return loop->fn(loop->context, begin, end, scratch, error);
}

/* Lock held. */
static void record_failure(struct gnp_pool *pool, struct loop *loop, size_t begin, gnp_status status,
                           const struct gnp_error *error)
{
	if (loop->status == GNP_OK || begin < loop->failed_at) {
		loop->status = status;
		loop->failed_at = begin;
		loop->error = *error;
	}
	loop->begin = loop->count;
	ring_remove(pool, loop);
}

static void *worker_main(void *argument)
{
	struct worker *worker = argument;
	struct gnp_pool *pool = worker->pool;
	pthread_mutex_lock(&pool->lock);
	for (;;) {
		while (!pool->turn && !pool->stopping)
			pthread_cond_wait(&pool->work, &pool->lock);
		if (!pool->turn)
			break;
		size_t begin, end;
		struct loop *loop = take_chunk(pool, &begin, &end);
		pthread_mutex_unlock(&pool->lock);

		struct gnp_error error = {0};
		double started = gnp_clock();
		gnp_status status = run_chunk(loop, begin, end, worker->scratch, &error);
		gnp_task_serve(loop->task, (uint64_t)(1e9 * (gnp_clock() - started)));
		if (status == GNP_OK)
			gnp_task_advance(loop->task, end - begin);

		pthread_mutex_lock(&pool->lock);
		loop->running--;
		if (status != GNP_OK)
			record_failure(pool, loop, begin, status, &error);
		if (!loop->running && loop->begin == loop->count)
			pthread_cond_signal(&loop->finished);
	}
	pthread_mutex_unlock(&pool->lock);
	return NULL;
}

static unsigned cores(void)
{
	cpu_set_t set;
	if (sched_getaffinity(0, sizeof set, &set) != 0)
		return 1;
	int count = CPU_COUNT(&set);
	return count > 0 ? (unsigned)count : 1;
}

gnp_status gnp_pool_create(unsigned workers, struct gnp_pool **out, struct gnp_error *error)
{
	enum { WORKERS_MAX = 1024 };
	if (workers > WORKERS_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "workers: got %u, need at most %d", workers, WORKERS_MAX);
	if (!workers)
		workers = cores();
	struct gnp_pool *pool = calloc(1, sizeof *pool + workers * sizeof pool->workers[0]);
	if (!pool)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "pool: no memory for %u workers", workers);
	pthread_mutex_init(&pool->lock, NULL);
	pthread_cond_init(&pool->work, NULL);
	for (unsigned i = 0; i < workers; i++) {
		struct worker *worker = &pool->workers[i];
		worker->pool = pool;
		worker->scratch = gnp_scratch_create();
		if (!worker->scratch || pthread_create(&worker->thread, NULL, worker_main, worker) != 0) {
			gnp_scratch_free(worker->scratch);
			gnp_pool_free(pool);
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "pool: cannot start worker %u of %u", i + 1, workers);
		}
		pool->count++;
	}
	*out = pool;
	return GNP_OK;
}

void gnp_pool_free(struct gnp_pool *pool)
{
	if (!pool)
		return;
	pthread_mutex_lock(&pool->lock);
	pool->stopping = true;
	pthread_cond_broadcast(&pool->work);
	pthread_mutex_unlock(&pool->lock);
	for (unsigned i = 0; i < pool->count; i++) {
		pthread_join(pool->workers[i].thread, NULL);
		gnp_scratch_free(pool->workers[i].scratch);
	}
	pthread_cond_destroy(&pool->work);
	pthread_mutex_destroy(&pool->lock);
	free(pool);
}

unsigned gnp_pool_workers(const struct gnp_pool *pool)
{
	return pool->count;
}

gnp_status gnp_pool_run(struct gnp_pool *pool, struct gnp_task *task, size_t count, size_t chunk,
                        gnp_chunk_fn fn, void *context, struct gnp_error *error)
{
	gnp_status status = gnp_task_check(task, error);
	if (status != GNP_OK || count == 0)
		return status;
	struct loop loop = {.task = task, .count = count, .chunk = chunk ? chunk : 1, .fn = fn, .context = context};
	pthread_cond_init(&loop.finished, NULL);
	pthread_mutex_lock(&pool->lock);
	ring_add(pool, &loop);
	pthread_cond_broadcast(&pool->work);
	while (loop.running || loop.begin < loop.count)
		pthread_cond_wait(&loop.finished, &pool->lock);
	pthread_mutex_unlock(&pool->lock);
	pthread_cond_destroy(&loop.finished);
	if (loop.status != GNP_OK)
		gnp_error_set(error, loop.status, "%s", loop.error.text[0] ? loop.error.text : gnp_status_text(loop.status));
	return loop.status;
}
