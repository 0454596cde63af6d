/* The keys by which the metadata of a file says what model is in it: one table of their names, types and ranges for
 * reading and writing. */
#ifndef GNP_CORE_MODEL_KEYS_H
#define GNP_CORE_MODEL_KEYS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "core/model/safetensors.h"
#include "core/network/architecture.h"

enum { GNP_MODEL_NAME_MAX = 63 }; /* bytes of a model's name: [A-Za-z0-9_.-], not beginning with a dot or a dash */

/* Whether a text may be a model's name. */
bool gnp_model_name_fits(const char *name);

/* How the patches are made that the network was trained on. epsilon = 1.1 r_k, r_k the distance to the k-th
 * neighbour. */
struct gnp_recipe {
	unsigned k;
	double buffer;       /* the network sees nodes out to buffer * epsilon */
	double height_scale; /* heights are divided by max(height_scale * their standard deviation, delta0) */
	double delta0_ratio; /* delta0 in units of epsilon; 0: it is a length */
	double delta0;       /* delta0 as a length [length]; 0: it is a ratio */
};

/* What the metadata of a file says of the model in it. */
struct gnp_model_description {
	struct gnp_architecture architecture;
	struct gnp_recipe recipe;
	const char *regime; /* what it was trained for, for example clean, outlier, noise; lives as long as what it was read from */
	unsigned format;
};

/* Every key must be known, and have a value in its range where the model needs one. Errors name file, key, found and
 * expected. */
gnp_status gnp_model_keys_read(const struct gnp_safetensors *file, struct gnp_model_description *out,
                               struct gnp_error *error);

/* Whether a key is of the table, or one for people. */
bool gnp_model_key_known(const char *name);

enum { GNP_MODEL_KEYS_MAX = 24, GNP_MODEL_VALUE_TEXT = 12 * GNP_SHELLS_MAX };

/* What the description has for the keys of the table, in its order, into metadata (GNP_MODEL_KEYS_MAX at least), whose
 * values lie in buffers. Refuses what gnp_model_keys_read would; path stands for the file in messages. */
gnp_status gnp_model_keys_write(const char *path, const struct gnp_model_description *description,
                                char buffers[GNP_MODEL_KEYS_MAX][GNP_MODEL_VALUE_TEXT], struct gnp_safetensors_metadata *metadata,
                                size_t *count, struct gnp_error *error);

#endif
