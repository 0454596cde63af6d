/* How well a network in training does on shapes it is not trained on: the columns of the paper's table, at the centres of patches.
 *
 * The protocol's judge has the last word; this is its quick relative: the same errors (score.h) on other shapes. */
#ifndef GNP_WEIGHTS_TRAIN_WATCH_H
#define GNP_WEIGHTS_TRAIN_WATCH_H

#include "weights/protocol/score.h"
#include "weights/train/trainable.h"

struct gnp_train_watch;

/* Loads `shapes` clouds of the regime and chooses `centres` points of each, the same every time. Borrows network and pool. */
gnp_status gnp_train_watch_open(const struct gnp_train_data *data, const struct gnp_train_recipe *recipe, size_t shapes,
                                size_t centres, const struct gnp_trainable *network, struct gnp_pool *pool,
                                struct gnp_train_watch **out, struct gnp_error *error);
void gnp_train_watch_close(struct gnp_train_watch *watch);

/* Errors with these parameters, which the network takes: means over the shapes of relative L2 norms (normals: of 1 - n . n*). */
gnp_status gnp_train_watch_run(struct gnp_train_watch *watch, const float *parameters, double errors[GNP_SCORES],
                               struct gnp_error *error);

#endif
