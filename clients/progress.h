/* Watches a task while it runs: a bar on stderr when that is a terminal, and Ctrl-C.
 *
 * From start to stop SIGINT and SIGTERM cancel the task instead of ending the process; a second one, more than half a
 * second later, ends it at once. A signal that was ignored stays so. One progress at a time in a process. */
#ifndef GNP_CLIENTS_PROGRESS_H
#define GNP_CLIENTS_PROGRESS_H

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "core/base/status.h"
#include "core/base/task.h"

struct gnp_progress {
	struct gnp_task *task;
	_Atomic(const char *) phase; /* what to call the current step; NULL: the task's stage. A string that stays. */
	struct sigaction previous[2]; /* of SIGINT and SIGTERM */
	pthread_mutex_t lock;
	pthread_cond_t stopped;
	bool stopping;
	pthread_t thread;
};

/* task must be initialised and outlive the progress. GNP_INTERNAL when no thread can be made. */
gnp_status gnp_progress_start(struct gnp_progress *progress, struct gnp_task *task, struct gnp_error *error);
void gnp_progress_stop(struct gnp_progress *progress);

/* One line of text without its end: "estimate  42% [########........] 3 s left". fraction in [0, 1], or negative
 * when unknown; elapsed in seconds since the step began. No time is promised before a twentieth is done. */
void gnp_progress_format(const char *phase, double fraction, double elapsed, char *line, size_t size);

#endif
