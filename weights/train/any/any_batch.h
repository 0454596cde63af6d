/* Micro-batches of the model for every cloud: what a worker draws, judges and differentiates at a time. */
#ifndef GNP_WEIGHTS_ANY_BATCH_H
#define GNP_WEIGHTS_ANY_BATCH_H

#include "weights/train/any/any_loss.h"
#include "weights/train/any/any_supports.h"

/* Clouds to draw from, borrowed. */
struct gnp_any_pick {
	const struct gnp_any_cloud *clouds; /* (count) */
	size_t count;
};

enum { GNP_ANY_BATCH_CLOUDS = 4, GNP_ANY_BATCH_FRAMES = 32 }; /* of a micro-batch of supports; of one of frames */

/* count supports of GNP_ANY_BATCH_CLOUDS clouds: their shares of a loss whose mean is over `batch` are added to terms,
 * its derivatives to gradient (the layout's total). */
gnp_status gnp_any_batch_supports(const struct gnp_network *network, const struct gnp_any_pick *from, size_t count,
                                  size_t batch, struct gnp_random *random, struct gnp_scratch *scratch,
                                  struct gnp_any_terms *terms, float *gradient, struct gnp_error *error);

/* GNP_ANY_BATCH_FRAMES frames of one cloud: the same for their expected cost. */
gnp_status gnp_any_batch_frames(const struct gnp_network *network, const struct gnp_any_pick *from, size_t batch,
                                struct gnp_random *random, struct gnp_scratch *scratch, double *loss, float *gradient,
                                struct gnp_error *error);

/* Means and deviations of the ladder's looks, and of supports' summaries, over all of the clouds; into parameters,
 * which are the network's own in the end. */
gnp_status gnp_any_batch_spread_looks(const struct gnp_network *network, const struct gnp_any_pick *from,
                                      struct gnp_random *random, struct gnp_scratch *scratch, float *parameters,
                                      struct gnp_error *error);
gnp_status gnp_any_batch_spread_summaries(const struct gnp_network *network, const struct gnp_any_pick *from,
                                          struct gnp_random *random, struct gnp_scratch *scratch, float *parameters,
                                          struct gnp_error *error);

#endif
