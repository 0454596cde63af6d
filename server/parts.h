/* The parts of the daemon: one table says in what order they start, and they stop in reverse. */
#ifndef GNPD_PARTS_H
#define GNPD_PARTS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "server/api/server.h"
#include "server/base/heap.h"
#include "server/base/inherit.h"
#include "server/base/log.h"
#include "server/base/metrics.h"
#include "server/http/listeners.h"

/* All that the process holds. */
struct gnpd_daemon {
	struct gnpd_server server;       /* what the parts are given; its pointers are the parts */
	struct gnpd_log log;
	struct gnpd_metrics metrics;
	struct gnpd_heap heap;
	struct gnpd_inherited inherited; /* sockets from the service manager, until the listeners take them */
	struct gnpd_listeners listeners;
	size_t started;                  /* of the table's rows */
};

/* The log writes to standard error from then on; no part has started. */
void gnpd_parts_init(struct gnpd_daemon *daemon, const struct gnpd_config *config, enum gnpd_log_format format,
                     enum gnpd_log_level level);

/* Starts the parts; check: only those that --check-config tries. On failure those that had started are stopped. */
gnp_status gnpd_parts_start(struct gnpd_daemon *daemon, bool check, struct gnp_error *error);
/* Stops those that started. No request may be suspended any more. */
void gnpd_parts_stop(struct gnpd_daemon *daemon);

#endif
