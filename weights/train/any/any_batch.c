#include "weights/train/any/any_batch.h"

#include <string.h>

#include "core/network/weighted_head.h"
#include "weights/train/any/any_frames.h"
#include "weights/train/any/any_start.h"

enum { OUTPUTS = GNP_WEIGHTED_OUTPUTS, SIZE = GNP_TAYLOR_SIZE };

/* Supports with the clouds they are of; the arrays lie in scratch. */
struct drawn {
	size_t count;
	const struct gnp_support **supports;
	const struct gnp_any_cloud **clouds;
};

static gnp_status make_room(size_t most, struct gnp_scratch *scratch, struct drawn *drawn, struct gnp_error *error)
{
	*drawn = (struct drawn){0, gnp_scratch_take(scratch, most, sizeof *drawn->supports),
	                        gnp_scratch_take(scratch, most, sizeof *drawn->clouds)};
	return drawn->supports && drawn->clouds ? GNP_OK : gnp_no_memory("training", most, "supports", error);
}

static gnp_status draw_from(const struct gnp_network *network, const struct gnp_any_cloud *cloud, size_t count,
                            struct gnp_random *random, struct gnp_scratch *scratch, struct drawn *drawn,
                            struct gnp_error *error)
{
	uint32_t *centres = gnp_scratch_take(scratch, count, sizeof *centres);
	if (!centres)
		return gnp_no_memory("training", count, "centres", error);
	gnp_any_supports_centres(cloud, true, count, random, centres);
	return gnp_any_supports_build(cloud, network, centres, count, random, scratch, drawn->supports, drawn->clouds,
	                              &drawn->count, error);
}

/* ---- Supports ---- */

static gnp_status judge(const struct gnp_network *network, const struct drawn *drawn, double share,
                        struct gnp_scratch *scratch, struct gnp_any_terms *terms, float *gradient,
                        struct gnp_error *error)
{
	struct gnp_weighted_pass pass;
	gnp_status status = gnp_weighted_forward(network, drawn->supports, drawn->count, &pass, scratch, error);
	if (status != GNP_OK)
		return status;
	double *dcoefficients = gnp_scratch_take(scratch, drawn->count, SIZE * sizeof *dcoefficients);
	double *dshares = gnp_scratch_take(scratch, pass.rows, sizeof *dshares);
	float *doutputs = gnp_scratch_take(scratch, drawn->count, OUTPUTS * sizeof *doutputs);
	double strange[GNP_SUPPORT_NODES];
	if (!dcoefficients || !dshares || !doutputs)
		return gnp_no_memory("training", drawn->count, "supports", error);
	for (size_t p = 0; p < drawn->count; p++)
		gnp_any_loss_support(drawn->clouds[p], drawn->supports[p], &pass.fits[p], pass.outputs + p * OUTPUTS, share,
		                     strange, terms, dcoefficients + p * SIZE, dshares + pass.start[p], doutputs + p * OUTPUTS);
	return gnp_weighted_backward(network, drawn->supports, &pass, dcoefficients, dshares, doutputs, gradient, scratch,
	                             error);
}

gnp_status gnp_any_batch_supports(const struct gnp_network *network, const struct gnp_any_pick *from, size_t count,
                                  size_t batch, struct gnp_random *random, struct gnp_scratch *scratch,
                                  struct gnp_any_terms *terms, float *gradient, struct gnp_error *error)
{
	struct drawn drawn;
	gnp_status status = make_room(count, scratch, &drawn, error);
	for (int part = 0; part < GNP_ANY_BATCH_CLOUDS && status == GNP_OK; part++) {
		const struct gnp_any_cloud *cloud = &from->clouds[gnp_random_below(random, from->count)];
		status = draw_from(network, cloud, count / GNP_ANY_BATCH_CLOUDS, random, scratch, &drawn, error);
	}
	if (status != GNP_OK || drawn.count == 0)
		return status;
	return judge(network, &drawn, 1 / (double)batch, scratch, terms, gradient, error);
}

/* ---- Frames ---- */

gnp_status gnp_any_batch_frames(const struct gnp_network *network, const struct gnp_any_pick *from, size_t batch,
                                struct gnp_random *random, struct gnp_scratch *scratch, double *loss, float *gradient,
                                struct gnp_error *error)
{
	const struct gnp_any_cloud *cloud = &from->clouds[gnp_random_below(random, from->count)];
	struct gnp_any_frames frames;
	gnp_status status = gnp_any_frames_draw(cloud, GNP_ANY_BATCH_FRAMES, random, scratch, &frames, error);
	for (size_t i = 0; status == GNP_OK && i < frames.count; i++)
		*loss += gnp_any_frames_expect(network, &frames, i, 1 / (double)batch, gradient) / (double)batch;
	return status;
}

/* ---- Spreads ---- */

gnp_status gnp_any_batch_spread_looks(const struct gnp_network *network, const struct gnp_any_pick *from,
                                      struct gnp_random *random, struct gnp_scratch *scratch, float *parameters,
                                      struct gnp_error *error)
{
	enum { EACH = 128 };
	struct gnp_any_spread spread;
	gnp_status status = gnp_any_spread_begin(GNP_LADDER_LOOKS, scratch, &spread, error);
	for (size_t c = 0; c < from->count && status == GNP_OK; c++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		struct gnp_any_frames frames;
		status = gnp_any_frames_draw(&from->clouds[c], EACH, random, scratch, &frames, error);
		for (size_t i = 0; i < EACH && status == GNP_OK; i++)
			gnp_any_spread_add(&spread, frames.ladders[i].looks);
		gnp_scratch_release(scratch, mark);
	}
	if (status == GNP_OK)
		gnp_any_spread_write(&spread, &network->layout, "frame", parameters);
	return status;
}

gnp_status gnp_any_batch_spread_summaries(const struct gnp_network *network, const struct gnp_any_pick *from,
                                          struct gnp_random *random, struct gnp_scratch *scratch, float *parameters,
                                          struct gnp_error *error)
{
	enum { EACH = 32 };
	struct gnp_any_spread spread;
	gnp_status status = gnp_any_spread_begin(GNP_SUPPORT_SUMMARY, scratch, &spread, error);
	for (size_t c = 0; c < from->count && status == GNP_OK; c++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		struct drawn drawn;
		status = make_room(EACH, scratch, &drawn, error);
		if (status == GNP_OK)
			status = draw_from(network, &from->clouds[c], EACH, random, scratch, &drawn, error);
		for (size_t i = 0; status == GNP_OK && i < drawn.count; i++)
			gnp_any_spread_add(&spread, drawn.supports[i]->summary);
		gnp_scratch_release(scratch, mark);
	}
	if (status == GNP_OK)
		gnp_any_spread_write(&spread, &network->layout, "head", parameters);
	return status;
}
