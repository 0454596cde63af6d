/* PLY in: ascii and both binary byte orders. Only the element `vertex` is kept; the others are stepped over. */
#ifndef GNP_PROTO_PLY_DECODE_H
#define GNP_PROTO_PLY_DECODE_H

#include "core/base/status.h"
#include "proto/codec/decode.h"
#include "proto/tensor/tensor.h"

/* Appends to *tensors, which may hold part of the file after a failure. */
gnp_status gnp_ply_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);

#endif
