/* What analysers cannot see of functions in other files: included before each file they look at, and by nothing that
 * is built.
 *
 * Without it they take gnp_error_set and gnp_no_memory for functions that may return GNP_OK, and follow every refused
 * allocation to a use of its null pointer. */
#ifndef GNP_TESTS_LINT_FACTS_H
#define GNP_TESTS_LINT_FACTS_H

#include "core/base/status.h"

#define gnp_error_set(error, status, ...) ((gnp_error_set)(error, status, __VA_ARGS__), (status))
#define gnp_no_memory(what, count, things, error) ((gnp_no_memory)(what, count, things, error), GNP_OUT_OF_MEMORY)

#endif
