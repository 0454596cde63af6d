/* Writes the table of equations on real and exact surfaces: as text, or as the Markdown of VALIDATION-PDE-REAL.md. */
#ifndef GNP_WEIGHTS_PDE_REAL_WRITE_H
#define GNP_WEIGHTS_PDE_REAL_WRITE_H

#include "weights/validate/pde/pde_real_table.h"

void gnp_pde_real_write_text(const struct gnp_pde_real_table *table, FILE *out);
void gnp_pde_real_write_markdown(const struct gnp_pde_real_table *table, FILE *out);

#endif
