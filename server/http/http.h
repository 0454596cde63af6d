/* Serves HTTP by libmicrohttpd: listeners, connections, bodies, replies.
 *
 * Its threads (http_loop) read sockets and never block: small answers are made in its callbacks, everything else by a
 * runner, the disk queue or a job's end while the connection is suspended. One completion callback logs, counts and
 * frees each request. */
#ifndef GNPD_HTTP_H
#define GNPD_HTTP_H

#include <stdbool.h>

#include "core/base/status.h"
#include "server/api/server.h"

struct gnpd_http;

/* Takes fd, a listening socket, over (also on failure). server must be complete. admin: the admin listener, whose
 * one thread and connections are its own; else the one of requests. tls: server->tls is there and the listener
 * speaks it. named: requests must be sent to a name of this server's (site.h). */
gnp_status gnpd_http_start_take(struct gnpd_server *server, int fd, bool admin, bool tls, bool named, struct gnpd_http **out,
                                struct gnp_error *error);

/* Closes all connections and frees. No request may be suspended any more. NULL is allowed. */
void gnpd_http_stop(struct gnpd_http *http);

#endif
