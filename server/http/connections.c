#include "server/http/connections.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "server/base/clock.h"
#include "server/base/metrics.h"
#include "server/base/tls.h"
#include "server/config/config.h"
#include "server/http/connection.h"
#include "server/http/late_reply.h"
#include "server/work/engine.h"

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

void gnpd_connection_cut_locked(struct gnpd_connections *connections, struct gnpd_connection *connection,
                                const struct gnp_error *error)
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
	gnpd_connection_cut_locked(connections, connection, error);
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

static void release(struct gnpd_connections *connections)
{
	pthread_cond_destroy(&connections->wake);
	pthread_mutex_destroy(&connections->lock);
	free(connections->polls);
	free(connections->probed);
	free(connections);
}

gnp_status gnpd_connections_create(const struct gnpd_engine *engine, struct gnpd_connections **out,
                                   struct gnp_error *error)
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
	if (!connections->polls || !connections->probed ||
	    pthread_create(&connections->thread, NULL, gnpd_connection_watch, connections) != 0) {
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
