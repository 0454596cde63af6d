/* Reads and writes one number of any datatype at any address, as the file codecs need it. */
#ifndef GNP_PROTO_SCALAR_H
#define GNP_PROTO_SCALAR_H

#include <stdbool.h>
#include <stddef.h>

#include "proto/tensor/datatype.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "tensors on the wire are little-endian and used in place");

/* The number at source (unaligned allowed) as a double; BOOL as 0 or 1, BYTES as 0. */
double gnp_scalar_load(enum gnp_datatype datatype, const void *source);

/* Stores value at target (unaligned allowed), integers truncated. False, target unchanged, when value does not fit
 * datatype: out of an integer's range, NaN for an integer, a finite number too large for FP32, FP16 or BYTES at all. */
bool gnp_scalar_store(enum gnp_datatype datatype, void *target, double value);

/* Copies count numbers of size bytes with their bytes reversed. */
void gnp_scalar_swap(void *target, const void *source, size_t count, size_t size);

/* The floating type that holds every value of datatype best: FP32 for FP16, FP32 and integers up to 16 bits, else
 * FP64. */
enum gnp_datatype gnp_scalar_floating(enum gnp_datatype datatype);

#endif
