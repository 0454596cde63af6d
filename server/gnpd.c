/* gnpd: reads its configuration, starts the parts in order of need, waits for signals, stops them in reverse. */
#include <errno.h>
#include <math.h>
#include <semaphore.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "proto/json/json_memory.h"
#include "proto/operation/operation.h"
#include "server/api/server.h"
#include "server/base/notify.h"
#include "server/base/reserve.h"
#include "server/config/config.h"
#include "server/http/http.h"
#include "server/http/listeners.h"

/* What git calls the sources; the Makefile says it. */
#ifndef GNPD_BUILD
#define GNPD_BUILD ""
#endif

extern char **environ;

/* "0.1.0 (f599a22)", or the version alone. */
static const char *const version = sizeof GNPD_BUILD > 1 ? GNPD_VERSION " (" GNPD_BUILD ")" : GNPD_VERSION;

/* The stop flag: what signals have come and not been acted on. A handler, not a mask alone, because libraries start threads
 * before main that no mask of ours reaches. */
static struct {
	atomic_int stops, hangups;
	sem_t wake;
} arrived;

static void on_signal(int number)
{
	atomic_fetch_add(number == SIGHUP ? &arrived.hangups : &arrived.stops, 1);
	sem_post(&arrived.wake);
}

static bool take(atomic_int *count)
{
	int now = atomic_load(count);
	while (now > 0 && !atomic_compare_exchange_weak(count, &now, now - 1))
		;
	return now > 0;
}

static void catch_signals(void)
{
	struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
	sem_init(&arrived.wake, 0, 0);
	sigemptyset(&action.sa_mask);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGHUP, &action, NULL);
	signal(SIGPIPE, SIG_IGN);
	signal(SIGXFSZ, SIG_IGN); /* a file over its limit is a write that fails */
}

/* Files that are open beside connections: those of each thread that serves sockets, of each job that runs, and some more. */
static size_t other_files(const struct gnpd_config *config)
{
	enum { SOME = 64, A_THREAD = 3 /* a copy of the listening socket, an epoll, an eventfd */, ADMIN_THREADS = 1 };
	return SOME + A_THREAD * (config->http_threads + ADMIN_THREADS) + config->job_runners;
}

static gnp_status raise_file_limit(const struct gnpd_config *config, struct gnp_error *error)
{
	struct rlimit limit;
	size_t connections = config->max_connections + config->admin_connections, others = other_files(config);
	rlim_t need = connections + others, better = 2 * connections + others; /* results of jobs are sent from their files */
	if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= better)
		return GNP_OK;
	if (limit.rlim_max != RLIM_INFINITY && limit.rlim_max < need)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "open files: the process may have %llu (ulimit -n), need %llu: %zu for connections "
		                     "(max-connections, admin-connections), %zu for others (http-threads, job-runners)",
		                     (unsigned long long)limit.rlim_max, (unsigned long long)need, connections, others);
	limit.rlim_cur = limit.rlim_max == RLIM_INFINITY || limit.rlim_max > better ? better : limit.rlim_max;
	if (setrlimit(RLIMIT_NOFILE, &limit) != 0)
		return gnp_error_set(error, GNP_IO, "open files: %s", strerror(errno));
	return GNP_OK;
}

static const double LAST_WORDS = 1; /* seconds for cancelled requests to get their answer */

/* For work that was cancelled to come to its end: as many as it had before it was. */
static double end_seconds(const struct gnpd_config *config)
{
	const double least = 5;
	return fmax(config->drain_seconds, least);
}

/* What the service manager hears: a sign of life as long as the watching thread and the queue answer, and a line for people. */
static void give_sign(struct gnpd_server *server)
{
	const double silence_max = 5; /* seconds; the watching thread comes round every 0.1 */
	if (!gnpd_notify_due(server->notify, gnp_clock()))
		return;
	struct gnpd_queue_state state = gnpd_queue_state(server->queue);
	if (gnpd_connections_silence(server->connections) < silence_max)
		gnpd_notify_alive(server->notify);
	const char *phase = atomic_load(&server->draining) ? "draining" : atomic_load(&server->leaving) ? "not ready" : "ready";
	gnpd_notify_status(server->notify, "%s: %zu running, %zu waiting", phase, state.running, state.waiting);
}

static void give_memory_back(struct gnpd_server *server)
{
	struct gnpd_queue_state state = gnpd_queue_state(server->queue);
	struct gnpd_jobs_counts jobs = {0};
	gnpd_jobs_count(server->jobs, &jobs);
	gnpd_heap_rest(&server->heap, gnpd_metrics_work(&server->metrics), state.running + state.waiting + jobs.states[GNPD_JOB_RUNNING] > 0,
	               gnp_clock());
}

/* The earliest of the end of the wait, the next sign of life and the next look at what is free. */
static bool sleep_until(struct gnpd_server *server, double until)
{
	const double look = 1;
	double interval = gnpd_notify_interval(server->notify), first = gnp_clock() + (interval > 0 && interval < look ? interval : look);
	if (until < first)
		first = until;
	struct timespec end = {(time_t)first, (long)((first - (double)(time_t)first) * 1e9)};
	return sem_clockwait(&arrived.wake, CLOCK_MONOTONIC, &end) == 0 || errno != ETIMEDOUT || gnp_clock() < until;
}

/* True when a signal other than SIGHUP came within the time; seconds < 0: waits for one. */
static bool wait_signal(struct gnpd_server *server, double seconds)
{
	double until = seconds < 0 ? INFINITY : gnp_clock() + seconds;
	for (;;) {
		while (take(&arrived.hangups))
			gnpd_log_event(&server->log, GNPD_LOG_INFO, "SIGHUP: reload %lu", gnpd_reloader_ask(server->reloader));
		if (take(&arrived.stops))
			return true;
		give_sign(server);
		give_memory_back(server);
		if (!sleep_until(server, until))
			return false;
	}
}

/* Load balancers hear that it is not ready, and have time to turn to others: until it is over, all is served as ever. Another signal
 * ends it. */
static void give_notice(struct gnpd_server *server)
{
	double seconds = server->config->drain_notice_seconds;
	atomic_store(&server->leaving, true);
	gnpd_notify_stopping(server->notify, seconds + server->config->drain_seconds + LAST_WORDS + end_seconds(server->config));
	if (seconds <= 0)
		return;
	gnpd_log_event(&server->log, GNPD_LOG_INFO, "not ready; serving for %.15g s more (drain-notice-seconds)", seconds);
	wait_signal(server, seconds);
}

/* Waits until no request is under way; false when the time is over or another signal came. */
static bool wait_drained(struct gnpd_server *server, double seconds)
{
	double until = gnp_clock() + seconds;
	while (atomic_load(&server->active) > 0) {
		if (gnp_clock() >= until || wait_signal(server, 0.02))
			return false;
	}
	return true;
}

static void drain(struct gnpd_server *server)
{
	atomic_store(&server->draining, true);
	gnpd_log_event(&server->log, GNPD_LOG_INFO, "draining: %zu requests under way", atomic_load(&server->active));
	gnpd_jobs_park(server->jobs);
	gnpd_watchers_end(server->watchers);
	if (wait_drained(server, server->config->drain_seconds))
		return;
	gnpd_log_event(&server->log, GNPD_LOG_WARNING, "cancelling %zu requests", atomic_load(&server->active));
	gnpd_connections_stop_all(server->connections, GNP_DRAINING);
	wait_drained(server, LAST_WORDS);
}

/* Work that does not hear that it is to end keeps neither the process nor what waits for its end. Its jobs were written as parked. */
static void leave_without(struct gnpd_server *server, size_t requests, size_t jobs)
{
	gnpd_log_event(&server->log, GNPD_LOG_ERROR, "%zu requests and %zu jobs did not end within %.15g s of being told to: leaving without them",
	               requests, jobs, end_seconds(server->config));
	_exit(EXIT_FAILURE);
}

/* The library may only stop when no connection is suspended. */
static void end_work(struct gnpd_server *server)
{
	double until = gnp_clock() + end_seconds(server->config);
	gnpd_queue_close(server->queue);
	gnpd_queue_close(server->disk_queue);
	gnpd_jobs_park(server->jobs);
	gnpd_watchers_end(server->watchers);
	gnpd_connections_stop_all(server->connections, GNP_DRAINING);
	for (;;) {
		struct gnpd_jobs_counts jobs = {0};
		size_t requests = atomic_load(&server->suspended);
		gnpd_jobs_count(server->jobs, &jobs);
		if (requests + jobs.states[GNPD_JOB_RUNNING] == 0)
			return;
		if (gnp_clock() >= until)
			leave_without(server, requests, jobs.states[GNPD_JOB_RUNNING]);
		wait_signal(server, 0.002);
	}
}

static gnp_status serve(struct gnpd_server *server, const struct gnpd_inherited *inherited, struct gnp_error *error)
{
	struct gnpd_listeners listeners;
	gnp_status status = gnpd_jobs_start(server->jobs, error);
	if (status == GNP_OK)
		status = gnpd_listeners_start_take(server, inherited, &listeners, error);
	if (status != GNP_OK)
		return status;
	gnpd_log_event(&server->log, GNPD_LOG_INFO, "gnpd %s ready with %u workers", version, gnp_pool_workers(server->pool));
	gnpd_notify_ready(server->notify);
	wait_signal(server, -1);
	give_notice(server);
	drain(server);
	end_work(server);
	gnpd_listeners_stop(&listeners);
	return GNP_OK;
}

static gnp_status hear_manager(struct gnpd_server *server, struct gnpd_inherited *inherited, struct gnp_error *error)
{
	enum { FIRST = 3 };
	gnp_status status = gnpd_inherit(getenv("LISTEN_PID"), getenv("LISTEN_FDS"), getenv("LISTEN_FDNAMES"), FIRST, inherited, error);
	if (status == GNP_OK)
		status = gnpd_notify_create(getenv("NOTIFY_SOCKET"), getenv("WATCHDOG_USEC"), getenv("WATCHDOG_PID"), &server->notify, error);
	return status;
}

static gnp_status load_secrets(struct gnpd_server *server, struct gnp_error *error)
{
	const struct gnpd_config *config = server->config;
	gnp_status status = gnpd_guard_create(config->keys_file, &server->guard, error);
	if (status == GNP_OK && config->tls_certificate[0])
		status = gnpd_tls_create(config->tls_certificate, config->tls_key, &server->tls, error);
	if (status == GNP_OK && server->tls)
		gnpd_tls_warn(server->tls, &server->log);
	return status;
}

/* Requests that wait for the disk are limited by the number of connections and by queue-bytes. */
static gnp_status start_jobs(struct gnpd_server *server, struct gnp_error *error)
{
	enum { DISK_THREADS = 2 };
	gnp_status status = gnpd_queue_create(DISK_THREADS, server->config->max_connections, 1, &server->disk_queue, error);
	if (status == GNP_OK)
		status = gnpd_watchers_create(server, &server->watchers, error);
	return status == GNP_OK ? gnpd_jobs_create(server, &server->jobs, error) : status;
}

static gnp_status run(const struct gnpd_config *config, struct gnp_error *error)
{
	struct gnpd_server server = {.config = config};
	struct gnpd_inherited inherited;
	gnpd_log_init(&server.log, (enum gnpd_log_format)config->log_format, (enum gnpd_log_level)config->log_level, STDERR_FILENO);
	gnpd_heap_keep();
	catch_signals();
	gnpd_metrics_init(&server.metrics);
	server.metrics.build = GNPD_BUILD;
	gnp_status status = hear_manager(&server, &inherited, error);
	if (status == GNP_OK)
		status = raise_file_limit(config, error);
	if (status == GNP_OK)
		status = load_secrets(&server, error);
	if (status == GNP_OK && getrandom(&server.boot, sizeof server.boot, 0) != sizeof server.boot)
		status = gnp_error_set(error, GNP_IO, "random numbers: %s", strerror(errno));
	if (status == GNP_OK)
		status = gnp_openapi_write(&server.openapi, error);
	if (status == GNP_OK)
		status = gnp_pool_create((unsigned)config->workers, &server.pool, error);
	if (status == GNP_OK)
		status = gnpd_loader_create(&server, &server.loader, error);
	if (status == GNP_OK)
		status = gnp_prepared_cache_create(config->operator_cache_bytes, &server.cache, error);
	if (status == GNP_OK)
		status = gnpd_queue_create(config->runners, config->queue_count, config->queue_bytes, &server.queue, error);
	if (status == GNP_OK)
		status = start_jobs(&server, error);
	if (status == GNP_OK)
		status = gnpd_connections_create(&server, &server.connections, error);
	if (status == GNP_OK)
		status = gnpd_reloader_create(&server, &server.reloader, error);
	if (status == GNP_OK)
		status = serve(&server, &inherited, error);
	gnpd_reloader_free(server.reloader);
	gnpd_connections_free(server.connections);
	gnpd_queue_free(server.disk_queue);
	gnpd_jobs_free(server.jobs);
	gnpd_watchers_free(server.watchers);
	gnpd_queue_free(server.queue);
	gnp_prepared_cache_free(server.cache);
	gnpd_loader_free(server.loader);
	gnpd_tls_free(server.tls);
	gnpd_guard_free(server.guard);
	gnpd_notify_free(server.notify);
	gnp_pool_free(server.pool);
	gnp_buffer_clear(&server.openapi);
	if (status == GNP_OK)
		gnpd_log_event(&server.log, GNPD_LOG_INFO, "stopped");
	gnpd_log_fini(&server.log);
	return status;
}

/* What the start would find wrong beyond the configuration itself; what it would warn of goes to standard error. */
static gnp_status check(const struct gnpd_config *config, struct gnp_error *error)
{
	struct gnpd_server server = {.config = config};
	gnpd_log_init(&server.log, GNPD_LOG_TEXT, GNPD_LOG_WARNING, STDERR_FILENO);
	gnp_status status = raise_file_limit(config, error);
	if (status == GNP_OK)
		status = load_secrets(&server, error);
	if (status == GNP_OK)
		status = gnpd_loader_create(&server, &server.loader, error);
	gnpd_loader_free(server.loader);
	gnpd_tls_free(server.tls);
	gnpd_guard_free(server.guard);
	gnpd_log_fini(&server.log);
	return status;
}

/* What is printed after a check can be read as a file of the configuration. */
static gnp_status act(unsigned actions, const struct gnpd_config *config, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (actions == GNPD_CONFIG_RUN)
		return run(config, error);
	if (actions & GNPD_CONFIG_HELP) {
		gnpd_config_help(stdout);
		return GNP_OK;
	}
	if (actions & GNPD_CONFIG_VERSION) {
		printf("gnpd %s\n", version);
		return GNP_OK;
	}
	if (actions & GNPD_CONFIG_CHECK)
		status = check(config, error);
	if (status == GNP_OK && (actions & GNPD_CONFIG_CHECK))
		printf("%sthe configuration is good\n", actions & GNPD_CONFIG_PRINT ? "# " : "");
	if (status == GNP_OK && (actions & GNPD_CONFIG_PRINT))
		gnpd_config_print(config, stdout);
	return status;
}

/* The key once, for its owner; then its line, for the file. */
static gnp_status make_key(const char *name, struct gnp_error *error)
{
	char key[GNPD_KEY_TEXT], hash[GNP_SHA256_TEXT];
	gnp_status status = gnpd_key_check_name(name, error);
	if (status == GNP_OK)
		status = gnpd_key_make(key, hash, error);
	if (status == GNP_OK)
		printf("%s\n%s sha256:%s infer,jobs\n", key, name, hash);
	return status;
}

int main(int argc, char **argv)
{
	struct gnpd_config config;
	struct gnp_error error = {0};
	unsigned actions;
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	gnpd_reserve_install();
	gnp_json_memory_init();
	gnp_status status;
	if (argc == 3 && strcmp(argv[1], "--make-key") == 0)
		status = make_key(argv[2], &error);
	else if ((status = gnpd_config_load(&config, argc, argv, environ, &actions, &error)) == GNP_OK)
		status = act(actions, &config, &error);
	if (status == GNP_OK)
		return EXIT_SUCCESS;
	fprintf(stderr, "gnpd: %s\n", error.text);
	return EXIT_FAILURE;
}
