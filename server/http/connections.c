#include "server/http/connections.h"

#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "server/api/request.h"
#include "server/base/clock.h"
#include "server/base/metrics.h"
#include "server/base/tls.h"
#include "server/config/config.h"
#include "server/http/late_reply.h"
#include "server/work/engine.h"

struct gnpd_connection {
	struct gnpd_connection *previous, *next;
	int fd;
	enum gnpd_phase phase;
	double since;    /* when the phase began */
	bool used;       /* has carried a request */
	size_t received; /* bytes of the body in GNPD_PHASE_BODY */
	gnp_status cut;
	struct gnpd_request *request;
	struct gnpd_origin origin;
	struct gnpd_tls_pair *pair;
};

struct gnpd_connections {
	const struct gnpd_engine *engine;
	pthread_mutex_t lock; /* held while a socket is touched, so that none is closed and reused meanwhile */
	pthread_cond_t wake;
	bool stopping;
	struct gnpd_connection *first;
	size_t count;
	size_t capacity;                    /* connections of both listeners */
	struct pollfd *polls;               /* (capacity) */
	struct gnpd_connection **probed;    /* (capacity) */
	double seen;                        /* gnp_clock() of the last round */
	pthread_t thread;
};

/* Lock held. The answer is a courtesy: what does not fit the socket's buffer is lost. Nobody but the library may write to a
 * TLS connection. */
static void send_error(struct gnpd_connection *connection, const struct gnp_error *error, double retry_after)
{
	struct gnp_buffer answer = {0};
	const char *id = connection->request ? connection->request->id : "";
	if (!connection->origin.tls && gnpd_late_reply(error, id, retry_after, &answer) == GNP_OK)
		send(connection->fd, answer.data, answer.size, MSG_DONTWAIT | MSG_NOSIGNAL);
	gnp_buffer_clear(&answer);
}

/* Lock held. Ends a connection that may not be: what it sent is not read. */
static void refuse(struct gnpd_connections *connections, struct gnpd_connection *connection, const struct gnp_error *error)
{
	connection->cut = error->status;
	send_error(connection, error, connections->engine->config->retry_after_seconds);
	shutdown(connection->fd, SHUT_RDWR);
}

/* Lock held. */
static size_t count_address(const struct gnpd_connections *connections, const struct gnpd_origin *origin)
{
	size_t count = 0;
	for (const struct gnpd_connection *c = connections->first; c; c = c->next)
		count += !c->origin.admin && c->cut == GNP_OK && strcmp(c->origin.remote, origin->remote) == 0;
	return count;
}

/* Lock held. */
static gnp_status check_address(const struct gnpd_connections *connections, const struct gnpd_origin *origin, struct gnp_error *error)
{
	size_t limit = connections->engine->config->max_connections_per_address;
	if (!limit || origin->admin || !origin->remote[0] || count_address(connections, origin) < limit)
		return GNP_OK;
	gnpd_metrics_reject(connections->engine->metrics, GNPD_REJECT_ADDRESS);
	return gnp_error_set(error, GNP_LIMITED, "connections: %zu are open from %s, at most %zu may be (max-connections-per-address)",
	                     limit, origin->remote, limit);
}

struct gnpd_connection *gnpd_connection_open(struct gnpd_connections *connections, int fd, const struct gnpd_origin *origin)
{
	struct gnpd_connection *connection = calloc(1, sizeof *connection);
	struct gnp_error error = {0};
	if (!connection)
		return NULL;
	connection->fd = fd;
	connection->since = gnp_clock();
	connection->origin = *origin;
	pthread_mutex_lock(&connections->lock);
	if (check_address(connections, origin, &error) != GNP_OK)
		refuse(connections, connection, &error);
	connection->next = connections->first;
	if (connections->first)
		connections->first->previous = connection;
	connections->first = connection;
	connections->count++;
	pthread_mutex_unlock(&connections->lock);
	atomic_fetch_add(&connections->engine->metrics->accepted, 1);
	atomic_fetch_add(&connections->engine->metrics->connections, 1);
	return connection;
}

void gnpd_connection_close(struct gnpd_connections *connections, struct gnpd_connection *connection)
{
	pthread_mutex_lock(&connections->lock);
	if (connection->previous)
		connection->previous->next = connection->next;
	else
		connections->first = connection->next;
	if (connection->next)
		connection->next->previous = connection->previous;
	connections->count--;
	pthread_mutex_unlock(&connections->lock);
	atomic_fetch_sub(&connections->engine->metrics->connections, 1);
	gnpd_tls_pair_release(connection->pair);
	free(connection);
}

void gnpd_connection_enter(struct gnpd_connections *connections, struct gnpd_connection *connection, enum gnpd_phase phase,
                           struct gnpd_request *request)
{
	double now = gnp_clock();
	pthread_mutex_lock(&connections->lock);
	connection->phase = phase;
	connection->since = now;
	connection->request = request;
	connection->received = 0;
	if (request)
		connection->used = true;
	pthread_mutex_unlock(&connections->lock);
}

void gnpd_connection_received(struct gnpd_connections *connections, struct gnpd_connection *connection, size_t received)
{
	pthread_mutex_lock(&connections->lock);
	connection->received = received;
	pthread_mutex_unlock(&connections->lock);
}

const char *gnpd_connection_remote(const struct gnpd_connection *connection)
{
	return connection->origin.remote;
}

struct gnpd_tls_pair *gnpd_connection_certificate(struct gnpd_connection *connection)
{
	if (!connection->pair)
		connection->pair = gnpd_tls_pair(connection->origin.tls);
	return connection->pair;
}

double gnpd_connections_silence(struct gnpd_connections *connections)
{
	pthread_mutex_lock(&connections->lock);
	double seen = connections->seen;
	pthread_mutex_unlock(&connections->lock);
	return gnp_clock() - seen;
}

gnp_status gnpd_connection_cut_reason(struct gnpd_connections *connections, const struct gnpd_connection *connection)
{
	pthread_mutex_lock(&connections->lock);
	gnp_status reason = connection->cut;
	pthread_mutex_unlock(&connections->lock);
	return reason;
}

/* Lock held. */
static void cut(struct gnpd_connections *connections, struct gnpd_connection *connection, const struct gnp_error *error)
{
	if (connection->cut != GNP_OK)
		return;
	connection->cut = error->status;
	if (connection->phase == GNPD_PHASE_HEADERS || connection->phase == GNPD_PHASE_BODY)
		send_error(connection, error, connections->engine->config->retry_after_seconds);
	shutdown(connection->fd, SHUT_RDWR);
}

void gnpd_connection_cut(struct gnpd_connections *connections, struct gnpd_connection *connection, const struct gnp_error *error)
{
	pthread_mutex_lock(&connections->lock);
	cut(connections, connection, error);
	pthread_mutex_unlock(&connections->lock);
}

bool gnpd_connection_half_close(struct gnpd_connections *connections, struct gnpd_connection *connection, const void *data, size_t size)
{
	double now = gnp_clock();
	pthread_mutex_lock(&connections->lock);
	bool whole = connection->cut == GNP_OK;
	whole = whole && (!size || send(connection->fd, data, size, MSG_DONTWAIT | MSG_NOSIGNAL) == (ssize_t)size);
	if (!whole && connection->cut == GNP_OK)
		connection->cut = GNP_CANCELLED;
	shutdown(connection->fd, whole ? SHUT_WR : SHUT_RDWR);
	connection->phase = GNPD_PHASE_LINGER;
	connection->since = now;
	pthread_mutex_unlock(&connections->lock);
	return whole;
}

/* Lock held. The fault of a connection over the deadline of its phase. */
static gnp_status check_deadline(const struct gnpd_config *config, const struct gnpd_connection *connection,
                                 double now, struct gnp_error *error)
{
	double spent = now - connection->since;
	double rated = (spent - config->body_grace_seconds) * (double)config->min_body_rate;
	switch (connection->phase) {
	case GNPD_PHASE_IDLE:
		if (spent > (connection->used ? config->idle_seconds : config->header_seconds))
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "connection: no request in %.3g s (%s)", spent, connection->used ? "idle-seconds" : "header-seconds");
		break;
	case GNPD_PHASE_HEADERS:
		if (spent > config->header_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "headers: incomplete after %.3g s, need them in %.3g s (header-seconds)", spent,
			                     config->header_seconds);
		break;
	case GNPD_PHASE_BODY:
		if (spent > config->body_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "body: incomplete after %.3g s, need it in %.3g s (body-seconds)", spent,
			                     config->body_seconds);
		if ((double)connection->received < rated)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "body: got %zu bytes in %.3g s, need %zu bytes/s (min-body-rate)",
			                     connection->received, spent, config->min_body_rate);
		break;
	case GNPD_PHASE_REPLY:
		if (spent > config->reply_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "reply: not taken in %.3g s (reply-seconds)", config->reply_seconds);
		break;
	case GNPD_PHASE_STREAM:
		if (spent > config->reply_seconds + config->jobs_heartbeat_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "events: not taken in %.3g s (reply-seconds)", config->reply_seconds);
		break;
	case GNPD_PHASE_LINGER:
		if (spent > config->linger_seconds)
			return gnp_error_set(error, GNP_CLIENT_TIMEOUT, "body: still comes %.3g s after its answer (linger-seconds)", spent);
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
		cut(connections, c, &error);
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

static void *connections_main(void *argument)
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
			cut(connections, c, &error);
	}
	pthread_mutex_unlock(&connections->lock);
	run_removed(removed);
}

static void release(struct gnpd_connections *connections)
{
	pthread_cond_destroy(&connections->wake);
	pthread_mutex_destroy(&connections->lock);
	free(connections->polls);
	free(connections->probed);
	free(connections);
}

gnp_status gnpd_connections_create(const struct gnpd_engine *engine, struct gnpd_connections **out, struct gnp_error *error)
{
	struct gnpd_connections *connections = calloc(1, sizeof *connections);
	if (!connections)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "connections: no memory");
	gnpd_clock_init(&connections->wake);
	pthread_mutex_init(&connections->lock, NULL);
	connections->engine = engine;
	connections->seen = gnp_clock();
	connections->capacity = engine->config->max_connections + engine->config->admin_connections;
	connections->polls = calloc(connections->capacity, sizeof *connections->polls);
	connections->probed = calloc(connections->capacity, sizeof *connections->probed);
	if (!connections->polls || !connections->probed || pthread_create(&connections->thread, NULL, connections_main, connections) != 0) {
		release(connections);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "connections: cannot start");
	}
	*out = connections;
	return GNP_OK;
}

void gnpd_connections_free(struct gnpd_connections *connections)
{
	if (!connections)
		return;
	pthread_mutex_lock(&connections->lock);
	connections->stopping = true;
	pthread_cond_signal(&connections->wake);
	pthread_mutex_unlock(&connections->lock);
	pthread_join(connections->thread, NULL);
	release(connections);
}
