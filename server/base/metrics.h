/* Counts what the process does, and writes the counters in Prometheus text form. All label sets are fixed: no client
 * can add a time series.
 *
 * Counters are atomic; any thread adds, any thread writes them out. */
#ifndef GNPD_METRICS_H
#define GNPD_METRICS_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/base/task.h"
#include "proto/operation/operations.h"
#include "proto/operation/prepared_cache.h"
#include "proto/tensor/message.h"
#include "server/base/queue.h"

/* What a request is counted as: one of these, or GNPD_LABEL_OPERATION + i for the i-th operation of the table. */
enum gnpd_label {
	GNPD_LABEL_OTHER, GNPD_LABEL_HEALTH, GNPD_LABEL_METRICS, GNPD_LABEL_OPENAPI, GNPD_LABEL_METADATA, GNPD_LABEL_ADMIN, GNPD_LABEL_JOBS,
	GNPD_LABEL_OPERATION, GNPD_LABELS = GNPD_LABEL_OPERATION + GNP_OPERATIONS_MAX
};

enum gnpd_reject {
	GNPD_REJECT_FRAMING, GNPD_REJECT_BODY_LIMIT, GNPD_REJECT_QUEUE_COUNT, GNPD_REJECT_QUEUE_BYTES,
	GNPD_REJECT_DRAINING, GNPD_REJECT_SLOW_HEADERS, GNPD_REJECT_SLOW_BODY, GNPD_REJECT_SLOW_REPLY, GNPD_REJECT_REQUEST_MEMORY, GNPD_REJECT_POINTS,
	GNPD_REJECT_ADDRESS, GNPD_REJECT_UNAUTHORIZED, GNPD_REJECT_FORBIDDEN, GNPD_REJECT_KEY_CONCURRENCY, GNPD_REJECT_KEY_RATE,
	GNPD_REJECT_HOST, GNPD_REJECT_CROSS_SITE,
	GNPD_REJECTS
};

enum gnpd_cancel { GNPD_CANCEL_CLIENT_GONE, GNPD_CANCEL_DEADLINE, GNPD_CANCEL_SHUTDOWN, GNPD_CANCELS };

enum gnpd_reload { GNPD_RELOAD_OK, GNPD_RELOAD_FAILED, GNPD_RELOADS };

enum { GNPD_METRICS_CODES = 26, GNPD_METRICS_BUCKETS = 13 };

struct gnpd_metrics {
	double started;    /* seconds since the epoch */
	const char *build; /* what git called the sources; "" until main says so */
	atomic_uint_fast64_t requests[GNPD_LABELS][GNPD_METRICS_CODES];
	atomic_uint_fast64_t buckets[GNPD_LABELS][GNPD_METRICS_BUCKETS + 1];
	atomic_uint_fast64_t nanoseconds[GNPD_LABELS];
	atomic_uint_fast64_t stages[GNP_STAGE_COUNT]; /* nanoseconds */
	atomic_uint_fast64_t rejected[GNPD_REJECTS], cancelled[GNPD_CANCELS];
	atomic_uint_fast64_t bytes_in, bytes_out, points, accepted;
	atomic_uint_fast64_t reloads[GNPD_RELOADS]; /* of weights, asked for while running */
	atomic_uint_fast64_t key_reloads[GNPD_RELOADS], certificate_reloads[GNPD_RELOADS];
	atomic_size_t connections, models;
};

void gnpd_metrics_init(struct gnpd_metrics *metrics);
void gnpd_metrics_reject(struct gnpd_metrics *metrics, enum gnpd_reject reason);
void gnpd_metrics_cancel(struct gnpd_metrics *metrics, enum gnpd_cancel reason);

/* What calls of an operation of the table are counted as. */
enum gnpd_label gnpd_metrics_label(const struct gnp_operation *operation);
/* One finished request: code is the HTTP status (one outside the known ones counts as 500). */
void gnpd_metrics_request(struct gnpd_metrics *metrics, enum gnpd_label label, int code, double seconds);
/* Adds the seconds of each stage of a finished task. */
void gnpd_metrics_stages(struct gnpd_metrics *metrics, const struct gnp_task *task);

/* A number that grows with every request that brought a body and every task that was worked on. */
uint64_t gnpd_metrics_work(const struct gnpd_metrics *metrics);

/* Finished requests of a label with a code below 400, and with another; nanoseconds of all. */
void gnpd_metrics_totals(const struct gnpd_metrics *metrics, enum gnpd_label label, uint64_t *good, uint64_t *bad,
                         uint64_t *nanoseconds);

/* Appends the exposition. state, cache: of the queue and of the prepared operators now. */
gnp_status gnpd_metrics_write(const struct gnpd_metrics *metrics, const struct gnpd_queue_state *state,
                              const struct gnp_prepared_cache_state *cache, size_t workers, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
