/* Values at points beside a cloud's surface from the values at its points: those of the local fit at the foot of the
 * nearest point's normal. */
#ifndef GNP_CORE_INTERPOLATION_H
#define GNP_CORE_INTERPOLATION_H

#include "core/cloud/prepare.h"
#include "core/linear/csr.h"

/* points (count, 3), anywhere. out (count, prepared->count): a row a point, its columns by distance, of the polynomial
 * of total degree `degree` (1..7) over twice as many neighbours as it has coefficients, or a lower one; the nearest
 * point's value where none is determined. Freed by gnp_csr_clear. task may be NULL. */
gnp_status gnp_interpolation_make(const struct gnp_prepared *prepared, const double *points, size_t count,
                                  unsigned degree, struct gnp_pool *pool, struct gnp_task *task, struct gnp_csr *out,
                                  struct gnp_error *error);

#endif
