/* The table of jobs without HTTP: whose they are, and what a disk that fails at any write makes of them. */
#include "test.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <unistd.h>

#include "job.h"
#include "linalg.h"
#include "server.h"

static struct gnpd_config config;
static struct gnpd_server server;
static struct gnp_buffer cloud; /* XYZ */

static void make_cloud(void)
{
	enum { POINTS = 300 };
	for (int i = 0; i < POINTS; i++) {
		double z = 1 - (2 * i + 1.0) / POINTS, r = sqrt(1 - z * z);
		CHECK(gnp_buffer_printf(&cloud, NULL, "%.9g %.9g %.9g\n", r * cos(2.4 * i), r * sin(2.4 * i), z) == GNP_OK);
	}
}

static void start_server(void)
{
	gnpd_config_defaults(&config);
	server.config = &config;
	gnpd_log_init(&server.log, GNPD_LOG_TEXT, GNPD_LOG_ERROR, open("/dev/null", O_WRONLY));
	gnpd_metrics_init(&server.metrics);
	CHECK(gnp_pool_create(2, &server.pool, NULL) == GNP_OK && gnpd_loader_create(&server, &server.loader, NULL) == GNP_OK);
	CHECK(gnp_prepared_cache_create(0, &server.cache, NULL) == GNP_OK);
	CHECK(gnpd_queue_create(1, 1, config.queue_bytes, &server.queue, NULL) == GNP_OK);
	CHECK(gnpd_watchers_create(&server, &server.watchers, NULL) == GNP_OK);
}

static void stop_server(void)
{
	gnpd_watchers_free(server.watchers);
	gnpd_queue_free(server.queue);
	gnp_prepared_cache_free(server.cache);
	gnpd_loader_free(server.loader);
	gnp_pool_free(server.pool);
	close(server.log.fd);
	gnpd_log_fini(&server.log);
}

static void open_jobs(void)
{
	CHECK(gnpd_jobs_create(&server, &server.jobs, NULL) == GNP_OK && gnpd_jobs_start(server.jobs, NULL) == GNP_OK);
}

static void close_jobs(void)
{
	gnpd_jobs_free(server.jobs);
	server.jobs = NULL;
}

static void make_folder(void)
{
	strcpy(config.jobs_dir, "/tmp/gnpd-test.XXXXXX");
	CHECK(mkdtemp(config.jobs_dir) != NULL);
}

static void remove_folder(void)
{
	char command[GNPD_CONFIG_TEXT + 16];
	snprintf(command, sizeof command, "rm -r %s", config.jobs_dir);
	CHECK(system(command) == 0);
	config.jobs_dir[0] = '\0';
}

/* Names in the folder that hold `part`. */
static size_t files_with(const char *part)
{
	size_t count = 0;
	DIR *directory = opendir(config.jobs_dir);
	for (struct dirent *entry; directory && (entry = readdir(directory));)
		count += entry->d_name[0] != '.' && strstr(entry->d_name, part);
	closedir(directory);
	return count;
}

static gnp_status submit(const char *principal, const char *key, struct gnpd_job **job, bool *existing, struct gnp_error *error)
{
	struct gnpd_reply reply = {0};
	struct gnpd_work work;
	gnpd_work_init(&work, &server, &reply);
	work.operation = gnp_operation_find("estimate");
	work.query = "estimator=gmls";
	work.content_type = gnp_format_media_type(GNP_FORMAT_XYZ);
	CHECK(gnp_buffer_append(&work.body, cloud.data, cloud.size, NULL) == GNP_OK);
	gnp_status status = gnpd_work_check(&work, error);
	if (status == GNP_OK)
		status = gnpd_jobs_submit(server.jobs, &work, principal, key, job, existing, error);
	gnpd_work_clear(&work);
	gnpd_reply_clear(&reply);
	return status;
}

static struct gnpd_job *submitted(const char *principal, const char *key, bool again)
{
	struct gnpd_job *job = NULL;
	bool existing = !again;
	struct gnp_error error = {0};
	CHECK(submit(principal, key, &job, &existing, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(existing == again);
	return job;
}

static struct gnpd_job_view ended(struct gnpd_job *job)
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

static size_t listed(const char *principal)
{
	struct gnpd_job *found[10];
	bool more;
	const struct gnpd_job_filter filter = {.principal = principal, .state = -1};
	size_t count = gnpd_jobs_list(server.jobs, &filter, found, 10, &more);
	for (size_t i = 0; i < count; i++)
		gnpd_job_release(found[i]);
	return count;
}

static void jobs_are_their_principals(void)
{
	struct gnpd_job *other = NULL;
	open_jobs();
	struct gnpd_job *job = submitted("ann", "key", false), *same = submitted("ann", "key", true), *bobs = submitted("bob", "key", false);
	CHECK(same == job && bobs != job);
	static const char *const strangers[] = {"bob", "", "an", "anna"};
	for (size_t i = 0; i < sizeof strangers / sizeof strangers[0]; i++) {
		struct gnp_error error = {0};
		CHECK(gnpd_jobs_find(server.jobs, strangers[i], job->record.id, &other, &error) == GNP_NOT_FOUND);
		CHECK_CONTAINS(error.text, "job: there is no");
	}
	CHECK(gnpd_jobs_find(server.jobs, "ann", job->record.id, &other, NULL) == GNP_OK && other == job);
	CHECK(listed("ann") == 1 && listed("bob") == 1 && listed("") == 0);
	ended(job);
	ended(bobs);
	gnpd_job_release(other);
	gnpd_job_release(same);
	gnpd_job_release(job);
	gnpd_job_release(bobs);
	close_jobs();
}

/* ---- A disk that takes so many writes ---- */

static atomic_int writes_left;

static ssize_t limited_write(int fd, const void *data, size_t size)
{
	if (atomic_fetch_sub(&writes_left, 1) > 0)
		return write(fd, data, size);
	errno = ENOSPC;
	return -1;
}

static void a_job_that_cannot_be_written_is_refused_whole(void)
{
	for (int good = 0; good < 2; good++) { /* the body's write, the record's */
		struct gnpd_job *job = NULL;
		bool existing = false;
		struct gnp_error error = {0};
		make_folder();
		open_jobs();
		atomic_store(&writes_left, good);
		server.jobs->store.disk.write = limited_write;
		CHECK(submit("", "key", &job, &existing, &error) == GNP_NO_SPACE);
		CHECK_CONTAINS(error.text, "No space left");
		CHECK(listed("") == 0 && server.jobs->bytes == 0 && files_with("") == 1);
		server.jobs->store.disk.write = write;
		job = submitted("", "key", false); /* the key is free */
		CHECK(ended(job).record.state == GNPD_JOB_SUCCEEDED);
		gnpd_job_release(job);
		close_jobs();
		remove_folder();
	}
}

/* Body, record, record of the run; then the result, which is one piece, and the record of its end. */
static void an_end_that_cannot_be_written_is_told_and_run_again(void)
{
	for (int good = 2; good < 5; good++) {
		char id[GNPD_JOB_ID + 1];
		struct gnpd_job *job;
		make_folder();
		open_jobs();
		atomic_store(&writes_left, good);
		server.jobs->store.disk.write = limited_write;
		job = submitted("", NULL, false);
		struct gnpd_job_view view = ended(job);
		CHECK(view.record.state == GNPD_JOB_FAILED && view.record.error == GNP_NO_SPACE);
		CHECK_CONTAINS(view.record.error_text, "No space left");
		strcpy(id, view.record.id);
		gnpd_job_release(job);
		close_jobs();
		CHECK(files_with(".new") == 0 && files_with(".result") == 0 && files_with(".job") == 1);
		open_jobs();
		CHECK(gnpd_jobs_find(server.jobs, "", id, &job, NULL) == GNP_OK);
		view = ended(job);
		CHECK(view.record.state == GNPD_JOB_SUCCEEDED);
		gnpd_job_release(job);
		close_jobs();
		remove_folder();
	}
}

/* ---- Jobs that cannot be let go ---- */

/* In the place of the job's file, what can neither be removed as a file nor be written over. */
static void block(const struct gnpd_job *job, const char *suffix)
{
	char path[GNPD_CONFIG_TEXT + 64];
	snprintf(path, sizeof path, "%s/%s%s", config.jobs_dir, job->record.id, suffix);
	CHECK((unlink(path) == 0 || errno == ENOENT) && mkdir(path, 0700) == 0);
}

static bool is_gone(const char *id)
{
	struct gnpd_job *job = NULL;
	if (gnpd_jobs_find(server.jobs, "", id, &job, NULL) != GNP_OK)
		return true;
	gnpd_job_release(job);
	return false;
}

static size_t lines_of(int fd)
{
	char text[65536];
	ssize_t size = pread(fd, text, sizeof text, 0);
	size_t count = 0;
	for (ssize_t i = 0; i < size; i++)
		count += text[i] == '\n';
	return count;
}

/* The clerk tried the first of them for ever, as fast as it could, with a line in the log each time, and never saw that it was to stop. */
static void what_cannot_be_let_go_holds_nothing_up(void)
{
	static const char *const suffixes[] = {".job", ".result"};
	FILE *log = tmpfile();
	int before = server.log.fd;
	server.log.fd = fileno(log);
	config.jobs_ttl_seconds = 0.5;
	for (size_t i = 0; i < 2; i++) {
		char id[GNPD_JOB_ID + 1];
		make_folder();
		open_jobs();
		struct gnpd_job *first = submitted("", NULL, false);
		ended(first);
		block(first, suffixes[i]);
		struct gnpd_job *second = submitted("", NULL, false);
		strcpy(id, second->record.id);
		gnpd_job_release(second);
		for (int j = 0; j < 10000 && !is_gone(id); j++)
			usleep(1000);
		CHECK(is_gone(id) && !is_gone(first->record.id));
		gnpd_job_release(first);
		double began = gnp_clock();
		close_jobs();
		CHECK(gnp_clock() - began < 5);
		remove_folder();
	}
	CHECK(lines_of(server.log.fd) == 2);
	server.log.fd = before;
	gnpd_config_defaults(&config);
	fclose(log);
}

/* Room was made before the key was looked up, and what went was the very job that was asked for again. */
static void a_job_is_not_dropped_for_itself(void)
{
	config.jobs_ttl_seconds = 0.5;
	config.jobs_count = 1;
	open_jobs();
	struct gnpd_job *job = submitted("", "key", false);
	struct gnpd_job_view view = ended(job);
	for (int i = 0; i < 10000 && view.record.state != GNPD_JOB_EXPIRED; i++) {
		usleep(1000);
		gnpd_job_look(job, &view);
	}
	CHECK(view.record.state == GNPD_JOB_EXPIRED);
	struct gnpd_job *same = submitted("", "key", true);
	CHECK(same == job);
	gnpd_job_release(same);
	gnpd_job_release(job);
	job = submitted("", "another", false); /* for that one it is */
	ended(job);
	gnpd_job_release(job);
	close_jobs();
	gnpd_config_defaults(&config);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(jobs_are_their_principals), TEST(a_job_that_cannot_be_written_is_refused_whole),
		TEST(an_end_that_cannot_be_written_is_told_and_run_again),
		TEST(what_cannot_be_let_go_holds_nothing_up), TEST(a_job_is_not_dropped_for_itself),
	};
	gnp_linalg_init();
	make_cloud();
	start_server();
	int status = RUN_TESTS(tests);
	stop_server();
	gnp_buffer_clear(&cloud);
	return status;
}
