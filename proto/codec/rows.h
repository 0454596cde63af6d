/* The columns of a file made of rows that is written: which number of which tensor stands in each, and under what
 * name. */
#ifndef GNP_PROTO_ROWS_H
#define GNP_PROTO_ROWS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/tensor.h"

/* Most columns of such a file. */
#define GNP_FORMAT_COLUMNS_MAX 4096

/* The type a tensor is stored in where a format has neither BOOL and FP16 nor integers of 64 bits: UINT8 for BOOL,
 * FP32 for FP16, INT32 for wide integers that all fit, else FP64. */
enum gnp_datatype gnp_stored_type(const struct gnp_tensor *tensor);

/* A number of every row of a tensor, under the name a file gives it. */
struct gnp_row_item {
	char name[GNP_TENSOR_NAME_MAX + 32];
	const struct gnp_tensor *tensor;
	size_t item; /* within the tensor's row */
};

/* The columns of a file of rows: x y z, nx ny nz, `quality` (the scalar of that name, or the first one once more), and
 * the rest as prefix + name (+ "_" and the index of a wider value). *items is freed by the caller. A tensor whose rows
 * are not the points': GNP_NOT_ACCEPTABLE. */
gnp_status gnp_row_items(const struct gnp_tensors *tensors, const char *format, const char *prefix, bool quality,
                         struct gnp_row_item **items, size_t *count, struct gnp_error *error);

/* points (n, 3) of tensors to be encoded; GNP_NOT_ACCEPTABLE when there are none. */
gnp_status gnp_encode_points(const struct gnp_tensors *tensors, const char *format, const struct gnp_tensor **points,
                             struct gnp_error *error);

#endif
