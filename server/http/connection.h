/* A connection and the list of all, for connections.c and connection_watch.c alone. */
#ifndef GNPD_CONNECTION_H
#define GNPD_CONNECTION_H

#include <poll.h>
#include <pthread.h>

#include "server/api/request.h"
#include "server/http/connections.h"

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

/* Lock held. gnpd_connection_cut. */
void gnpd_connection_cut_locked(struct gnpd_connections *connections, struct gnpd_connection *connection,
                                const struct gnp_error *error);

/* connection_watch.c: what the thread does until the connections are stopping. */
void *gnpd_connection_watch(void *connections);

#endif
