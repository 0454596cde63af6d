#include "proto/operation/prepared_cache.h"

#include <pthread.h>
#include <stdatomic.h>
#include <time.h>

#include "tests/unit/test.h"

static atomic_int made, alive;

/* Makes an int of 100 bytes' worth; context: its value, negative to fail; waits as long as the task lives when it is 1000. */
static gnp_status make(void *context, struct gnp_task *task, void **object, size_t *bytes, struct gnp_error *error)
{
	int value = *(int *)context;
	struct timespec pause = {0, 20000000};
	atomic_fetch_add(&made, 1);
	nanosleep(&pause, NULL);
	while (value == 1000 && gnp_task_check(task, error) == GNP_OK)
		nanosleep(&pause, NULL);
	if (value == 1000)
		return GNP_CANCELLED;
	if (value < 0)
		return gnp_error_set(error, GNP_SINGULAR, "no %d", value);
	int *copy = malloc(sizeof *copy);
	*copy = value;
	*object = copy;
	*bytes = 100;
	atomic_fetch_add(&alive, 1);
	return GNP_OK;
}

static void destroy(void *object)
{
	free(object);
	atomic_fetch_sub(&alive, 1);
}

static const struct gnp_prepared_kind kind = {make, destroy};

static struct gnp_prepared_entry *get(struct gnp_prepared_cache *cache, int value, bool *found)
{
	struct gnp_prepared_entry *entry = NULL;
	char key[GNP_SHA256_TEXT];
	memset(key, 0, sizeof key);
	snprintf(key, sizeof key, "%d", value);
	CHECK(gnp_prepared_get(cache, key, &kind, &value, NULL, &entry, found, NULL) == GNP_OK);
	CHECK(entry && *(int *)gnp_prepared_object(entry) == value);
	return entry;
}

static void begin(void)
{
	atomic_store(&made, 0);
	CHECK(atomic_load(&alive) == 0);
}

static void least_recently_used_goes_first(void)
{
	struct gnp_prepared_cache *cache;
	bool found;
	begin();
	CHECK(gnp_prepared_cache_create(250, &cache, NULL) == GNP_OK);
	for (int value = 1; value <= 2; value++) {
		gnp_prepared_release(get(cache, value, &found));
		CHECK(!found);
	}
	gnp_prepared_release(get(cache, 1, &found));
	CHECK(found);
	gnp_prepared_release(get(cache, 3, &found)); /* 2 goes */
	gnp_prepared_release(get(cache, 1, &found));
	CHECK(found);
	gnp_prepared_release(get(cache, 2, &found));
	CHECK(!found && atomic_load(&made) == 4 && atomic_load(&alive) == 2);
	struct gnp_prepared_cache_state state = gnp_prepared_cache_state(cache);
	CHECK(state.entries == 2 && state.bytes == 200 && state.limit == 250);
	CHECK(state.hits == 2 && state.misses == 4 && state.evictions == 2);
	gnp_prepared_cache_free(cache);
	CHECK(atomic_load(&alive) == 0);
}

static void what_is_held_stays(void)
{
	struct gnp_prepared_cache *cache;
	bool found;
	begin();
	CHECK(gnp_prepared_cache_create(0, &cache, NULL) == GNP_OK);
	struct gnp_prepared_entry *first = get(cache, 1, &found), *again = get(cache, 1, &found), *second = get(cache, 2, &found);
	CHECK(again == first && atomic_load(&alive) == 2 && *(int *)gnp_prepared_object(first) == 1);
	gnp_prepared_release(first);
	CHECK(atomic_load(&alive) == 2);
	gnp_prepared_release(again);
	CHECK(atomic_load(&alive) == 1); /* nothing is kept */
	gnp_prepared_release(second);
	gnp_prepared_release(NULL);
	CHECK(atomic_load(&alive) == 0 && gnp_prepared_cache_state(cache).bytes == 0);
	gnp_prepared_cache_free(cache);
	gnp_prepared_release(get(NULL, 5, &found)); /* without a cache */
	CHECK(!found && atomic_load(&alive) == 0);
}

static void failures_are_not_kept(void)
{
	struct gnp_prepared_cache *cache;
	struct gnp_prepared_entry *entry = NULL;
	struct gnp_error error = {0};
	char key[GNP_SHA256_TEXT] = "a";
	int value = -4;
	bool found;
	begin();
	CHECK(gnp_prepared_cache_create(1000, &cache, NULL) == GNP_OK);
	CHECK(gnp_prepared_get(cache, key, &kind, &value, NULL, &entry, &found, &error) == GNP_SINGULAR && !entry);
	CHECK_STRING(error.text, "no -4");
	value = 4;
	CHECK(gnp_prepared_get(cache, key, &kind, &value, NULL, &entry, &found, NULL) == GNP_OK && !found);
	gnp_prepared_release(entry);
	gnp_prepared_cache_free(cache);
	CHECK(atomic_load(&alive) == 0);
}

struct asking {
	struct gnp_prepared_cache *cache;
	int value;
	struct gnp_task task;
	gnp_status status;
	bool found;
};

static void *ask(void *context)
{
	struct asking *asking = context;
	struct gnp_prepared_entry *entry = NULL;
	char key[GNP_SHA256_TEXT] = "same";
	asking->status = gnp_prepared_get(asking->cache, key, &kind, &asking->value, &asking->task, &entry, &asking->found, NULL);
	if (asking->status == GNP_OK)
		CHECK(*(int *)gnp_prepared_object(entry) == 7);
	gnp_prepared_release(entry);
	return NULL;
}

static void requests_at_once_make_it_once(void)
{
	enum { THREADS = 12 };
	struct gnp_prepared_cache *cache;
	struct asking asking[THREADS];
	pthread_t threads[THREADS];
	int finders = 0;
	begin();
	CHECK(gnp_prepared_cache_create(1000, &cache, NULL) == GNP_OK);
	for (int i = 0; i < THREADS; i++) {
		asking[i] = (struct asking){.cache = cache, .value = 7};
		gnp_task_init(&asking[i].task);
		pthread_create(&threads[i], NULL, ask, &asking[i]);
	}
	for (int i = 0; i < THREADS; i++) {
		pthread_join(threads[i], NULL);
		CHECK(asking[i].status == GNP_OK);
		finders += asking[i].found;
	}
	CHECK(atomic_load(&made) == 1 && finders == THREADS - 1);
	gnp_prepared_cache_free(cache);
	CHECK(atomic_load(&alive) == 0);
}

/* One makes for ever, one waits: cancelling the one that waits does not touch the other; cancelling the maker lets a third begin. */
static void one_clients_cancel_is_its_own(void)
{
	struct gnp_prepared_cache *cache;
	struct asking maker, waiter, third;
	pthread_t making, waiting, following;
	struct timespec pause = {0, 60000000};
	begin();
	CHECK(gnp_prepared_cache_create(1000, &cache, NULL) == GNP_OK);
	maker = (struct asking){.cache = cache, .value = 1000};
	waiter = third = (struct asking){.cache = cache, .value = 7};
	gnp_task_init(&maker.task);
	gnp_task_init(&waiter.task);
	gnp_task_init(&third.task);
	pthread_create(&making, NULL, ask, &maker);
	nanosleep(&pause, NULL);
	pthread_create(&waiting, NULL, ask, &waiter);
	pthread_create(&following, NULL, ask, &third);
	nanosleep(&pause, NULL);
	gnp_task_cancel(&waiter.task);
	pthread_join(waiting, NULL);
	CHECK(waiter.status == GNP_CANCELLED && atomic_load(&made) == 1);
	gnp_task_cancel(&maker.task);
	pthread_join(making, NULL);
	pthread_join(following, NULL);
	CHECK(maker.status == GNP_CANCELLED && third.status == GNP_OK && !third.found && atomic_load(&made) == 2);
	gnp_prepared_cache_free(cache);
	CHECK(atomic_load(&alive) == 0);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(least_recently_used_goes_first), TEST(what_is_held_stays), TEST(failures_are_not_kept),
	                                    TEST(requests_at_once_make_it_once), TEST(one_clients_cancel_is_its_own)};
	return RUN_TESTS(tests);
}
