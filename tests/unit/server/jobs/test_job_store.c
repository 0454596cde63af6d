/* The folder of jobs: files whole or not at all whatever the disk does, one daemon at a time, and what a scan makes of what a process
 * that was killed left behind. */
#include "tests/unit/test.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "server/base/log.h"
#include "server/jobs/job_store_scan.h"

static char folder[64];
static struct gnpd_log log_;

static const char ID[] = "066121009272871a8efb27b8507d8c", OTHER[] = "066121009272881a8efb27b8507d8c";

static void open_fresh(struct gnpd_job_store *store)
{
	strcpy(folder, "/tmp/gnpd-test.XXXXXX");
	CHECK(mkdtemp(folder) != NULL);
	CHECK(gnpd_job_store_open(folder, store, NULL) == GNP_OK);
}

static void close_and_remove(struct gnpd_job_store *store)
{
	char command[128];
	gnpd_job_store_close(store);
	snprintf(command, sizeof command, "rm -r %s", folder);
	CHECK(system(command) == 0);
}

static bool is_there(const char *name)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	return access(path, F_OK) == 0;
}

static bool has(const char *id, const char *suffix)
{
	char name[128];
	snprintf(name, sizeof name, "%s%s", id, suffix);
	return is_there(name);
}

/* Of the record: another one when it is written anew. */
static ino_t inode(const char *id)
{
	char path[256];
	struct stat information = {0};
	snprintf(path, sizeof path, "%s/%s.job", folder, id);
	CHECK(stat(path, &information) == 0);
	return information.st_ino;
}

static void put_file(const char *id, const char *suffix, const char *text)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s%s", folder, id, suffix);
	FILE *file = fopen(path, "w");
	CHECK(file && fputs(text, file) >= 0 && fclose(file) == 0);
}

static struct gnpd_job_record record_of(const char *id, enum gnpd_job_state state)
{
	struct gnpd_job_record record = {.state = state, .body_bytes = 4, .created = 1, .result_bytes = 6};
	strcpy(record.id, id);
	strcpy(record.operation, "estimate");
	strcpy(record.codec, "file");
	strcpy(record.fingerprint, "f");
	if (gnpd_job_state_is_final(state)) {
		record.finished = 2;
		strcpy(record.result_type, "application/ply");
		strcpy(record.result_hash, "h");
	}
	return record;
}

static void put(struct gnpd_job_store *store, const char *id, enum gnpd_job_state state)
{
	struct gnpd_job_record record = record_of(id, state);
	CHECK(gnpd_job_store_put_record(store, &record, NULL) == GNP_OK);
}

static struct gnpd_job_found scanned(struct gnpd_job_store *store)
{
	struct gnpd_job_found found = {0};
	CHECK(gnpd_job_store_scan(store, &log_, &found, NULL) == GNP_OK);
	return found;
}

static void forget(struct gnpd_job_found *found)
{
	for (size_t i = 0; i < found->count; i++)
		gnpd_job_record_clear(&found->records[i]);
	free(found->records);
}

/* ---- A disk that fails: after `good` bytes, with `number`; errno 0: it takes no more bytes and gives no reason ---- */

static size_t good_bytes;
static int failure, syncs, good_syncs;

static ssize_t failing_write(int fd, const void *data, size_t size)
{
	size_t most = size < 3 ? size : 3; /* short writes on the way */
	if (good_bytes == 0) {
		errno = failure;
		return failure ? -1 : 0;
	}
	most = most < good_bytes ? most : good_bytes;
	good_bytes -= most;
	return write(fd, data, most);
}

static int failing_sync(int fd)
{
	(void)fd;
	errno = EIO;
	return syncs++ < good_syncs ? 0 : -1;
}

static gnp_status put_text(struct gnpd_job_store *store, const char *text, struct gnp_error *error)
{
	const struct gnp_piece pieces[] = {{text, 2}, {text + 2, strlen(text) - 2}};
	return gnpd_job_store_put(store, ID, GNPD_JOB_RESULT_FILE, pieces, 2, error);
}

static void check_content(struct gnpd_job_store *store, const char *text)
{
	struct gnp_buffer buffer = {0};
	CHECK(gnpd_job_store_get(store, ID, GNPD_JOB_RESULT_FILE, 100, &buffer, NULL) == GNP_OK);
	CHECK(buffer.size == strlen(text) && memcmp(buffer.data, text, buffer.size) == 0);
	gnp_buffer_clear(&buffer);
}

static void a_failing_write_leaves_what_was_there(void)
{
	static const struct {
		int number;
		gnp_status status;
	} faults[] = {{ENOSPC, GNP_NO_SPACE}, {EDQUOT, GNP_NO_SPACE}, {EFBIG, GNP_NO_SPACE}, {EIO, GNP_STORAGE}, {0, GNP_NO_SPACE}};
	struct gnpd_job_store store;
	open_fresh(&store);
	CHECK(put_text(&store, "first one", NULL) == GNP_OK);
	for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
		for (size_t good = 0; good < 10; good++) {
			struct gnp_error error = {0};
			failure = faults[i].number;
			good_bytes = good;
			store.disk.write = failing_write;
			CHECK(put_text(&store, "second one", &error) == faults[i].status);
			CHECK_CONTAINS(error.text, ".result: ");
			CHECK_CONTAINS(error.text, "jobs-dir");
			CHECK(!has(ID, ".result.new"));
			check_content(&store, "first one");
		}
	}
	good_bytes = 10;
	CHECK(put_text(&store, "second one", NULL) == GNP_OK); /* in short writes */
	check_content(&store, "second one");
	close_and_remove(&store);
}

/* A file that replaced another was removed when the folder could not be synced, and then there was neither: a record went with its job. */
static void what_cannot_be_synced_is_not_there_but_in_place_of_another(void)
{
	struct gnpd_job_store store;
	open_fresh(&store);
	CHECK(put_text(&store, "first one", NULL) == GNP_OK);
	store.disk.sync = failing_sync;
	syncs = good_syncs = 0;
	CHECK(put_text(&store, "second one", NULL) == GNP_STORAGE);
	check_content(&store, "first one");
	CHECK(!has(ID, ".result.new"));
	syncs = 0;
	good_syncs = 1; /* the file's; the folder's fails */
	CHECK(put_text(&store, "second one", NULL) == GNP_STORAGE);
	check_content(&store, "second one");
	CHECK(!has(ID, ".result.new"));
	CHECK(gnpd_job_store_remove(&store, ID, GNPD_JOB_RESULT_FILE, NULL) == GNP_STORAGE && !has(ID, ".result"));
	syncs = 0;
	CHECK(put_text(&store, "a new one", NULL) == GNP_STORAGE);
	CHECK(!has(ID, ".result") && !has(ID, ".result.new"));
	close_and_remove(&store);
}

static void one_daemon_at_a_time(void)
{
	struct gnpd_job_store store, second;
	struct gnp_error error = {0};
	open_fresh(&store);
	CHECK(gnpd_job_store_open(folder, &second, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "another gnpd uses it");
	CHECK_CONTAINS(error.text, folder);
	gnpd_job_store_close(&store);
	CHECK(gnpd_job_store_open(folder, &store, NULL) == GNP_OK);
	close_and_remove(&store);
}

static void folders_that_will_not_do_are_refused(void)
{
	struct gnpd_job_store store;
	struct gnp_error error = {0};
	CHECK(gnpd_job_store_open("/nowhere/at/all", &store, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "jobs-dir: /nowhere/at/all: No such file");
	error = (struct gnp_error){0};
	CHECK(gnpd_job_store_open("/proc/self/status", &store, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "Not a directory");
	error = (struct gnp_error){0};
	CHECK(gnpd_job_store_open("/proc/self", &store, &error) == GNP_IO); /* nobody may write there, root included */
	CHECK_CONTAINS(error.text, "jobs-dir: /proc/self: ");
}

static void temporary_folders_go_with_the_process(void)
{
	struct gnpd_job_store store;
	char path[1024];
	CHECK(gnpd_job_store_open("", &store, NULL) == GNP_OK);
	strcpy(path, store.path);
	CHECK(put_text(&store, "something", NULL) == GNP_OK && access(path, F_OK) == 0);
	gnpd_job_store_close(&store);
	CHECK(access(path, F_OK) != 0);
}

/* A folder that a killed process had left was taken away by starts that came more than a minute later, which may be none. */
static void temporary_folders_of_killed_processes_are_removed(void)
{
	struct gnpd_job_store store, second;
	char old[256] = "", link[256], elsewhere[256], left[1024];
	strcpy(folder, "/tmp/gnpd-test.XXXXXX");
	CHECK(mkdtemp(folder) != NULL);
	if (getenv("TMPDIR"))
		snprintf(old, sizeof old, "%s", getenv("TMPDIR"));
	setenv("TMPDIR", folder, 1);
	CHECK(gnpd_job_store_open("", &store, NULL) == GNP_OK); /* killed: nothing of it is removed and the lock is gone */
	CHECK(put_text(&store, "something", NULL) == GNP_OK);
	strcpy(left, store.path);
	close(store.lock);
	close(store.disk.folder);
	snprintf(elsewhere, sizeof elsewhere, "%s/elsewhere", folder);
	snprintf(link, sizeof link, "%s/gnpd-jobs.link", folder);
	CHECK(mkdir(elsewhere, 0700) == 0 && symlink(elsewhere, link) == 0);
	put_file("elsewhere/lock", "", "");
	CHECK(gnpd_job_store_open("", &store, NULL) == GNP_OK && gnpd_job_store_open("", &second, NULL) == GNP_OK);
	CHECK(access(left, F_OK) != 0);
	CHECK(access(store.path, F_OK) == 0 && access(second.path, F_OK) == 0 && strcmp(store.path, second.path) != 0);
	CHECK(is_there("elsewhere/lock"));
	gnpd_job_store_close(&second);
	if (*old)
		setenv("TMPDIR", old, 1);
	else
		unsetenv("TMPDIR");
	close_and_remove(&store);
}

static void make_young(const char *name, int age, bool lock)
{
	char path[256];
	struct timespec times[2] = {{.tv_sec = time(NULL) - age}, {.tv_sec = time(NULL) - age}};
	snprintf(path, sizeof path, "%s/%s", folder, name);
	CHECK(mkdir(path, 0700) == 0);
	if (lock)
		put_file(name, "/lock", "1\n");
	CHECK(utimensat(AT_FDCWD, path, times, 0) == 0);
}

/* One of a process killed before the folder had its name stayed for ever. */
static void half_made_temporary_folders_are_removed_after_a_while(void)
{
	static const char *const names[] = {"gnpd-jobs-new.oldold", "gnpd-jobs-new.empty1", "gnpd-jobs-new.young1", "gnpd-jobs-new.locked"};
	struct gnpd_job_store store;
	char old[256] = "", path[256];
	strcpy(folder, "/tmp/gnpd-test.XXXXXX");
	CHECK(mkdtemp(folder) != NULL);
	if (getenv("TMPDIR"))
		snprintf(old, sizeof old, "%s", getenv("TMPDIR"));
	setenv("TMPDIR", folder, 1);
	for (int i = 0; i < 4; i++)
		make_young(names[i], i == 2 ? 10 : 100, i != 1);
	snprintf(path, sizeof path, "%s/%s/lock", folder, names[3]);
	int fd = open(path, O_RDWR);
	CHECK(fd >= 0 && flock(fd, LOCK_EX) == 0);
	CHECK(gnpd_job_store_open("", &store, NULL) == GNP_OK);
	CHECK(!is_there(names[0]) && !is_there(names[1]) && is_there(names[2]) && is_there(names[3]));
	close(fd);
	if (*old)
		setenv("TMPDIR", old, 1);
	else
		unsetenv("TMPDIR");
	close_and_remove(&store);
}

/* Its lock was removed and the rest was not: no later start touched what was left. */
static void a_temporary_folder_that_cannot_be_emptied_keeps_its_lock(void)
{
	struct gnpd_job_store store;
	struct rlimit limit, none;
	char path[1024];
	CHECK(gnpd_job_store_open("", &store, NULL) == GNP_OK && put_text(&store, "something", NULL) == GNP_OK);
	snprintf(folder, sizeof folder, "%.63s", store.path);
	CHECK_STRING(folder, store.path);
	CHECK(getrlimit(RLIMIT_NOFILE, &limit) == 0);
	none = limit;
	none.rlim_cur = 0;
	CHECK(setrlimit(RLIMIT_NOFILE, &none) == 0);
	gnpd_job_store_close(&store);
	CHECK(setrlimit(RLIMIT_NOFILE, &limit) == 0);
	CHECK(is_there("lock") && has(ID, ".result"));
	snprintf(path, sizeof path, "rm -r %s", folder);
	CHECK(system(path) == 0);
}

/* ---- Scans ---- */

static void jobs_are_found_in_order(void)
{
	struct gnpd_job_store store;
	open_fresh(&store);
	put(&store, OTHER, GNPD_JOB_RUNNING);
	put(&store, ID, GNPD_JOB_SUCCEEDED);
	put_file(OTHER, ".body", "four");
	put_file(OTHER, ".checkpoint", "c");
	put_file(ID, ".result", "sixsix");
	put_file(ID, ".body", "four"); /* its job is over: of no use any more */
	struct gnpd_job_found found = scanned(&store);
	CHECK(found.count == 2 && found.damaged == 0);
	CHECK_STRING(found.records[0].id, ID);
	CHECK_STRING(found.records[1].id, OTHER);
	CHECK(found.records[0].state == GNPD_JOB_SUCCEEDED && found.records[1].state == GNPD_JOB_RUNNING);
	CHECK(has(OTHER, ".body") && has(OTHER, ".checkpoint") && has(ID, ".result") && !has(ID, ".body"));
	forget(&found);
	close_and_remove(&store);
}

static void half_files_and_orphans_are_removed(void)
{
	struct gnpd_job_store store;
	open_fresh(&store);
	put_file(ID, ".job.new", "half a rec");
	put_file(ID, ".body", "no record: it was never acknowledged");
	put_file(OTHER, ".result.new", "half");
	put_file("notes", ".txt", "somebody's");
	put_file("notes.txt", ".new", "somebody's as well: it was removed as a half of ours");
	struct gnpd_job_found found = scanned(&store);
	CHECK(found.count == 0 && found.damaged == 0);
	CHECK(!has(ID, ".job.new") && !has(ID, ".body") && !has(OTHER, ".result.new"));
	CHECK(is_there("notes.txt") && is_there("notes.txt.new") && is_there("lock"));
	forget(&found);
	close_and_remove(&store);
}

static void damaged_records_are_set_aside(void)
{
	struct gnpd_job_store store;
	open_fresh(&store);
	put_file(ID, ".job", "gnpd-job 1 nonsense\n");
	put_file(ID, ".body", "four");
	put_file(OTHER, ".job", "");
	for (int scan = 0; scan < 2; scan++) {
		struct gnpd_job_found found = scanned(&store);
		CHECK(found.count == 0 && found.damaged == (scan ? 0 : 2));
		CHECK(!has(ID, ".job") && has(ID, ".job.damaged") && has(ID, ".body.damaged") && has(OTHER, ".job.damaged"));
		forget(&found);
	}
	close_and_remove(&store);
}

/* A record under another job's name would let one job be taken for the other. */
/* Its body was removed as that of no job, and nobody heard of it. */
static void what_cannot_be_set_aside_stays(void)
{
	struct gnpd_job_store store;
	open_fresh(&store);
	put_file(ID, ".job", "gnpd-job 1 nonsense\n");
	put_file(ID, ".body", "four");
	char aside[256];
	snprintf(aside, sizeof aside, "%s/%s.body.damaged", folder, ID);
	CHECK(mkdir(aside, 0700) == 0); /* a file cannot take its place */
	struct gnpd_job_found found = scanned(&store);
	CHECK(found.count == 0 && found.damaged == 1 && has(ID, ".job.damaged") && has(ID, ".body"));
	forget(&found);
	CHECK(rmdir(aside) == 0);
	close_and_remove(&store);
}

static void a_record_under_another_name_is_damaged(void)
{
	char from[256], to[256];
	struct gnpd_job_store store;
	open_fresh(&store);
	put(&store, ID, GNPD_JOB_CANCELLED);
	snprintf(from, sizeof from, "%s/%s.job", folder, ID);
	snprintf(to, sizeof to, "%s/%s.job", folder, OTHER);
	CHECK(rename(from, to) == 0);
	struct gnpd_job_found found = scanned(&store);
	CHECK(found.count == 0 && found.damaged == 1);
	forget(&found);
	close_and_remove(&store);
}

static void jobs_without_their_files_have_failed(void)
{
	struct gnpd_job_store store;
	open_fresh(&store);
	put(&store, ID, GNPD_JOB_QUEUED); /* no body */
	put(&store, OTHER, GNPD_JOB_SUCCEEDED);
	put_file(OTHER, ".result", "six"); /* half of it */
	struct gnpd_job_found found = scanned(&store);
	CHECK(found.count == 2);
	for (size_t i = 0; i < found.count; i++) {
		CHECK(found.records[i].state == GNPD_JOB_FAILED && found.records[i].error == GNP_STORAGE && found.records[i].finished > 0);
		CHECK_CONTAINS(found.records[i].error_text, i ? "result was not there whole" : "body was not there whole");
		CHECK(!*found.records[i].result_hash && !*found.records[i].result_type && !found.records[i].result_bytes); /* it had the lost one's */
	}
	CHECK(!has(OTHER, ".result"));
	forget(&found);
	struct gnp_buffer text = {0};
	CHECK(gnpd_job_store_get(&store, OTHER, GNPD_JOB_RECORD_FILE, 10000, &text, NULL) == GNP_OK && gnp_buffer_append(&text, "", 1, NULL) == GNP_OK);
	CHECK_CONTAINS((const char *)text.data, "\nstate failed\n");
	gnp_buffer_clear(&text);
	ino_t before[] = {inode(ID), inode(OTHER)};
	found = scanned(&store); /* the next start rewrites nothing */
	CHECK(found.count == 2 && found.records[0].state == GNPD_JOB_FAILED && found.records[1].state == GNPD_JOB_FAILED);
	CHECK(inode(ID) == before[0] && inode(OTHER) == before[1]);
	forget(&found);
	close_and_remove(&store);
}

/* ---- A disk that does not answer while it is scanned ---- */

static const char *unopened; /* part of the name */
static int open_failure = EMFILE;

static int failing_open(int folder_, const char *name, int flags, ...)
{
	if (!strstr(name, unopened))
		return openat(folder_, name, flags);
	errno = open_failure;
	return -1;
}

static struct dirent *failing_next(DIR *directory)
{
	struct dirent *entry;
	do
		entry = readdir(directory);
	while (entry && strstr(entry->d_name, ".job"));
	errno = entry ? errno : EIO;
	return entry;
}

/* Too many open files at the start, or a folder that could not be read to its end, and jobs had failed for good and their bodies were
 * gone. */
static void what_cannot_be_read_is_no_damage(void)
{
	static const char *const names[] = {".body", ".result", ".job", NULL};
	struct gnpd_job_store store;
	open_fresh(&store);
	put(&store, ID, GNPD_JOB_QUEUED);
	put_file(ID, ".body", "four");
	put(&store, OTHER, GNPD_JOB_SUCCEEDED);
	put_file(OTHER, ".result", "sixsix");
	for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
		struct gnpd_job_found found = {0};
		struct gnp_error error = {0};
		unopened = names[i];
		if (unopened)
			store.disk.open = failing_open;
		else
			store.disk.next = failing_next;
		gnp_status status = gnpd_job_store_scan(&store, &log_, &found, &error);
		CHECK(status == GNP_IO || status == GNP_STORAGE);
		CHECK_CONTAINS(error.text, unopened ? "Too many open files" : "Input/output error");
		CHECK_CONTAINS(error.text, "jobs-dir");
		CHECK(!found.records);
		gnpd_disk_init(&store.disk, store.disk.folder, true);
	}
	CHECK(has(ID, ".job") && has(ID, ".body") && has(OTHER, ".job") && has(OTHER, ".result"));
	struct gnpd_job_found found = scanned(&store);
	CHECK(found.count == 2 && found.records[0].state == GNPD_JOB_QUEUED && found.records[1].state == GNPD_JOB_SUCCEEDED);
	forget(&found);
	close_and_remove(&store);
}

/* Damaged records had been set aside and failed ones written by a start that one later file refused. */
static void a_refused_start_changes_nothing(void)
{
	static const char MIDDLE[] = "066121009272877a8efb27b8507d8c";
	struct gnpd_job_store store;
	struct gnpd_job_found found = {0};
	struct gnp_error error = {0};
	char name[256];
	open_fresh(&store);
	put_file(ID, ".job", "gnpd-job 1 nonsense\n");
	put(&store, MIDDLE, GNPD_JOB_QUEUED); /* no body */
	put_file(MIDDLE, ".result.new", "half");
	put(&store, OTHER, GNPD_JOB_CANCELLED);
	ino_t before = inode(MIDDLE);
	unopened = OTHER;
	open_failure = EACCES;
	store.disk.open = failing_open;
	CHECK(gnpd_job_store_scan(&store, &log_, &found, &error) == GNP_IO);
	snprintf(name, sizeof name, "jobs-dir: %s/%s.job cannot be read: Permission denied; make it readable", folder, OTHER);
	CHECK_CONTAINS(error.text, name);
	CHECK_CONTAINS(error.text, "or move it away with the other files of that job");
	CHECK(has(ID, ".job") && !has(ID, ".job.damaged") && inode(MIDDLE) == before && has(MIDDLE, ".result.new"));
	store.disk.open = openat;
	found = scanned(&store);
	CHECK(found.count == 2 && found.damaged == 1 && has(ID, ".job.damaged") && inode(MIDDLE) != before && !has(MIDDLE, ".result.new"));
	forget(&found);
	open_failure = EMFILE;
	close_and_remove(&store);
}

static void put_socket(const char *id, const char *suffix)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	int fd = socket(AF_UNIX, SOCK_STREAM, 0);
	CHECK(snprintf(address.sun_path, sizeof address.sun_path, "%s/%s%s", folder, id, suffix) < (int)sizeof address.sun_path);
	CHECK(fd >= 0 && bind(fd, (struct sockaddr *)&address, sizeof address) == 0);
	close(fd);
}

/* It kept the daemon from its start. */
static void a_socket_is_no_file_of_a_job(void)
{
	struct gnpd_job_store store;
	open_fresh(&store);
	put_socket(ID, ".job");
	put(&store, OTHER, GNPD_JOB_QUEUED);
	put_socket(OTHER, ".body");
	struct gnpd_job_found found = scanned(&store);
	CHECK(found.damaged == 1 && found.count == 1 && found.records[0].state == GNPD_JOB_FAILED);
	forget(&found);
	close_and_remove(&store);
}

/* It said that the configuration was good, and the start was refused. */
static void a_check_finds_what_a_start_would(void)
{
	static const char *const unreadables[] = {".job", ".body"};
	uid_t user = geteuid();
	struct gnpd_job_store store;
	struct gnp_error error = {0};
	char path[256];
	open_fresh(&store);
	put_file(OTHER, ".job", "gnpd-job 1 nonsense\n");
	put(&store, ID, GNPD_JOB_QUEUED);
	put_file(ID, ".body", "four");
	CHECK(gnpd_job_store_check(folder, NULL) == GNP_OK && has(OTHER, ".job")); /* also while a daemon has it */
	CHECK(chmod(folder, 0777) == 0);
	for (size_t i = 0; i < 2; i++) {
		snprintf(path, sizeof path, "%s/%s%s", folder, ID, unreadables[i]);
		CHECK(chmod(path, 0) == 0 && (user || seteuid(65534) == 0));
		gnp_status status = gnpd_job_store_check(folder, &error);
		CHECK((user || seteuid(0) == 0) && chmod(path, 0644) == 0);
		snprintf(path, sizeof path, "%s/%s%s cannot be read: Permission denied", folder, ID, unreadables[i]);
		CHECK(status == GNP_IO);
		CHECK_CONTAINS(error.text, path);
		error = (struct gnp_error){0};
		snprintf(path, sizeof path, "%s/%s.job", folder, OTHER);
		CHECK(chmod(path, 0644) == 0);
	}
	close_and_remove(&store);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(a_failing_write_leaves_what_was_there),   TEST(what_cannot_be_synced_is_not_there_but_in_place_of_another),
		TEST(one_daemon_at_a_time),                    TEST(folders_that_will_not_do_are_refused),
		TEST(temporary_folders_go_with_the_process),   TEST(jobs_are_found_in_order),
		TEST(half_files_and_orphans_are_removed),      TEST(damaged_records_are_set_aside), TEST(what_cannot_be_set_aside_stays),
		TEST(a_record_under_another_name_is_damaged),  TEST(jobs_without_their_files_have_failed),
		TEST(a_refused_start_changes_nothing),         TEST(a_socket_is_no_file_of_a_job),
		TEST(a_check_finds_what_a_start_would),        TEST(half_made_temporary_folders_are_removed_after_a_while),
		TEST(a_temporary_folder_that_cannot_be_emptied_keeps_its_lock),
		TEST(what_cannot_be_read_is_no_damage),        TEST(temporary_folders_of_killed_processes_are_removed),
	};
	int nowhere = open("/dev/null", O_WRONLY);
	gnpd_log_init(&log_, GNPD_LOG_TEXT, GNPD_LOG_ERROR, nowhere);
	int status = RUN_TESTS(tests);
	gnpd_log_fini(&log_);
	close(nowhere);
	return status;
}
