/* Points drawn on a body by a pattern of sampling: candidates for those that become the sample. */
#ifndef GNP_CORE_SOLID_DRAW_H
#define GNP_CORE_SOLID_DRAW_H

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/solids/solid.h"
#include "core/solids/solid_body.h"

struct gnp_solid_draw {
	double x[3], p[2]; /* body coordinates; parameters on the face */
	int face, side;    /* side: gnp_solid_body_side */
	double row, along; /* of scan lines: number of the row, how far along it roughly */
};

/* What many draws show of a body: the share of them that is on it, its area, its bounds. */
struct gnp_solid_survey {
	double share, area, low[3], high[3];
};

/* Owned; freed by gnp_solid_draws_clear. */
struct gnp_solid_draws {
	size_t count; /* as many as points are wanted; several times as many where the sampling is spread */
	struct gnp_solid_draw *draw;
};

void gnp_solid_draws_survey(const struct gnp_solid_body *body, uint64_t seed, struct gnp_solid_survey *survey);

/* True for samplings whose points keep a distance from each other: the draws are to be thinned out to those wanted. */
bool gnp_solid_draws_are_spread(int sampling);

/* Options: checked. On failure *out is unchanged. */
gnp_status gnp_solid_draws_create(const struct gnp_solid_body *body, const struct gnp_solid_options *options,
                                  const struct gnp_solid_survey *survey, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_solid_draws *out, struct gnp_error *error);
void gnp_solid_draws_clear(struct gnp_solid_draws *draws);

/* Of scan lines: thins each row to steps as even as draws allow. chosen (wanted): of the draws, which are put in
 * order of rows; wanted <= draws->count. On failure chosen is undefined. */
gnp_status gnp_solid_draws_thin_rows(struct gnp_solid_draws *draws, size_t wanted, uint32_t *chosen,
                                     struct gnp_error *error);

#endif
