#include "server/api/reloader.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "server/access/guard.h"
#include "server/api/server.h"
#include "server/base/log.h"
#include "server/base/metrics.h"
#include "server/base/notify.h"
#include "server/base/tls.h"
#include "server/work/loader.h"

struct gnpd_reloader {
	struct gnpd_server *server;
	pthread_t thread;
	pthread_mutex_t lock; /* of all below */
	pthread_cond_t wake;
	struct gnpd_reload_state state;
	bool ending;
};

const char *gnpd_reloaded_name(enum gnpd_reloaded what)
{
	static const char *const names[GNPD_RELOADED] = {
		[GNPD_RELOADED_KEYS] = "keys", [GNPD_RELOADED_CERTIFICATE] = "certificate", [GNPD_RELOADED_WEIGHTS] = "weights"};
	return names[what];
}

/* The one place that logs and counts what came of a load. */
static void report(struct gnpd_server *server, enum gnpd_reloaded what, atomic_uint_fast64_t *counts, const struct gnp_error *fault)
{
	atomic_fetch_add(&counts[fault->status == GNP_OK ? GNPD_RELOAD_OK : GNPD_RELOAD_FAILED], 1);
	if (fault->status != GNP_OK)
		gnpd_log_event(server->engine.log, GNPD_LOG_ERROR, "reload: %s: what is in use stays: %s",
		               gnpd_reloaded_name(what), fault->text);
}

static void reload(struct gnpd_server *server, struct gnp_error faults[GNPD_RELOADED])
{
	struct gnpd_metrics *metrics = server->engine.metrics;
	struct gnp_error *keys = &faults[GNPD_RELOADED_KEYS], *certificate = &faults[GNPD_RELOADED_CERTIFICATE];
	if (gnpd_guard_on(server->guard)) {
		if (gnpd_guard_reload(server->guard, keys) == GNP_OK)
			gnpd_log_event(server->engine.log, GNPD_LOG_INFO, "reload: %zu names with keys",
			               gnpd_guard_count(server->guard));
		report(server, GNPD_RELOADED_KEYS, metrics->key_reloads, keys);
	}
	if (server->tls) {
		if (gnpd_tls_reload(server->tls, certificate) == GNP_OK)
			gnpd_log_event(server->engine.log, GNPD_LOG_INFO, "reload: certificate");
		gnpd_tls_warn(server->tls, server->engine.log);
		report(server, GNPD_RELOADED_CERTIFICATE, metrics->certificate_reloads, certificate);
	}
	gnpd_loader_reload(server->engine.loader, &faults[GNPD_RELOADED_WEIGHTS]);
	report(server, GNPD_RELOADED_WEIGHTS, metrics->reloads, &faults[GNPD_RELOADED_WEIGHTS]);
}

/* The number of the load to do, 0 at the end. */
static unsigned long wait_asked(struct gnpd_reloader *reloader)
{
	pthread_mutex_lock(&reloader->lock);
	while (reloader->state.asked == reloader->state.done && !reloader->ending)
		pthread_cond_wait(&reloader->wake, &reloader->lock);
	unsigned long number = reloader->ending ? 0 : reloader->state.asked;
	pthread_mutex_unlock(&reloader->lock);
	return number;
}

static void *reload_when_asked(void *context)
{
	struct gnpd_reloader *reloader = context;
	unsigned long number;
	while ((number = wait_asked(reloader)) != 0) {
		struct gnp_error faults[GNPD_RELOADED] = {{0}};
		gnpd_notify_reloading(reloader->server->notify);
		reload(reloader->server, faults);
		pthread_mutex_lock(&reloader->lock);
		reloader->state.done = number;
		memcpy(reloader->state.faults, faults, sizeof faults);
		pthread_mutex_unlock(&reloader->lock);
		if (!atomic_load(&reloader->server->leaving))
			gnpd_notify_ready(reloader->server->notify);
	}
	return NULL;
}

gnp_status gnpd_reloader_create(struct gnpd_server *server, struct gnpd_reloader **out, struct gnp_error *error)
{
	struct gnpd_reloader *reloader = calloc(1, sizeof *reloader);
	if (!reloader)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "reloader: no memory for %zu bytes", sizeof *reloader);
	reloader->server = server;
	pthread_mutex_init(&reloader->lock, NULL);
	pthread_cond_init(&reloader->wake, NULL);
	int fault = pthread_create(&reloader->thread, NULL, reload_when_asked, reloader);
	if (fault) {
		free(reloader);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "reloader: no thread: %s", strerror(fault));
	}
	*out = reloader;
	return GNP_OK;
}

void gnpd_reloader_free(struct gnpd_reloader *reloader)
{
	if (!reloader)
		return;
	pthread_mutex_lock(&reloader->lock);
	reloader->ending = true;
	pthread_cond_signal(&reloader->wake);
	pthread_mutex_unlock(&reloader->lock);
	pthread_join(reloader->thread, NULL);
	pthread_cond_destroy(&reloader->wake);
	pthread_mutex_destroy(&reloader->lock);
	free(reloader);
}

unsigned long gnpd_reloader_ask(struct gnpd_reloader *reloader)
{
	pthread_mutex_lock(&reloader->lock);
	unsigned long number = ++reloader->state.asked;
	pthread_cond_signal(&reloader->wake);
	pthread_mutex_unlock(&reloader->lock);
	return number;
}

void gnpd_reloader_state(struct gnpd_reloader *reloader, struct gnpd_reload_state *state)
{
	pthread_mutex_lock(&reloader->lock);
	*state = reloader->state;
	pthread_mutex_unlock(&reloader->lock);
}
