/* The geometric neural operator as training sees it: trunk and head, forward and backward. */
#ifndef GNP_WEIGHTS_TRAIN_OPERATOR_H
#define GNP_WEIGHTS_TRAIN_OPERATOR_H

#include "core/network/architecture.h"
#include "weights/train/train_network.h"

/* On failure *out is unchanged. Freed by gnp_train_operator_close. */
gnp_status gnp_train_operator_open(const struct gnp_architecture *architecture, struct gnp_train_network *out,
                                   struct gnp_error *error);
void gnp_train_operator_close(struct gnp_train_network *network);

#endif
