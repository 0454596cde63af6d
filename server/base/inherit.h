/* Takes over the listening sockets that a service manager opened (systemd's sd_listen_fds protocol). */
#ifndef GNPD_INHERIT_H
#define GNPD_INHERIT_H

#include "core/base/status.h"

struct gnpd_inherited {
	int main, admin; /* -1 when there is none; the caller's to close */
};

/* pid, count, names: values of LISTEN_PID, LISTEN_FDS and LISTEN_FDNAMES, NULL when unset; first: where the descriptors begin (3 for a
 * service). The socket named "admin" is the admin listener's, one of any other name that of requests. Each must be a
 * listening stream socket, and there may be one of a kind: else GNP_INVALID_ARGUMENT, and what was handed over is closed. */
gnp_status gnpd_inherit(const char *pid, const char *count, const char *names, int first, struct gnpd_inherited *out,
                        struct gnp_error *error);

#endif
