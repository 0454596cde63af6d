/* Watches every connection from one thread, because the HTTP library cannot: its timeout measures inactivity, which a
 * client that sends a byte a second evades, and it does not look at a suspended connection at all.
 *
 * Every 100 ms it cuts connections that are over a deadline of their phase, stops work that is over its time limit, and
 * cancels work whose client has gone (a client that shuts its sending side down counts as gone). */
#ifndef GNPD_CONNECTIONS_H
#define GNPD_CONNECTIONS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

struct gnpd_connection;
struct gnpd_connections;
struct gnpd_engine;
struct gnpd_request;
struct gnpd_tls;
struct gnpd_tls_pair;

enum gnpd_phase {
	GNPD_PHASE_IDLE,    /* between requests */
	GNPD_PHASE_HEADERS, /* the request line has come */
	GNPD_PHASE_BODY,
	GNPD_PHASE_WORK,    /* suspended: waits or runs */
	GNPD_PHASE_REPLY,
	GNPD_PHASE_STREAM,  /* a reply that is written bit by bit; entered anew with each */
	GNPD_PHASE_LINGER   /* has its answer, and sends what is dropped */
};

/* Of the engine configuration and metrics are used. */
gnp_status gnpd_connections_create(const struct gnpd_engine *engine, struct gnpd_connections **out,
                                   struct gnp_error *error);
/* Joins the thread. No connection may be open any more. NULL is allowed. */
void gnpd_connections_free(struct gnpd_connections *connections);

/* What kind of connection it is. */
struct gnpd_origin {
	char remote[64];      /* the client's address; "" for a local socket */
	struct gnpd_tls *tls; /* what its session begins with: only the HTTP library may write to it; NULL: it is no TLS */
	bool admin;           /* of the admin listener: max-connections-per-address is not about it */
};

/* NULL when memory is exhausted. fd stays the HTTP library's; close must be called before it closes it. One that is over
 * max-connections-per-address is told so and cut off; closing it is still up to the library. */
struct gnpd_connection *gnpd_connection_open(struct gnpd_connections *connections, int fd, const struct gnpd_origin *origin);
void gnpd_connection_close(struct gnpd_connections *connections, struct gnpd_connection *connection);

/* The connection enters a phase. request: the one it carries, NULL in GNPD_PHASE_IDLE. */
void gnpd_connection_enter(struct gnpd_connections *connections, struct gnpd_connection *connection, enum gnpd_phase phase,
                           struct gnpd_request *request);
/* received: bytes of body so far. */
void gnpd_connection_received(struct gnpd_connections *connections, struct gnpd_connection *connection, size_t received);

const char *gnpd_connection_remote(const struct gnpd_connection *connection);

/* The certificate that a TLS connection began with, which is the one in use when it is first asked for. Borrowed. */
struct gnpd_tls_pair *gnpd_connection_certificate(struct gnpd_connection *connection);

/* The reason the connection was cut, or GNP_OK. */
gnp_status gnpd_connection_cut_reason(struct gnpd_connections *connections, const struct gnpd_connection *connection);

/* Writes an error reply straight to the socket and shuts it down: the only way to answer in the middle of a body, where the
 * HTTP library takes no reply. Only while the library is reading. A TLS connection is only shut down. */
void gnpd_connection_cut(struct gnpd_connections *connections, struct gnpd_connection *connection, const struct gnp_error *error);

/* Writes data, an answer or nothing, straight to the socket, closes the sending side and enters GNPD_PHASE_LINGER.
 * False when the connection was cut before or the socket does not take all of it: then it is cut now. */
bool gnpd_connection_half_close(struct gnpd_connections *connections, struct gnpd_connection *connection, const void *data, size_t size);

/* Seconds since the watching thread was last seen at work. */
double gnpd_connections_silence(struct gnpd_connections *connections);

/* Stops the work of every request with a reason, and cuts the connections that are still sending one. */
void gnpd_connections_stop_all(struct gnpd_connections *connections, gnp_status reason);

#endif
