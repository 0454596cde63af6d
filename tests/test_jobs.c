/* The table of jobs without HTTP: whose they are, and what a disk that fails at any write makes of them. */
#include "test.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "job.h"
#include "job_json.h"
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

/* What is submitted, and the memory it was said to need. */
static const char ESTIMATE[] = "estimate", FLOW[] = "flow", QUICK[] = "estimator=gmls", LONG[] = "estimator=gmls&steps=1000000&dt=1e-9";
static const char *operation = ESTIMATE, *query = QUICK;
static size_t needed;

static gnp_status submit(const char *principal, const char *key, struct gnpd_job **job, bool *existing, struct gnp_error *error)
{
	struct gnpd_reply reply = {0};
	struct gnpd_work work;
	gnpd_work_init(&work, &server, &reply);
	work.operation = gnp_operation_find(operation);
	work.query = query;
	work.content_type = gnp_format_media_type(GNP_FORMAT_XYZ);
	CHECK(gnp_buffer_append(&work.body, cloud.data, cloud.size, NULL) == GNP_OK);
	gnp_status status = gnpd_work_check(&work, error);
	needed = work.body.size + work.reserved + work.call.memory;
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

static struct gnpd_job *long_submitted(void)
{
	operation = FLOW;
	query = LONG;
	struct gnpd_job *job = submitted("", NULL, false);
	operation = ESTIMATE;
	query = QUICK;
	return job;
}

static enum gnpd_job_state state_of(struct gnpd_job *job)
{
	struct gnpd_job_view view;
	gnpd_job_look(job, &view);
	return view.record.state;
}

static void reach(struct gnpd_job *job, enum gnpd_job_state state)
{
	for (int i = 0; i < 10000 && state_of(job) != state; i++)
		usleep(1000);
	CHECK(state_of(job) == state);
}

/* The job of an earlier process. */
static struct gnpd_job *found(const char *id)
{
	struct gnpd_job *job = NULL;
	CHECK(gnpd_jobs_find(server.jobs, "", id, &job, NULL) == GNP_OK);
	return job;
}

static void copy_id(struct gnpd_job *job, char id[GNPD_JOB_ID + 1])
{
	struct gnpd_job_view view;
	gnpd_job_look(job, &view);
	strcpy(id, view.record.id);
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
	char id[GNPD_JOB_ID + 1];
	struct gnpd_job *other = NULL;
	open_jobs();
	struct gnpd_job *job = submitted("ann", "key", false), *same = submitted("ann", "key", true), *bobs = submitted("bob", "key", false);
	CHECK(same == job && bobs != job);
	copy_id(job, id);
	static const char *const strangers[] = {"bob", "", "an", "anna"};
	for (size_t i = 0; i < sizeof strangers / sizeof strangers[0]; i++) {
		struct gnp_error error = {0};
		CHECK(gnpd_jobs_find(server.jobs, strangers[i], id, &other, &error) == GNP_NOT_FOUND);
		CHECK_CONTAINS(error.text, "job: there is no");
	}
	CHECK(gnpd_jobs_find(server.jobs, "ann", id, &other, NULL) == GNP_OK && other == job);
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
static void block(const char *id, const char *suffix)
{
	char path[GNPD_CONFIG_TEXT + 64];
	snprintf(path, sizeof path, "%s/%s%s", config.jobs_dir, id, suffix);
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

static struct stat record_file(const char *id)
{
	char path[GNPD_CONFIG_TEXT + 64];
	struct stat information = {0};
	snprintf(path, sizeof path, "%s/%s.job", config.jobs_dir, id);
	CHECK(stat(path, &information) == 0);
	return information;
}

/* The disk is full as long as a result is on it. */
static ssize_t write_without_result(int fd, const void *data, size_t size)
{
	if (!files_with(".result"))
		return write(fd, data, size);
	errno = ENOSPC;
	return -1;
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
		char id[GNPD_JOB_ID + 1], stuck[GNPD_JOB_ID + 1];
		make_folder();
		open_jobs();
		struct gnpd_job *first = submitted("", NULL, false);
		ended(first);
		copy_id(first, stuck);
		block(stuck, suffixes[i]);
		struct gnpd_job *second = submitted("", NULL, false);
		copy_id(second, id);
		gnpd_job_release(second);
		for (int j = 0; j < 10000 && !is_gone(id); j++)
			usleep(1000);
		CHECK(is_gone(id) && !is_gone(stuck));
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

static void wait_for_line(int fd)
{
	for (int i = 0; i < 10000 && !lines_of(fd); i++)
		usleep(1000);
	CHECK(lines_of(fd) == 1);
}

/* Its result went first, and it was said to have expired, which nothing on disk knew: the next start took it for a job that had failed,
 * and it was tried again only when its record was to go as well. */
static void what_cannot_expire_is_what_it_was(void)
{
	FILE *log = tmpfile();
	int before = server.log.fd;
	char id[GNPD_JOB_ID + 1], path[GNPD_CONFIG_TEXT + 64];
	server.log.fd = fileno(log);
	config.jobs_ttl_seconds = 2;
	make_folder();
	open_jobs();
	struct gnpd_job *job = submitted("", NULL, false);
	ended(job);
	copy_id(job, id);
	block(id, ".job");
	wait_for_line(server.log.fd);
	CHECK(state_of(job) == GNPD_JOB_SUCCEEDED && files_with(".result") == 1);
	snprintf(path, sizeof path, "%s/%s.job", config.jobs_dir, id);
	CHECK(rmdir(path) == 0);
	pthread_mutex_lock(&server.jobs->lock);
	job->again = 0; /* half a minute later */
	pthread_mutex_unlock(&server.jobs->lock);
	reach(job, GNPD_JOB_EXPIRED);
	CHECK(files_with(".result") == 0 && record_file(id).st_size > 0 && !is_gone(id));
	gnpd_job_release(job);
	close_jobs();
	remove_folder();
	server.log.fd = before;
	gnpd_config_defaults(&config);
	fclose(log);
}

/* The record that says a job expired needs room, which its result holds. */
static void files_make_room_for_the_record(void)
{
	config.jobs_ttl_seconds = 1;
	make_folder();
	open_jobs();
	struct gnpd_job *job = submitted("", NULL, false);
	ended(job);
	server.jobs->store.disk.write = write_without_result;
	reach(job, GNPD_JOB_EXPIRED);
	CHECK(files_with(".result") == 0 && files_with(".job") == 1);
	gnpd_job_release(job);
	close_jobs();
	remove_folder();
	gnpd_config_defaults(&config);
}

/* Room was made before the key was looked up, and what went was the very job that was asked for again. */
static void a_job_is_not_dropped_for_itself(void)
{
	config.jobs_ttl_seconds = 0.5;
	config.jobs_count = 1;
	open_jobs();
	struct gnpd_job *job = submitted("", "key", false);
	reach(job, GNPD_JOB_EXPIRED);
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

/* ---- Processes that died ---- */

/* The record of a job of a process that died while it ran. */
static void leave_running(const char *id, uint64_t attempts)
{
	struct gnpd_job_store store = {0};
	struct gnpd_job_found found = {0};
	CHECK(gnpd_job_store_open(config.jobs_dir, &store, NULL) == GNP_OK);
	CHECK(gnpd_job_store_scan(&store, &server.log, &found, NULL) == GNP_OK);
	for (size_t i = 0; i < found.count; i++) {
		if (strcmp(found.records[i].id, id) == 0) {
			found.records[i].state = GNPD_JOB_RUNNING;
			found.records[i].attempts = attempts;
			CHECK(gnpd_job_store_put_record(&store, &found.records[i], NULL) == GNP_OK);
		}
		gnpd_job_record_clear(&found.records[i]);
	}
	free(found.records);
	gnpd_job_store_close(&store);
}

/* Three long jobs, of which the process died in the runs of the first two; opens the table again. */
static void open_after_death(uint64_t attempts, struct gnpd_job *jobs[3])
{
	char ids[3][GNPD_JOB_ID + 1];
	config.job_runners = 3;
	make_folder();
	open_jobs();
	for (int i = 0; i < 3; i++) {
		struct gnpd_job *job = long_submitted();
		copy_id(job, ids[i]);
		gnpd_job_release(job);
	}
	close_jobs();
	for (int i = 0; i < 2; i++)
		leave_running(ids[i], attempts);
	open_jobs();
	for (int i = 0; i < 3; i++)
		jobs[i] = found(ids[i]);
}

static void close_after_death(struct gnpd_job *jobs[3])
{
	for (int i = 0; i < 3; i++)
		gnpd_job_release(jobs[i]);
	close_jobs();
	remove_folder();
	gnpd_config_defaults(&config);
}

static size_t suspects(void)
{
	struct gnpd_jobs_counts counts;
	gnpd_jobs_count(server.jobs, &counts);
	return counts.suspects;
}

/* Of those that ran when a process died, and ran again, all were blamed for its next death. */
static void suspected_jobs_run_one_at_a_time_and_before_others(void)
{
	struct gnpd_job *jobs[3];
	config.jobs_checkpoint_seconds = 1000;
	open_after_death(1, jobs);
	for (int i = 0; i < 3; i++) {
		enum gnpd_job_deletion what;
		reach(jobs[i], GNPD_JOB_RUNNING);
		usleep(50000);
		for (int j = i + 1; j < 3; j++)
			CHECK(state_of(jobs[j]) == GNPD_JOB_QUEUED);
		CHECK(suspects() == (i == 0 ? 2U : i == 1 ? 1U : 0U));
		CHECK(gnpd_jobs_delete(server.jobs, jobs[i], &what, NULL) == GNP_OK && what == GNPD_JOB_IS_BEING_CANCELLED);
	}
	reach(jobs[2], GNPD_JOB_CANCELLED);
	close_after_death(jobs);
}

static void a_suspected_job_that_waits_can_be_cancelled(void)
{
	struct gnpd_job *jobs[3];
	config.jobs_checkpoint_seconds = 1000;
	open_after_death(1, jobs);
	reach(jobs[0], GNPD_JOB_RUNNING);
	for (int i = 1; i >= 0; i--) {
		enum gnpd_job_deletion what;
		CHECK(gnpd_jobs_delete(server.jobs, jobs[i], &what, NULL) == GNP_OK);
		reach(jobs[i], GNPD_JOB_CANCELLED);
	}
	CHECK(suspects() == 0);
	reach(jobs[2], GNPD_JOB_RUNNING);
	close_after_death(jobs);
}

/* A long job that was hit twice by what it had no part in is not lost as long as it gets on. */
static void a_job_that_gets_further_is_not_suspected_any_more(void)
{
	struct gnpd_job *jobs[3];
	struct gnpd_job_view view;
	config.jobs_checkpoint_seconds = 0;
	config.jobs_attempts = 6;
	open_after_death(5, jobs);
	for (int i = 0; i < 3; i++) {
		reach(jobs[i], GNPD_JOB_RUNNING);
		for (int wait = 0; wait < 10000 && suspects(); wait++)
			usleep(1000);
		reach(jobs[i], GNPD_JOB_RUNNING);
		gnpd_job_look(jobs[i], &view);
		CHECK(view.record.attempts == 1);
	}
	CHECK(suspects() == 0);
	close_after_death(jobs);
}

static void a_job_a_process_died_of_twice_has_failed(void)
{
	struct gnpd_job *jobs[3];
	struct gnpd_job_view view;
	CHECK(config.jobs_attempts == 2);
	open_after_death(2, jobs);
	for (int i = 0; i < 2; i++) {
		gnpd_job_look(jobs[i], &view);
		CHECK(view.record.state == GNPD_JOB_FAILED && view.record.error == GNP_INTERNAL);
		CHECK_CONTAINS(view.record.error_text, "the process died 2 times while this job ran, at last with no other job beside it");
	}
	CHECK(files_with(".body") == 1);
	reach(jobs[2], GNPD_JOB_RUNNING);
	close_after_death(jobs);
}

/* ---- Ends that are asked for ---- */

/* Until no runner has it any more: else it is the runner that cancels it. */
static void wait_until_parked(struct gnpd_job *job)
{
	bool parked = false;
	for (int i = 0; i < 10000 && !parked; i++) {
		usleep(1000);
		pthread_mutex_lock(&server.jobs->lock);
		parked = job->parked;
		pthread_mutex_unlock(&server.jobs->lock);
	}
	CHECK(parked);
}

/* A parked job belonged to nobody: its DELETE was accepted, and it ran again in the next process. */
static void parked_jobs_can_be_cancelled(void)
{
	char ids[2][GNPD_JOB_ID + 1];
	config.job_runners = 1;
	make_folder();
	open_jobs();
	struct gnpd_job *jobs[2] = {long_submitted(), long_submitted()}; /* one runs, one waits */
	reach(jobs[0], GNPD_JOB_RUNNING);
	gnpd_jobs_park(server.jobs);
	reach(jobs[0], GNPD_JOB_QUEUED);
	for (int i = 0; i < 2; i++) {
		enum gnpd_job_deletion what = GNPD_JOB_WAS_REMOVED;
		wait_until_parked(jobs[i]);
		CHECK(gnpd_jobs_delete(server.jobs, jobs[i], &what, NULL) == GNP_OK && what == GNPD_JOB_WAS_CANCELLED);
		CHECK(state_of(jobs[i]) == GNPD_JOB_CANCELLED);
		copy_id(jobs[i], ids[i]);
		gnpd_job_release(jobs[i]);
	}
	close_jobs();
	CHECK(files_with(".body") == 0 && files_with(".checkpoint") == 0);
	open_jobs();
	for (int i = 0; i < 2; i++) {
		struct gnpd_job *job = found(ids[i]);
		CHECK(state_of(job) == GNPD_JOB_CANCELLED);
		gnpd_job_release(job);
	}
	close_jobs();
	remove_folder();
	gnpd_config_defaults(&config);
}

/* Once it is holding: of the test's thread the writes are taken, of others the first is held until it may go on, and it fails as all
 * after it do. */
static pthread_t own_thread;
static atomic_bool holding, held, may_go_on;

static ssize_t held_write(int fd, const void *data, size_t size)
{
	if (!atomic_load(&holding) || pthread_equal(pthread_self(), own_thread))
		return write(fd, data, size);
	atomic_store(&held, true);
	while (!atomic_load(&may_go_on))
		usleep(1000);
	errno = ENOSPC;
	return -1;
}

/* Before there is a job. */
static void prepare_to_hold(void)
{
	own_thread = pthread_self();
	atomic_store(&holding, false);
	atomic_store(&held, false);
	atomic_store(&may_go_on, false);
	server.jobs->store.disk.write = held_write;
}

static void wait_until_held(void)
{
	for (int i = 0; i < 10000 && !atomic_load(&held); i++)
		usleep(1000);
	CHECK(atomic_load(&held));
}

/* The process ends before it could write the end of a job whose DELETE was accepted, and the next one ran the job again. Every start
 * after that wrote the record anew, as it did those of all jobs that had failed. */
static void an_accepted_cancel_outlives_the_process(void)
{
	char id[GNPD_JOB_ID + 1];
	enum gnpd_job_deletion what = GNPD_JOB_WAS_REMOVED;
	config.jobs_checkpoint_seconds = 0;
	make_folder();
	open_jobs();
	prepare_to_hold();
	struct gnpd_job *job = long_submitted();
	reach(job, GNPD_JOB_RUNNING);
	atomic_store(&holding, true);
	wait_until_held(); /* in the middle of a checkpoint */
	CHECK(gnpd_jobs_delete(server.jobs, job, &what, NULL) == GNP_OK && what == GNPD_JOB_IS_BEING_CANCELLED);
	atomic_store(&may_go_on, true);
	reach(job, GNPD_JOB_CANCELLED);
	copy_id(job, id);
	gnpd_job_release(job);
	close_jobs();
	struct stat before = {0};
	for (int start = 0; start < 3; start++) {
		open_jobs();
		job = found(id);
		CHECK(state_of(job) == GNPD_JOB_CANCELLED && server.jobs->counts.recovered == 0);
		gnpd_job_release(job);
		close_jobs();
		CHECK(files_with(id) == 1);
		struct stat now = record_file(id);
		CHECK(start == 0 || now.st_ino == before.st_ino);
		before = now;
	}
	remove_folder();
	gnpd_config_defaults(&config);
}

static atomic_bool folder_fails;

static int failing_folder_sync(int fd)
{
	struct stat information;
	if (!atomic_load(&folder_fails) || fstat(fd, &information) != 0 || !S_ISDIR(information.st_mode))
		return fsync(fd);
	errno = EIO;
	return -1;
}

/* The record of a job that was parked took the place of the one before, was removed because the folder could not be synced, and the next
 * start removed the body that had no record. */
static void a_folder_that_cannot_be_synced_loses_no_job(void)
{
	char id[GNPD_JOB_ID + 1];
	make_folder();
	open_jobs();
	atomic_store(&folder_fails, false);
	server.jobs->store.disk.sync = failing_folder_sync;
	struct gnpd_job *job = long_submitted();
	reach(job, GNPD_JOB_RUNNING);
	atomic_store(&folder_fails, true);
	copy_id(job, id);
	gnpd_job_release(job);
	close_jobs();
	open_jobs();
	job = found(id);
	reach(job, GNPD_JOB_RUNNING);
	gnpd_job_release(job);
	close_jobs();
	remove_folder();
}

/* ---- Memory ---- */

/* A job was taken when its body and what it needs fit jobs-memory-bytes, and failed for good once it had a checkpoint besides. */
static void a_checkpoint_that_does_not_fit_is_let_go(void)
{
	char id[GNPD_JOB_ID + 1];
	make_folder();
	open_jobs();
	struct gnpd_job *job = long_submitted();
	struct gnpd_job_view view = {0};
	for (int i = 0; i < 10000 && !(view.progress.step && strcmp(view.progress.stage, "flow") == 0); i++) {
		usleep(1000);
		gnpd_job_look(job, &view);
	}
	copy_id(job, id);
	gnpd_job_release(job);
	close_jobs();
	CHECK(files_with(".checkpoint") == 1);
	config.jobs_memory_bytes = needed + 1000;
	open_jobs();
	job = found(id);
	reach(job, GNPD_JOB_RUNNING);
	for (int i = 0; i < 10000 && files_with(".checkpoint"); i++)
		usleep(1000);
	usleep(50000);
	CHECK(files_with(".checkpoint") == 0 && state_of(job) == GNPD_JOB_RUNNING);
	gnpd_job_release(job);
	close_jobs();
	remove_folder();
	gnpd_config_defaults(&config);
}

static void jobs_that_fit_no_memory_are_refused_and_counted(void)
{
	struct gnpd_job *job = NULL;
	bool existing = false;
	struct gnp_error error = {0};
	struct gnpd_jobs_counts counts;
	open_jobs();
	struct gnpd_job *kept = submitted("", "key", false);
	ended(kept);
	config.jobs_memory_bytes = 1000;
	CHECK(submit("", NULL, &job, &existing, &error) == GNP_TOO_LARGE);
	CHECK_CONTAINS(error.text, "jobs-memory-bytes");
	gnpd_jobs_count(server.jobs, &counts);
	CHECK(counts.refused_memory == 1);
	struct gnpd_job *same = submitted("", "key", true); /* one that was taken is not refused */
	CHECK(same == kept);
	gnpd_job_release(same);
	gnpd_job_release(kept);
	close_jobs();
	gnpd_config_defaults(&config);
}

static void set_gathering(bool gathering)
{
	pthread_mutex_lock(&server.jobs->lock);
	server.jobs->gathering = gathering;
	gnpd_jobs_changed(server.jobs);
	pthread_mutex_unlock(&server.jobs->lock);
}

/* It asked fifty times a second, and every time was counted as a request that was refused. */
static void a_job_that_waits_for_memory_is_no_refusal(void)
{
	struct gnpd_reply reply = {0};
	struct gnpd_work work;
	struct gnpd_job *job = NULL;
	bool existing = false;
	open_jobs();
	set_gathering(true); /* until there is no more memory */
	gnpd_work_init(&work, &server, &reply);
	work.operation = gnp_operation_find("estimate");
	work.query = QUICK;
	work.content_type = gnp_format_media_type(GNP_FORMAT_XYZ);
	work.content_encoding = "deflate";
	uLongf size = compressBound(cloud.size);
	CHECK(gnp_buffer_reserve(&work.body, size, NULL) == GNP_OK && compress(work.body.data, &size, cloud.data, cloud.size) == Z_OK);
	work.body.size = size;
	CHECK(gnpd_work_check(&work, NULL) == GNP_OK);
	CHECK(gnpd_jobs_submit(server.jobs, &work, "", NULL, &job, &existing, NULL) == GNP_OK);
	gnpd_work_clear(&work);
	gnpd_reply_clear(&reply);
	size_t room = config.queue_bytes - size - 1000, counted = atomic_load(&server.metrics.rejected[GNPD_REJECT_QUEUE_BYTES]);
	CHECK(gnpd_queue_reserve(server.queue, 0, room, NULL) == GNP_OK);
	set_gathering(false);
	usleep(200000);
	CHECK(!gnpd_job_state_is_final(state_of(job)));
	CHECK(atomic_load(&server.metrics.rejected[GNPD_REJECT_QUEUE_BYTES]) == counted);
	gnpd_queue_release(server.queue, room);
	reach(job, GNPD_JOB_SUCCEEDED);
	gnpd_job_release(job);
	close_jobs();
}

/* ---- Time and keys ---- */

static void jobs_stopped_by_their_time_are_counted_and_say_how_far_they_came(void)
{
	uint64_t before = atomic_load(&server.metrics.cancelled[GNPD_CANCEL_DEADLINE]);
	config.jobs_seconds = 1;
	open_jobs();
	struct gnpd_job *job = long_submitted();
	struct gnpd_job_view view = ended(job);
	CHECK(view.record.error == GNP_DEADLINE);
	CHECK(atomic_load(&server.metrics.cancelled[GNPD_CANCEL_DEADLINE]) == before + 1);
	CHECK_STRING(view.progress.stage, "flow");
	CHECK(view.progress.step > 0 && view.progress.steps == 1000000 && view.progress.fraction >= 0.1);
	struct gnp_buffer text = {0};
	CHECK(gnpd_job_write_json(&view, &text, NULL) == GNP_OK && gnp_buffer_append(&text, "", 1, NULL) == GNP_OK);
	CHECK_CONTAINS((const char *)text.data, "\"stage\":\"flow\"");
	CHECK_CONTAINS((const char *)text.data, "\"steps\":1000000,\"eta_seconds\":null}");
	gnp_buffer_clear(&text);
	gnpd_job_release(job);
	close_jobs();
	gnpd_config_defaults(&config);
}

static void *submit_first(void *job)
{
	bool existing = false;
	return submit("", "key", job, &existing, NULL) == GNP_NO_SPACE ? NULL : job;
}

/* It had the code of a key that is another request's, which no client may ask with again. */
static void a_key_that_is_being_taken_may_be_asked_for_again(void)
{
	pthread_t thread;
	struct gnpd_job *job = NULL, *first = NULL;
	bool existing = false;
	void *taken = NULL;
	struct gnp_error error = {0}, other = {0};
	open_jobs();
	prepare_to_hold();
	atomic_store(&holding, true);
	CHECK(pthread_create(&thread, NULL, submit_first, &first) == 0);
	wait_until_held();
	CHECK(submit("", "key", &job, &existing, &error) == GNP_IN_PROGRESS);
	CHECK_CONTAINS(error.text, "is being taken");
	query = "estimator=gmls&k=40";
	CHECK(submit("", "key", &job, &existing, &other) == GNP_CONFLICT);
	query = QUICK;
	atomic_store(&may_go_on, true);
	CHECK(pthread_join(thread, &taken) == 0 && !taken && !first);
	close_jobs();
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(jobs_are_their_principals), TEST(a_job_that_cannot_be_written_is_refused_whole),
		TEST(an_end_that_cannot_be_written_is_told_and_run_again),
		TEST(suspected_jobs_run_one_at_a_time_and_before_others), TEST(a_suspected_job_that_waits_can_be_cancelled),
		TEST(a_job_that_gets_further_is_not_suspected_any_more), TEST(a_job_a_process_died_of_twice_has_failed),
		TEST(parked_jobs_can_be_cancelled), TEST(an_accepted_cancel_outlives_the_process),
		TEST(a_folder_that_cannot_be_synced_loses_no_job), TEST(a_checkpoint_that_does_not_fit_is_let_go),
		TEST(jobs_that_fit_no_memory_are_refused_and_counted), TEST(a_job_that_waits_for_memory_is_no_refusal),
		TEST(jobs_stopped_by_their_time_are_counted_and_say_how_far_they_came), TEST(a_key_that_is_being_taken_may_be_asked_for_again),
		TEST(what_cannot_expire_is_what_it_was), TEST(files_make_room_for_the_record),
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
