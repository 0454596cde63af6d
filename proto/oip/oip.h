/* The Open Inference Protocol (KServe v2) over REST with the binary tensor data extension: bodies of /v2. */
#ifndef GNP_PROTO_OIP_H
#define GNP_PROTO_OIP_H

#include "core/base/status.h"
#include "proto/operation/operation.h"
#include "proto/tensor/message.h"

/* Passed for header_length when the Inference-Header-Content-Length header was absent: all JSON. */
#define GNP_OIP_NO_HEADER SIZE_MAX

/* Parses the text of an Inference-Header-Content-Length header against the (decompressed) body size. */
gnp_status gnp_oip_header_length(const char *text, size_t body_size, size_t *header_length, struct gnp_error *error);

/* Whether the text is an object with a member "inputs", which tells a request of the protocol from a cloud in JSON. Looks no deeper, so
 * that what is wrong with the rest is for gnp_oip_decode_request to say. */
bool gnp_oip_is_request(const unsigned char *body, size_t size);

/* Decodes an infer request. header_length 0: the whole body is raw FP32 `points` (n, 3). Binary tensors borrow from body,
 * which must outlive request (misaligned ones are copied). Memory is asked of request->inputs.budget before it is taken. On failure
 * *request is unchanged, and some of the budget may still be reserved. */
gnp_status gnp_oip_decode_request(const unsigned char *body, size_t size, size_t header_length,
                                  struct gnp_request *request, struct gnp_error *error);

/* Encodes a response: the JSON head followed by binary tensors. The head is complete; `tails` names the outputs whose
 * bytes follow, in order, so that a server can send them without a copy. *tails is malloc'd, freed by the caller. */
gnp_status gnp_oip_encode_response(const struct gnp_operation *operation, const struct gnp_request *request,
                                   const struct gnp_response *response, struct gnp_buffer *head,
                                   const struct gnp_tensor ***tails, size_t *tail_count, struct gnp_error *error);

/* Encodes an infer request (the command line's side); all tensors binary. *header_length: bytes of JSON. */
gnp_status gnp_oip_encode_request(const struct gnp_request *request, struct gnp_buffer *body, size_t *header_length,
                                  struct gnp_error *error);
/* Decodes a response; header_length as above. Binary tensors borrow from body. */
gnp_status gnp_oip_decode_response(const unsigned char *body, size_t size, size_t header_length,
                                   struct gnp_response *response, struct gnp_error *error);

/* {"name","versions","platform","inputs","outputs","parameters"} of an operation, for GET /v2/models/{name}; of one that uses
 * weights also "weights": [{"name","sha256","parameter_count","regime","k"}], those of models (NULL: none). */
gnp_status gnp_oip_model_metadata(const struct gnp_operation *operation, const struct gnp_models *models,
                                  struct gnp_buffer *buffer, struct gnp_error *error);

/* {"name","platform","backend","max_batch_size","input","output"}, for GET /v2/models/{name}/config, as Triton's model configuration names
 * them: no batches, dims of -1 are free. */
gnp_status gnp_oip_model_config(const struct gnp_operation *operation, struct gnp_buffer *buffer, struct gnp_error *error);

/* {"error","code","request_id"}. request_id may be NULL. */
gnp_status gnp_oip_error_body(gnp_status status, const char *text, const char *request_id, struct gnp_buffer *buffer);

#endif
