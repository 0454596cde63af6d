/* The run of a validation: draws the shapes, has every selected method judged in every selected regime. */
#ifndef GNP_WEIGHTS_VALIDATION_H
#define GNP_WEIGHTS_VALIDATION_H

#include "weights/validate/table.h"

/* Fills a table that gnp_table_create made, for its protocol and selection. A shape and its clean sample serve all regimes
 * and methods. Deterministic for any worker count, but for the seconds. Progress counts shapes and estimates; task may
 * be NULL. On failure the table is partly filled. */
gnp_status gnp_validation_run(struct gnp_table *table, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error);

#endif
