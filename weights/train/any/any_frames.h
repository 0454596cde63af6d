/* How frames are learned: by what every step of a point's ladder would cost, and the cost that the model's scores make
 * likely. It is trained first and alone: supports are built in the frames it chooses. */
#ifndef GNP_WEIGHTS_ANY_FRAMES_H
#define GNP_WEIGHTS_ANY_FRAMES_H

#include "weights/train/any/any_supports.h"

/* At points of a cloud that are no outliers, drawn alike. Lives in scratch. */
struct gnp_any_frames {
	size_t count;
	const struct gnp_ladder *ladders; /* (count) */
	float (*cost)[GNP_LADDER_STEPS];  /* (count) of each step's frame (any_loss.h) */
};

gnp_status gnp_any_frames_draw(const struct gnp_any_cloud *cloud, size_t count, struct gnp_random *random,
                               struct gnp_scratch *scratch, struct gnp_any_frames *out, struct gnp_error *error);

/* Expected cost of frame i where steps are chosen as likely as exp(score). Its derivative times share is added to
 * gradient (the layout's total). */
double gnp_any_frames_expect(const struct gnp_network *network, const struct gnp_any_frames *frames, size_t i,
                             double share, float *gradient);

/* Cost of the step that is chosen. */
double gnp_any_frames_chosen(const struct gnp_network *network, const struct gnp_any_frames *frames, size_t i);

#endif
