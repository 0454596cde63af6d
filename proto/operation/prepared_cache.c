#include "proto/operation/prepared_cache.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum state { MAKING, READY, FAILED };

struct gnp_prepared_entry {
	struct gnp_prepared_cache *cache; /* NULL: of one hold alone */
	const struct gnp_prepared_kind *kind;
	struct gnp_prepared_entry *next;  /* in the cache's list, the most recently used first */
	char key[GNP_SHA256_TEXT];
	enum state state;
	bool listed;
	size_t holds, bytes;
	void *object;
	struct gnp_warnings warnings;     /* that the making left */
};

struct gnp_prepared_cache {
	pthread_mutex_t lock;
	pthread_cond_t made;
	struct gnp_prepared_entry *first;
	struct gnp_prepared_cache_state state;
};

gnp_status gnp_prepared_cache_create(size_t bytes, struct gnp_prepared_cache **out, struct gnp_error *error)
{
	struct gnp_prepared_cache *cache = calloc(1, sizeof *cache);
	if (!cache)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "cache: no memory");
	pthread_mutex_init(&cache->lock, NULL);
	pthread_condattr_t attributes;
	pthread_condattr_init(&attributes);
	pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
	pthread_cond_init(&cache->made, &attributes);
	pthread_condattr_destroy(&attributes);
	cache->state.limit = bytes;
	*out = cache;
	return GNP_OK;
}

static void entry_free(struct gnp_prepared_entry *entry)
{
	if (entry->object)
		entry->kind->destroy(entry->object);
	free(entry);
}

void gnp_prepared_cache_free(struct gnp_prepared_cache *cache)
{
	if (!cache)
		return;
	while (cache->first) {
		struct gnp_prepared_entry *entry = cache->first;
		cache->first = entry->next;
		entry_free(entry);
	}
	pthread_cond_destroy(&cache->made);
	pthread_mutex_destroy(&cache->lock);
	free(cache);
}

/* ---- The list; the lock is held ---- */

static void unlist(struct gnp_prepared_cache *cache, struct gnp_prepared_entry *entry)
{
	struct gnp_prepared_entry **at = &cache->first;
	while (*at != entry)
		at = &(*at)->next;
	*at = entry->next;
	entry->listed = false;
	if (entry->state == READY) {
		cache->state.entries--;
		cache->state.bytes -= entry->bytes;
	}
}

static void list_first(struct gnp_prepared_cache *cache, struct gnp_prepared_entry *entry)
{
	entry->next = cache->first;
	entry->listed = true;
	cache->first = entry;
}

static struct gnp_prepared_entry *find(struct gnp_prepared_cache *cache, const char *key)
{
	struct gnp_prepared_entry *entry = cache->first;
	while (entry && strcmp(entry->key, key) != 0)
		entry = entry->next;
	return entry;
}

/* The least recently used that is ready and in nobody's hands. */
static struct gnp_prepared_entry *idlest(struct gnp_prepared_cache *cache)
{
	struct gnp_prepared_entry *last = NULL;
	for (struct gnp_prepared_entry *entry = cache->first; entry; entry = entry->next)
		if (entry->state == READY && entry->holds == 0)
			last = entry;
	return last;
}

/* Takes what is too much out of the list; to be freed without the lock, linked by next. */
static struct gnp_prepared_entry *evict(struct gnp_prepared_cache *cache)
{
	struct gnp_prepared_entry *evicted = NULL, *entry;
	while (cache->state.bytes > cache->state.limit && (entry = idlest(cache)) != NULL) {
		unlist(cache, entry);
		cache->state.evictions++;
		entry->next = evicted;
		evicted = entry;
	}
	return evicted;
}

static void free_all(struct gnp_prepared_entry *entry)
{
	while (entry) {
		struct gnp_prepared_entry *next = entry->next;
		entry_free(entry);
		entry = next;
	}
}

/* ---- Holds ---- */

static void wait_a_little(struct gnp_prepared_cache *cache)
{
	enum { TICK = 30000000, SECOND = 1000000000 };
	struct timespec until;
	clock_gettime(CLOCK_MONOTONIC, &until);
	until.tv_nsec += TICK;
	until.tv_sec += until.tv_nsec / SECOND;
	until.tv_nsec %= SECOND;
	pthread_cond_timedwait(&cache->made, &cache->lock, &until);
}

/* Whether it is the last hold of an entry that is no longer listed, which is then the caller's to free. */
static bool let_go(struct gnp_prepared_entry *entry)
{
	return --entry->holds == 0 && !entry->listed;
}

/* An entry that is ready or that the caller is to make; NULL when memory is exhausted or the task is stopped. Lock held. */
static struct gnp_prepared_entry *hold(struct gnp_prepared_cache *cache, const char *key, const struct gnp_prepared_kind *kind,
                                       struct gnp_task *task, bool *found, struct gnp_error *error)
{
	struct gnp_prepared_entry *entry;
	while ((entry = find(cache, key)) != NULL) {
		entry->holds++;
		while (entry->state == MAKING && gnp_task_check(task, NULL) == GNP_OK)
			wait_a_little(cache);
		*found = entry->state == READY;
		if (*found) {
			unlist(cache, entry);
			list_first(cache, entry);
			cache->state.entries++;
			cache->state.bytes += entry->bytes;
			return entry;
		}
		/* stopped, or its maker failed: whoever comes first tries again */
		if (let_go(entry))
			entry_free(entry);
		if (gnp_task_check(task, error) != GNP_OK)
			return NULL;
	}
	entry = calloc(1, sizeof *entry);
	if (!entry) {
		gnp_error_set(error, GNP_OUT_OF_MEMORY, "cache: no memory");
		return NULL;
	}
	*entry = (struct gnp_prepared_entry){.cache = cache, .kind = kind, .holds = 1};
	memcpy(entry->key, key, sizeof entry->key);
	list_first(cache, entry);
	*found = false;
	return entry;
}

/* The maker's result, for all who wait. Lock held. *evicted: to be freed without it. */
static void publish(struct gnp_prepared_cache *cache, struct gnp_prepared_entry *entry, gnp_status status,
                    struct gnp_prepared_entry **evicted)
{
	if (status == GNP_OK) {
		entry->state = READY;
		cache->state.entries++;
		cache->state.bytes += entry->bytes;
		*evicted = evict(cache);
	} else {
		unlist(cache, entry);
		entry->state = FAILED;
	}
	pthread_cond_broadcast(&cache->made);
}

/* What was warned of while the object was made is true of every answer from it. */
static gnp_status make(struct gnp_prepared_entry *entry, void *context, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = entry->kind->make(context, task, &entry->object, &entry->bytes, error);
	if (status == GNP_OK)
		gnp_warnings_merge(&entry->warnings, gnp_task_warnings(task));
	return status;
}

static gnp_status make_alone(const struct gnp_prepared_kind *kind, void *context, struct gnp_task *task, struct gnp_prepared_entry **out,
                             struct gnp_error *error)
{
	struct gnp_prepared_entry *entry = calloc(1, sizeof *entry);
	if (!entry)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "cache: no memory");
	*entry = (struct gnp_prepared_entry){.kind = kind, .holds = 1, .state = READY};
	gnp_status status = make(entry, context, task, error);
	if (status == GNP_OK)
		*out = entry;
	else
		entry_free(entry);
	return status;
}

gnp_status gnp_prepared_get(struct gnp_prepared_cache *cache, const char key[GNP_SHA256_TEXT], const struct gnp_prepared_kind *kind,
                            void *context, struct gnp_task *task, struct gnp_prepared_entry **out, bool *found, struct gnp_error *error)
{
	struct gnp_error reason = {0};
	*found = false;
	if (!cache)
		return make_alone(kind, context, task, out, error);
	pthread_mutex_lock(&cache->lock);
	struct gnp_prepared_entry *entry = hold(cache, key, kind, task, found, &reason), *evicted = NULL;
	if (entry && *found)
		cache->state.hits++;
	else
		cache->state.misses++;
	pthread_mutex_unlock(&cache->lock);
	if (!entry)
		return gnp_error_set(error, reason.status, "%s", reason.text);
	gnp_status status = *found ? GNP_OK : make(entry, context, task, error);
	if (!*found) {
		pthread_mutex_lock(&cache->lock);
		publish(cache, entry, status, &evicted);
		bool last = status != GNP_OK && let_go(entry);
		pthread_mutex_unlock(&cache->lock);
		if (last)
			entry_free(entry);
		free_all(evicted);
	}
	if (*found)
		gnp_warnings_merge(gnp_task_warnings(task), &entry->warnings);
	if (status == GNP_OK)
		*out = entry;
	return status;
}

void *gnp_prepared_object(const struct gnp_prepared_entry *entry)
{
	return entry->object;
}

void gnp_prepared_release(struct gnp_prepared_entry *entry)
{
	if (!entry)
		return;
	struct gnp_prepared_cache *cache = entry->cache;
	if (!cache) {
		entry_free(entry);
		return;
	}
	pthread_mutex_lock(&cache->lock);
	bool last = let_go(entry);
	struct gnp_prepared_entry *evicted = evict(cache);
	pthread_mutex_unlock(&cache->lock);
	if (last)
		entry_free(entry);
	free_all(evicted);
}

struct gnp_prepared_cache_state gnp_prepared_cache_state(struct gnp_prepared_cache *cache)
{
	pthread_mutex_lock(&cache->lock);
	struct gnp_prepared_cache_state state = cache->state;
	pthread_mutex_unlock(&cache->lock);
	return state;
}
