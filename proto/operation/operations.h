/* The table of all operations. */
#ifndef GNP_PROTO_OPERATIONS_H
#define GNP_PROTO_OPERATIONS_H

#include <stddef.h>

#include "proto/operation/operation.h"

/* Most operations there can be: tables beside this one that have a row for each have room for so many. */
enum { GNP_OPERATIONS_MAX = 32 };

/* The i-th operation, or NULL past the last; by name, or NULL. */
const struct gnp_operation *gnp_operation_at(size_t i);
const struct gnp_operation *gnp_operation_find(const char *name);

#endif
