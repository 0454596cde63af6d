/* Named typed tensors: what every codec decodes to and encodes from. */
#ifndef GNP_PROTO_TENSOR_H
#define GNP_PROTO_TENSOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"
#include "proto/tensor/budget.h"
#include "proto/tensor/datatype.h"

#define GNP_TENSOR_RANK_MAX 8
#define GNP_TENSOR_NAME_MAX 64

/* Row-major, native endianness (little on every supported machine). */
struct gnp_tensor {
	char name[GNP_TENSOR_NAME_MAX];
	enum gnp_datatype datatype;
	unsigned rank;
	size_t shape[GNP_TENSOR_RANK_MAX];
	void *data;      /* size bytes */
	size_t size;
	bool owned;      /* data is freed with the tensor; else it is borrowed from a body that outlives it */
};

struct gnp_tensors {
	size_t count, capacity;
	struct gnp_tensor *items;
	/* Borrowed: asked for the bytes of every tensor that gnp_tensors_add makes; NULL: nobody is. */
	const struct gnp_budget *budget;
};

/* What a tensor of an operation is. shape: -1 for the number of points; -2, -3, ... for other free extents. */
struct gnp_tensor_info {
	const char *name;
	/* Of inputs: the natural one, any numeric type is taken, for GNP_BOOL with the values 0 and 1; of outputs: GNP_FP32
	 * for that of `points` (FP64 where it is FP64, else FP32), any other is meant as it is. */
	enum gnp_datatype datatype;
	unsigned rank;
	int64_t shape[4];
	bool optional;              /* of outputs: an answer whose format has no place for it is whole without it */
	const char *help;
};

/* Of a table of tensors: the one of that name (length bytes), or NULL; and what a refusal of the name says is known. */
const struct gnp_tensor_info *gnp_tensor_infos_find(const struct gnp_tensor_info *infos, size_t count, const char *name,
                                                    size_t length);
struct gnp_names;
const char *gnp_tensor_infos_names(const struct gnp_tensor_info *infos, size_t count, const char *given, size_t length,
                                   struct gnp_names *list);

/* What texts call a free extent: n for -1, then m, s, t, u, v. */
char gnp_extent_letter(int64_t extent);

/* Elements of a shape, overflow-checked; false on overflow. */
bool gnp_tensor_elements(unsigned rank, const size_t *shape, size_t *elements);

/* Appends an uninitialised owned tensor (data allocated) and returns it through out; its address is valid until the
 * next append. GNP_INVALID_ARGUMENT on overflow or a bad rank, GNP_OUT_OF_MEMORY, and whatever the budget answers. */
gnp_status gnp_tensors_add(struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype, unsigned rank,
                           const size_t *shape, struct gnp_tensor **out, struct gnp_error *error);
/* The same with data of the right size that is borrowed (owned false) or taken over, freed by free() (owned true). */
gnp_status gnp_tensors_add_data(struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype,
                                unsigned rank, const size_t *shape, void *data, bool owned,
                                struct gnp_tensor **out, struct gnp_error *error);
const struct gnp_tensor *gnp_tensors_find(const struct gnp_tensors *tensors, const char *name);
void gnp_tensors_clear(struct gnp_tensors *tensors);

/* Element i of a numeric tensor as a double (BOOL as 0 or 1). */
double gnp_tensor_get(const struct gnp_tensor *tensor, size_t i);

/* A fresh array (free()) of all elements of a numeric tensor as doubles; NULL when memory is exhausted. */
double *gnp_tensor_to_double(const struct gnp_tensor *tensor);

#endif
