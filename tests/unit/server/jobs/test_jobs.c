/* The table of jobs without HTTP: whose they are, and what a disk that fails at any write makes of them. */
#include "proto/operation/operations.h"
#include "tests/unit/server/jobs/jobs_fixture.h"

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
		CHECK(gnpd_jobs_find(table, strangers[i], id, &other, &error) == GNP_NOT_FOUND);
		CHECK_CONTAINS(error.text, "job: there is no");
	}
	CHECK(gnpd_jobs_find(table, "ann", id, &other, NULL) == GNP_OK && other == job);
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
		table->store.disk.write = limited_write;
		CHECK(submit("", "key", &job, &existing, &error) == GNP_NO_SPACE);
		CHECK_CONTAINS(error.text, "No space left");
		CHECK(listed("") == 0 && table->bytes == 0 && files_with("") == 1);
		table->store.disk.write = write;
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
		table->store.disk.write = limited_write;
		job = submitted("", NULL, false);
		struct gnpd_job_view view = ended(job);
		CHECK(view.record.state == GNPD_JOB_FAILED && view.record.error == GNP_NO_SPACE);
		CHECK_CONTAINS(view.record.error_text, "No space left");
		strcpy(id, view.record.id);
		gnpd_job_release(job);
		close_jobs();
		CHECK(files_with(".new") == 0 && files_with(".result") == 0 && files_with(".job") == 1);
		open_jobs();
		CHECK(gnpd_jobs_find(table, "", id, &job, NULL) == GNP_OK);
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
	if (gnpd_jobs_find(table, "", id, &job, NULL) != GNP_OK)
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

/* The thread of job_expiry tried the first of them for ever, as fast as it could, with a line in the log each time,
 * and never saw that it was to stop. */
static void what_cannot_be_let_go_holds_nothing_up(void)
{
	static const char *const suffixes[] = {".job", ".result"};
	FILE *log = tmpfile();
	int before = events.fd;
	events.fd = fileno(log);
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
	CHECK(lines_of(events.fd) == 2);
	events.fd = before;
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
	int before = events.fd;
	char id[GNPD_JOB_ID + 1], path[GNPD_CONFIG_TEXT + 64];
	events.fd = fileno(log);
	config.jobs_ttl_seconds = 2;
	make_folder();
	open_jobs();
	struct gnpd_job *job = submitted("", NULL, false);
	ended(job);
	copy_id(job, id);
	block(id, ".job");
	wait_for_line(events.fd);
	CHECK(state_of(job) == GNPD_JOB_SUCCEEDED && files_with(".result") == 1);
	snprintf(path, sizeof path, "%s/%s.job", config.jobs_dir, id);
	CHECK(rmdir(path) == 0);
	pthread_mutex_lock(&table->lock);
	job->again = 0; /* half a minute later */
	pthread_mutex_unlock(&table->lock);
	reach(job, GNPD_JOB_EXPIRED);
	CHECK(files_with(".result") == 0 && record_file(id).st_size > 0 && !is_gone(id));
	gnpd_job_release(job);
	close_jobs();
	remove_folder();
	events.fd = before;
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
	table->store.disk.write = write_without_result;
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

/* ---- Ends that are asked for ---- */

/* Until no runner has it any more: else it is the runner that cancels it. */
static void wait_until_parked(struct gnpd_job *job)
{
	bool parked = false;
	for (int i = 0; i < 10000 && !parked; i++) {
		usleep(1000);
		pthread_mutex_lock(&table->lock);
		parked = job->parked;
		pthread_mutex_unlock(&table->lock);
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
	gnpd_jobs_park(table);
	reach(jobs[0], GNPD_JOB_QUEUED);
	for (int i = 0; i < 2; i++) {
		enum gnpd_job_deletion what = GNPD_JOB_WAS_REMOVED;
		wait_until_parked(jobs[i]);
		CHECK(gnpd_jobs_delete(table, jobs[i], &what, NULL) == GNP_OK && what == GNPD_JOB_WAS_CANCELLED);
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
	table->store.disk.write = held_write;
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
	CHECK(gnpd_jobs_delete(table, job, &what, NULL) == GNP_OK && what == GNPD_JOB_IS_BEING_CANCELLED);
	atomic_store(&may_go_on, true);
	reach(job, GNPD_JOB_CANCELLED);
	copy_id(job, id);
	gnpd_job_release(job);
	close_jobs();
	struct stat before = {0};
	for (int start = 0; start < 3; start++) {
		open_jobs();
		job = found(id);
		CHECK(state_of(job) == GNPD_JOB_CANCELLED && table->counts.recovered == 0);
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
	table->store.disk.sync = failing_folder_sync;
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
	gnpd_jobs_count(table, &counts);
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
	pthread_mutex_lock(&table->lock);
	table->gathering = gathering;
	gnpd_jobs_changed(table);
	pthread_mutex_unlock(&table->lock);
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
	gnpd_work_init(&work, &engine, &reply);
	work.operation = gnp_operation_find("estimate");
	work.query = QUICK;
	work.content_type = gnp_format_media_type(&gnp_format_xyz);
	work.content_encoding = "deflate";
	uLongf size = compressBound(cloud.size);
	CHECK(gnp_buffer_reserve(&work.body, size, NULL) == GNP_OK && compress(work.body.data, &size, cloud.data, cloud.size) == Z_OK);
	work.body.size = size;
	CHECK(gnpd_work_check(&work, NULL) == GNP_OK);
	CHECK(gnpd_jobs_submit(table, &work, "", NULL, &job, &existing, NULL) == GNP_OK);
	gnpd_work_clear(&work);
	gnpd_reply_clear(&reply);
	size_t room = config.queue_bytes - size - 1000, counted = atomic_load(&metrics.rejected[GNPD_REJECT_QUEUE_BYTES]);
	CHECK(gnpd_queue_reserve(engine.queue, 0, room, NULL) == GNP_OK);
	set_gathering(false);
	usleep(200000);
	CHECK(!gnpd_job_state_is_final(state_of(job)));
	CHECK(atomic_load(&metrics.rejected[GNPD_REJECT_QUEUE_BYTES]) == counted);
	gnpd_queue_release(engine.queue, room);
	reach(job, GNPD_JOB_SUCCEEDED);
	gnpd_job_release(job);
	close_jobs();
}

/* ---- Time and keys ---- */

static void jobs_stopped_by_their_time_are_counted_and_say_how_far_they_came(void)
{
	uint64_t before = atomic_load(&metrics.cancelled[GNPD_CANCEL_DEADLINE]);
	config.jobs_seconds = 1;
	open_jobs();
	struct gnpd_job *job = long_submitted();
	struct gnpd_job_view view = ended(job);
	CHECK(view.record.error == GNP_DEADLINE);
	CHECK(atomic_load(&metrics.cancelled[GNPD_CANCEL_DEADLINE]) == before + 1);
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
		TEST(parked_jobs_can_be_cancelled), TEST(an_accepted_cancel_outlives_the_process),
		TEST(a_folder_that_cannot_be_synced_loses_no_job), TEST(a_checkpoint_that_does_not_fit_is_let_go),
		TEST(jobs_that_fit_no_memory_are_refused_and_counted), TEST(a_job_that_waits_for_memory_is_no_refusal),
		TEST(jobs_stopped_by_their_time_are_counted_and_say_how_far_they_came), TEST(a_key_that_is_being_taken_may_be_asked_for_again),
		TEST(what_cannot_expire_is_what_it_was), TEST(files_make_room_for_the_record),
		TEST(what_cannot_be_let_go_holds_nothing_up), TEST(a_job_is_not_dropped_for_itself),
	};
	return run_with_jobs(argc, argv, tests, sizeof tests / sizeof *tests);
}
