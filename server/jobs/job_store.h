/* The folder jobs are kept in. Of each job: ID.job, its record; ID.body, what was sent, until it is over;
 * ID.checkpoint, what a run left to go on from; ID.result, the body of its answer. `lock` keeps a second daemon out.
 * What cannot be read is set aside as NAME.damaged and left to a person. */
#ifndef GNPD_JOB_STORE_H
#define GNPD_JOB_STORE_H

#include <dirent.h>
#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "server/base/disk.h"
#include "server/jobs/job_record.h"

struct gnpd_job_store {
	struct gnpd_disk disk;
	int lock;
	char path[1024];
	bool temporary; /* a folder of this process alone, removed with it */
};

enum gnpd_job_file { GNPD_JOB_RECORD_FILE, GNPD_JOB_BODY_FILE, GNPD_JOB_CHECKPOINT_FILE, GNPD_JOB_RESULT_FILE, GNPD_JOB_FILES };

/* path: a folder that is there and can be written to, else GNP_IO says why; "": a temporary one. On failure *store is unchanged. */
gnp_status gnpd_job_store_open(const char *path, struct gnpd_job_store *store, struct gnp_error *error);
/* Removes a temporary folder with all that is in it. A zeroed store is allowed. */
void gnpd_job_store_close(struct gnpd_job_store *store);

gnp_status gnpd_job_store_put_record(struct gnpd_job_store *store, const struct gnpd_job_record *record, struct gnp_error *error);
gnp_status gnpd_job_store_put(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, const struct gnp_piece *pieces,
                              size_t count, struct gnp_error *error);
gnp_status gnpd_job_store_get(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, size_t most,
                              struct gnp_buffer *buffer, struct gnp_error *error);
/* gnpd_disk_open. */
int gnpd_job_store_open_file(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, size_t *size);
gnp_status gnpd_job_store_remove(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, struct gnp_error *error);

/* For job_store_scan.c: the names of files, and the folder as such. */
#define GNPD_JOB_LOCK "lock"
enum { GNPD_JOB_FILE_NAME = GNPD_JOB_ID + 32 };
void gnpd_job_store_name(const char *id, enum gnpd_job_file file, char name[GNPD_JOB_FILE_NAME]);
/* The id and kind of a name; false when it is not that of a file of a job. */
bool gnpd_job_store_parse_name(const char *name, char id[GNPD_JOB_ID + 1], enum gnpd_job_file *file);
/* GNP_IO: jobs-dir, the path and what errno says. */
gnp_status gnpd_job_store_fault(const char *path, int number, struct gnp_error *error);
/* Whether the path is a folder that can be read and written to. */
gnp_status gnpd_job_store_check_folder(const char *path, struct gnp_error *error);
/* Another stream over the folder's names, or NULL and errno. */
DIR *gnpd_job_store_list(int folder);

#endif
