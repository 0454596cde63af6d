/* What a decoder is asked for, and the checks that all of them make. */
#ifndef GNP_PROTO_DECODE_H
#define GNP_PROTO_DECODE_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/tensor.h"

struct gnp_operation;

/* What is wanted of a file. */
struct gnp_file_wants {
	size_t max_points;                    /* 0: no limit; more are GNP_TOO_LARGE */
	/* Those beside points and normals are taken where a column or an array has their name or scalar_ and their name;
	 * columns name_0, name_1, ... are one input of rank 2. */
	const struct gnp_tensor_info *inputs;
	size_t input_count;
	/* Of a request: members of JSON that would have no effect are refused, but what answers carry; NULL: members that
	 * are no input are passed over. */
	const struct gnp_operation *operation;
};

/* What a decoder is asked for. `all` false: points and normals, FP32 or FP64, and what is wanted beside them; true:
 * everything the file names. */
struct gnp_decode {
	const unsigned char *body;
	size_t size;
	bool all;
	struct gnp_file_wants wants;
};

/* GNP_TOO_LARGE when count is over decode's limit. */
gnp_status gnp_decode_check_points(const struct gnp_decode *decode, size_t count, struct gnp_error *error);

/* The wanted input beside points and normals that a file calls name, or scalar_ and its name; NULL when there is
 * none. */
const struct gnp_tensor_info *gnp_decode_input(const struct gnp_decode *decode, const char *name);

/* Whether a file's name for something (length bytes) stands for `name`: as it is, or after the scalar_ that PLY puts
 * before scalars. */
bool gnp_decode_spells(const char *text, size_t length, const char *name);
/* Such a name without its scalar_; *length becomes shorter. */
const char *gnp_decode_bare_name(const char *text, size_t *length);

/* Whether an input is one beside points and normals. */
bool gnp_decode_is_extra(const struct gnp_tensor_info *info);

/* Six unnamed columns may be colours as well: as normals columns 4 to 6 must be of unit length, to 0.05.
 * GNP_INVALID_ARGUMENT names the file or array, the row and the length, and what else may come (otherwise). */
gnp_status gnp_decode_check_normal(const char *what, size_t row, const double normal[3], const char *otherwise,
                                   struct gnp_error *error);

#endif
