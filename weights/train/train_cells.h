/* Judges points of many patches together: the centres of a micro-batch, and further points of its patches, by the rules
 * `cell` and `near` of the loss, with the way back to the coefficients of their surfaces. */
#ifndef GNP_WEIGHTS_TRAIN_CELLS_H
#define GNP_WEIGHTS_TRAIN_CELLS_H

#include "core/fit/legendre.h"
#include "weights/train/loss.h"

struct gnp_train_cells {
	const struct gnp_loss_options *loss;
	struct gnp_basis basis;
	size_t batch; /* patches a step: what a micro-batch is a part of */
	size_t k;     /* of the patches */
};

/* Adds a micro-batch's part of the loss to *loss and to dcoefficients (patches, size of the basis), given coefficients, and
 * of the terms to terms->cell and terms->near. GNP_OUT_OF_MEMORY. */
gnp_status gnp_train_cells_judge(const struct gnp_train_cells *cells, const struct gnp_train_patches *patches,
                                 const double *coefficients, double *dcoefficients, struct gnp_loss_terms *terms,
                                 double *loss, struct gnp_scratch *scratch, struct gnp_error *error);

#endif
