/* How a request gets its answer: at once, or by a runner, the disk queue or the end of a job while its connection is
 * suspended. */
#include "server/http/http_steps.h"

#include <math.h>

#include "proto/operation/operations.h"
#include "server/api/job_routes.h"
#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/base/container.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/http/http_loop.h"
#include "server/jobs/jobs.h"
#include "server/work/codec_file.h"

static void run_handler(struct gnpd_request *request, gnpd_handler handler)
{
	struct gnp_error error = {0};
	gnp_status status = gnp_task_check(&request->work.task, &error);
	if (status == GNP_OK)
		status = handler(request, &error);
	if (status == GNP_DEADLINE && gnp_task_check(&request->work.task, NULL) == GNP_DEADLINE) /* not a job's that the handler tells of */
		gnpd_work_overdue(&request->work, &error);
	if (status != GNP_OK) {
		error.status = status;
		gnpd_reply_error(request, &error);
	}
}

/* The reply is there: the library calls on_request again, which sends it. */
static void resume(struct gnpd_request *request)
{
	struct gnpd_server *server = request->server;
	request->step = GNPD_STEP_REPLY;
	gnpd_connection_enter(server->connections, request->connection, GNPD_PHASE_REPLY, request);
	gnpd_http_loop_resume(request->loop, request->http);
	atomic_fetch_sub(&server->suspended, 1);
}

struct gnpd_queue *gnpd_http_queue(const struct gnpd_request *request)
{
	return request->route->work == GNPD_BY_DISK_QUEUE ? request->server->disk_queue : request->server->engine.queue;
}

static bool withdraw_from_queue(struct gnpd_request *request)
{
	return gnpd_queue_remove(gnpd_http_queue(request), &request->queued);
}

static void run_queued(struct gnpd_queued *queued)
{
	struct gnpd_request *request = GNPD_CONTAINER_OF(queued, struct gnpd_request, queued);
	request->waited = gnp_clock() - request->submitted;
	if (request->route->work == GNPD_ON_RUNNER)
		gnpd_jobs_keep_company(request->server->jobs);
	run_handler(request, request->route->handler);
	gnp_task_stage(&request->work.task, GNP_STAGE_DONE, 0);
	resume(request);
}

/* The connection is out of the library's hands until resume. */
static void suspend(struct gnpd_request *request)
{
	request->submitted = gnp_clock();
	atomic_fetch_add(&request->server->suspended, 1);
	MHD_suspend_connection(request->http);
	gnpd_connection_enter(request->server->connections, request->connection, GNPD_PHASE_WORK, request);
}

/* Suspends first: the runner may be done before submit returns. */
static enum MHD_Result begin_work(struct gnpd_request *request)
{
	struct gnpd_server *server = request->server;
	struct gnp_error error = {0};
	struct gnpd_work *work = &request->work;
	request->queued.run = run_queued;
	request->withdraw = withdraw_from_queue;
	if (request->model)
		work->operation = gnp_operation_find(request->model);
	work->codec = gnpd_routes_codec(request->route);
	gnp_task_init(&work->task);
	gnpd_work_begin(work, server->engine.config->work_seconds, "work-seconds",
	                work->codec == &gnpd_codec_file ? request->target.query : NULL);
	work->query = request->target.query;
	suspend(request);
	gnp_status status = gnpd_queue_submit(gnpd_http_queue(request), &request->queued, &error);
	if (status == GNP_OK)
		return MHD_YES;
	gnpd_metrics_reject(server->engine.metrics,
	                    status == GNP_DRAINING ? GNPD_REJECT_DRAINING : GNPD_REJECT_QUEUE_COUNT);
	gnpd_reply_error(request, &error);
	resume(request);
	return MHD_YES;
}

static void run_polled(struct gnpd_queued *queued)
{
	struct gnpd_request *request = GNPD_CONTAINER_OF(queued, struct gnpd_request, queued);
	run_handler(request, gnpd_job_routes_polled);
	resume(request);
}

static void wake_poll(struct gnpd_watch *watch)
{
	struct gnpd_request *request = GNPD_CONTAINER_OF(watch, struct gnpd_request, watch);
	run_polled(&request->queued);
}

static bool withdraw_from_watchers(struct gnpd_request *request)
{
	return gnpd_watch_withdraw(&request->watch);
}

static enum MHD_Result begin_watch(struct gnpd_request *request)
{
	request->queued.run = run_polled;
	request->withdraw = withdraw_from_watchers;
	request->watch.wake = wake_poll;
	atomic_store(&request->work.deadline, INFINITY);
	suspend(request);
	gnpd_watch_wait(&request->watch);
	return MHD_YES;
}

enum MHD_Result gnpd_http_answer(struct gnpd_request *request)
{
	if (request->reply.code)
		return gnpd_http_reply(request);
	if (request->route->work)
		return begin_work(request);
	run_handler(request, request->route->handler);
	if (request->reply.code == 0 && request->watch.kind == GNPD_WATCH_POLL)
		return begin_watch(request);
	return gnpd_http_reply(request);
}
