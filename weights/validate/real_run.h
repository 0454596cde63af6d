/* Fills the real table: every cloud of the plan, judged by every method. */
#ifndef GNP_WEIGHTS_REAL_RUN_H
#define GNP_WEIGHTS_REAL_RUN_H

#include "weights/validate/real_table.h"

/* models are borrowed as long as the table's methods are. Lines of progress, and what is left out ("skipped: NAME"),
 * to `log` (NULL: none). Where a method fails, each of its normals counts as lost, and the log says why. On failure
 * *out is unchanged; cleared by gnp_real_table_clear. */
gnp_status gnp_real_run(const struct gnp_real_plan *plan, const struct gnp_models *models, struct gnp_pool *pool,
                        struct gnp_task *task, FILE *log, struct gnp_real_table *out, struct gnp_error *error);

#endif
