/* What the parameters of the model for every cloud are before training, and those that follow from data. */
#ifndef GNP_WEIGHTS_ANY_START_H
#define GNP_WEIGHTS_ANY_START_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/scratch.h"
#include "core/network/architecture.h"

/* Fills parameters (layout->total) for a seed: weights of a layer of m inputs uniform within 1 / sqrt(m), biases of the
 * trunk within 0.2, others 0; a kernel's last layer so that a block keeps the size of what it is given. Every support
 * starts with light penalties, all nodes about as heavy, and with creases and outliers rare. */
void gnp_any_start_parameters(const struct gnp_architecture *architecture, const struct gnp_layout *layout,
                              uint64_t seed, float *parameters);

/* Mean and deviation of rows (count) of numbers (width). */
struct gnp_any_spread {
	size_t width, count;
	double *sum, *square; /* (width) */
};
gnp_status gnp_any_spread_begin(size_t width, struct gnp_scratch *scratch, struct gnp_any_spread *out,
                                struct gnp_error *error);
void gnp_any_spread_add(struct gnp_any_spread *spread, const float *row);
/* Into the layout's rows PREFIX.mean and PREFIX.deviation, which is at least 0.1: what hardly varies is not blown
 * up. */
void gnp_any_spread_write(const struct gnp_any_spread *spread, const struct gnp_layout *layout, const char *prefix,
                          float *parameters);

#endif
