/* gnpd: reads its configuration, starts the parts (parts.h), waits for signals, lets what is under way come to its
 * end and stops them. */
#include <errno.h>
#include <math.h>
#include <semaphore.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/base/pool.h"
#include "core/base/version.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "proto/json/json_memory.h"
#include "server/access/keys.h"
#include "server/api/reloader.h"
#include "server/base/notify.h"
#include "server/base/queue.h"
#include "server/base/reserve.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/jobs/job_store_scan.h"
#include "server/jobs/job_watch.h"
#include "server/jobs/jobs.h"
#include "server/parts.h"

/* What git calls the sources; the Makefile says it. */
#ifndef GNPD_BUILD
#define GNPD_BUILD ""
#endif

extern char **environ;

/* "0.1.0 (f599a22)", or the version alone. */
static const char *const version = sizeof GNPD_BUILD > 1 ? GNP_VERSION " (" GNPD_BUILD ")" : GNP_VERSION;

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
	struct gnpd_queue_state state = gnpd_queue_state(server->engine.queue);
	if (gnpd_connections_silence(server->connections) < silence_max)
		gnpd_notify_alive(server->notify);
	const char *phase = atomic_load(&server->draining) ? "draining" : atomic_load(&server->leaving) ? "not ready" : "ready";
	gnpd_notify_status(server->notify, "%s: %zu running, %zu waiting", phase, state.running, state.waiting);
}

static void give_memory_back(struct gnpd_daemon *daemon)
{
	struct gnpd_queue_state state = gnpd_queue_state(daemon->server.engine.queue);
	struct gnpd_jobs_counts jobs = {0};
	gnpd_jobs_count(daemon->server.jobs, &jobs);
	bool busy = state.running + state.waiting + jobs.states[GNPD_JOB_RUNNING] > 0;
	gnpd_heap_rest(&daemon->heap, gnpd_metrics_work(&daemon->metrics), busy, gnp_clock());
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
static bool wait_signal(struct gnpd_daemon *daemon, double seconds)
{
	struct gnpd_server *server = &daemon->server;
	double until = seconds < 0 ? INFINITY : gnp_clock() + seconds;
	for (;;) {
		while (take(&arrived.hangups))
			gnpd_log_event(&daemon->log, GNPD_LOG_INFO, "SIGHUP: reload %lu", gnpd_reloader_ask(server->reloader));
		if (take(&arrived.stops))
			return true;
		give_sign(server);
		give_memory_back(daemon);
		if (!sleep_until(server, until))
			return false;
	}
}

/* Load balancers hear that it is not ready, and have time to turn to others: until it is over, all is served as ever. Another signal
 * ends it. */
static void give_notice(struct gnpd_daemon *daemon)
{
	struct gnpd_server *server = &daemon->server;
	const struct gnpd_config *config = server->engine.config;
	double seconds = config->drain_notice_seconds;
	atomic_store(&server->leaving, true);
	gnpd_notify_stopping(server->notify, seconds + config->drain_seconds + LAST_WORDS + end_seconds(config));
	if (seconds <= 0)
		return;
	gnpd_log_event(&daemon->log, GNPD_LOG_INFO, "not ready; serving for %.15g s more (drain-notice-seconds)", seconds);
	wait_signal(daemon, seconds);
}

/* Waits until no request is under way; false when the time is over or another signal came. */
static bool wait_drained(struct gnpd_daemon *daemon, double seconds)
{
	double until = gnp_clock() + seconds;
	while (atomic_load(&daemon->server.active) > 0) {
		if (gnp_clock() >= until || wait_signal(daemon, 0.02))
			return false;
	}
	return true;
}

static void drain(struct gnpd_daemon *daemon)
{
	struct gnpd_server *server = &daemon->server;
	atomic_store(&server->draining, true);
	gnpd_log_event(&daemon->log, GNPD_LOG_INFO, "draining: %zu requests under way", atomic_load(&server->active));
	gnpd_jobs_park(server->jobs);
	gnpd_watchers_end(server->watchers);
	if (wait_drained(daemon, server->engine.config->drain_seconds))
		return;
	gnpd_log_event(&daemon->log, GNPD_LOG_WARNING, "cancelling %zu requests", atomic_load(&server->active));
	gnpd_connections_stop_all(server->connections, GNP_DRAINING);
	wait_drained(daemon, LAST_WORDS);
}

/* Work that does not hear that it is to end keeps neither the process nor what waits for its end. Its jobs were written as parked. */
static void leave_without(struct gnpd_daemon *daemon, size_t requests, size_t jobs)
{
	gnpd_log_event(&daemon->log, GNPD_LOG_ERROR,
	               "%zu requests and %zu jobs did not end within %.15g s of being told to: leaving without them",
	               requests, jobs, end_seconds(daemon->server.engine.config));
	_exit(EXIT_FAILURE);
}

/* The library may only stop when no connection is suspended. */
static void end_work(struct gnpd_daemon *daemon)
{
	struct gnpd_server *server = &daemon->server;
	double until = gnp_clock() + end_seconds(server->engine.config);
	gnpd_queue_close(server->engine.queue);
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
			leave_without(daemon, requests, jobs.states[GNPD_JOB_RUNNING]);
		wait_signal(daemon, 0.002);
	}
}

/* From the first request to the last. */
static void serve(struct gnpd_daemon *daemon)
{
	struct gnpd_server *server = &daemon->server;
	gnpd_log_event(&daemon->log, GNPD_LOG_INFO, "gnpd %s ready with %u workers", version,
	               gnp_pool_workers(server->engine.pool));
	gnpd_notify_ready(server->notify);
	wait_signal(daemon, -1);
	give_notice(daemon);
	drain(daemon);
	end_work(daemon);
}

static gnp_status run(const struct gnpd_config *config, struct gnp_error *error)
{
	struct gnpd_daemon daemon;
	gnpd_parts_init(&daemon, config, (enum gnpd_log_format)config->log_format, (enum gnpd_log_level)config->log_level);
	gnpd_heap_keep();
	catch_signals();
	daemon.metrics.build = GNPD_BUILD;
	gnp_status status = gnpd_parts_start(&daemon, false, error);
	if (status == GNP_OK) {
		serve(&daemon);
		gnpd_parts_stop(&daemon);
		gnpd_log_event(&daemon.log, GNPD_LOG_INFO, "stopped");
	}
	gnpd_log_fini(&daemon.log);
	return status;
}

/* What the start would find wrong beyond the configuration itself; what it would warn of goes to standard error. */
static gnp_status check(const struct gnpd_config *config, struct gnp_error *error)
{
	struct gnpd_daemon daemon;
	gnpd_parts_init(&daemon, config, GNPD_LOG_TEXT, GNPD_LOG_WARNING);
	gnp_status status = gnpd_parts_start(&daemon, true, error);
	if (status == GNP_OK)
		gnpd_parts_stop(&daemon);
	gnpd_log_fini(&daemon.log);
	return status;
}

static bool checks_machine(unsigned actions)
{
	return actions == GNPD_CONFIG_RUN || (actions & GNPD_CONFIG_CHECK);
}

static gnp_status check_jobs_dir(const struct gnpd_config *config, struct gnp_error *error)
{
	return *config->jobs_dir ? gnpd_job_store_check(config->jobs_dir, error) : GNP_OK;
}

/* What is printed after a check can be read as a file of the configuration. */
static gnp_status act(unsigned actions, const struct gnpd_config *config, struct gnp_error *error)
{
	gnp_status status = checks_machine(actions) ? check_jobs_dir(config, error) : GNP_OK;
	if (status != GNP_OK)
		return status;
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
