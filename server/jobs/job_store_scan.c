#include "server/jobs/job_store_scan.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/base/clock.h"
#include "server/base/log.h"

static const char damaged_suffix[] = ".damaged", new_suffix[] = ".new";

enum { RECORD_MOST = 1 << 20, NAME_LENGTH = 256 };

static bool ends_with(const char *name, const char *suffix)
{
	size_t length = strlen(name), size = strlen(suffix);
	return length >= size && strcmp(name + length - size, suffix) == 0;
}

/* ---- Reading ---- */

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
	DIR *directory = gnpd_job_store_list(store->disk.folder);
	if (!directory)
		return gnpd_job_store_fault(store->path, errno, error);
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
		status = gnpd_job_store_fault(store->path, errno, error);
	closedir(directory);
	if (names->count)
		qsort(names->items, names->count, sizeof *names->items, compare_names);
	return status;
}

/* One that could be whole keeps the daemon from its start: a person is to say what becomes of it. */
static gnp_status unreadable(const struct gnpd_job_store *store, const char *name, int number, struct gnp_error *error)
{
	bool ours = number == EMFILE || number == ENFILE || number == ENOMEM; /* not the file's fault */
	return gnp_error_set(error, GNP_IO, "jobs-dir: %s/%s cannot be read: %s%s", store->path, name, strerror(number),
	                     ours ? "" : "; make it readable for gnpd, or move it away with the other files of that job");
}

/* *there: whether there is such a file, of *size bytes; it can be read then. */
static gnp_status probe(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, bool *there,
                        size_t *size, struct gnp_error *error)
{
	char name[GNPD_JOB_FILE_NAME];
	gnpd_job_store_name(id, file, name);
	int fd = gnpd_disk_open(&store->disk, name, size);
	*there = fd >= 0;
	if (fd < 0 && errno != ENOENT)
		return unreadable(store, name, errno, error);
	if (fd >= 0)
		close(fd);
	return GNP_OK;
}

/* *record is the caller's; where it is damaged, it is unchanged and *damage says why. */
static gnp_status read_record(struct gnpd_job_store *store, const char *id, struct gnpd_job_record *record,
                              struct gnp_error *damage, struct gnp_error *error)
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
	enum gnpd_job_file file = final ? GNPD_JOB_RESULT_FILE : GNPD_JOB_BODY_FILE;
	gnp_status status = probe(store, record->id, file, &there, &size, error);
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
	return gnpd_job_store_parse_name(name, id, &file) && file == GNPD_JOB_RECORD_FILE;
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
	gnp_status status = gnpd_job_store_check_folder(path, error);
	if (status != GNP_OK)
		return status;
	int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (folder < 0)
		return gnpd_job_store_fault(path, errno, error);
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
		char name[GNPD_JOB_FILE_NAME], aside[GNPD_JOB_FILE_NAME + sizeof damaged_suffix];
		gnpd_job_store_name(damage->id, (enum gnpd_job_file)f, name);
		snprintf(aside, sizeof aside, "%s%s", name, damaged_suffix);
		if (renameat(store->disk.folder, name, store->disk.folder, aside) == 0 || errno == ENOENT)
			continue;
		gnpd_log_event(log, GNPD_LOG_ERROR, "job %s: damaged, and %s/%s cannot be set aside and stays: %s", damage->id,
		               store->path, name, strerror(errno));
		stays |= f == GNPD_JOB_RECORD_FILE;
	}
	if (stays)
		gnpd_log_event(log, GNPD_LOG_ERROR, "job %s: left alone: %s", damage->id, damage->cause.text);
	else
		gnpd_log_event(log, GNPD_LOG_ERROR, "job %s: set aside as %s/%s.job%s: %s", damage->id, store->path, damage->id,
		               damaged_suffix, damage->cause.text);
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
	record->result_type[0] = record->result_inference_length[0] = '\0';
	record->result_timing[0] = record->result_hash[0] = '\0';
	snprintf(record->error_text, sizeof record->error_text,
	         "its %s was not there whole when the daemon started (jobs-dir)", what);
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
	if (strcmp(name, GNPD_JOB_LOCK) == 0 || ends_with(name, damaged_suffix))
		return;
	snprintf(whole, sizeof whole, "%.*s", (int)(strlen(name) - (half ? sizeof new_suffix - 1 : 0)), name);
	if (!gnpd_job_store_parse_name(whole, id, &file)) {
		gnpd_log_event(log, GNPD_LOG_WARNING, "jobs-dir: %s/%s is no file of a job and is left alone", store->path,
		               name);
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

gnp_status gnpd_job_store_scan(struct gnpd_job_store *store, struct gnpd_log *log, struct gnpd_job_found *found,
                               struct gnp_error *error)
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
