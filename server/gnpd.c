/* gnpd: reads its configuration, starts the parts in order of need, waits for signals, stops them in reverse. */
#include <errno.h>
#include <malloc.h>
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

#include "config.h"
#include "http.h"
#include "linalg.h"
#include "listen.h"
#include "operation.h"
#include "server.h"

extern char **environ;

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

/* A request takes and frees tens of megabytes: what goes back to the kernel comes again a zeroed page at a time, which costs
 * more than the encoding. One arena, because the free pieces of many do not fit together. */
static void keep_freed_memory(void)
{
	mallopt(M_ARENA_MAX, 1);
	mallopt(M_MMAP_THRESHOLD, 32 << 20);
	mallopt(M_TRIM_THRESHOLD, 256 << 20);
}

static gnp_status raise_file_limit(size_t connections, struct gnp_error *error)
{
	enum { OTHER_FILES = 64 };
	struct rlimit limit;
	rlim_t need = connections + OTHER_FILES, better = 2 * connections + OTHER_FILES; /* results of jobs are sent from their files */
	if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= better)
		return GNP_OK;
	if (limit.rlim_max != RLIM_INFINITY && limit.rlim_max < need)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "max-connections: got %zu, need at most %llu: the process may open "
		                     "%llu files (ulimit -n)", connections, (unsigned long long)limit.rlim_max - OTHER_FILES,
		                     (unsigned long long)limit.rlim_max);
	limit.rlim_cur = limit.rlim_max == RLIM_INFINITY || limit.rlim_max > better ? better : limit.rlim_max;
	if (setrlimit(RLIMIT_NOFILE, &limit) != 0)
		return gnp_error_set(error, GNP_IO, "open files: %s", strerror(errno));
	return GNP_OK;
}

/* Written beside and renamed, so that whoever waits for the file never reads half of it. */
static gnp_status write_port_file(const char *path, unsigned port, struct gnp_error *error)
{
	char beside[GNPD_CONFIG_TEXT + 8];
	if (!*path)
		return GNP_OK;
	snprintf(beside, sizeof beside, "%s.new", path);
	FILE *file = fopen(beside, "w");
	if (!file)
		return gnp_error_set(error, GNP_IO, "port-file: %s: %s", beside, strerror(errno));
	bool written = fprintf(file, "%u\n", port) > 0;
	written = fclose(file) == 0 && written;
	if (!written || rename(beside, path) != 0)
		return gnp_error_set(error, GNP_IO, "port-file: %s: %s", path, strerror(errno));
	return GNP_OK;
}

/* True when a signal other than SIGHUP came within the time; seconds < 0: waits for one. */
static bool wait_signal(struct gnpd_server *server, double seconds)
{
	double until = gnp_clock() + seconds;
	struct timespec end = {(time_t)until, (long)((until - (double)(time_t)until) * 1e9)};
	for (;;) {
		while (take(&arrived.hangups))
			gnpd_loader_reload(server->loader);
		if (take(&arrived.stops))
			return true;
		if (seconds < 0)
			sem_wait(&arrived.wake);
		else if (sem_clockwait(&arrived.wake, CLOCK_MONOTONIC, &end) != 0 && errno == ETIMEDOUT)
			return false;
	}
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
	const double last_words = 2; /* seconds for cancelled requests to get their answer */
	atomic_store(&server->draining, true);
	gnpd_log_event(&server->log, "info", "draining: %zu requests under way", atomic_load(&server->active));
	gnpd_jobs_park(server->jobs);
	gnpd_watchers_end(server->watchers);
	if (wait_drained(server, server->config->drain_seconds))
		return;
	gnpd_log_event(&server->log, "warning", "cancelling %zu requests", atomic_load(&server->active));
	gnpd_reaper_stop_all(server->reaper, GNP_DRAINING);
	wait_drained(server, last_words);
}

/* The library may only stop when no connection is suspended. */
static void end_work(struct gnpd_server *server)
{
	gnpd_queue_close(server->queue);
	gnpd_jobs_park(server->jobs);
	gnpd_watchers_end(server->watchers);
	gnpd_reaper_stop_all(server->reaper, GNP_DRAINING);
	while (atomic_load(&server->suspended) > 0)
		usleep(1000);
}

static gnp_status serve(struct gnpd_server *server, struct gnp_error *error)
{
	struct gnpd_address address;
	struct gnpd_http *http = NULL;
	unsigned port;
	int fd;
	gnp_status status = gnpd_address_parse(server->config->listen, &address, error);
	if (status == GNP_OK)
		status = gnpd_jobs_start(server->jobs, error);
	if (status == GNP_OK)
		status = gnpd_listen_open(&address, &fd, &port, error);
	if (status == GNP_OK)
		status = gnpd_http_start_take(server, fd, &http, error);
	if (status != GNP_OK)
		return status;
	status = write_port_file(server->config->port_file, port, error);
	if (status == GNP_OK) {
		gnpd_log_event(&server->log, "info", "gnpd " GNPD_VERSION " ready on port %u with %u workers", port,
		               gnp_pool_workers(server->pool));
		wait_signal(server, -1);
		drain(server);
	}
	end_work(server);
	gnpd_http_stop(http);
	return status;
}

/* Requests at the desk are bounded by the connections and by queue-bytes. */
static gnp_status start_jobs(struct gnpd_server *server, struct gnp_error *error)
{
	enum { CLERKS = 2 };
	gnp_status status = gnpd_queue_create(CLERKS, server->config->max_connections, 1, &server->desk, error);
	if (status == GNP_OK)
		status = gnpd_watchers_create(server, &server->watchers, error);
	return status == GNP_OK ? gnpd_jobs_create(server, &server->jobs, error) : status;
}

static gnp_status run(const struct gnpd_config *config, struct gnp_error *error)
{
	struct gnpd_server server = {.config = config};
	gnpd_log_init(&server.log, (enum gnpd_log_format)config->log_format, STDERR_FILENO);
	keep_freed_memory();
	catch_signals();
	gnpd_metrics_init(&server.metrics);
	gnp_status status = raise_file_limit(config->max_connections, error);
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
		status = gnpd_reaper_create(&server, &server.reaper, error);
	if (status == GNP_OK)
		status = serve(&server, error);
	gnpd_reaper_free(server.reaper);
	gnpd_queue_free(server.desk);
	gnpd_jobs_free(server.jobs);
	gnpd_watchers_free(server.watchers);
	gnpd_queue_free(server.queue);
	gnp_prepared_cache_free(server.cache);
	gnpd_loader_free(server.loader);
	gnp_pool_free(server.pool);
	gnp_buffer_clear(&server.openapi);
	if (status == GNP_OK)
		gnpd_log_event(&server.log, "info", "stopped");
	gnpd_log_fini(&server.log);
	return status;
}

/* What the start would find wrong beyond the configuration itself. */
static gnp_status check(const struct gnpd_config *config, struct gnp_error *error)
{
	struct gnp_models *models = NULL;
	gnp_status status = gnp_models_load(config->weights_dir, &models, error);
	gnp_models_release(models);
	return status;
}

static gnp_status act(enum gnpd_config_action action, const struct gnpd_config *config, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	switch (action) {
	case GNPD_CONFIG_RUN: return run(config, error);
	case GNPD_CONFIG_HELP: gnpd_config_help(stdout); break;
	case GNPD_CONFIG_PRINT: gnpd_config_print(config, stdout); break;
	case GNPD_CONFIG_VERSION: puts("gnpd " GNPD_VERSION); break;
	case GNPD_CONFIG_CHECK:
		status = check(config, error);
		if (status == GNP_OK)
			puts("the configuration is good");
		break;
	}
	return status;
}

int main(int argc, char **argv)
{
	struct gnpd_config config;
	struct gnp_error error = {0};
	enum gnpd_config_action action;
	gnp_linalg_restart(argv);
	gnp_linalg_init();
	gnp_status status = gnpd_config_load(&config, argc, argv, environ, &action, &error);
	if (status == GNP_OK)
		status = act(action, &config, &error);
	if (status == GNP_OK)
		return EXIT_SUCCESS;
	fprintf(stderr, "gnpd: %s\n", error.text);
	return EXIT_FAILURE;
}
