#include "proto/operation/operations.h"

#include <string.h>

/* One row for each operation, which operation_NAME.c defines as gnp_operation_NAME. The order is that of every list. */
#define OPERATIONS(X)                                      \
	X(estimate) X(patch) X(filter) X(flow) X(smooth)       \
	X(laplacian) X(poisson) X(heat) X(geodesic) X(spectrum)

#define DECLARE(name) extern const struct gnp_operation gnp_operation_##name;
OPERATIONS(DECLARE)

#define ROW(name) &gnp_operation_##name,
static const struct gnp_operation *const operations[] = {OPERATIONS(ROW)};
enum { COUNT = sizeof operations / sizeof operations[0] };
_Static_assert(sizeof operations / sizeof operations[0] <= GNP_OPERATIONS_MAX,
               "tables beside this one have room for all");

const struct gnp_operation *gnp_operation_at(size_t i)
{
	return i < COUNT ? operations[i] : NULL;
}

const struct gnp_operation *gnp_operation_find(const char *name)
{
	for (size_t i = 0; i < COUNT; i++)
		if (strcmp(operations[i]->name, name) == 0)
			return operations[i];
	return NULL;
}
