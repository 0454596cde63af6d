/* What a command of gnp needs while it works: a task under watch (progress, Ctrl-C) and, for local work, a pool. */
#ifndef GNP_CLIENTS_SESSION_H
#define GNP_CLIENTS_SESSION_H

#include "clients/progress.h"
#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

struct gnp_session {
	struct gnp_task task;
	struct gnp_progress progress;
	struct gnp_pool *pool; /* NULL when workers was GNP_NO_WORKERS */
};

#define GNP_NO_WORKERS (~0u)

/* workers: as for gnp_pool_create, or GNP_NO_WORKERS. On failure there is nothing to close. */
gnp_status gnp_session_open(struct gnp_session *session, unsigned workers, struct gnp_error *error);
void gnp_session_close(struct gnp_session *session);

#endif
