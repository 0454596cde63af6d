/* Watches a task while it runs: a bar on stderr when that is a terminal, and Ctrl-C.
 *
 * From start to stop SIGINT and SIGTERM cancel the task instead of ending the process; a second one ends it at once.
 * Threads made in between (a pool's workers) leave the signals alone too. */
#ifndef GNP_CLIENTS_PROGRESS_H
#define GNP_CLIENTS_PROGRESS_H

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "status.h"
#include "task.h"

struct gnp_progress {
	struct gnp_task *task;
	_Atomic(const char *) phase; /* what to call the current step; NULL: the task's stage. A string that stays. */
	sigset_t previous;
	pthread_t thread;
};

/* task must be initialised and outlive the progress. GNP_INTERNAL when no thread can be made. */
gnp_status gnp_progress_start(struct gnp_progress *progress, struct gnp_task *task, struct gnp_error *error);
void gnp_progress_stop(struct gnp_progress *progress);

/* One line of text without its end: "estimate  42% [########........] 3 s left". fraction in [0, 1], elapsed in seconds
 * since the step began; no time is promised before a twentieth is done. */
void gnp_progress_format(const char *phase, double fraction, double elapsed, char *line, size_t size);

#endif
