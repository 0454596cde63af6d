/* Equations on vertices of real meshes and on exact surfaces: the library's answers against what is known, cloud by
 * cloud. */
#ifndef GNP_WEIGHTS_PDE_REAL_TABLE_H
#define GNP_WEIGHTS_PDE_REAL_TABLE_H

#include <stdio.h>

#include "weights/validate/pde/pde_case.h"
#include "weights/validate/real_list.h"

enum gnp_pde_section { GNP_PDE_CLOSED,
	                   GNP_PDE_OPEN,
	                   GNP_PDE_EXACT,
	                   GNP_PDE_SECTIONS };

/* closed: meshes without rims; open: others; exact. NULL past the last. */
const char *gnp_pde_section_name(unsigned section);

struct gnp_pde_real_plan {
	struct gnp_real_list meshes; /* borrowed */
	unsigned sections;           /* mask */
	size_t points_most;          /* larger clouds are left out; 0: none is */
};

struct gnp_pde_real_row {
	enum gnp_pde_section section;
	char name[48], variant[48];
	size_t points, open, pieces;
	double doubt;                                /* as in struct gnp_pde_case */
	struct gnp_pde_judged judged[GNP_PDE_SIDES]; /* exact ones: by own normals alone */
};

enum { GNP_PDE_ROWS = 64 };

struct gnp_pde_real_table {
	struct gnp_pde_real_plan plan;
	size_t row_count;
	struct gnp_pde_real_row rows[GNP_PDE_ROWS];
};

/* Fills the table. models: for the estimator gnp. Lines of progress to log (NULL: none). */
gnp_status gnp_pde_real_table_run(const struct gnp_pde_real_plan *plan, const struct gnp_models *models,
                                  struct gnp_pool *pool, struct gnp_task *task, FILE *log,
                                  struct gnp_pde_real_table *out, struct gnp_error *error);

#endif
