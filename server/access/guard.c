#include "server/access/guard.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/task.h"
#include "server/access/bucket.h"

enum { CLASSES = 3, LIMITS = 2 };
static const char *const classes[CLASSES] = {"2xx", "4xx", "5xx"};
static const char *const limits[LIMITS] = {"concurrency", "rate"};

struct gnpd_principal {
	char name[GNPD_KEY_NAME_MAX + 1];
	atomic_size_t references;
	pthread_mutex_t lock; /* of what follows up to the counters */
	size_t concurrency;
	double rate, burst;
	size_t active;
	struct gnpd_bucket bucket;
	atomic_uint_fast64_t requests[CLASSES], limited[LIMITS], points;
};

/* What one reading of the file gave; principals[i] is keys->items[i]'s. */
struct set {
	atomic_size_t references;
	struct gnpd_keys *keys;
	struct gnpd_principal **principals;
};

struct gnpd_guard {
	char *path;
	pthread_mutex_t lock; /* of current */
	struct set *current;  /* NULL without a file */
};

/* ---- principals ---- */

void gnpd_principal_release(struct gnpd_principal *principal)
{
	if (!principal || atomic_fetch_sub(&principal->references, 1) > 1)
		return;
	pthread_mutex_destroy(&principal->lock);
	free(principal);
}

static struct gnpd_principal *principal_retain(struct gnpd_principal *principal)
{
	atomic_fetch_add(&principal->references, 1);
	return principal;
}

static struct gnpd_principal *principal_create(const struct gnpd_key *key)
{
	struct gnpd_principal *principal = calloc(1, sizeof *principal);
	if (!principal)
		return NULL;
	strcpy(principal->name, key->name);
	atomic_init(&principal->references, 1);
	pthread_mutex_init(&principal->lock, NULL);
	gnpd_bucket_init(&principal->bucket, key->burst, gnp_clock());
	return principal;
}

static void principal_limit(struct gnpd_principal *principal, const struct gnpd_key *key)
{
	pthread_mutex_lock(&principal->lock);
	/* A limit that comes into force begins with a full bucket. */
	if (!principal->rate)
		gnpd_bucket_init(&principal->bucket, key->burst, gnp_clock());
	principal->concurrency = key->concurrency;
	principal->rate = key->rate;
	principal->burst = key->burst;
	pthread_mutex_unlock(&principal->lock);
}

const char *gnpd_principal_name(const struct gnpd_principal *principal)
{
	return principal->name;
}

/* Lock held. The concurrency first: what it refuses costs no token. */
static gnp_status check_limits(struct gnpd_principal *principal, double now, enum gnpd_limit *limit, double *retry_after,
                               struct gnp_error *error)
{
	if (principal->concurrency && principal->active >= principal->concurrency) {
		*limit = GNPD_LIMIT_CONCURRENCY;
		return gnp_error_set(error, GNP_LIMITED, "key %s: %zu requests are under way, at most %zu may be (concurrency)",
		                     principal->name, principal->active, principal->concurrency);
	}
	if (!principal->rate)
		return GNP_OK;
	*retry_after = gnpd_bucket_take(&principal->bucket, principal->rate, principal->burst, now);
	if (*retry_after <= 0)
		return GNP_OK;
	*limit = GNPD_LIMIT_RATE;
	return gnp_error_set(error, GNP_LIMITED, "key %s: over %.6g requests a second after %.6g at once (rate, burst), the next in %.3g s",
	                     principal->name, principal->rate, principal->burst, *retry_after);
}

gnp_status gnpd_principal_enter(struct gnpd_principal *principal, double now, enum gnpd_limit *limit, double *retry_after,
                                struct gnp_error *error)
{
	*limit = GNPD_LIMIT_NONE;
	*retry_after = 0;
	pthread_mutex_lock(&principal->lock);
	gnp_status status = check_limits(principal, now, limit, retry_after, error);
	if (status == GNP_OK)
		principal->active++;
	pthread_mutex_unlock(&principal->lock);
	if (status != GNP_OK)
		atomic_fetch_add(&principal->limited[*limit - GNPD_LIMIT_CONCURRENCY], 1);
	return status;
}

void gnpd_principal_leave(struct gnpd_principal *principal)
{
	pthread_mutex_lock(&principal->lock);
	principal->active--;
	pthread_mutex_unlock(&principal->lock);
}

void gnpd_principal_count(struct gnpd_principal *principal, int code, size_t points)
{
	atomic_fetch_add(&principal->requests[code < 400 ? 0 : code < 500 ? 1 : 2], 1);
	atomic_fetch_add(&principal->points, points);
}

/* ---- sets ---- */

static void set_release(struct set *set)
{
	if (!set || atomic_fetch_sub(&set->references, 1) > 1)
		return;
	for (size_t i = 0; set->principals && i < set->keys->count; i++)
		gnpd_principal_release(set->principals[i]);
	free(set->principals);
	gnpd_keys_free(set->keys);
	free(set);
}

static struct set *set_retain(struct gnpd_guard *guard)
{
	pthread_mutex_lock(&guard->lock);
	struct set *set = guard->current;
	if (set)
		atomic_fetch_add(&set->references, 1);
	pthread_mutex_unlock(&guard->lock);
	return set;
}

static struct gnpd_principal *find_name(const struct set *set, const char *name)
{
	for (size_t i = 0; set && i < set->keys->count; i++)
		if (strcmp(set->keys->items[i].name, name) == 0)
			return set->principals[i];
	return NULL;
}

/* Takes keys over, also on failure. Names of before keep their principals; limits change only when all is there. */
static struct set *set_create_take(struct gnpd_keys *keys, const struct set *before)
{
	struct set *set = calloc(1, sizeof *set);
	if (!set) {
		gnpd_keys_free(keys);
		return NULL;
	}
	atomic_init(&set->references, 1);
	set->keys = keys;
	set->principals = calloc(keys->count, sizeof *set->principals);
	for (size_t i = 0; set->principals && i < keys->count; i++) {
		struct gnpd_principal *known = find_name(before, keys->items[i].name);
		set->principals[i] = known ? principal_retain(known) : principal_create(&keys->items[i]);
		if (!set->principals[i]) {
			set_release(set);
			return NULL;
		}
	}
	if (set->principals)
		return set;
	set_release(set);
	return NULL;
}

/* ---- the guard ---- */

gnp_status gnpd_guard_reload(struct gnpd_guard *guard, struct gnp_error *error)
{
	struct gnpd_keys *keys = NULL;
	if (!gnpd_guard_on(guard))
		return GNP_OK;
	gnp_status status = gnpd_keys_load(guard->path, &keys, error);
	if (status != GNP_OK)
		return status;
	struct set *before = set_retain(guard);
	struct set *set = set_create_take(keys, before);
	if (!set) {
		set_release(before);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "keys-file: no memory");
	}
	for (size_t i = 0; i < set->keys->count; i++)
		principal_limit(set->principals[i], &set->keys->items[i]);
	pthread_mutex_lock(&guard->lock);
	guard->current = set;
	pthread_mutex_unlock(&guard->lock);
	if (before)
		set_release(before); /* the guard's */
	set_release(before);
	return GNP_OK;
}

gnp_status gnpd_guard_create(const char *path, struct gnpd_guard **out, struct gnp_error *error)
{
	struct gnpd_guard *guard = calloc(1, sizeof *guard);
	if (guard && !(guard->path = strdup(path))) {
		free(guard);
		guard = NULL;
	}
	if (!guard)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "keys-file: no memory");
	pthread_mutex_init(&guard->lock, NULL);
	gnp_status status = gnpd_guard_reload(guard, error);
	if (status == GNP_OK)
		*out = guard;
	else
		gnpd_guard_free(guard);
	return status;
}

void gnpd_guard_free(struct gnpd_guard *guard)
{
	if (!guard)
		return;
	set_release(guard->current);
	pthread_mutex_destroy(&guard->lock);
	free(guard->path);
	free(guard);
}

bool gnpd_guard_on(const struct gnpd_guard *guard)
{
	return guard->path[0] != '\0';
}

size_t gnpd_guard_count(struct gnpd_guard *guard)
{
	struct set *set = set_retain(guard);
	size_t count = set ? set->keys->count : 0;
	set_release(set);
	return count;
}

gnp_status gnpd_guard_identify(struct gnpd_guard *guard, const struct gnpd_credentials *credentials, struct gnpd_principal **out,
                               unsigned *scopes, struct gnp_error *error)
{
	const char *secret;
	gnp_status status = gnpd_credentials_secret(credentials, &secret, error);
	if (status != GNP_OK)
		return status;
	struct set *set = set_retain(guard);
	long index = set ? gnpd_keys_find(set->keys, secret) : GNPD_KEY_NONE;
	if (index == GNPD_KEY_NONE) {
		status = gnp_error_set(error, GNP_UNAUTHORIZED, "the key is not known");
	} else {
		*scopes = set->keys->items[index].scopes;
		*out = principal_retain(set->principals[index]);
	}
	set_release(set);
	return status;
}

/* ---- metrics ---- */

typedef uint64_t (*reading)(struct gnpd_principal *principal, size_t i);

static uint64_t read_requests(struct gnpd_principal *principal, size_t i)
{
	return atomic_load(&principal->requests[i]);
}

static uint64_t read_limited(struct gnpd_principal *principal, size_t i)
{
	return atomic_load(&principal->limited[i]);
}

static uint64_t read_points(struct gnpd_principal *principal, size_t i)
{
	(void)i;
	return atomic_load(&principal->points);
}

static uint64_t read_active(struct gnpd_principal *principal, size_t i)
{
	(void)i;
	pthread_mutex_lock(&principal->lock);
	size_t active = principal->active;
	pthread_mutex_unlock(&principal->lock);
	return active;
}

/* label NULL: one sample a name. */
static gnp_status write_family(const struct set *set, const char *name, const char *type, const char *help, const char *label,
                               const char *const *values, size_t count, reading read, struct gnp_buffer *buffer,
                               struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "# HELP gnpd_%s %s\n# TYPE gnpd_%s %s\n", name, help, name, type);
	for (size_t k = 0; k < set->keys->count; k++)
		for (size_t i = 0; i < count && status == GNP_OK; i++)
			status = gnp_buffer_printf(buffer, error, "gnpd_%s{principal=\"%s\"%s%s%s%s%s} %llu\n", name,
			                           set->principals[k]->name, label ? "," : "", label ? label : "", label ? "=\"" : "",
			                           label ? values[i] : "", label ? "\"" : "",
			                           (unsigned long long)read(set->principals[k], i));
	return status;
}

gnp_status gnpd_guard_write(struct gnpd_guard *guard, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct set *set = set_retain(guard);
	if (!set)
		return GNP_OK;
	gnp_status status = write_family(set, "principal_requests_total", "counter", "Finished requests of a key's name.", "class",
	                                 classes, CLASSES, read_requests, buffer, error);
	if (status == GNP_OK)
		status = write_family(set, "principal_limited_total", "counter", "Requests refused by a limit of the key.", "limit", limits,
		                      LIMITS, read_limited, buffer, error);
	if (status == GNP_OK)
		status = write_family(set, "principal_points_total", "counter", "Points computed.", NULL, NULL, 1, read_points, buffer, error);
	if (status == GNP_OK)
		status = write_family(set, "principal_active_requests", "gauge", "Requests under way.", NULL, NULL, 1, read_active, buffer,
		                      error);
	set_release(set);
	return status;
}
