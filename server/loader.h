/* The weights in use: the set of models that requests begin with, and the thread that loads another one when asked.
 *
 * A request keeps the set it began with. A set that cannot be loaded changes nothing but the log and the metrics; neither does a
 * folder that has lost all of its models. */
#ifndef GNPD_LOADER_H
#define GNPD_LOADER_H

#include "models.h"
#include "status.h"

struct gnpd_loader;
struct gnpd_server;

/* Loads the set of the configuration's weights-dir. On failure nothing is left. server: for configuration, log and metrics. */
gnp_status gnpd_loader_create(struct gnpd_server *server, struct gnpd_loader **out, struct gnp_error *error);
/* Waits for a load under way. NULL is allowed. */
void gnpd_loader_free(struct gnpd_loader *loader);

/* A reference to the set in use, for gnp_models_release. */
struct gnp_models *gnpd_loader_models(struct gnpd_loader *loader);

/* Asks for a load, and returns at once. What is asked during a load is done after it, once. */
void gnpd_loader_reload(struct gnpd_loader *loader);

#endif
