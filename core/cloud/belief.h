/* Whether a cloud is to be believed: what can be told from a few hundred of its points, with limits that clouds of
 * smooth surfaces, evenly sampled, stay far below. What passes its limit is recorded as a warning of the task
 * (warning.h). */
#ifndef GNP_CORE_BELIEF_H
#define GNP_CORE_BELIEF_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* Of the cloud: steps of its numbers against its spacing, points in rows, sheets and folds closer than their points are
 * spaced; of normals that were given, that they contradict the points or one another. Nothing is done without a task.
 * Deterministic. */
gnp_status gnp_belief_check_cloud(const struct gnp_prepared *prepared, bool given, struct gnp_pool *pool,
                                  struct gnp_task *task, struct gnp_error *error);

#endif
