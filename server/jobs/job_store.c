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

#include "server/base/clock.h"

static const char lock_name[] = "lock", damaged_suffix[] = ".damaged", new_suffix[] = ".new";
static const char *const suffixes[GNPD_JOB_FILES] = {".job", ".body", ".checkpoint", ".result"};
static const char temporary_prefix[] = "gnpd-jobs.", young_prefix[] = "gnpd-jobs-new.";

enum {
	FILE_NAME = GNPD_JOB_ID + 32, RECORD_MOST = 1 << 20, NAME_LENGTH = 256,
	YOUNG = 60 /* seconds in which a temporary folder that has no lock yet is somebody's who makes it */
};

static void file_name(const char *id, enum gnpd_job_file file, char name[FILE_NAME])
{
	snprintf(name, FILE_NAME, "%s%s", id, suffixes[file]);
}

static bool ends_with(const char *name, const char *suffix)
{
	size_t length = strlen(name), size = strlen(suffix);
	return length >= size && strcmp(name + length - size, suffix) == 0;
}

/* ---- Opening ---- */

static gnp_status fault(const char *path, int number, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_IO, "jobs-dir: %s: %s", path, strerror(number));
}

static gnp_status check_folder(const char *path, struct gnp_error *error)
{
	struct stat information;
	if (stat(path, &information) != 0)
		return fault(path, errno, error);
	if (!S_ISDIR(information.st_mode))
		return fault(path, ENOTDIR, error);
	return access(path, R_OK | W_OK | X_OK) == 0 ? GNP_OK : fault(path, errno, error);
}

/* Takes the lock of the folder; -1 with errno EWOULDBLOCK when another has it. */
static int take_lock(int folder)
{
	char text[32];
	int fd = openat(folder, lock_name, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
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
		return fault(path, errno, error);
	int lock = take_lock(folder);
	if (lock < 0) {
		int number = errno;
		close(folder);
		if (number == EWOULDBLOCK)
			return gnp_error_set(error, GNP_IO, "jobs-dir: %s: another gnpd uses it (%s/%s has its process id)", path, path, lock_name);
		return fault(path, number, error);
	}
	gnpd_disk_init(&store->disk, folder, durable);
	store->lock = lock;
	store->temporary = !durable;
	snprintf(store->path, sizeof store->path, "%s", path);
	return GNP_OK;
}

/* ---- Temporary folders ---- */

/* Another stream over the folder's names, or NULL and errno. */
static DIR *open_names(int folder)
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
	DIR *directory = open_names(folder);
	if (!directory)
		return;
	for (struct dirent *entry; (entry = readdir(directory));)
		if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0 && strcmp(entry->d_name, lock_name) != 0)
			unlinkat(folder, entry->d_name, 0);
	closedir(directory);
	unlinkat(folder, lock_name, 0);
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
		int lock = openat(folder, lock_name, O_RDWR | O_CLOEXEC | O_NOFOLLOW);
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
		return fault(parent, ENAMETOOLONG, error);
	remove_left(parent);
	if (!mkdtemp(young))
		return fault(young, errno, error);
	snprintf(path, sizeof path, "%s/%s%s", parent, temporary_prefix, young + strlen(young) - strlen(chance));
	gnp_status status = open_folder(young, false, store, error);
	if (status != GNP_OK) {
		rmdir(young);
	} else if (rename(young, path) != 0) {
		status = fault(path, errno, error);
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
	gnp_status status = check_folder(path, error);
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
	char name[FILE_NAME];
	file_name(id, file, name);
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
	char name[FILE_NAME];
	file_name(id, file, name);
	return gnpd_disk_get(&store->disk, name, most, buffer, error);
}

int gnpd_job_store_open_file(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, size_t *size)
{
	char name[FILE_NAME];
	file_name(id, file, name);
	return gnpd_disk_open(&store->disk, name, size);
}

gnp_status gnpd_job_store_remove(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, struct gnp_error *error)
{
	char name[FILE_NAME];
	file_name(id, file, name);
	return gnpd_disk_remove(&store->disk, name, error);
}

/* ---- Scanning ---- */

struct names {
	size_t count, capacity;
	char (*items)[NAME_LENGTH];
};

static gnp_status add_name(struct names *names, const char *name, struct gnp_error *error)
{
	if (names->count == names->capacity) {
		size_t capacity = names->capacity ? 2 * names->capacity : 64;
		void *items = realloc(names->items, capacity * sizeof *names->items);
		if (!items)
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs-dir: no memory for %zu names", capacity);
		names->items = items;
		names->capacity = capacity;
	}
	snprintf(names->items[names->count++], NAME_LENGTH, "%s", name);
	return GNP_OK;
}

static int compare_names(const void *a, const void *b)
{
	return strcmp(a, b);
}

static gnp_status list_names(const struct gnpd_job_store *store, struct names *names, struct gnp_error *error)
{
	DIR *directory = open_names(store->disk.folder);
	if (!directory)
		return fault(store->path, errno, error);
	gnp_status status = GNP_OK;
	for (;;) {
		errno = 0; /* the end of the folder leaves it so */
		struct dirent *entry = status == GNP_OK ? store->disk.next(directory) : NULL;
		if (!entry)
			break;
		if (entry->d_name[0] != '.')
			status = add_name(names, entry->d_name, error);
	}
	if (status == GNP_OK && errno)
		status = fault(store->path, errno, error);
	closedir(directory);
	if (names->count)
		qsort(names->items, names->count, sizeof *names->items, compare_names);
	return status;
}

/* The id a name begins with, when it is that of a file of a job. */
static bool name_parse(const char *name, char id[GNPD_JOB_ID + 1], enum gnpd_job_file *file)
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

/* One that could be whole keeps the daemon from its start: a person is to say what becomes of it. */
static gnp_status unreadable(const struct gnpd_job_store *store, const char *name, int number, struct gnp_error *error)
{
	bool ours = number == EMFILE || number == ENFILE || number == ENOMEM; /* not the file's fault */
	return gnp_error_set(error, GNP_IO, "jobs-dir: %s/%s cannot be read: %s%s", store->path, name, strerror(number),
	                     ours ? "" : "; make it readable for gnpd, or move it away with the other files of that job");
}

/* *there: whether there is such a file, of *size bytes; it can be read then. */
static gnp_status probe(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, bool *there, size_t *size,
                        struct gnp_error *error)
{
	char name[FILE_NAME];
	file_name(id, file, name);
	int fd = gnpd_disk_open(&store->disk, name, size);
	*there = fd >= 0;
	if (fd < 0 && errno != ENOENT)
		return unreadable(store, name, errno, error);
	if (fd >= 0)
		close(fd);
	return GNP_OK;
}

/* *record is the caller's; where it is damaged, it is unchanged and *damage says why. */
static gnp_status read_record(struct gnpd_job_store *store, const char *id, struct gnpd_job_record *record, struct gnp_error *damage,
                              struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	struct gnpd_job_record read = {0};
	bool there;
	size_t size;
	gnp_status status = probe(store, id, GNPD_JOB_RECORD_FILE, &there, &size, error);
	if (status != GNP_OK)
		return status;
	status = gnpd_job_store_get(store, id, GNPD_JOB_RECORD_FILE, RECORD_MOST, &text, damage);
	if (status == GNP_OK)
		status = gnpd_job_record_parse((const char *)text.data, text.size, &read, damage);
	gnp_buffer_clear(&text);
	if (status == GNP_OUT_OF_MEMORY || status == GNP_STORAGE) /* it may be read the next time */
		return gnp_error_set(error, status, "jobs-dir: %s: %s", store->path, damage->text);
	if (status == GNP_OK && strcmp(read.id, id) != 0) {
		gnpd_job_record_clear(&read);
		status = gnp_error_set(damage, GNP_INVALID_ARGUMENT, "record: it is that of another job");
	}
	if (status == GNP_OK)
		*record = read;
	return GNP_OK;
}

/* *missing: what of the job's files is not there whole, or NULL. */
static gnp_status check_files(struct gnpd_job_store *store, const struct gnpd_job_record *record, const char **missing,
                              struct gnp_error *error)
{
	bool final = gnpd_job_state_is_final(record->state), there;
	*missing = NULL;
	if ((final && record->state != GNPD_JOB_SUCCEEDED) || record->cancelled)
		return GNP_OK;
	size_t size = 0, wanted = final ? record->result_bytes : record->body_bytes;
	gnp_status status = probe(store, record->id, final ? GNPD_JOB_RESULT_FILE : GNPD_JOB_BODY_FILE, &there, &size, error);
	if (status == GNP_OK && (!there || size != wanted))
		*missing = final ? "result" : "body";
	return status;
}

/* What is read before anything is changed: a start that is refused leaves the folder as it was. */
struct scan {
	struct names names;
	struct gnpd_job_found found;
	const char **missing; /* (found.count), of each record, or NULL */
	struct damage {
		char id[GNPD_JOB_ID + 1];
		struct gnp_error cause;
	} *damages;           /* (found.damaged) */
};

static gnp_status read_job(struct gnpd_job_store *store, const char *id, struct scan *scan, struct gnp_error *error)
{
	struct gnpd_job_found *found = &scan->found;
	struct gnpd_job_record *record = &found->records[found->count];
	struct damage *damage = &scan->damages[found->damaged];
	gnp_status status = read_record(store, id, record, &damage->cause, error);
	if (status != GNP_OK)
		return status;
	if (damage->cause.status != GNP_OK) {
		memcpy(damage->id, id, sizeof damage->id);
		found->damaged++;
		return GNP_OK;
	}
	return check_files(store, record, &scan->missing[found->count++], error);
}

static bool is_record(const char *name, char id[GNPD_JOB_ID + 1])
{
	enum gnpd_job_file file;
	return name_parse(name, id, &file) && file == GNPD_JOB_RECORD_FILE;
}

static gnp_status read_folder(struct gnpd_job_store *store, struct scan *scan, struct gnp_error *error)
{
	char id[GNPD_JOB_ID + 1];
	gnp_status status = list_names(store, &scan->names, error);
	if (status != GNP_OK)
		return status;
	size_t most = scan->names.count + 1;
	scan->found.records = calloc(most, sizeof *scan->found.records);
	scan->missing = calloc(most, sizeof *scan->missing);
	scan->damages = calloc(most, sizeof *scan->damages);
	if (!scan->found.records || !scan->missing || !scan->damages)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs-dir: no memory for %zu records", most);
	for (size_t i = 0; i < scan->names.count && status == GNP_OK; i++)
		if (is_record(scan->names.items[i], id))
			status = read_job(store, id, scan, error);
	return status;
}

/* All but what was found. */
static void free_scan(struct scan *scan)
{
	free(scan->names.items);
	free(scan->missing);
	free(scan->damages);
}

static void free_found(struct gnpd_job_found *found)
{
	for (size_t i = 0; i < found->count; i++)
		gnpd_job_record_clear(&found->records[i]);
	free(found->records);
}

gnp_status gnpd_job_store_check(const char *path, struct gnp_error *error)
{
	struct gnpd_job_store store = {0};
	struct scan scan = {0};
	gnp_status status = check_folder(path, error);
	if (status != GNP_OK)
		return status;
	int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (folder < 0)
		return fault(path, errno, error);
	gnpd_disk_init(&store.disk, folder, true);
	snprintf(store.path, sizeof store.path, "%s", path);
	status = read_folder(&store, &scan, error);
	free_found(&scan.found);
	free_scan(&scan);
	close(folder);
	return status;
}

/* ---- Mending ---- */

static void set_aside(struct gnpd_job_store *store, const struct damage *damage, struct gnpd_log *log)
{
	bool stays = false;
	for (int f = 0; f < GNPD_JOB_FILES; f++) {
		char name[FILE_NAME], aside[FILE_NAME + sizeof damaged_suffix];
		file_name(damage->id, (enum gnpd_job_file)f, name);
		snprintf(aside, sizeof aside, "%s%s", name, damaged_suffix);
		if (renameat(store->disk.folder, name, store->disk.folder, aside) == 0 || errno == ENOENT)
			continue;
		gnpd_log_event(log, GNPD_LOG_ERROR, "job %s: damaged, and %s/%s cannot be set aside and stays: %s", damage->id, store->path, name,
		               strerror(errno));
		stays |= f == GNPD_JOB_RECORD_FILE;
	}
	if (stays)
		gnpd_log_event(log, GNPD_LOG_ERROR, "job %s: left alone: %s", damage->id, damage->cause.text);
	else
		gnpd_log_event(log, GNPD_LOG_ERROR, "job %s: set aside as %s/%s.job%s: %s", damage->id, store->path, damage->id, damaged_suffix,
		               damage->cause.text);
}

/* A job whose files are not there whole has failed; what its record says of a result goes. */
static void fail(struct gnpd_job_record *record, const char *what)
{
	record->state = GNPD_JOB_FAILED;
	record->error = GNP_STORAGE;
	record->finished = gnpd_clock_now();
	record->result_bytes = 0;
	free(record->result_warnings);
	free(record->result_parameters);
	record->result_warnings = record->result_parameters = NULL;
	record->result_type[0] = record->result_inference_length[0] = record->result_timing[0] = record->result_hash[0] = '\0';
	snprintf(record->error_text, sizeof record->error_text, "its %s was not there whole when the daemon started (jobs-dir)", what);
}

static int compare_records(const void *a, const void *b)
{
	return strcmp(((const struct gnpd_job_record *)a)->id, ((const struct gnpd_job_record *)b)->id);
}

static const struct gnpd_job_record *record_of(const struct gnpd_job_found *found, const char *id)
{
	struct gnpd_job_record key;
	memcpy(key.id, id, sizeof key.id);
	return found->count ? bsearch(&key, found->records, found->count, sizeof key, compare_records) : NULL;
}

/* Whether a job in this state still has use for the file. */
static bool wanted(const struct gnpd_job_record *record, enum gnpd_job_file file)
{
	if (!record)
		return false;
	switch (file) {
	case GNPD_JOB_RECORD_FILE: return true;
	case GNPD_JOB_RESULT_FILE: return record->state == GNPD_JOB_SUCCEEDED;
	default: return !gnpd_job_state_is_final(record->state);
	}
}

/* Of a damaged job nothing is thrown away, also where it could not be set aside. */
static bool is_damaged(const struct scan *scan, const char *id)
{
	for (size_t i = 0; i < scan->found.damaged; i++)
		if (strcmp(scan->damages[i].id, id) == 0)
			return true;
	return false;
}

static void tidy(struct gnpd_job_store *store, const char *name, const struct scan *scan, struct gnpd_log *log)
{
	const struct gnpd_job_found *found = &scan->found;
	char id[GNPD_JOB_ID + 1], whole[NAME_LENGTH];
	enum gnpd_job_file file;
	bool half = ends_with(name, new_suffix);
	if (strcmp(name, lock_name) == 0 || ends_with(name, damaged_suffix))
		return;
	snprintf(whole, sizeof whole, "%.*s", (int)(strlen(name) - (half ? sizeof new_suffix - 1 : 0)), name);
	if (!name_parse(whole, id, &file)) {
		gnpd_log_event(log, GNPD_LOG_WARNING, "jobs-dir: %s/%s is no file of a job and is left alone", store->path, name);
		return;
	}
	if (!half && (file == GNPD_JOB_RECORD_FILE || wanted(record_of(found, id), file)))
		return;
	if (half || !is_damaged(scan, id))
		unlinkat(store->disk.folder, name, 0);
}

static void mend(struct gnpd_job_store *store, struct scan *scan, struct gnpd_log *log)
{
	struct gnpd_job_found *found = &scan->found;
	for (size_t i = 0; i < found->damaged; i++)
		set_aside(store, &scan->damages[i], log);
	for (size_t i = 0; i < found->count; i++) {
		if (!scan->missing[i])
			continue;
		fail(&found->records[i], scan->missing[i]);
		gnpd_job_store_put_record(store, &found->records[i], NULL);
	}
	for (size_t i = 0; i < scan->names.count; i++)
		tidy(store, scan->names.items[i], scan, log);
}

gnp_status gnpd_job_store_scan(struct gnpd_job_store *store, struct gnpd_log *log, struct gnpd_job_found *found, struct gnp_error *error)
{
	struct scan scan = {0};
	gnp_status status = read_folder(store, &scan, error);
	if (status == GNP_OK) {
		mend(store, &scan, log);
		*found = scan.found;
	} else {
		free_found(&scan.found);
	}
	free_scan(&scan);
	return status;
}
