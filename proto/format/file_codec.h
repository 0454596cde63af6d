/* The codecs behind file.h, one file each, and what they share. */
#ifndef GNP_PROTO_FILE_CODEC_H
#define GNP_PROTO_FILE_CODEC_H

#include "proto/file/file.h"

/* What a decoder is asked for. `all` false: points and normals, FP32 or FP64, and what is wanted beside them; true: everything the
 * file names. */
struct gnp_decode {
	const unsigned char *body;
	size_t size;
	bool all;
	struct gnp_file_wants wants;
};

/* Decoders append to *tensors, which may hold part of the file after a failure. */
typedef gnp_status (*gnp_decode_fn)(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
gnp_status gnp_ply_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
gnp_status gnp_npy_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
gnp_status gnp_npz_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
/* The bytes of the array `parameters` of an answer; none where there is no such array. */
gnp_status gnp_npz_parameters(const unsigned char *body, size_t size, struct gnp_buffer *json, struct gnp_error *error);
gnp_status gnp_xyz_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
gnp_status gnp_pcd_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
gnp_status gnp_obj_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
gnp_status gnp_json_file_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);

/* Encoders append to *buffer, which may hold part of the file after a failure. comments may be NULL. */
typedef gnp_status (*gnp_encode_fn)(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                                    struct gnp_buffer *buffer, struct gnp_error *error);
gnp_status gnp_ply_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error);
gnp_status gnp_npy_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error);
gnp_status gnp_npz_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error);
gnp_status gnp_xyz_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error);
/* Commas and a plain heading; there is no place for comments. */
gnp_status gnp_csv_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error);
gnp_status gnp_vtk_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error);
gnp_status gnp_mtx_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error);
gnp_status gnp_json_file_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                                struct gnp_buffer *buffer, struct gnp_error *error);

/* GNP_TOO_LARGE when count is over decode's limit. */
gnp_status gnp_decode_check_points(const struct gnp_decode *decode, size_t count, struct gnp_error *error);

/* The wanted input beside points and normals that a file calls name, or scalar_ and its name; NULL when there is none. */
const struct gnp_tensor_info *gnp_decode_input(const struct gnp_decode *decode, const char *name);

/* One number of every row goes to target + row * stride as datatype. */
struct gnp_column {
	unsigned char *target; /* NULL: the number is skipped */
	size_t stride;
	enum gnp_datatype datatype;
};

/* A named number of every row, as formats made of rows declare them. */
struct gnp_field {
	const char *name; /* not NUL-terminated */
	size_t length;
	enum gnp_datatype datatype;
};

/* Makes the tensors of `rows` rows of `count` fields and says where each field goes: x y z become points, nx ny nz (or
 * normal_x..., normalx...) normals, those of wanted inputs these, and with `all` every other field a tensor of its own datatype, less
 * a leading "scalar_". columns (count). The caller has checked that rows are backed by the body. */
gnp_status gnp_fields_bind(const struct gnp_decode *decode, const char *format, const struct gnp_field *fields,
                           size_t count, size_t rows, struct gnp_tensors *tensors, struct gnp_column *columns,
                           struct gnp_error *error);

/* Copies a number of every row, found every `step` bytes from source on, to where its column goes. False when a value does
 * not fit the column's datatype. */
bool gnp_column_copy(const struct gnp_column *column, enum gnp_datatype datatype, const unsigned char *source, size_t step,
                     size_t rows);

/* The type a tensor is stored in where a format has neither BOOL and FP16 nor integers of 64 bits: UINT8 for BOOL, FP32 for FP16, INT32
 * for wide integers that all fit, else FP64. */
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

/* Six unnamed columns may be colours as well: as normals columns 4 to 6 must be of unit length, to 0.05. GNP_INVALID_ARGUMENT names the file
 * or array, the row and the length, and what else may come (otherwise). */
gnp_status gnp_check_normal_columns(const char *what, size_t row, const double normal[3], const char *otherwise, struct gnp_error *error);

/* Appends "<prefix>name value\n" for every comment, and one for each warning; line ends within become spaces. */
gnp_status gnp_write_comments(const struct gnp_values *comments, const char *prefix, struct gnp_buffer *buffer,
                              struct gnp_error *error);

#endif
