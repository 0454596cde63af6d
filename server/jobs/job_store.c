#include "server/jobs/job_store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static const char *const suffixes[GNPD_JOB_FILES] = {".job", ".body", ".checkpoint", ".result"};
static const char temporary_prefix[] = "gnpd-jobs.", young_prefix[] = "gnpd-jobs-new.";

/* Seconds in which a temporary folder that has no lock yet is somebody's who makes it. */
enum { YOUNG = 60 };

void gnpd_job_store_name(const char *id, enum gnpd_job_file file, char name[GNPD_JOB_FILE_NAME])
{
	snprintf(name, GNPD_JOB_FILE_NAME, "%s%s", id, suffixes[file]);
}

bool gnpd_job_store_parse_name(const char *name, char id[GNPD_JOB_ID + 1], enum gnpd_job_file *file)
{
	if (strlen(name) < GNPD_JOB_ID)
		return false;
	memcpy(id, name, GNPD_JOB_ID);
	id[GNPD_JOB_ID] = '\0';
	for (int f = 0; f < GNPD_JOB_FILES; f++) {
		if (strcmp(name + GNPD_JOB_ID, suffixes[f]) == 0) {
			*file = (enum gnpd_job_file)f;
			return gnpd_job_id_valid(id);
		}
	}
	return false;
}

/* ---- Opening ---- */

gnp_status gnpd_job_store_fault(const char *path, int number, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_IO, "jobs-dir: %s: %s", path, strerror(number));
}

gnp_status gnpd_job_store_check_folder(const char *path, struct gnp_error *error)
{
	struct stat information;
	if (stat(path, &information) != 0)
		return gnpd_job_store_fault(path, errno, error);
	if (!S_ISDIR(information.st_mode))
		return gnpd_job_store_fault(path, ENOTDIR, error);
	return access(path, R_OK | W_OK | X_OK) == 0 ? GNP_OK : gnpd_job_store_fault(path, errno, error);
}

/* Takes the lock of the folder; -1 with errno EWOULDBLOCK when another has it. */
static int take_lock(int folder)
{
	char text[32];
	int fd = openat(folder, GNPD_JOB_LOCK, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
	if (fd < 0)
		return -1;
	if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
		int number = errno;
		close(fd);
		errno = number;
		return -1;
	}
	int length = snprintf(text, sizeof text, "%ld\n", (long)getpid());
	if (ftruncate(fd, 0) != 0 || write(fd, text, (size_t)length) != length) {
		int number = errno ? errno : ENOSPC;
		close(fd);
		errno = number;
		return -1;
	}
	return fd;
}

static gnp_status open_folder(const char *path, bool durable, struct gnpd_job_store *store, struct gnp_error *error)
{
	int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (folder < 0)
		return gnpd_job_store_fault(path, errno, error);
	int lock = take_lock(folder);
	if (lock < 0) {
		int number = errno;
		close(folder);
		if (number == EWOULDBLOCK)
			return gnp_error_set(error, GNP_IO, "jobs-dir: %s: another gnpd uses it (%s/%s has its process id)", path,
			                     path, GNPD_JOB_LOCK);
		return gnpd_job_store_fault(path, number, error);
	}
	gnpd_disk_init(&store->disk, folder, durable);
	store->lock = lock;
	store->temporary = !durable;
	snprintf(store->path, sizeof store->path, "%s", path);
	return GNP_OK;
}

/* ---- Temporary folders ---- */

DIR *gnpd_job_store_list(int folder)
{
	int copy = openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	DIR *directory = copy >= 0 ? fdopendir(copy) : NULL;
	if (!directory && copy >= 0) {
		int number = errno;
		close(copy);
		errno = number;
	}
	return directory;
}

/* The lock last: what has none is never touched, so it stays where the others cannot be found. */
static void remove_files(int folder)
{
	DIR *directory = gnpd_job_store_list(folder);
	if (!directory)
		return;
	for (struct dirent *entry; (entry = readdir(directory));)
		if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0 &&
		    strcmp(entry->d_name, GNPD_JOB_LOCK) != 0)
			unlinkat(folder, entry->d_name, 0);
	closedir(directory);
	unlinkat(folder, GNPD_JOB_LOCK, 0);
}

/* One that a killed process left: ours, unchanged for so many seconds, and nobody has its lock. */
static void remove_if_left(const char *parent, const char *name, int seconds)
{
	char path[1024];
	struct stat information;
	if (snprintf(path, sizeof path, "%s/%s", parent, name) >= (int)sizeof path)
		return;
	int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
	if (folder < 0)
		return;
	if (fstat(folder, &information) == 0 && information.st_uid == geteuid() && time(NULL) - information.st_mtime >= seconds) {
		int lock = openat(folder, GNPD_JOB_LOCK, O_RDWR | O_CLOEXEC | O_NOFOLLOW);
		if (lock >= 0 && flock(lock, LOCK_EX | LOCK_NB) == 0) {
			remove_files(folder);
			rmdir(path);
		}
		else if (lock < 0 && seconds)
			rmdir(path); /* killed before it had one: where it is empty */
		if (lock >= 0)
			close(lock);
	}
	close(folder);
}

static void remove_left(const char *parent)
{
	DIR *directory = opendir(parent);
	for (struct dirent *entry; directory && (entry = readdir(directory));) {
		if (strncmp(entry->d_name, temporary_prefix, sizeof temporary_prefix - 1) == 0)
			remove_if_left(parent, entry->d_name, 0); /* its process had the lock before it got this name */
		else if (strncmp(entry->d_name, young_prefix, sizeof young_prefix - 1) == 0)
			remove_if_left(parent, entry->d_name, YOUNG);
	}
	if (directory)
		closedir(directory);
}

/* Gets its name once it is locked, so that nobody takes it for one that was left. */
static gnp_status open_temporary(struct gnpd_job_store *store, struct gnp_error *error)
{
	const char *parent = getenv("TMPDIR");
	char young[1024], path[1024], chance[7] = "";
	memset(chance, 'X', sizeof chance - 1); /* what mkdtemp replaces */
	if (!parent || !*parent)
		parent = "/tmp";
	if (snprintf(young, sizeof young, "%s/%s%s", parent, young_prefix, chance) >= (int)sizeof young)
		return gnpd_job_store_fault(parent, ENAMETOOLONG, error);
	remove_left(parent);
	if (!mkdtemp(young))
		return gnpd_job_store_fault(young, errno, error);
	snprintf(path, sizeof path, "%s/%s%s", parent, temporary_prefix, young + strlen(young) - strlen(chance));
	gnp_status status = open_folder(young, false, store, error);
	if (status != GNP_OK) {
		rmdir(young);
	} else if (rename(young, path) != 0) {
		status = gnpd_job_store_fault(path, errno, error);
		gnpd_job_store_close(store);
	} else {
		snprintf(store->path, sizeof store->path, "%s", path);
	}
	return status;
}

gnp_status gnpd_job_store_open(const char *path, struct gnpd_job_store *store, struct gnp_error *error)
{
	if (!*path)
		return open_temporary(store, error);
	gnp_status status = gnpd_job_store_check_folder(path, error);
	return status == GNP_OK ? open_folder(path, true, store, error) : status;
}

void gnpd_job_store_close(struct gnpd_job_store *store)
{
	if (!*store->path)
		return;
	if (store->temporary) {
		remove_files(store->disk.folder);
		rmdir(store->path);
	}
	close(store->lock);
	close(store->disk.folder);
	memset(store, 0, sizeof *store);
}

/* ---- Files of a job ---- */

gnp_status gnpd_job_store_put(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, const struct gnp_piece *pieces,
                              size_t count, struct gnp_error *error)
{
	char name[GNPD_JOB_FILE_NAME];
	gnpd_job_store_name(id, file, name);
	return gnpd_disk_put(&store->disk, name, pieces, count, error);
}

gnp_status gnpd_job_store_put_record(struct gnpd_job_store *store, const struct gnpd_job_record *record, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	gnp_status status = gnpd_job_record_write(record, &text, error);
	if (status == GNP_OK)
		status = gnpd_job_store_put(store, record->id, GNPD_JOB_RECORD_FILE, &(struct gnp_piece){text.data, text.size}, 1, error);
	gnp_buffer_clear(&text);
	return status;
}

gnp_status gnpd_job_store_get(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, size_t most,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	char name[GNPD_JOB_FILE_NAME];
	gnpd_job_store_name(id, file, name);
	return gnpd_disk_get(&store->disk, name, most, buffer, error);
}

int gnpd_job_store_open_file(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, size_t *size)
{
	char name[GNPD_JOB_FILE_NAME];
	gnpd_job_store_name(id, file, name);
	return gnpd_disk_open(&store->disk, name, size);
}

gnp_status gnpd_job_store_remove(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, struct gnp_error *error)
{
	char name[GNPD_JOB_FILE_NAME];
	gnpd_job_store_name(id, file, name);
	return gnpd_disk_remove(&store->disk, name, error);
}
