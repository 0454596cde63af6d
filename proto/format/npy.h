/* NPY arrays: the header, and the way from its element order and byte order to a tensor. */
#ifndef GNP_PROTO_NPY_H
#define GNP_PROTO_NPY_H

#include "proto/codec/decode.h"
#include "proto/tensor/buffer.h"

struct gnp_npy {
	enum gnp_datatype datatype;
	bool swapped; /* big-endian */
	bool fortran; /* first index fastest */
	unsigned rank;
	size_t shape[GNP_TENSOR_RANK_MAX];
	size_t header; /* bytes before the data */
	size_t bytes;  /* of the data; the product of shape is known to fit */
};

/* Reads the header of versions 1.0, 2.0 and 3.0; size is what is at hand of the file. */
gnp_status gnp_npy_read_header(const unsigned char *file, size_t size, struct gnp_npy *npy, struct gnp_error *error);

/* Whether gnp_npy_split_vectors can make points or normals (name) of the array, and whether it can be an input: of
 * its rank, or a list that serves one of rank 2 as its only column. */
gnp_status gnp_npy_check_vectors(const struct gnp_npy *npy, const char *name, struct gnp_error *error);
gnp_status gnp_npy_check_input(const struct gnp_npy *npy, const struct gnp_tensor_info *input, struct gnp_error *error);

/* Appends the array as a tensor. data: npy->bytes bytes, borrowed where they can be used in place; with `take` data is
 * malloc'd, reserved of the tensors' budget, and the call's to keep or free, also when it fails. */
gnp_status gnp_npy_add(const struct gnp_npy *npy, const char *name, unsigned char *data, bool take,
                       struct gnp_tensors *tensors, struct gnp_error *error);

/* Replaces the last tensor, named `name` and of a shape that was checked, by the floating (n, 3) tensor of that
 * name, or from (n, 6) points and normals. */
gnp_status gnp_npy_split_vectors(struct gnp_tensors *tensors, const char *name, struct gnp_error *error);

/* Appends a version 1.0 header for tensor, padded to 64 bytes. */
gnp_status gnp_npy_write_header(const struct gnp_tensor *tensor, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
