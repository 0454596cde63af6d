/* Writes files of tensors that safetensors.h reads. */
#ifndef GNP_CORE_SAFETENSORS_WRITE_H
#define GNP_CORE_SAFETENSORS_WRITE_H

#include <stddef.h>

#include "core/base/status.h"
#include "core/model/safetensors.h"

/* What to write; borrowed. `count` of the tensors is not looked at. */
struct gnp_safetensors_source {
	const struct gnp_safetensors_metadata *metadata; /* in any order */
	size_t metadata_count;
	const struct gnp_safetensors_tensor *tensors;    /* laid out in this order */
	size_t tensor_count;
};

/* The bytes of a file: the same for the same source, whatever the order of the metadata; the header is padded with
 * spaces so that the data begins at a multiple of 8. Refuses what gnp_safetensors_decode would: what it makes is read
 * back first. name stands for the file in messages. *bytes is the caller's, for free(). */
gnp_status gnp_safetensors_encode(const char *name, const struct gnp_safetensors_source *source, void **bytes,
                                  size_t *size, struct gnp_error *error);

/* Writes them to PATH.new, syncs, and renames: a reader sees the old file or the new one, never a part. GNP_IO. */
gnp_status gnp_safetensors_save(const char *path, const struct gnp_safetensors_source *source, struct gnp_error *error);

#endif
