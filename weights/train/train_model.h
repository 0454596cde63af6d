/* The file of a trained model, with notes for people on how it was trained. */
#ifndef GNP_WEIGHTS_TRAIN_MODEL_H
#define GNP_WEIGHTS_TRAIN_MODEL_H

#include "weights/train/train_plan.h"

/* Writes plan->output. last: the last row of the training's log. */
gnp_status gnp_train_model_write(const struct gnp_train_plan *plan, const float *parameters,
                                 const struct gnp_train_row *last, struct gnp_error *error);

#endif
