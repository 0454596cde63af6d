/* Reads and writes arrays of numbers as JSON text without a tree: a million numbers cost no more than their tensor. */
#ifndef GNP_PROTO_JSON_NUMBERS_H
#define GNP_PROTO_JSON_NUMBERS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"
#include "proto/tensor/tensor.h"

/* Appends a tensor with the elements of a JSON array, flat or nested as shape says, row-major. Nothing larger than a small
 * multiple of size is allocated, whatever shape claims. BOOL takes true and false, integers must fit their datatype.
 * On failure *tensors is unchanged. */
gnp_status gnp_json_numbers_read(const char *text, size_t size, const char *name, enum gnp_datatype datatype,
                                 unsigned rank, const size_t *shape, struct gnp_tensors *tensors, struct gnp_error *error);

/* The shape of a nested JSON array, from its first elements and the outermost count; ragged ones fail on reading. */
gnp_status gnp_json_numbers_shape(const char *text, size_t size, const char *name, unsigned *rank,
                                  size_t shape[GNP_TENSOR_RANK_MAX], struct gnp_error *error);

/* Appends a tensor's elements as a JSON array, flat or nested. NaN and infinity: GNP_NOT_ACCEPTABLE naming the tensor. */
gnp_status gnp_json_numbers_write(const struct gnp_tensor *tensor, bool nested, struct gnp_buffer *buffer,
                                  struct gnp_error *error);

#endif
