/* The real table's parts beside the angles: creases found, error bars that hold, and points the filter drops. */
#ifndef GNP_WEIGHTS_REAL_EXTRA_H
#define GNP_WEIGHTS_REAL_EXTRA_H

#include <stdio.h>

#include "weights/validate/real_table.h"

/* Those of them that there are, under headings. Errors of writing are left in the stream. */
void gnp_real_extra_write_text(const struct gnp_real_table *table, FILE *out);
void gnp_real_extra_write_markdown(const struct gnp_real_table *table, FILE *out);

/* Members of the table's object, each with a comma behind. */
void gnp_real_extra_write_json(const struct gnp_real_table *table, FILE *out);

/* What all judged clouds of a kind, or of every kind (GNP_REAL_HARDNESSES), come to: counts are summed, figures are
 * means over the clouds that have them. */
struct gnp_real_detail gnp_real_extra_sum(const struct gnp_real_table *table, enum gnp_real_detailed which,
                                          enum gnp_real_hardness hardness);

#endif
