/* A model: the weights of a network with all that is needed to run it, from one file.
 *
 * The file's metadata says which network it is and how its patches are made; the keys, their types and ranges are one
 * table in model_keys.c, described in weights/README.md. The tensors must be those of gnp_architecture_layout, by name
 * and shape, none missing and none more. Nothing is guessed: a file that does not say what it is is refused. */
#ifndef GNP_CORE_MODEL_H
#define GNP_CORE_MODEL_H

#include <stddef.h>

#include "core/base/status.h"
#include "core/model/model_keys.h"
#include "core/model/safetensors.h"
#include "core/network/network.h"

/* Immutable, so threads share it. Everything belongs to the model. */
struct gnp_model {
	char name[GNP_MODEL_NAME_MAX + 1]; /* the file's, without folder and extension */
	const char *sha256;                /* of the file, 64 hexadecimal digits */
	const char *regime;                /* what it was trained for, for example clean, outlier, noise */
	struct gnp_architecture architecture;
	struct gnp_recipe recipe;
	size_t parameter_count;
	struct gnp_network *network;
	struct gnp_safetensors *file; /* without its tensors: all of the metadata, for gnp_safetensors_metadata_find */
};

/* From a file PATH/NAME.safetensors. Errors name file, key or tensor, found and expected. */
gnp_status gnp_model_load(const char *path, struct gnp_model **out, struct gnp_error *error);
/* The same from a file already read, which becomes the model's, also on failure. */
gnp_status gnp_model_create_take(struct gnp_safetensors *file, struct gnp_model **out, struct gnp_error *error);
void gnp_model_free(struct gnp_model *model);

/* What to write; borrowed. */
struct gnp_model_source {
	struct gnp_architecture architecture;
	struct gnp_recipe recipe;
	const char *regime;
	const struct gnp_safetensors_metadata *more; /* of the keys for people (weights/README.md) */
	size_t more_count;
	const float *parameters; /* the flat block */
};

/* Writes the file of a model: metadata, and the parameters as tensors in the layout's order; see gnp_safetensors_save.
 * What gnp_model_load would refuse is refused, and then there is no file or the old one. */
gnp_status gnp_model_save(const char *path, const struct gnp_model_source *source, struct gnp_error *error);

#endif
