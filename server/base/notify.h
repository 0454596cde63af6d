/* Tells a service manager how the daemon is: datagrams to the socket it names in NOTIFY_SOCKET (systemd's sd_notify
 * protocol).
 *
 * These are a few lines of our own because libsystemd would bring its compression and cryptography libraries into a
 * process that listens. All functions allow NULL, the object of a daemon that nobody supervises, and may be called
 * from any thread; what cannot be sent is lost. */
#ifndef GNPD_NOTIFY_H
#define GNPD_NOTIFY_H

#include <stdbool.h>

#include "core/base/status.h"

struct gnpd_notify;

/* socket, watchdog_usec, watchdog_pid: values of NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID, NULL when unset. *out is NULL without a
 * socket. A socket that is no path and no abstract name: GNP_INVALID_ARGUMENT. */
gnp_status gnpd_notify_create(const char *socket, const char *watchdog_usec, const char *watchdog_pid, struct gnpd_notify **out,
                              struct gnp_error *error);
void gnpd_notify_free(struct gnpd_notify *notify);

/* Seconds between signs of life: half of what the manager waits for one, at most 5. 0 without a manager. */
double gnpd_notify_interval(const struct gnpd_notify *notify);
/* True once in an interval. One thread only. */
bool gnpd_notify_due(struct gnpd_notify *notify, double now);

void gnpd_notify_ready(struct gnpd_notify *notify);
void gnpd_notify_reloading(struct gnpd_notify *notify);
/* seconds: what the end may take. */
void gnpd_notify_stopping(struct gnpd_notify *notify, double seconds);
/* Only where the manager waits for signs of life. */
void gnpd_notify_alive(struct gnpd_notify *notify);
/* One line for people. */
void gnpd_notify_status(struct gnpd_notify *notify, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
