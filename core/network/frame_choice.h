/* The small network that chooses the frame of a point's surface from the ladder of its nested neighbourhoods.
 *
 * One hidden layer from the ladder's looks (ladder.h), in units of their spread over the training data, to a score of
 * each step; the step with the highest is taken. Part of a model with the head `weighted`: its tensors are frame.*. */
#ifndef GNP_CORE_FRAME_CHOICE_H
#define GNP_CORE_FRAME_CHOICE_H

#include "core/network/network.h"
#include "core/support/ladder.h"

enum { GNP_FRAME_WIDTH_MAX = 1024 };

/* scores (GNP_LADDER_STEPS); hidden (frame_width) out. */
void gnp_frame_scores(const struct gnp_network *network, const float *looks, float *hidden, float *scores);

/* The step of the highest score among those the ladder has. */
unsigned gnp_frame_choose(const struct gnp_network *network, const struct gnp_ladder *ladder);

/* Adds d loss / d parameters to gradient (the layout's total), given hidden of the forward pass and
 * d loss / d scores. */
void gnp_frame_scores_backward(const struct gnp_network *network, const float *looks, const float *hidden,
                               const float *dscores, float *gradient);

#endif
