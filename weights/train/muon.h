/* The step for matrices: momentum made orthogonal (Muon; Jordan et al. 2024). A matrix then moves by the same amount
 * along all of its singular directions, of which a gradient's few large ones would drown the others. Vectors, and
 * matrices that read coordinates, take Adam's step. */
#ifndef GNP_WEIGHTS_MUON_H
#define GNP_WEIGHTS_MUON_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/network/architecture.h"
#include "weights/train/adam.h"

/* Replaces a matrix (rows, columns) by about the nearest one whose rows, or columns where those are fewer, are
 * orthonormal: five steps of a quintic Newton-Schulz iteration in float. Singular values that were above a hundredth of
 * the Frobenius norm end within 0.6 .. 1.3. A matrix of zeros stays. GNP_OUT_OF_MEMORY. */
gnp_status gnp_muon_orthogonalize(size_t rows, size_t columns, float *matrix, struct gnp_scratch *scratch,
                                  struct gnp_error *error);

/* Whether a tensor is moved so: a matrix of at least GNP_MUON_SIDE rows and columns. */
enum { GNP_MUON_SIDE = 16 };
bool gnp_muon_takes(const struct gnp_parameter_row *row);

/* One update of all parameters of the layout. With m' = 0.9 m + 0.1 g, Adam's first moment, a matrix moves by
 * -rate 0.2 sqrt(max(rows, columns)) orthogonal(0.9 m' + 0.1 g): steps of the size of Adam's. The same bytes for any
 * number of workers. */
gnp_status gnp_muon_update(const struct gnp_layout *layout, struct gnp_adam *adam, double rate, const float *gradient,
                           float *parameters, struct gnp_pool *pool, struct gnp_error *error);

#endif
