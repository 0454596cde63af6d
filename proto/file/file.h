/* Files in, files out, by the functions of their format: bodies of /v1 and the command line's files. */
#ifndef GNP_PROTO_FILE_H
#define GNP_PROTO_FILE_H

#include <stddef.h>

#include "core/base/status.h"
#include "proto/format/format.h"
#include "proto/tensor/message.h"
#include "proto/tensor/tensor.h"

/* Decodes a file into request inputs: `points` (n, 3) and, when present, `normals` (n, 3), FP32 or FP64 as in the
 * file, and other inputs that are wanted, in the file's type. wants may be NULL: points and normals without a limit.
 * No count in the file is trusted before the body's size. What is decoded is asked of tensors->budget before it is
 * allocated, and what a decoder needs besides (a table, an archive's entry) while it needs it. Binary data may
 * borrow from body. On failure *tensors is unchanged, and some of the budget may still be reserved. */
gnp_status gnp_file_decode(const struct gnp_format *format, const unsigned char *body, size_t size,
                           const struct gnp_file_wants *wants, struct gnp_tensors *tensors, struct gnp_error *error);

/* Decodes every named array / property of a file as its own tensor (the command line's `convert`, `plot` and tests). */
gnp_status gnp_file_decode_all(const struct gnp_format *format, const unsigned char *body, size_t size,
                               struct gnp_tensors *tensors, struct gnp_error *error);

/* Encodes tensors as a file. PLY/XYZ/VTK need a `points` (n, 3) tensor; `normals` becomes nx ny nz; scalars become
 * `quality` (the first) and `scalar_<name>`; wider values scalar_<name>_<i>. comments: what goes into comment lines. */
gnp_status gnp_file_encode(const struct gnp_format *format, const struct gnp_tensors *tensors,
                           const struct gnp_values *comments, struct gnp_buffer *buffer, struct gnp_error *error);

/* Adds what a file says of itself: the parameters of an answer under their names, and lines of comments, whose first
 * word is taken for the name and the rest for a text. Formats without a place for either (NPY), and files that say
 * nothing, add nothing. */
gnp_status gnp_file_parameters(const struct gnp_format *format, const unsigned char *body, size_t size,
                               struct gnp_values *values, struct gnp_error *error);

#endif
