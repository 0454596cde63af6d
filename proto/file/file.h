/* Files in, files out: PLY, NPY, NPZ, XYZ/TXT/CSV, PCD, OBJ (in), VTK and Matrix Market (out). Bodies of /v1 and the command line's files. */
#ifndef GNP_PROTO_FILE_H
#define GNP_PROTO_FILE_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"
#include "proto/tensor/tensor.h"

/* enumerator, name (as in ?format=), media type, file extension, readable, writable, made of rows (all tensors have as many) */
#define GNP_FORMAT_TABLE(X)                                                               \
	X(GNP_FORMAT_PLY, "ply", "application/ply", "ply", true, true, true)                  \
	X(GNP_FORMAT_NPY, "npy", "application/x-npy", "npy", true, true, false)               \
	X(GNP_FORMAT_NPZ, "npz", "application/x-npz", "npz", true, true, false)               \
	X(GNP_FORMAT_XYZ, "xyz", "text/plain", "xyz", true, true, true)                       \
	X(GNP_FORMAT_CSV, "csv", "text/csv", "csv", true, true, true)                         \
	X(GNP_FORMAT_PCD, "pcd", "application/x-pcd", "pcd", true, false, true)               \
	X(GNP_FORMAT_OBJ, "obj", "model/obj", "obj", true, false, true)                       \
	X(GNP_FORMAT_VTK, "vtk", "application/x-vtk", "vtk", false, true, true)               \
	X(GNP_FORMAT_MTX, "mtx", "application/x-matrix-market", "mtx", false, true, false)    \
	X(GNP_FORMAT_JSON, "json", "application/json", "json", true, true, false)

enum gnp_format {
#define GNP_FORMAT_ENUM(id, name, media, extension, in, out, rows) id,
	GNP_FORMAT_TABLE(GNP_FORMAT_ENUM)
#undef GNP_FORMAT_ENUM
	GNP_FORMAT_COUNT
};

/* Most columns of a file made of rows that is written. */
#define GNP_FORMAT_COLUMNS_MAX 4096

const char *gnp_format_name(enum gnp_format format);
const char *gnp_format_media_type(enum gnp_format format);
bool gnp_format_readable(enum gnp_format format);
bool gnp_format_writable(enum gnp_format format);
bool gnp_format_of_rows(enum gnp_format format);

/* By name or extension ("ply"); by media type, parameters and synonyms allowed (model/ply, text/x-xyz, ...; generic ones such as
 * application/octet-stream or application/x-www-form-urlencoded are not a format); by the first bytes of a body. */
bool gnp_format_by_name(const char *name, enum gnp_format *format);
bool gnp_format_by_media_type(const char *media_type, enum gnp_format *format);
bool gnp_format_by_magic(const unsigned char *data, size_t size, enum gnp_format *format);
/* The media type of an answer, synonyms and application/octet-stream among them, as the tables spell it: static. NULL: it is none. */
const char *gnp_format_media_type_spelled(const char *media_type);
/* The format of an answer, and what it is called. */
struct gnp_format_choice {
	enum gnp_format format;
	const char *media_type; /* static */
	bool asked;             /* the client named it, so that no other may take its place */
};

/* Changes the choice to what an Accept header (RFC 9110) likes best of what can be written: the type with the highest q, the first of
 * several. A range, and application/octet-stream, mean the format chosen before where they cover it, else the first they cover; a type
 * with q=0 is none of a range's. Entries whose q is not 0 to 1 with at most three decimals are passed over. False, and the choice
 * unchanged, when nothing is left. */
bool gnp_format_by_accept(const char *accept, struct gnp_format_choice *choice);

struct gnp_operation;

/* What is wanted of a file. */
struct gnp_file_wants {
	size_t max_points;                    /* 0: no limit; more are GNP_TOO_LARGE */
	const struct gnp_tensor_info *inputs; /* those beside points and normals are taken where a column or an array has their name or
	                                         scalar_ and their name; columns name_0, name_1, ... are one input of rank 2 */
	size_t input_count;
	const struct gnp_operation *operation; /* of a request: members of JSON that would have no effect are refused, but what answers carry;
	                                         NULL: members that are no input are passed over */
};

/* Decodes a file into request inputs: `points` (n, 3) and, when present, `normals` (n, 3), FP32 or FP64 as in the file, and other
 * inputs that are wanted, in the file's type. wants may be NULL: points and normals without a limit.
 * No count in the file is trusted before the body's size. What is decoded is asked of tensors->budget before it is allocated, and what
 * a decoder needs besides (a table, an archive's entry) while it needs it. Binary data may borrow from body. On failure *tensors is
 * unchanged, and some of the budget may still be reserved. */
gnp_status gnp_file_decode(enum gnp_format format, const unsigned char *body, size_t size, const struct gnp_file_wants *wants,
                           struct gnp_tensors *tensors, struct gnp_error *error);

/* Decodes every named array / property of a file as its own tensor (the command line's `convert`, `plot` and tests). */
gnp_status gnp_file_decode_all(enum gnp_format format, const unsigned char *body, size_t size,
                               struct gnp_tensors *tensors, struct gnp_error *error);

/* Encodes tensors as a file. PLY/XYZ/VTK need a `points` (n, 3) tensor; `normals` becomes nx ny nz; scalars become
 * `quality` (the first) and `scalar_<name>`; wider values scalar_<name>_<i>. comments: what goes into comment lines. */
gnp_status gnp_file_encode(enum gnp_format format, const struct gnp_tensors *tensors, const struct gnp_values *comments,
                           struct gnp_buffer *buffer, struct gnp_error *error);

#endif
