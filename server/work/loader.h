/* The weights in use: the set of models that requests begin with, and another one in its place when asked.
 *
 * A request keeps the set it began with. A set that cannot be loaded changes nothing; neither does a
 * folder that has lost all of its models. */
#ifndef GNPD_LOADER_H
#define GNPD_LOADER_H

#include "core/base/status.h"
#include "core/model/models.h"

struct gnpd_engine;
struct gnpd_loader;

/* Loads the set of the configuration's weights-dir. On failure nothing is left. Of the engine configuration, log and
 * metrics are used. */
gnp_status gnpd_loader_create(const struct gnpd_engine *engine, struct gnpd_loader **out, struct gnp_error *error);
/* NULL is allowed. */
void gnpd_loader_free(struct gnpd_loader *loader);

/* A reference to the set in use, for gnp_models_release. */
struct gnp_models *gnpd_loader_models(struct gnpd_loader *loader);

/* Loads a set and uses it, in the calling thread; never by two at once. On failure the one in use stays. */
gnp_status gnpd_loader_reload(struct gnpd_loader *loader, struct gnp_error *error);

#endif
