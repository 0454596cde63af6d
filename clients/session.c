#include "clients/session.h"

#include <stddef.h>

gnp_status gnp_session_open(struct gnp_session *session, unsigned workers, struct gnp_error *error)
{
	session->pool = NULL;
	gnp_task_init(&session->task);
	gnp_status status = gnp_progress_start(&session->progress, &session->task, error);
	if (status != GNP_OK || workers == GNP_NO_WORKERS)
		return status;
	status = gnp_pool_create(workers, &session->pool, error);
	if (status != GNP_OK)
		gnp_progress_stop(&session->progress);
	return status;
}

void gnp_session_close(struct gnp_session *session)
{
	gnp_progress_stop(&session->progress);
	gnp_pool_free(session->pool);
}
