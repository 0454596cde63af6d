/* What a computation needs, whoever asked for it: a request, a job or a test. Filled by whoever starts the parts
 * (main), which are all borrowed here; it outlives all work. */
#ifndef GNPD_ENGINE_H
#define GNPD_ENGINE_H

struct gnp_pool;
struct gnp_prepared_cache;
struct gnpd_config;
struct gnpd_loader;
struct gnpd_log;
struct gnpd_metrics;
struct gnpd_queue;

struct gnpd_engine {
	const struct gnpd_config *config;
	struct gnpd_log *log;
	struct gnpd_metrics *metrics;
	struct gnp_pool *pool;            /* of compute threads */
	struct gnpd_queue *queue;         /* of requests; its bytes are all work's */
	struct gnpd_loader *loader;       /* of the models in use */
	struct gnp_prepared_cache *cache; /* of operators */
};

#endif
