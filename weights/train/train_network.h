/* The geometric neural operator as training sees it: trunk and head, forward and backward. */
#ifndef GNP_WEIGHTS_TRAIN_NETWORK_H
#define GNP_WEIGHTS_TRAIN_NETWORK_H

#include "weights/train/trainable.h"

/* from: a file of weights of this very network, with whose parameters it begins instead of drawn ones, and nothing is
 * calibrated; or NULL. On failure *out is unchanged. Freed by gnp_train_network_close. */
gnp_status gnp_train_network_open(const struct gnp_architecture *architecture, const char *from,
                                  struct gnp_trainable *out, struct gnp_error *error);
void gnp_train_network_close(struct gnp_trainable *network);

#endif
