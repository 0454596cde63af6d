/* What the parts of the daemon share. Filled by main before the first connection, torn down after the last. */
#ifndef GNPD_SERVER_H
#define GNPD_SERVER_H

#include <stdatomic.h>
#include <stdbool.h>

#include "core/base/pool.h"
#include "proto/operation/prepared_cache.h"
#include "server/access/guard.h"
#include "server/api/reloader.h"
#include "server/base/heap.h"
#include "server/base/log.h"
#include "server/base/metrics.h"
#include "server/base/queue.h"
#include "server/base/tls.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/jobs/job_watch.h"
#include "server/jobs/jobs.h"
#include "server/work/loader.h"

struct gnpd_notify;

struct gnpd_server {
	const struct gnpd_config *config;
	struct gnpd_log log;
	struct gnpd_metrics metrics;
	struct gnp_pool *pool;
	struct gnpd_loader *loader;
	struct gnpd_guard *guard;
	struct gnpd_tls *tls;              /* NULL without a certificate */
	struct gnpd_reloader *reloader;
	struct gnpd_notify *notify;        /* of the service manager; NULL without one */
	struct gnp_prepared_cache *cache;  /* of operators */
	struct gnpd_queue *queue;
	struct gnpd_queue *disk_queue;           /* of what waits for the disk */
	struct gnpd_watchers *watchers;
	struct gnpd_jobs *jobs;
	struct gnpd_connections *connections;
	struct gnpd_heap heap;             /* main's */
	struct gnp_buffer openapi;         /* written once */
	unsigned boot;                     /* random, the first half of generated request ids */
	atomic_uint_fast64_t requests;     /* the second half */
	atomic_size_t active;              /* requests past their headers whose answer is not out */
	atomic_size_t suspended;           /* connections that wait for an answer, or for the next bit of a stream */
	atomic_bool leaving;               /* about to end: not ready, and connections end with the next answer */
	atomic_bool draining;              /* no new work; leaving too */
};

#endif
