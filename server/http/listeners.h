/* The listeners: the one of requests and, where configured or handed over, the admin listener.
 *
 * A socket is opened at the configuration's address or taken from the service manager. Beyond loopback it needs keys
 * or --insecure. The listener of requests speaks TLS where there is a certificate; the admin listener does so beyond
 * loopback only, so that what watches the machine from the machine needs neither a certificate nor a name for it. */
#ifndef GNPD_LISTENERS_H
#define GNPD_LISTENERS_H

#include "core/base/status.h"
#include "server/api/server.h"
#include "server/base/inherit.h"
#include "server/http/http.h"

struct gnpd_listeners {
	struct gnpd_http *main, *admin; /* admin: NULL when there is none */
};

/* server must be complete. Takes the inherited sockets over. Writes the port files last. On failure nothing is left. */
gnp_status gnpd_listeners_start_take(struct gnpd_server *server, const struct gnpd_inherited *inherited, struct gnpd_listeners *out,
                                     struct gnp_error *error);
/* No request may be suspended any more. */
void gnpd_listeners_stop(struct gnpd_listeners *listeners);

#endif
