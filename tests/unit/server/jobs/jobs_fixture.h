/* What tests of the table of jobs stand on: an engine without HTTP, a cloud, jobs that are submitted and looked at. */
#ifndef GNP_TESTS_JOBS_FIXTURE_H
#define GNP_TESTS_JOBS_FIXTURE_H

#include "tests/unit/test.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "core/base/pool.h"
#include "core/linear/linalg.h"
#include "proto/operation/operations.h"
#include "server/base/log.h"
#include "server/base/metrics.h"
#include "server/config/config.h"
#include "server/jobs/job.h"
#include "server/jobs/job_json.h"
#include "server/jobs/job_store_scan.h"
#include "server/jobs/job_watch.h"
#include "server/work/engine.h"
#include "server/work/loader.h"

static struct gnpd_config config;
static struct gnpd_log events;
static struct gnpd_metrics metrics;
static struct gnpd_engine engine = {.config = &config, .log = &events, .metrics = &metrics};
static struct gnpd_watchers *watchers;
static struct gnpd_jobs *table;
static struct gnp_buffer cloud; /* XYZ */

static inline void make_cloud(void)
{
	enum { POINTS = 300 };
	for (int i = 0; i < POINTS; i++) {
		double z = 1 - (2 * i + 1.0) / POINTS, r = sqrt(1 - z * z);
		CHECK(gnp_buffer_printf(&cloud, NULL, "%.9g %.9g %.9g\n", r * cos(2.4 * i), r * sin(2.4 * i), z) == GNP_OK);
	}
}

static inline void start_engine(void)
{
	gnpd_config_defaults(&config);
	gnpd_log_init(&events, GNPD_LOG_TEXT, GNPD_LOG_ERROR, open("/dev/null", O_WRONLY));
	gnpd_metrics_init(&metrics);
	CHECK(gnp_pool_create(2, &engine.pool, NULL) == GNP_OK &&
	      gnpd_loader_create(&engine, &engine.loader, NULL) == GNP_OK);
	CHECK(gnp_prepared_cache_create(0, &engine.cache, NULL) == GNP_OK);
	CHECK(gnpd_queue_create(1, 1, config.queue_bytes, &engine.queue, NULL) == GNP_OK);
	CHECK(gnpd_watchers_create(&config, &watchers, NULL) == GNP_OK);
}

static inline void stop_engine(void)
{
	gnpd_watchers_free(watchers);
	gnpd_queue_free(engine.queue);
	gnp_prepared_cache_free(engine.cache);
	gnpd_loader_free(engine.loader);
	gnp_pool_free(engine.pool);
	close(events.fd);
	gnpd_log_fini(&events);
}

static inline void open_jobs(void)
{
	CHECK(gnpd_jobs_create(&engine, watchers, &table, NULL) == GNP_OK && gnpd_jobs_start(table, NULL) == GNP_OK);
}

static inline void close_jobs(void)
{
	gnpd_jobs_free(table);
	table = NULL;
}

static inline void make_folder(void)
{
	strcpy(config.jobs_dir, "/tmp/gnpd-test.XXXXXX");
	CHECK(mkdtemp(config.jobs_dir) != NULL);
}

static inline void remove_folder(void)
{
	char command[GNPD_CONFIG_TEXT + 16];
	snprintf(command, sizeof command, "rm -r %s", config.jobs_dir);
	CHECK(system(command) == 0);
	config.jobs_dir[0] = '\0';
}

/* Names in the folder that hold `part`. */
static inline size_t files_with(const char *part)
{
	size_t count = 0;
	DIR *directory = opendir(config.jobs_dir);
	for (struct dirent *entry; directory && (entry = readdir(directory));)
		count += entry->d_name[0] != '.' && strstr(entry->d_name, part);
	closedir(directory);
	return count;
}

/* What is submitted, and the memory it was said to need. */
static const char ESTIMATE[] = "estimate", FLOW[] = "flow", QUICK[] = "estimator=gmls";
static const char LONG[] = "estimator=gmls&steps=1000000&dt=1e-9&scheme=explicit";
static const char *operation = ESTIMATE, *query = QUICK;
static size_t needed;

static inline gnp_status submit(const char *principal, const char *key, struct gnpd_job **job, bool *existing, struct gnp_error *error)
{
	struct gnpd_reply reply = {0};
	struct gnpd_work work;
	gnpd_work_init(&work, &engine, &reply);
	work.operation = gnp_operation_find(operation);
	work.query = query;
	work.content_type = gnp_format_media_type(&gnp_format_xyz);
	CHECK(gnp_buffer_append(&work.body, cloud.data, cloud.size, NULL) == GNP_OK);
	gnp_status status = gnpd_work_check(&work, error);
	needed = work.body.size + work.reserved + work.call.memory;
	if (status == GNP_OK)
		status = gnpd_jobs_submit(table, &work, principal, key, job, existing, error);
	gnpd_work_clear(&work);
	gnpd_reply_clear(&reply);
	return status;
}

static inline struct gnpd_job *submitted(const char *principal, const char *key, bool again)
{
	struct gnpd_job *job = NULL;
	bool existing = !again;
	struct gnp_error error = {0};
	CHECK(submit(principal, key, &job, &existing, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(existing == again);
	return job;
}

static inline struct gnpd_job_view ended(struct gnpd_job *job)
{
	struct gnpd_job_view view;
	for (int i = 0; i < 10000; i++) {
		gnpd_job_look(job, &view);
		if (gnpd_job_state_is_final(view.record.state))
			break;
		usleep(1000);
	}
	CHECK(gnpd_job_state_is_final(view.record.state));
	return view;
}

static inline struct gnpd_job *long_submitted(void)
{
	operation = FLOW;
	query = LONG;
	struct gnpd_job *job = submitted("", NULL, false);
	operation = ESTIMATE;
	query = QUICK;
	return job;
}

static inline enum gnpd_job_state state_of(struct gnpd_job *job)
{
	struct gnpd_job_view view;
	gnpd_job_look(job, &view);
	return view.record.state;
}

static inline void reach(struct gnpd_job *job, enum gnpd_job_state state)
{
	for (int i = 0; i < 10000 && state_of(job) != state; i++)
		usleep(1000);
	CHECK(state_of(job) == state);
}

/* The job of an earlier process. */
static inline struct gnpd_job *found(const char *id)
{
	struct gnpd_job *job = NULL;
	CHECK(gnpd_jobs_find(table, "", id, &job, NULL) == GNP_OK);
	return job;
}

static inline void copy_id(struct gnpd_job *job, char id[GNPD_JOB_ID + 1])
{
	struct gnpd_job_view view;
	gnpd_job_look(job, &view);
	strcpy(id, view.record.id);
}

static inline size_t listed(const char *principal)
{
	struct gnpd_job *found[10];
	bool more;
	const struct gnpd_job_filter filter = {.principal = principal, .state = -1};
	size_t count = gnpd_jobs_list(table, &filter, found, 10, &more);
	for (size_t i = 0; i < count; i++)
		gnpd_job_release(found[i]);
	return count;
}

/* Runs them with an engine and a cloud; the exit status. */
static inline int run_with_jobs(int argc, char **argv, const struct test *tests, size_t count)
{
	gnp_linalg_init();
	make_cloud();
	start_engine();
	int status = test_run(argc, argv, tests, count);
	stop_engine();
	gnp_buffer_clear(&cloud);
	return status;
}

#endif
