/* The columns of a file made of rows that is read: where each named number of every row goes. */
#ifndef GNP_PROTO_FIELDS_H
#define GNP_PROTO_FIELDS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/codec/decode.h"
#include "proto/tensor/tensor.h"

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

/* Makes the tensors of `rows` rows of `count` fields and says where each field goes: x y z become points, nx ny nz
 * (or normal_x..., normalx...) normals, those of wanted inputs these, and with `all` every other field a tensor of
 * its own datatype, less a leading "scalar_". columns (count). The caller has checked that rows are backed by the
 * body. */
gnp_status gnp_fields_bind(const struct gnp_decode *decode, const char *format, const struct gnp_field *fields,
                           size_t count, size_t rows, struct gnp_tensors *tensors, struct gnp_column *columns,
                           struct gnp_error *error);

/* Copies a number of every row, found every `step` bytes from source on, to where its column goes. False when a
 * value does not fit the column's datatype. */
bool gnp_column_copy(const struct gnp_column *column, enum gnp_datatype datatype, const unsigned char *source,
                     size_t step, size_t rows);

#endif
