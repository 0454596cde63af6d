/* Inside of a file of tensors: what its JSON header says is read into the list of tensors and the metadata. */
#ifndef GNP_CORE_SAFETENSORS_HEADER_H
#define GNP_CORE_SAFETENSORS_HEADER_H

#include "core/base/sha256.h"
#include "core/model/safetensors.h"

struct json_t;

struct gnp_safetensors {
	char *path;
	char sha256[GNP_SHA256_TEXT];
	struct json_t *root; /* the header; owns every string below */
	unsigned char *data;
	size_t data_size;
	struct gnp_safetensors_tensor *tensors;
	size_t tensor_count;
	struct gnp_safetensors_metadata *metadata;
	size_t metadata_count;
};

/* Fills tensors and metadata from the header of that size, text in memory that is freed afterwards; data and data_size
 * are there. Every tensor has its bytes, together they cover the data, all are finite. On failure what is made is the
 * file's, for gnp_safetensors_free. */
gnp_status gnp_safetensors_header_read(struct gnp_safetensors *file, const char *text, size_t size,
                                       struct gnp_error *error);
void gnp_safetensors_header_free(struct gnp_safetensors *file);

/* Sets error to "FILE: TEXT", of a long path the end, which tells more, and returns status. */
gnp_status gnp_safetensors_fail(const char *path, struct gnp_error *error, gnp_status status, const char *format, ...)
	__attribute__((format(printf, 4, 5)));
gnp_status gnp_safetensors_no_memory(const char *path, size_t bytes, struct gnp_error *error);

#endif
