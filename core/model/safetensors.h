/* Files of weights: safetensors, read strictly and written deterministically.
 *
 * A file is 8 bytes of header length N (little-endian), N bytes of JSON, and the tensors' bytes, little-endian and
 * row-major. The JSON is an object: tensor name -> {"dtype", "shape", "data_offsets": [begin, end)}, offsets counted
 * from the end of the header, and "__metadata__" -> an object of strings. Read strictly means: the lengths are checked
 * against the size of the file before anything of that size is allocated; no key is given twice or unknown; names are
 * UTF-8 without control characters; tensors are F32 and finite, each has exactly the bytes of its shape, and together
 * they cover the rest of the file without a hole or an overlap. What is refused is refused with a message that names
 * file, tensor, found and expected. */
#ifndef GNP_CORE_SAFETENSORS_H
#define GNP_CORE_SAFETENSORS_H

#include <stddef.h>

#include "core/base/status.h"

enum {
	GNP_SAFETENSORS_RANK_MAX = 8,
	GNP_SAFETENSORS_NAME_MAX = 128,         /* bytes of a tensor's name or a metadata key */
	GNP_SAFETENSORS_TENSORS_MAX = 4096,
	GNP_SAFETENSORS_HEADER_MAX = 1 << 20,   /* bytes */
	GNP_SAFETENSORS_FILE_MAX = 1 << 30      /* bytes */
};

struct gnp_safetensors_tensor {
	const char *name;
	size_t rank, shape[GNP_SAFETENSORS_RANK_MAX];
	size_t count;      /* product of the shape */
	const float *data; /* (shape), row-major */
};

struct gnp_safetensors_metadata {
	const char *key, *value;
};

/* A file in memory; immutable, so threads may share it. */
struct gnp_safetensors;

/* Reads the file, all of it at once. GNP_IO: it cannot be read; GNP_INVALID_ARGUMENT: what it holds is refused. */
gnp_status gnp_safetensors_load(const char *path, struct gnp_safetensors **out, struct gnp_error *error);
/* The same for bytes in memory, which are copied; name stands for the file in messages. */
gnp_status gnp_safetensors_decode(const char *name, const void *bytes, size_t size, struct gnp_safetensors **out,
                                  struct gnp_error *error);
void gnp_safetensors_free(struct gnp_safetensors *file);
/* Frees the tensors and keeps the rest, for whoever has made something of them. */
void gnp_safetensors_drop_tensors(struct gnp_safetensors *file);

/* Sets error to "FILE: TEXT" and returns GNP_INVALID_ARGUMENT: for whoever finds fault with what a file holds. */
gnp_status gnp_safetensors_refuse(const struct gnp_safetensors *file, struct gnp_error *error, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Everything below lives as long as the file. Tensors come in the order of their data, metadata in that of the keys. */
const char *gnp_safetensors_path(const struct gnp_safetensors *file);
/* Of all bytes of the file, 64 hexadecimal digits. */
const char *gnp_safetensors_sha256(const struct gnp_safetensors *file);
size_t gnp_safetensors_tensor_count(const struct gnp_safetensors *file);
/* NULL past the last / when there is none of that name. */
const struct gnp_safetensors_tensor *gnp_safetensors_tensor_at(const struct gnp_safetensors *file, size_t i);
const struct gnp_safetensors_tensor *gnp_safetensors_tensor_find(const struct gnp_safetensors *file, const char *name);
const struct gnp_safetensors_metadata *gnp_safetensors_metadata_at(const struct gnp_safetensors *file, size_t i);
/* The value of a key, or NULL. */
const char *gnp_safetensors_metadata_find(const struct gnp_safetensors *file, const char *key);

#endif
