/* Whether a cloud and an answer are to be believed: what can be told from a few hundred of the points, with limits that clouds of smooth
 * surfaces, evenly sampled, stay far below. What passes its limit is recorded as a warning of the task (warning.h). */
#ifndef GNP_CORE_BELIEF_H
#define GNP_CORE_BELIEF_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* Of so many points in curve order one is looked at, and which one of the s-th so many: not always the first, as points that lie on grids have strides
 * of their own. */
size_t gnp_belief_stride(size_t count);
static inline size_t gnp_belief_point(size_t stride, size_t count, size_t s)
{
	size_t begin = s * stride, width = count - begin < stride ? count - begin : stride;
	return begin + (s * 2654435761U >> 8) % width;
}

/* Of the cloud: steps of its numbers against its spacing, points in rows, sheets and folds closer than their points are spaced; of normals
 * that were given, that they contradict the points or one another. Nothing is done without a task. Deterministic. */
gnp_status gnp_belief_check_cloud(const struct gnp_prepared *prepared, bool given, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_error *error);

/* What an estimator found at a point that is looked at. */
struct gnp_belief_probe {
	double normal[3];
	double residual; /* root mean square of the heights' misfit [length] */
	bool outlier;    /* nothing is said of such points */
};

/* Of an answer: normals that contradict the plane of a neighbourhood wide enough to span two directions, detail that the fits smooth away;
 * where standard errors are answered, that noise biases what they stand beside. probes: one for each point looked at. Nothing is done without a task. Deterministic. */
gnp_status gnp_belief_check_answer(const struct gnp_prepared *prepared, const struct gnp_belief_probe *probes, bool standard_errors,
                                   struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error);

#endif
