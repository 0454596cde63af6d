/* Distances to the creases, rims and tips of a body.
 *
 * They are covered by short straight strokes: those along its curves follow from parameters; those where faces of
 * primitives cross are found by pulling points drawn near the crossing onto both surfaces. Overlaps do no harm. */
#ifndef GNP_CORE_SOLID_CREASE_H
#define GNP_CORE_SOLID_CREASE_H

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/solids/solid_body.h"

/* The points within half of either side of the middle. */
struct gnp_solid_stroke {
	double middle[3], half[3];
	double low[3], high[3]; /* the tree's: bounds of the strokes that this one is in the middle of */
};

/* Owned; freed by gnp_solid_creases_clear. */
struct gnp_solid_creases {
	size_t count;
	struct gnp_solid_stroke *stroke; /* (count) a balanced tree: the middle one parts before from after */
};

/* spacing: of the points to be judged; seed: of the draws. On failure *out is unchanged. */
gnp_status gnp_solid_creases_create(const struct gnp_solid_body *body, double spacing, uint64_t seed,
                                    struct gnp_pool *pool, struct gnp_task *task, struct gnp_solid_creases *out,
                                    struct gnp_error *error);
void gnp_solid_creases_clear(struct gnp_solid_creases *creases);

/* INFINITY without strokes. */
double gnp_solid_creases_distance(const struct gnp_solid_creases *creases, const double x[3]);

#endif
