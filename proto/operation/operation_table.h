/* The descriptors operation.c gathers into the table, each in a file of its own. */
#ifndef GNP_PROTO_OPERATION_TABLE_H
#define GNP_PROTO_OPERATION_TABLE_H

#include "proto/operation/operation.h"

extern const struct gnp_operation gnp_operation_estimate, gnp_operation_filter, gnp_operation_flow, gnp_operation_laplacian,
	gnp_operation_poisson, gnp_operation_heat, gnp_operation_geodesic, gnp_operation_spectrum;

#endif
