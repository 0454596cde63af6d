/* What main, the handlers and HTTP share: the engine that computes, and what stands between it and those who ask.
 * Only server/api, server/http and gnpd.c know it; all other parts are given what they use. Filled by main before
 * the first connection, torn down after the last. */
#ifndef GNPD_SERVER_H
#define GNPD_SERVER_H

#include <stdatomic.h>
#include <stdbool.h>

#include "proto/tensor/message.h"
#include "server/work/engine.h"

struct gnpd_connections;
struct gnpd_guard;
struct gnpd_jobs;
struct gnpd_notify;
struct gnpd_reloader;
struct gnpd_tls;
struct gnpd_watchers;

struct gnpd_server {
	struct gnpd_engine engine;
	struct gnpd_guard *guard;
	struct gnpd_tls *tls;              /* NULL without a certificate */
	struct gnpd_reloader *reloader;
	struct gnpd_notify *notify;        /* of the service manager; NULL without one */
	struct gnpd_queue *disk_queue;     /* of what waits for the disk */
	struct gnpd_watchers *watchers;
	struct gnpd_jobs *jobs;
	struct gnpd_connections *connections;
	struct gnp_buffer openapi;         /* written once */
	unsigned boot;                     /* random, the first half of generated request ids */
	atomic_uint_fast64_t requests;     /* the second half */
	atomic_size_t active;              /* requests past their headers whose answer is not out */
	atomic_size_t suspended;           /* connections that wait for an answer, or for the next bit of a stream */
	atomic_bool leaving;               /* about to end: not ready, and connections end with the next answer */
	atomic_bool draining;              /* no new work; leaving too */
};

#endif
