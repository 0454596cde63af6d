/* A model: the weights of a network with all that is needed to run it, from one file.
 *
 * The file's metadata says which network it is and how its patches are made; the keys, their types and ranges are one table in
 * model.c, described in weights/README.md. The tensors must be those of gnp_architecture_layout, by name and shape, none missing
 * and none more. Nothing is guessed: a file that does not say what it is is refused. */
#ifndef GNP_CORE_MODEL_H
#define GNP_CORE_MODEL_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "core/network/network.h"
#include "core/network/safetensors.h"

enum { GNP_MODEL_NAME_MAX = 63 }; /* bytes of a model's name: [A-Za-z0-9_.-], not beginning with a dot or a dash */

/* How the patches are made that the network was trained on. epsilon = 1.1 r_k, r_k the distance to the k-th neighbour. */
struct gnp_recipe {
	unsigned k;
	double buffer;       /* the network sees nodes out to buffer * epsilon */
	double height_scale; /* heights are divided by max(height_scale * their standard deviation, delta0) */
	double delta0_ratio; /* delta0 in units of epsilon; 0: it is a length */
	double delta0;       /* delta0 as a length [length]; 0: it is a ratio */
};

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

/* Writes the file of a model: metadata, and the parameters as tensors in the layout's order; see gnp_safetensors_save. What
 * gnp_model_load would refuse is refused, and then there is no file or the old one. */
gnp_status gnp_model_save(const char *path, const struct gnp_model_source *source, struct gnp_error *error);

/* Whether a text may be a model's name. */
bool gnp_model_name_fits(const char *name);

#endif
