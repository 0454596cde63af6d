/* The thread that watches connections: deadlines of their phases and of their work, clients that have gone; and the
 * end of all work when the daemon stops. */
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "server/base/clock.h"
#include "server/base/metrics.h"
#include "server/config/config.h"
#include "server/http/connection.h"
#include "server/work/engine.h"

/* Lock held. The fault of a connection over the deadline of its phase. */
static gnp_status check_deadline(const struct gnpd_config *config, const struct gnpd_connection *connection,
                                 double now, struct gnp_error *error)
{
	double spent = now - connection->since;
	double rated = (spent - config->body_grace_seconds) * (double)config->min_body_rate;
	switch (connection->phase) {
	case GNPD_PHASE_IDLE:
		if (spent > (connection->used ? config->idle_seconds : config->header_seconds))
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "connection: no request in %.3g s (%s)", spent,
			                     connection->used ? "idle-seconds" : "header-seconds");
		break;
	case GNPD_PHASE_HEADERS:
		if (spent > config->header_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT,
			                     "headers: incomplete after %.3g s, need them in %.3g s (header-seconds)", spent,
			                     config->header_seconds);
		break;
	case GNPD_PHASE_BODY:
		if (spent > config->body_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT,
			                     "body: incomplete after %.3g s, need it in %.3g s (body-seconds)", spent,
			                     config->body_seconds);
		if ((double)connection->received < rated)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT,
			                     "body: got %zu bytes in %.3g s, need %zu bytes/s (min-body-rate)",
			                     connection->received, spent, config->min_body_rate);
		break;
	case GNPD_PHASE_REPLY:
		if (spent > config->reply_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "reply: not taken in %.3g s (reply-seconds)",
			                     config->reply_seconds);
		break;
	case GNPD_PHASE_STREAM:
		if (spent > config->reply_seconds + config->jobs_heartbeat_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "events: not taken in %.3g s (reply-seconds)",
			                     config->reply_seconds);
		break;
	case GNPD_PHASE_LINGER:
		if (spent > config->linger_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT,
			                     "body: still comes %.3g s after its answer (linger-seconds)", spent);
		break;
	case GNPD_PHASE_WORK: break;
	}
	return GNP_OK;
}

/* Lock held. Stops the request's work; one that still waits is linked into *removed, to be run by the caller so that
 * it ends at once and its place in the queue is free. */
static void stop_work(struct gnpd_connections *connections, struct gnpd_request *request, gnp_status reason,
                      enum gnpd_cancel counted, struct gnpd_queued **removed)
{
	if (gnp_task_check(&request->work.task, NULL) == GNP_OK)
		gnpd_metrics_cancel(connections->engine->metrics, counted);
	gnp_task_stop(&request->work.task, reason);
	if (request->withdraw(request)) {
		request->queued.next = *removed;
		*removed = &request->queued;
	}
}

/* Lock held. The client has gone. The library's edge-triggered polling misses an end that came together with the last
 * data it read, so shut the socket down to wake it, unless there is more to read. */
static void leave(struct gnpd_connection *connection)
{
	int unread = 0;
	if (connection->cut != GNP_OK || (ioctl(connection->fd, FIONREAD, &unread) == 0 && unread > 0))
		return;
	connection->cut = GNP_CANCELLED;
	shutdown(connection->fd, SHUT_RDWR);
}

/* Lock held. The client of a stream has gone. */
static void end_stream(struct gnpd_connection *connection)
{
	if (connection->cut != GNP_OK)
		return;
	connection->cut = GNP_CANCELLED;
	shutdown(connection->fd, SHUT_RDWR);
	gnpd_watch_leave(&connection->request->watch);
}

/* Lock held. One poll for all sockets but those that are being written to. */
static void probe_clients(struct gnpd_connections *connections, struct gnpd_queued **removed)
{
	nfds_t count = 0;
	for (struct gnpd_connection *c = connections->first; c && count < connections->capacity; c = c->next)
		if (c->phase != GNPD_PHASE_REPLY) {
			connections->polls[count] = (struct pollfd){.fd = c->fd, .events = POLLRDHUP};
			connections->probed[count++] = c;
		}
	if (count && poll(connections->polls, count, 0) <= 0)
		return;
	for (nfds_t i = 0; i < count; i++) {
		struct gnpd_connection *connection = connections->probed[i];
		if (!(connections->polls[i].revents & (POLLRDHUP | POLLHUP | POLLERR)))
			continue;
		if (connection->phase == GNPD_PHASE_WORK)
			stop_work(connections, connection->request, GNP_CANCELLED, GNPD_CANCEL_CLIENT_GONE, removed);
		else if (connection->phase == GNPD_PHASE_STREAM)
			end_stream(connection);
		else
			leave(connection);
	}
}

/* Lock held. */
static void check_work_deadlines(struct gnpd_connections *connections, double now, struct gnpd_queued **removed)
{
	for (struct gnpd_connection *c = connections->first; c; c = c->next)
		if (c->phase == GNPD_PHASE_WORK && now > atomic_load(&c->request->work.deadline))
			stop_work(connections, c->request, GNP_DEADLINE, GNPD_CANCEL_DEADLINE, removed);
}

/* Lock held. */
static void check_deadlines(struct gnpd_connections *connections, double now)
{
	for (struct gnpd_connection *c = connections->first; c; c = c->next) {
		struct gnp_error error = {0};
		if (c->cut != GNP_OK || check_deadline(connections->engine->config, c, now, &error) == GNP_OK)
			continue;
		if (c->phase == GNPD_PHASE_HEADERS || (c->phase == GNPD_PHASE_IDLE && !c->used))
			gnpd_metrics_reject(connections->engine->metrics, GNPD_REJECT_SLOW_HEADERS);
		else if (c->phase == GNPD_PHASE_BODY)
			gnpd_metrics_reject(connections->engine->metrics, GNPD_REJECT_SLOW_BODY);
		else if (c->phase == GNPD_PHASE_REPLY || c->phase == GNPD_PHASE_STREAM)
			gnpd_metrics_reject(connections->engine->metrics, GNPD_REJECT_SLOW_REPLY);
		gnpd_connection_cut_locked(connections, c, &error);
	}
}

/* Lock not held: a job's end enters the next phase. */
static void run_removed(struct gnpd_queued *removed)
{
	while (removed) {
		struct gnpd_queued *job = removed;
		removed = job->next;
		job->next = NULL;
		job->run(job);
	}
}

void *gnpd_connection_watch(void *argument)
{
	struct gnpd_connections *connections = argument;
	pthread_mutex_lock(&connections->lock);
	while (!connections->stopping) {
		struct gnpd_queued *removed = NULL;
		double now = gnp_clock();
		connections->seen = now;
		check_deadlines(connections, now);
		probe_clients(connections, &removed);
		check_work_deadlines(connections, now, &removed);
		if (removed) {
			pthread_mutex_unlock(&connections->lock);
			run_removed(removed);
			pthread_mutex_lock(&connections->lock);
		}
		if (!connections->stopping)
			gnpd_clock_tick(&connections->wake, &connections->lock);
	}
	pthread_mutex_unlock(&connections->lock);
	return NULL;
}

void gnpd_connections_stop_all(struct gnpd_connections *connections, gnp_status reason)
{
	struct gnpd_queued *removed = NULL;
	struct gnp_error error = {0};
	gnp_error_set(&error, reason, "%s", gnp_status_text(reason));
	pthread_mutex_lock(&connections->lock);
	for (struct gnpd_connection *c = connections->first; c; c = c->next) {
		if (c->phase == GNPD_PHASE_WORK)
			stop_work(connections, c->request, reason, GNPD_CANCEL_SHUTDOWN, &removed);
		else if (c->phase == GNPD_PHASE_HEADERS || c->phase == GNPD_PHASE_BODY)
			gnpd_connection_cut_locked(connections, c, &error);
	}
	pthread_mutex_unlock(&connections->lock);
	run_removed(removed);
}
