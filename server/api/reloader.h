/* Loads keys, certificate and weights again, on a thread of its own: each is read, checked and swapped, and one that
 * is no good changes nothing. Requests and connections finish with what they began with. */
#ifndef GNPD_RELOADER_H
#define GNPD_RELOADER_H

#include <stdbool.h>

#include "core/base/status.h"

struct gnpd_reloader;
struct gnpd_server;

/* server must have its guard and loader; its tls may be NULL. */
gnp_status gnpd_reloader_create(struct gnpd_server *server, struct gnpd_reloader **out, struct gnp_error *error);
/* Waits for a load under way. NULL is allowed. */
void gnpd_reloader_free(struct gnpd_reloader *reloader);

/* Asks for a load and returns its number at once. What is asked during a load is done after it, once. */
unsigned long gnpd_reloader_ask(struct gnpd_reloader *reloader);

enum gnpd_reloaded { GNPD_RELOADED_KEYS, GNPD_RELOADED_CERTIFICATE, GNPD_RELOADED_WEIGHTS, GNPD_RELOADED };
const char *gnpd_reloaded_name(enum gnpd_reloaded what);

struct gnpd_reload_state {
	unsigned long asked, done;         /* numbers of the last; equal when nothing is under way */
	struct gnp_error faults[GNPD_RELOADED]; /* of the last; status GNP_OK where it went well or there is nothing to load */
};
void gnpd_reloader_state(struct gnpd_reloader *reloader, struct gnpd_reload_state *state);

#endif
