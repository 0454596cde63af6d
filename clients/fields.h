/* Finds the named fields of a decoded file, whatever way its format spells them. */
#ifndef GNP_CLIENTS_FIELDS_H
#define GNP_CLIENTS_FIELDS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/tensor.h"

/* The field called name, or scalar_name as PLY spells it; for names that a format splits into columns (name_0, name_1, ...),
 * the first column. NULL when there is none. */
const struct gnp_tensor *gnp_field_find(const struct gnp_tensors *tensors, const char *name);

/* A fresh array (count, width) of the field's numbers, freed by free(); columns are put together again. GNP_NOT_FOUND
 * listing the fields there are; GNP_INVALID_ARGUMENT when it has another number of values. */
gnp_status gnp_field_load(const struct gnp_tensors *tensors, const char *name, size_t count, size_t width, double **out,
                          struct gnp_error *error);

/* Rows of `points`; GNP_INVALID_ARGUMENT when there are none, or when a coordinate is not finite. */
gnp_status gnp_field_points(const struct gnp_tensors *tensors, size_t *count, double **out, struct gnp_error *error);

#endif
