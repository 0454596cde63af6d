#include "weights/train/any/any_frames.h"

#include <math.h>

#include "core/base/vector.h"
#include "core/network/frame_choice.h"
#include "weights/train/any/any_loss.h"

enum { STEPS = GNP_LADDER_STEPS };

gnp_status gnp_any_frames_draw(const struct gnp_any_cloud *cloud, size_t count, struct gnp_random *random,
                               struct gnp_scratch *scratch, struct gnp_any_frames *out, struct gnp_error *error)
{
	struct gnp_any_views views;
	uint32_t *centres = gnp_scratch_take(scratch, count, sizeof *centres);
	*out = (struct gnp_any_frames){.count = count, .cost = gnp_scratch_take(scratch, count, sizeof *out->cost)};
	if (!centres || !out->cost)
		return gnp_no_memory("training", count, "frames", error);
	gnp_any_supports_centres(cloud, false, count, random, centres);
	gnp_status status = gnp_any_supports_look(cloud, centres, count, scratch, &views, error);
	if (status != GNP_OK)
		return status;
	out->ladders = views.ladders;
	for (size_t i = 0; i < count; i++)
		for (int l = 0; l < STEPS; l++)
			out->cost[i][l] = (float)gnp_any_loss_frame(
				gnp_dot(views.ladders[i].frames[l][2], cloud->normals + 3 * (size_t)centres[i]));
	return GNP_OK;
}

double gnp_any_frames_expect(const struct gnp_network *network, const struct gnp_any_frames *frames, size_t i,
                             double share, float *gradient)
{
	const struct gnp_ladder *ladder = &frames->ladders[i];
	float hidden[GNP_FRAME_WIDTH_MAX], scores[STEPS], chance[STEPS], dscores[STEPS] = {0}, top, sum = 0, mean = 0;
	gnp_frame_scores(network, ladder->looks, hidden, scores);
	top = scores[0];
	for (int l = 1; l < ladder->steps; l++)
		top = fmaxf(top, scores[l]);
	for (int l = 0; l < ladder->steps; l++)
		sum += chance[l] = expf(scores[l] - top);
	for (int l = 0; l < ladder->steps; l++) {
		chance[l] /= sum;
		mean += chance[l] * frames->cost[i][l];
	}
	for (int l = 0; l < ladder->steps; l++)
		dscores[l] = chance[l] * (frames->cost[i][l] - mean) * (float)share;
	gnp_frame_scores_backward(network, ladder->looks, hidden, dscores, gradient);
	return (double)mean;
}

double gnp_any_frames_chosen(const struct gnp_network *network, const struct gnp_any_frames *frames, size_t i)
{
	return (double)frames->cost[i][gnp_frame_choose(network, &frames->ladders[i])];
}
