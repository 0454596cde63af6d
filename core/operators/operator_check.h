/* Whether an operator on a cloud can be believed, whatever it will be asked for: tests that cost little beside making
 * it. Each records a warning with the value found and its limit (warning.h); warnings may be NULL. */
#ifndef GNP_CORE_OPERATOR_CHECK_H
#define GNP_CORE_OPERATOR_CHECK_H

#include "core/base/warning.h"
#include "core/cells/diffusion.h"
#include "core/operators/collocation.h"
#include "core/operators/domain.h"

/* Random right-hand sides, the same ones every time: they hold a share of every mode that an operator has, also of
 * those that no surface has. */
void gnp_operator_check_draw(size_t count, double *numbers);
/* energy (count): the quotients (energy.h) of their solutions. Of an operator that resolves the surface they are 1.03
 * to 1.3, of one with modes of its own beyond all bounds or negative, whatever its screening and what is given. */
void gnp_operator_check_energy(const double *energy, size_t count, const struct gnp_domain *domain,
                               struct gnp_warnings *warnings);

/* Edges of cells between points whose normals agree, one far above the other's tangent plane: sheets that face the same
 * way, taken for one. */
void gnp_operator_check_crossings(const struct gnp_prepared *prepared, const struct gnp_stiffness *volumes,
                                  struct gnp_warnings *warnings);

/* Rows of the Laplacian, where it is among the matrices, whose point has a positive weight of its own, or one that all
 * others outweigh by far. open: cells at boundaries, where that is to be expected. */
void gnp_operator_check_rows(const struct gnp_collocation *matrices, size_t open, struct gnp_warnings *warnings);

/* Stencils of a lower degree than asked for. */
void gnp_operator_check_stencils(const struct gnp_collocation *matrices, unsigned degree,
                                 struct gnp_warnings *warnings);

#endif
