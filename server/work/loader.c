#include "server/work/loader.h"

#include <limits.h>
#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

#include "server/base/log.h"
#include "server/base/metrics.h"
#include "server/config/config.h"
#include "server/work/engine.h"

struct gnpd_loader {
	const struct gnpd_engine *engine;
	pthread_mutex_t lock; /* of models */
	struct gnp_models *models;
};

/* A folder that had models and has none is a mistake, say an unmounted disk. */
static gnp_status load(const char *folder, size_t before, struct gnp_models **out, struct gnp_error *error)
{
	struct gnp_models *models;
	gnp_status status = gnp_models_load(folder, &models, error);
	if (status != GNP_OK)
		return status;
	if (before && !gnp_models_count(models)) {
		gnp_models_release(models);
		return gnp_error_set(error, GNP_IO, "weights-dir: got no *.safetensors, need some: %zu models are in use", before);
	}
	*out = models;
	return GNP_OK;
}

static void log_models(struct gnpd_log *log, const char *what, const struct gnp_models *models)
{
	static const char without[] = "the estimator gnp, the default, answers 503 unavailable, gmls and adaptive work";
	const char *folder = gnp_models_folder(models);
	char here[PATH_MAX];
	if (gnp_models_count(models))
		gnpd_log_event(log, GNPD_LOG_INFO, "%s: %zu models from %s", what, gnp_models_count(models), folder);
	else if (*folder)
		gnpd_log_event(log, GNPD_LOG_WARNING, "%s: got no *.safetensors in %s: %s", what, folder, without);
	else
		gnpd_log_event(log, GNPD_LOG_WARNING, "%s: got no *.safetensors in ../share/gnpd/weights beside the program and in ./weights of %s "
		               "(weights-dir): %s", what, getcwd(here, sizeof here) ? here : "?", without);
}

static void use(struct gnpd_loader *loader, struct gnp_models *models)
{
	pthread_mutex_lock(&loader->lock);
	struct gnp_models *old = loader->models;
	loader->models = models;
	pthread_mutex_unlock(&loader->lock);
	atomic_store(&loader->engine->metrics->models, gnp_models_count(models));
	gnp_models_release(old);
}

gnp_status gnpd_loader_reload(struct gnpd_loader *loader, struct gnp_error *error)
{
	const struct gnpd_engine *engine = loader->engine;
	struct gnp_models *models = NULL;
	gnp_status status = load(engine->config->weights_dir, atomic_load(&engine->metrics->models), &models, error);
	if (status != GNP_OK)
		return status;
	log_models(engine->log, "reload: weights", models);
	use(loader, models);
	return GNP_OK;
}

gnp_status gnpd_loader_create(const struct gnpd_engine *engine, struct gnpd_loader **out, struct gnp_error *error)
{
	struct gnpd_loader *loader = calloc(1, sizeof *loader);
	if (!loader)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "loader: no memory for %zu bytes", sizeof *loader);
	loader->engine = engine;
	pthread_mutex_init(&loader->lock, NULL);
	gnp_status status = load(engine->config->weights_dir, 0, &loader->models, error);
	if (status != GNP_OK) {
		pthread_mutex_destroy(&loader->lock);
		free(loader);
		return status;
	}
	atomic_store(&engine->metrics->models, gnp_models_count(loader->models));
	log_models(engine->log, "weights", loader->models);
	*out = loader;
	return GNP_OK;
}

void gnpd_loader_free(struct gnpd_loader *loader)
{
	if (!loader)
		return;
	gnp_models_release(loader->models);
	pthread_mutex_destroy(&loader->lock);
	free(loader);
}

struct gnp_models *gnpd_loader_models(struct gnpd_loader *loader)
{
	pthread_mutex_lock(&loader->lock);
	struct gnp_models *models = gnp_models_retain(loader->models);
	pthread_mutex_unlock(&loader->lock);
	return models;
}
