/* Table 1 of altered models: what the parts of those that gnp and fit are judged with do to their errors. */
#ifndef GNP_WEIGHTS_ABLATION_TABLE_H
#define GNP_WEIGHTS_ABLATION_TABLE_H

#include <stdio.h>

#include "core/base/task.h"
#include "weights/validate/ablation.h"
#include "weights/validate/table.h"

/* Means over the shapes; NAN: not judged, or the model has no such part. */
struct gnp_ablation_table {
	double mean[GNP_ABLATION_PARTS][GNP_METHODS][GNP_FAMILIES][GNP_REGIMES][GNP_SCORES];
};

/* Takes the whole models' errors from a table that is filled, and judges altered ones on the same shapes where that has
 * gnp or fit. */
gnp_status gnp_ablation_table_run(const struct gnp_table *whole, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_ablation_table *out, struct gnp_error *error);

/* Errors of writing are left in the stream. */
void gnp_ablation_table_write_text(const struct gnp_ablation_table *table, FILE *out);
void gnp_ablation_table_write_markdown(const struct gnp_ablation_table *table, FILE *out);

#endif
