/* What requests and responses of the protocol share: an object of a tensor list and the binary section behind the
 * JSON. */
#ifndef GNP_PROTO_OIP_TENSOR_H
#define GNP_PROTO_OIP_TENSOR_H

#include "core/base/status.h"
#include "proto/json/json_text.h"
#include "proto/tensor/tensor.h"

/* The binary section: next is the address of the first byte not yet given to a tensor. */
struct gnp_oip_binary {
	const unsigned char *next, *end;
	bool allowed; /* false: the body is JSON alone */
};

/* The two parts of a body by header_length (GNP_OIP_NO_HEADER: JSON alone). budget: of gnp_json_parse. */
gnp_status gnp_oip_split(const unsigned char *body, size_t size, size_t header_length, const struct gnp_budget *budget,
                         struct gnp_json_document *document, struct gnp_oip_binary *binary, struct gnp_error *error);

/* Decodes root[list], an array of tensor objects, in order. `list` is "inputs" or "outputs". */
gnp_status gnp_oip_decode_tensors(const struct gnp_json_document *document, const char *list,
                                  struct gnp_oip_binary *binary, struct gnp_tensors *tensors, struct gnp_error *error);

/* Decodes a parameters object (may be NULL): strings, numbers and booleans. */
gnp_status gnp_oip_decode_values(const json_t *object, struct gnp_values *values, struct gnp_error *error);

/* Appends {"name","datatype","shape",...}, without the closing brace. */
gnp_status gnp_oip_encode_tensor(const struct gnp_tensor *tensor, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
