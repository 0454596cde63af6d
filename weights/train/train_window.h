/* The clouds training draws patches from at a time: those of the last few visits. */
#ifndef GNP_WEIGHTS_TRAIN_WINDOW_H
#define GNP_WEIGHTS_TRAIN_WINDOW_H

#include "weights/train/train_cloud.h"

struct gnp_train_window;

/* Holds visits first to first + size - 1; the next one's cloud is made ready by a thread of its own meanwhile. data and pool
 * are borrowed until gnp_train_window_close. */
gnp_status gnp_train_window_open(const struct gnp_train_data *data, size_t size, uint64_t first, struct gnp_pool *pool,
                                 struct gnp_train_window **out, struct gnp_error *error);
/* Moves on by a visit: waits for the cloud that comes, the oldest leaves. After a failure the window may only be closed. */
gnp_status gnp_train_window_advance(struct gnp_train_window *window, struct gnp_error *error);
/* Visits held: the first of them, and the cloud of the i-th, i < size. */
uint64_t gnp_train_window_first(const struct gnp_train_window *window);
const struct gnp_train_cloud *gnp_train_window_at(const struct gnp_train_window *window, size_t i);
void gnp_train_window_close(struct gnp_train_window *window);

#endif
