#include "server/base/metrics.h"

#include <assert.h>
#include <string.h>
#include <time.h>

#include "core/base/version.h"
#include "proto/operation/operations.h"
#include "proto/tensor/writer.h"

static const int codes[GNPD_METRICS_CODES] = {200, 202, 204, 206, 304, 400, 401, 403, 404, 405, 406, 408,
                                              409, 410, 413, 414, 415, 416, 422, 429, 431, 499, 500, 503, 504, 507};
static const double bounds[GNPD_METRICS_BUCKETS] = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1,
                                                    0.25,  0.5,    1,     2.5,  10,    60};
static const char *const labels[GNPD_LABEL_OPERATION] = {
	[GNPD_LABEL_OTHER] = "other", [GNPD_LABEL_HEALTH] = "health", [GNPD_LABEL_METRICS] = "metrics",
	[GNPD_LABEL_OPENAPI] = "openapi", [GNPD_LABEL_METADATA] = "metadata", [GNPD_LABEL_ADMIN] = "admin", [GNPD_LABEL_JOBS] = "jobs"};
static const char *const rejects[GNPD_REJECTS] = {
	[GNPD_REJECT_FRAMING] = "framing", [GNPD_REJECT_BODY_LIMIT] = "body_limit",
	[GNPD_REJECT_QUEUE_COUNT] = "queue_count", [GNPD_REJECT_QUEUE_BYTES] = "queue_bytes",
	[GNPD_REJECT_DRAINING] = "draining", [GNPD_REJECT_SLOW_HEADERS] = "slow_headers",
	[GNPD_REJECT_SLOW_BODY] = "slow_body", [GNPD_REJECT_SLOW_REPLY] = "slow_reply", [GNPD_REJECT_REQUEST_MEMORY] = "request_memory", [GNPD_REJECT_POINTS] = "points",
	[GNPD_REJECT_ADDRESS] = "connections_per_address", [GNPD_REJECT_UNAUTHORIZED] = "unauthorized",
	[GNPD_REJECT_FORBIDDEN] = "forbidden", [GNPD_REJECT_KEY_CONCURRENCY] = "key_concurrency",
	[GNPD_REJECT_KEY_RATE] = "key_rate",
	[GNPD_REJECT_HOST] = "host", [GNPD_REJECT_CROSS_SITE] = "cross_site"};
static const char *const cancels[GNPD_CANCELS] = {
	[GNPD_CANCEL_CLIENT_GONE] = "client_gone", [GNPD_CANCEL_DEADLINE] = "deadline", [GNPD_CANCEL_SHUTDOWN] = "shutdown"};

static const char *const reloads[GNPD_RELOADS] = {[GNPD_RELOAD_OK] = "ok", [GNPD_RELOAD_FAILED] = "failed"};

static const char *label_name(unsigned label)
{
	if (label < GNPD_LABEL_OPERATION)
		return labels[label];
	return gnp_operation_at(label - GNPD_LABEL_OPERATION)->name;
}

enum gnpd_label gnpd_metrics_label(const struct gnp_operation *operation)
{
	unsigned label = GNPD_LABEL_OPERATION;
	while (label < GNPD_LABELS && gnp_operation_at(label - GNPD_LABEL_OPERATION) != operation)
		label++;
	assert(label < GNPD_LABELS);
	return (enum gnpd_label)label;
}

void gnpd_metrics_init(struct gnpd_metrics *metrics)
{
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	memset(metrics, 0, sizeof *metrics);
	metrics->build = "";
	metrics->started = (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void gnpd_metrics_reject(struct gnpd_metrics *metrics, enum gnpd_reject reason)
{
	atomic_fetch_add(&metrics->rejected[reason], 1);
}

void gnpd_metrics_cancel(struct gnpd_metrics *metrics, enum gnpd_cancel reason)
{
	atomic_fetch_add(&metrics->cancelled[reason], 1);
}

static size_t code_index(int code)
{
	size_t unknown = 0;
	for (size_t i = 0; i < GNPD_METRICS_CODES; i++) {
		if (codes[i] == code)
			return i;
		if (codes[i] == 500)
			unknown = i;
	}
	return unknown;
}

void gnpd_metrics_request(struct gnpd_metrics *metrics, enum gnpd_label label, int code, double seconds)
{
	size_t bucket = 0;
	while (bucket < GNPD_METRICS_BUCKETS && seconds > bounds[bucket])
		bucket++;
	atomic_fetch_add(&metrics->requests[label][code_index(code)], 1);
	atomic_fetch_add(&metrics->buckets[label][bucket], 1);
	atomic_fetch_add(&metrics->nanoseconds[label], (uint64_t)(seconds * 1e9));
}

void gnpd_metrics_stages(struct gnpd_metrics *metrics, const struct gnp_task *task)
{
	for (int i = 0; i < GNP_STAGE_COUNT; i++)
		atomic_fetch_add(&metrics->stages[i], (uint64_t)(task->seconds[i] * 1e9));
}

uint64_t gnpd_metrics_work(const struct gnpd_metrics *metrics)
{
	uint64_t work = atomic_load(&metrics->bytes_in);
	for (int i = 0; i < GNP_STAGE_COUNT; i++)
		work += atomic_load(&metrics->stages[i]);
	return work;
}

void gnpd_metrics_totals(const struct gnpd_metrics *metrics, enum gnpd_label label, uint64_t *good, uint64_t *bad,
                         uint64_t *nanoseconds)
{
	*good = *bad = 0;
	for (size_t i = 0; i < GNPD_METRICS_CODES; i++)
		*(codes[i] < 400 ? good : bad) += atomic_load(&metrics->requests[label][i]);
	*nanoseconds = atomic_load(&metrics->nanoseconds[label]);
}

/* ---- Writing ---- */

/* Labels that have a name: there is room for more operations than there are. */
static unsigned labels_used(void)
{
	unsigned label = GNPD_LABEL_OPERATION;
	while (gnp_operation_at(label - GNPD_LABEL_OPERATION))
		label++;
	return label;
}

static void put_family(struct gnp_writer *w, const char *name, const char *type, const char *help)
{
	gnp_writer_printf(w, "# HELP gnpd_%s %s\n# TYPE gnpd_%s %s\n", name, help, name, type);
}

static void put_requests(struct gnp_writer *w, const struct gnpd_metrics *metrics)
{
	put_family(w, "requests_total", "counter", "Finished requests.");
	for (unsigned label = 0; label < labels_used(); label++)
		for (size_t i = 0; i < GNPD_METRICS_CODES; i++)
			gnp_writer_printf(w, "gnpd_requests_total{operation=\"%s\",code=\"%d\"} %llu\n", label_name(label), codes[i],
			                  (unsigned long long)atomic_load(&metrics->requests[label][i]));
}

static void put_histogram(struct gnp_writer *w, const struct gnpd_metrics *metrics, unsigned label)
{
	static const char name[] = "gnpd_request_duration_seconds";
	const char *operation = label_name(label);
	double seconds = 1e-9 * (double)atomic_load(&metrics->nanoseconds[label]);
	unsigned long long below = 0;
	for (size_t i = 0; i < GNPD_METRICS_BUCKETS; i++) {
		below += atomic_load(&metrics->buckets[label][i]);
		gnp_writer_printf(w, "%s_bucket{operation=\"%s\",le=\"%g\"} %llu\n", name, operation, bounds[i], below);
	}
	below += atomic_load(&metrics->buckets[label][GNPD_METRICS_BUCKETS]);
	gnp_writer_printf(w, "%s_bucket{operation=\"%s\",le=\"+Inf\"} %llu\n", name, operation, below);
	gnp_writer_printf(w, "%s_sum{operation=\"%s\"} %.9f\n", name, operation, seconds);
	gnp_writer_printf(w, "%s_count{operation=\"%s\"} %llu\n", name, operation, below);
}

static void put_durations(struct gnp_writer *w, const struct gnpd_metrics *metrics)
{
	put_family(w, "request_duration_seconds", "histogram", "From the request line to the end of the answer.");
	for (unsigned label = 0; label < labels_used(); label++)
		put_histogram(w, metrics, label);
}

/* One counter for each name, which is the value of its label. */
struct reasons {
	const char *name, *help, *label;
	const char *const *values;
	const atomic_uint_fast64_t *counts;
	size_t count;
};

static void put_reasons(struct gnp_writer *w, const struct reasons *reasons)
{
	put_family(w, reasons->name, "counter", reasons->help);
	for (size_t i = 0; i < reasons->count; i++)
		gnp_writer_printf(w, "gnpd_%s{%s=\"%s\"} %llu\n", reasons->name, reasons->label, reasons->values[i],
		                  (unsigned long long)atomic_load(&reasons->counts[i]));
}

static void put_all_reasons(struct gnp_writer *w, const struct gnpd_metrics *m)
{
	const struct reasons all[] = {
		{"rejected_total", "Requests refused by a limit.", "reason", rejects, m->rejected, GNPD_REJECTS},
		{"cancelled_total", "Requests and jobs whose work was stopped.", "reason", cancels, m->cancelled, GNPD_CANCELS},
		{"weights_reloads_total", "Loads of weights asked for while running.", "result", reloads, m->reloads, GNPD_RELOADS},
		{"keys_reloads_total", "Loads of keys asked for while running.", "result", reloads, m->key_reloads, GNPD_RELOADS},
		{"certificate_reloads_total", "Loads of the certificate asked for while running.", "result", reloads,
		 m->certificate_reloads, GNPD_RELOADS},
	};
	for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
		put_reasons(w, &all[i]);
}

static void put_stages(struct gnp_writer *w, const struct gnpd_metrics *metrics)
{
	put_family(w, "stage_seconds_total", "counter", "Time spent in each stage of the work.");
	for (int i = 0; i < GNP_STAGE_DONE; i++)
		gnp_writer_printf(w, "gnpd_stage_seconds_total{stage=\"%s\"} %.9f\n", gnp_stage_name((enum gnp_stage)i),
		                  1e-9 * (double)atomic_load(&metrics->stages[i]));
}

static void put_singles(struct gnp_writer *w, const struct gnpd_metrics *metrics, const struct gnpd_queue_state *state,
                        const struct gnp_prepared_cache_state *cache, size_t workers)
{
	const struct { const char *name, *type, *help; double value; } singles[] = {
		{"request_body_bytes_total", "counter", "Bytes of request bodies read.", (double)atomic_load(&metrics->bytes_in)},
		{"response_body_bytes_total", "counter", "Bytes of response bodies prepared.", (double)atomic_load(&metrics->bytes_out)},
		{"points_total", "counter", "Points of requests that were computed.", (double)atomic_load(&metrics->points)},
		{"connections_accepted_total", "counter", "Connections accepted.", (double)atomic_load(&metrics->accepted)},
		{"connections", "gauge", "Open connections.", (double)atomic_load(&metrics->connections)},
		{"weights_models", "gauge", "Models in use.", (double)atomic_load(&metrics->models)},
		{"queue_requests", "gauge", "Requests that wait for a runner.", (double)state->waiting},
		{"queue_bytes", "gauge", "Bodies and estimated memory of all requests held.", (double)state->bytes},
		{"running_requests", "gauge", "Requests that are being computed.", (double)state->running},
		{"prepared_cache_operators", "gauge", "Prepared operators kept.", (double)cache->entries},
		{"prepared_cache_bytes", "gauge", "Bytes of prepared operators kept.", (double)cache->bytes},
		{"prepared_cache_limit_bytes", "gauge", "Most bytes of them.", (double)cache->limit},
		{"prepared_cache_hits_total", "counter", "Requests that found their operator.", (double)cache->hits},
		{"prepared_cache_misses_total", "counter", "Requests that made their operator.", (double)cache->misses},
		{"prepared_cache_evictions_total", "counter", "Operators let go for want of room.", (double)cache->evictions},
		{"operator_cache_operators", "gauge", "Old name of gnpd_prepared_cache_operators.", (double)cache->entries},
		{"operator_cache_bytes", "gauge", "Old name of gnpd_prepared_cache_bytes.", (double)cache->bytes},
		{"operator_cache_limit_bytes", "gauge", "Old name of gnpd_prepared_cache_limit_bytes.", (double)cache->limit},
		{"operator_cache_hits_total", "counter", "Old name of gnpd_prepared_cache_hits_total.", (double)cache->hits},
		{"operator_cache_misses_total", "counter", "Old name of gnpd_prepared_cache_misses_total.", (double)cache->misses},
		{"operator_cache_evictions_total", "counter", "Old name of gnpd_prepared_cache_evictions_total.", (double)cache->evictions},
		{"workers", "gauge", "Compute threads.", (double)workers},
		{"start_time_seconds", "gauge", "Start of the process since the epoch.", metrics->started},
	};
	for (size_t i = 0; i < sizeof singles / sizeof singles[0]; i++) {
		put_family(w, singles[i].name, singles[i].type, singles[i].help);
		gnp_writer_printf(w, "gnpd_%s %.15g\n", singles[i].name, singles[i].value);
	}
}

gnp_status gnpd_metrics_write(const struct gnpd_metrics *metrics, const struct gnpd_queue_state *state,
                              const struct gnp_prepared_cache_state *cache, size_t workers, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_writer w = gnp_writer_to(buffer, error);
	put_family(&w, "build_info", "gauge", "The version and build that run, as labels.");
	gnp_writer_printf(&w, "gnpd_build_info{version=\"" GNP_VERSION "\",build=\"%s\"} 1\n", metrics->build);
	put_requests(&w, metrics);
	put_durations(&w, metrics);
	put_stages(&w, metrics);
	put_all_reasons(&w, metrics);
	put_singles(&w, metrics, state, cache, workers);
	return w.status;
}
