/* Requests that wait for a job to change: long polls, which are answered once, and streams of events. They wait
 * suspended, in the hands of one thread, and occupy neither a runner nor a thread of the HTTP library. */
#ifndef GNPD_JOB_WATCH_H
#define GNPD_JOB_WATCH_H

#include <stdbool.h>
#include <sys/types.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"

struct gnpd_config;
struct gnpd_job;
struct gnpd_job_view;
struct gnpd_watchers;

enum gnpd_watch_kind { GNPD_WATCH_NONE, GNPD_WATCH_POLL, GNPD_WATCH_STREAM };

/* Of a request, embedded; zero-initialised. */
struct gnpd_watch {
	struct gnpd_watch *previous, *next;
	enum gnpd_watch_kind kind;
	struct gnpd_job *job; /* a reference */
	bool listed, counted;
	double until;         /* gnp_clock(): of a poll */
	/* Resumes the request's connection: of a poll to be answered, of a stream because there is more to write. Called without a lock for
	 * a poll, within that of the watchers for a stream. */
	void (*wake)(struct gnpd_watch *watch);

	/* Of a stream: */
	struct gnpd_watchers *watchers;
	struct gnp_buffer text; /* to be written, from `sent` on */
	size_t sent;
	bool begun, over, suspended;
	unsigned version;       /* of the job when its state was last told */
	double told, progressed, fraction; /* when anything was last told, when progress was, and how much */
};

gnp_status gnpd_watchers_create(const struct gnpd_config *config, struct gnpd_watchers **out, struct gnp_error *error);
/* Ends what waits, for good, then joins the thread. NULL is allowed. */
void gnpd_watchers_end(struct gnpd_watchers *watchers);
void gnpd_watchers_free(struct gnpd_watchers *watchers);

/* A job has changed. Any thread, with no lock of the watchers held. NULL is allowed. */
void gnpd_watchers_notify(struct gnpd_watchers *watchers);

/* Makes a zeroed watch one of the job, whose reference it takes over on success. GNP_OVERLOADED when jobs-watch-count watch. */
gnp_status gnpd_watch_init(struct gnpd_watchers *watchers, struct gnpd_watch *watch, enum gnpd_watch_kind kind, struct gnpd_job *job,
                           struct gnp_error *error);
/* Of a watch that is not listed any more. A zeroed one is allowed. */
void gnpd_watch_clear(struct gnpd_watch *watch);

/* Lists a poll whose connection is suspended: wake is called once, soon if the job is over or there is no time to wait. */
void gnpd_watch_wait(struct gnpd_watch *watch);
/* Takes a poll out before it is woken, which it then never is; false when it has been. */
bool gnpd_watch_withdraw(struct gnpd_watch *watch);

enum { GNPD_EVENT_ID = 32 };
/* What the events that tell of a job as it is in view are called: its version and state, so that the id of a job's end is that of nothing
 * before it, in no process. */
void gnpd_watch_event_id(const struct gnpd_job_view *view, char id[GNPD_EVENT_ID]);

/* What a stream has to write, at most `most` bytes of it: their number, -1 at its end, or 0 when there is nothing: then `suspend` has
 * been called, and wake will be. */
ssize_t gnpd_watch_read(struct gnpd_watch *watch, char *data, size_t most, void (*suspend)(struct gnpd_watch *watch));
/* The stream's client is gone: it ends. */
void gnpd_watch_leave(struct gnpd_watch *watch);

/* Requests that watch. */
size_t gnpd_watchers_count(struct gnpd_watchers *watchers);

#endif
