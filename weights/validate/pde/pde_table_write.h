/* Writes the paper's Table 2 beside ours: as text, or as the Markdown of VALIDATION-PDE.md. */
#ifndef GNP_WEIGHTS_PDE_TABLE_WRITE_H
#define GNP_WEIGHTS_PDE_TABLE_WRITE_H

#include "weights/validate/pde/pde_table.h"

void gnp_pde_table_write_text(const struct gnp_pde_table *table, FILE *out);
void gnp_pde_table_write_markdown(const struct gnp_pde_table *table, FILE *out);

#endif
