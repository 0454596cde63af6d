/* The folder jobs are kept in. Of each job: ID.job, its record; ID.body, what was sent, until it is over; ID.checkpoint, what a run
 * left to go on from; ID.result, the body of its answer. `lock` keeps a second daemon out. What cannot be read is set aside as
 * NAME.damaged and left to a person. */
#ifndef GNPD_JOB_STORE_H
#define GNPD_JOB_STORE_H

#include "server/base/disk.h"
#include "server/base/log.h"
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

/* Whether gnpd_job_store_open would take the path and gnpd_job_store_scan what it holds: reads all they would, without the lock, which a
 * daemon may have, and changes nothing. */
gnp_status gnpd_job_store_check(const char *path, struct gnp_error *error);

struct gnpd_job_found {
	struct gnpd_job_record *records; /* (count), by id; owned by the caller */
	size_t count;
	size_t damaged; /* records set aside */
};

/* What the folder holds after a run that may have ended anywhere: removes files half written and files without a record, sets damaged
 * records aside with what belongs to them, logs both. A record whose body or result is not there whole becomes a failed one, on disk
 * too where that can be written. What cannot be read may be whole: GNP_STORAGE or GNP_IO naming it, and nothing is changed. */
gnp_status gnpd_job_store_scan(struct gnpd_job_store *store, struct gnpd_log *log, struct gnpd_job_found *found, struct gnp_error *error);

gnp_status gnpd_job_store_put_record(struct gnpd_job_store *store, const struct gnpd_job_record *record, struct gnp_error *error);
gnp_status gnpd_job_store_put(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, const struct gnp_piece *pieces,
                              size_t count, struct gnp_error *error);
gnp_status gnpd_job_store_get(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, size_t most,
                              struct gnp_buffer *buffer, struct gnp_error *error);
/* gnpd_disk_open. */
int gnpd_job_store_open_file(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, size_t *size);
gnp_status gnpd_job_store_remove(struct gnpd_job_store *store, const char *id, enum gnpd_job_file file, struct gnp_error *error);

#endif
