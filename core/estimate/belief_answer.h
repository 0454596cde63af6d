/* Whether an answer is to be believed: what can be told from the fits at a few hundred of the points, with limits that
 * smooth surfaces, evenly sampled, stay far below. What passes its limit is recorded as a warning of the task
 * (warning.h). */
#ifndef GNP_CORE_BELIEF_ANSWER_H
#define GNP_CORE_BELIEF_ANSWER_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* What an estimator found at a point that is looked at. */
struct gnp_belief_probe {
	double normal[3];
	double residual; /* root mean square of the heights' misfit [length] */
	bool outlier;    /* nothing is said of such points */
};

/* Of an answer: normals that contradict the plane of a neighbourhood wide enough to span two directions, detail that
 * the fits smooth away; where standard errors are answered, that noise biases what they stand beside. probes: one for
 * each point of the sample (core/cloud/belief_sample.h). Nothing is done without a task. Deterministic. */
gnp_status gnp_belief_answer_check(const struct gnp_prepared *prepared, const struct gnp_belief_probe *probes,
                                   bool standard_errors, struct gnp_pool *pool, struct gnp_task *task,
                                   struct gnp_error *error);

#endif
