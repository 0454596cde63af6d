/* The models of a folder: every *.safetensors in it, loaded once, sorted by name, immutable and reference counted, so
 * that those who began with a set finish with it whatever is loaded meanwhile. */
#ifndef GNP_CORE_MODELS_H
#define GNP_CORE_MODELS_H

#include <stddef.h>

#include "core/base/status.h"
#include "core/model/model.h"

struct gnp_models;

/* All or nothing: one bad file is an error that names it. A folder without such files gives an empty set. NULL or "":
 * the first of the default folders that has any (../share/gnpd/weights beside the program, ./weights), else an empty
 * set. The caller holds one reference. */
gnp_status gnp_models_load(const char *folder, struct gnp_models **out, struct gnp_error *error);

/* Any thread. release frees with the last reference; NULL is allowed. */
struct gnp_models *gnp_models_retain(struct gnp_models *models);
void gnp_models_release(struct gnp_models *models);

/* The folder they came from; "" when there was none. */
const char *gnp_models_folder(const struct gnp_models *models);

/* models may be NULL: the empty set. NULL past the last. */
size_t gnp_models_count(const struct gnp_models *models);
const struct gnp_model *gnp_models_at(const struct gnp_models *models, size_t i);

/* By name. GNP_INVALID_ARGUMENT lists those there are; of an empty set GNP_UNAVAILABLE. */
gnp_status gnp_models_find(const struct gnp_models *models, const char *name, const struct gnp_model **out,
                           struct gnp_error *error);

#endif
