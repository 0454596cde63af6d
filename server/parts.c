#include "server/parts.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/base/pool.h"
#include "proto/operation/prepared_cache.h"
#include "server/access/guard.h"
#include "server/api/openapi.h"
#include "server/api/reloader.h"
#include "server/base/notify.h"
#include "server/base/queue.h"
#include "server/base/tls.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/jobs/job_watch.h"
#include "server/jobs/jobs.h"
#include "server/work/loader.h"

/* ---- What the system gives ---- */

static gnp_status warn_of_config(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	(void)error;
	gnpd_config_warn(daemon->server.engine.config, &daemon->log);
	return GNP_OK;
}

/* Sockets that were handed over, and the socket to tell how it goes. */
static gnp_status start_manager(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	enum { FIRST = 3 };
	gnp_status status = gnpd_inherit(getenv("LISTEN_PID"), getenv("LISTEN_FDS"), getenv("LISTEN_FDNAMES"), FIRST,
	                                 &daemon->inherited, error);
	if (status != GNP_OK)
		return status;
	return gnpd_notify_create(getenv("NOTIFY_SOCKET"), getenv("WATCHDOG_USEC"), getenv("WATCHDOG_PID"),
	                          &daemon->server.notify, error);
}

static void stop_manager(struct gnpd_daemon *daemon)
{
	gnpd_notify_free(daemon->server.notify);
}

/* Files that are open beside connections: those of each thread that serves sockets, of each job that runs, and some
 * more. */
static size_t other_files(const struct gnpd_config *config)
{
	enum { SOME = 64, A_THREAD = 3 /* a copy of the listening socket, an epoll, an eventfd */, ADMIN_THREADS = 1 };
	return SOME + A_THREAD * (config->http_threads + ADMIN_THREADS) + config->job_runners;
}

static gnp_status raise_file_limit(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	const struct gnpd_config *config = daemon->server.engine.config;
	struct rlimit limit;
	size_t connections = config->max_connections + config->admin_connections, others = other_files(config);
	rlim_t need = connections + others;
	rlim_t better = 2 * connections + others; /* results of jobs are sent from their files */
	if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= better)
		return GNP_OK;
	if (limit.rlim_max != RLIM_INFINITY && limit.rlim_max < need)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "open files: the process may have %llu (ulimit -n), need %llu: %zu for connections "
		                     "(max-connections, admin-connections), %zu for others (http-threads, job-runners)",
		                     (unsigned long long)limit.rlim_max, (unsigned long long)need, connections, others);
	limit.rlim_cur = limit.rlim_max == RLIM_INFINITY || limit.rlim_max > better ? better : limit.rlim_max;
	if (setrlimit(RLIMIT_NOFILE, &limit) != 0)
		return gnp_error_set(error, GNP_IO, "open files: %s", strerror(errno));
	return GNP_OK;
}

static gnp_status draw_boot(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	unsigned *boot = &daemon->server.boot;
	if (getrandom(boot, sizeof *boot, 0) != sizeof *boot)
		return gnp_error_set(error, GNP_IO, "random numbers: %s", strerror(errno));
	return GNP_OK;
}

/* ---- Who may ask ---- */

static gnp_status start_guard(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_guard_create(daemon->server.engine.config->keys_file, &daemon->server.guard, error);
}

static void stop_guard(struct gnpd_daemon *daemon)
{
	gnpd_guard_free(daemon->server.guard);
}

static gnp_status start_tls(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	const struct gnpd_config *config = daemon->server.engine.config;
	if (!config->tls_certificate[0])
		return GNP_OK;
	gnp_status status = gnpd_tls_create(config->tls_certificate, config->tls_key, &daemon->server.tls, error);
	if (status == GNP_OK)
		gnpd_tls_warn(daemon->server.tls, &daemon->log);
	return status;
}

static void stop_tls(struct gnpd_daemon *daemon)
{
	gnpd_tls_free(daemon->server.tls);
}

/* ---- What computes ---- */

static gnp_status write_openapi(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	gnp_status status = gnpd_openapi_write(&daemon->server.openapi, error);
	if (status != GNP_OK)
		gnp_buffer_clear(&daemon->server.openapi);
	return status;
}

static void clear_openapi(struct gnpd_daemon *daemon)
{
	gnp_buffer_clear(&daemon->server.openapi);
}

static gnp_status start_pool(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	struct gnpd_engine *engine = &daemon->server.engine;
	return gnp_pool_create((unsigned)engine->config->workers, &engine->pool, error);
}

static void stop_pool(struct gnpd_daemon *daemon)
{
	gnp_pool_free(daemon->server.engine.pool);
}

static gnp_status start_loader(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_loader_create(&daemon->server.engine, &daemon->server.engine.loader, error);
}

static void stop_loader(struct gnpd_daemon *daemon)
{
	gnpd_loader_free(daemon->server.engine.loader);
}

static gnp_status start_cache(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	struct gnpd_engine *engine = &daemon->server.engine;
	return gnp_prepared_cache_create(engine->config->prepared_cache_bytes, &engine->cache, error);
}

static void stop_cache(struct gnpd_daemon *daemon)
{
	gnp_prepared_cache_free(daemon->server.engine.cache);
}

static gnp_status start_queue(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	struct gnpd_engine *engine = &daemon->server.engine;
	const struct gnpd_config *config = engine->config;
	return gnpd_queue_create(config->runners, config->queue_count, config->queue_bytes, &engine->queue, error);
}

static void stop_queue(struct gnpd_daemon *daemon)
{
	gnpd_queue_free(daemon->server.engine.queue);
}

/* ---- Jobs ---- */

static gnp_status start_watchers(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_watchers_create(daemon->server.engine.config, &daemon->server.watchers, error);
}

static void stop_watchers(struct gnpd_daemon *daemon)
{
	gnpd_watchers_free(daemon->server.watchers);
}

static gnp_status open_jobs(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_jobs_create(&daemon->server.engine, daemon->server.watchers, &daemon->server.jobs, error);
}

static gnp_status start_jobs(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_jobs_start(daemon->server.jobs, error);
}

static void close_jobs(struct gnpd_daemon *daemon)
{
	gnpd_jobs_free(daemon->server.jobs);
}

/* Requests that wait for the disk are limited by the number of connections and by queue-bytes. */
static gnp_status start_disk_queue(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	enum { DISK_THREADS = 2 };
	return gnpd_queue_create(DISK_THREADS, daemon->server.engine.config->max_connections, 1, &daemon->server.disk_queue,
	                         error);
}

static void stop_disk_queue(struct gnpd_daemon *daemon)
{
	gnpd_queue_free(daemon->server.disk_queue);
}

/* ---- Who asks ---- */

static gnp_status start_connections(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_connections_create(&daemon->server.engine, &daemon->server.connections, error);
}

static void stop_connections(struct gnpd_daemon *daemon)
{
	gnpd_connections_free(daemon->server.connections);
}

static gnp_status start_reloader(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_reloader_create(&daemon->server, &daemon->server.reloader, error);
}

static void stop_reloader(struct gnpd_daemon *daemon)
{
	gnpd_reloader_free(daemon->server.reloader);
}

static gnp_status start_listeners(struct gnpd_daemon *daemon, struct gnp_error *error)
{
	return gnpd_listeners_start_take(&daemon->server, &daemon->inherited, &daemon->listeners, error);
}

static void stop_listeners(struct gnpd_daemon *daemon)
{
	gnpd_listeners_stop(&daemon->listeners);
}

/* ---- All of them ---- */

/* In order of need: each may use those above it. */
static const struct part {
	const char *name;
	gnp_status (*start)(struct gnpd_daemon *daemon, struct gnp_error *error); /* on failure nothing of it is left */
	void (*stop)(struct gnpd_daemon *daemon); /* nothing where it was not started; NULL: there is nothing to stop */
	bool checked;                             /* --check-config starts it too */
} parts[] = {
	{"configuration", warn_of_config, NULL, true},
	{"service manager", start_manager, stop_manager, false},
	{"open files", raise_file_limit, NULL, true},
	{"keys", start_guard, stop_guard, true},
	{"certificate", start_tls, stop_tls, true},
	{"request ids", draw_boot, NULL, false},
	{"openapi", write_openapi, clear_openapi, false},
	{"workers", start_pool, stop_pool, false},
	{"weights", start_loader, stop_loader, true},
	{"prepared operators", start_cache, stop_cache, false},
	{"queue", start_queue, stop_queue, false},
	{"watchers", start_watchers, stop_watchers, false},
	{"jobs", open_jobs, close_jobs, false},
	{"disk queue", start_disk_queue, stop_disk_queue, false},
	{"connections", start_connections, stop_connections, false},
	{"reloader", start_reloader, stop_reloader, false},
	{"runners of jobs", start_jobs, NULL, false},
	{"listeners", start_listeners, stop_listeners, false},
};
enum { PARTS = sizeof parts / sizeof parts[0] };

void gnpd_parts_init(struct gnpd_daemon *daemon, const struct gnpd_config *config, enum gnpd_log_format format,
                     enum gnpd_log_level level)
{
	memset(daemon, 0, sizeof *daemon);
	gnpd_log_init(&daemon->log, format, level, STDERR_FILENO);
	gnpd_metrics_init(&daemon->metrics);
	daemon->server.engine = (struct gnpd_engine){.config = config, .log = &daemon->log, .metrics = &daemon->metrics};
}

gnp_status gnpd_parts_start(struct gnpd_daemon *daemon, bool check, struct gnp_error *error)
{
	for (; daemon->started < PARTS; daemon->started++) {
		const struct part *part = &parts[daemon->started];
		if (check && !part->checked)
			continue;
		gnpd_log_event(&daemon->log, GNPD_LOG_DEBUG, "start: %s", part->name);
		gnp_status status = part->start(daemon, error);
		if (status == GNP_OK)
			continue;
		gnpd_parts_stop(daemon);
		return status;
	}
	return GNP_OK;
}

void gnpd_parts_stop(struct gnpd_daemon *daemon)
{
	while (daemon->started > 0) {
		const struct part *part = &parts[--daemon->started];
		if (!part->stop)
			continue;
		gnpd_log_event(&daemon->log, GNPD_LOG_DEBUG, "stop: %s", part->name);
		part->stop(daemon);
	}
}
