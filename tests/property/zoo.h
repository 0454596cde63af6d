/* The clouds and inputs of the property tests, made from words. */
#ifndef GNP_TESTS_PROPERTY_ZOO_H
#define GNP_TESTS_PROPERTY_ZOO_H

#include "proto/operation/operation.h"
#include "proto/tensor/message.h"
#include "tests/property/spec.h"

/* What words may say, last what must be refused; NULL-terminated. */
extern const char *const zoo_clouds[], *const zoo_normals[], *const zoo_masks[], *const zoo_values[];

/* The request that a line stands for. False where the line names what is not known, or memory is exhausted. Freed by gnp_request_clear. */
bool zoo_request(const struct spec *spec, const struct gnp_operation *operation, struct gnp_request *request);

#endif
