/* What is in the folder of jobs after a run that may have ended anywhere: every record is read before anything is
 * changed, so that a start that is refused leaves the folder as it was; then what is half or damaged is mended. */
#ifndef GNPD_JOB_STORE_SCAN_H
#define GNPD_JOB_STORE_SCAN_H

#include <stddef.h>

#include "core/base/status.h"
#include "server/jobs/job_store.h"

struct gnpd_log;

/* Whether gnpd_job_store_open would take the path and gnpd_job_store_scan what it holds: reads all they would,
 * without the lock, which a daemon may have, and changes nothing. */
gnp_status gnpd_job_store_check(const char *path, struct gnp_error *error);

struct gnpd_job_found {
	struct gnpd_job_record *records; /* (count), by id; owned by the caller */
	size_t count;
	size_t damaged; /* records set aside */
};

/* What the folder holds after a run that may have ended anywhere: removes files half written and files without a
 * record, sets damaged records aside with what belongs to them, logs both. A record whose body or result is not
 * there whole becomes a failed one, on disk too where that can be written. What cannot be read may be whole:
 * GNP_STORAGE or GNP_IO naming it, and nothing is changed. */
gnp_status gnpd_job_store_scan(struct gnpd_job_store *store, struct gnpd_log *log, struct gnpd_job_found *found,
                               struct gnp_error *error);

#endif
