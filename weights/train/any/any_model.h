/* The file of a trained model for every cloud, with notes for people on how it was trained. */
#ifndef GNP_WEIGHTS_ANY_MODEL_H
#define GNP_WEIGHTS_ANY_MODEL_H

#include "weights/train/any/any_plan.h"

/* Writes plan->output. end: of the training. */
gnp_status gnp_any_model_write(const struct gnp_any_plan *plan, const float *parameters, const struct gnp_any_end *end,
                               struct gnp_error *error);

#endif
