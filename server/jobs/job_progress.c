#include "server/jobs/job_progress.h"

#include <math.h>

/* Where each stage begins and ends in the whole, as seen on clouds of 100,000 points. */
static const struct {
	double from, to;
} shares[GNP_STAGE_COUNT] = {
	[GNP_STAGE_WAITING] = {0, 0},          [GNP_STAGE_DECODE] = {0, 0.02},     [GNP_STAGE_ORDER] = {0.02, 0.03},
	[GNP_STAGE_NEIGHBORS] = {0.03, 0.04},  [GNP_STAGE_ORIENT] = {0.04, 0.07},  [GNP_STAGE_PREPARE] = {0.04, 0.1},
	[GNP_STAGE_ESTIMATE] = {0.1, 0.9},     [GNP_STAGE_FILTER] = {0.5, 0.95},   [GNP_STAGE_FLOW] = {0.1, 0.97},
	[GNP_STAGE_ASSEMBLE] = {0.4, 0.5},     [GNP_STAGE_FACTOR] = {0.5, 0.85},   [GNP_STAGE_SOLVE] = {0.85, 0.95},
	[GNP_STAGE_ENCODE] = {0.95, 0.99},     [GNP_STAGE_DONE] = {0.99, 1}};

/* What comes before the work itself is no measure of it. */
static const double LEAST = 0.11;

/* Items of the stage that this run has done. */
static size_t own_items(const struct gnp_task *task)
{
	size_t done = atomic_load(&task->done), skipped = atomic_load(&task->skipped);
	return done > skipped ? done - skipped : 0;
}

/* Steps take as long as those of this run before them, whatever share of the whole their stage is said to be. */
static double steps_left(const struct gnpd_job_progress *now, size_t own, double elapsed)
{
	return own > now->from ? (elapsed - now->since) / (double)(own - now->from) * (double)(now->steps - now->step) : -1;
}

struct gnpd_job_progress gnpd_job_progress_of(const struct gnp_task *task, double elapsed, const struct gnpd_job_progress *before)
{
	enum gnp_stage stage = gnp_task_current(task);
	size_t own = own_items(task);
	struct gnpd_job_progress now = *before;
	now.eta = -1;
	if (stage == GNP_STAGE_DONE || gnp_task_check(task, NULL) != GNP_OK)
		return now;
	now.stage = gnp_stage_name(stage);
	now.steps = atomic_load(&task->total);
	now.step = atomic_load(&task->done);
	if (now.step > now.steps)
		now.step = now.steps;
	now.fraction = fmax(before->fraction, shares[stage].from + (shares[stage].to - shares[stage].from) * gnp_task_fraction(task));
	if (now.stage != before->stage) {
		now.since = elapsed;
		now.from = own;
	}
	if (stage == GNP_STAGE_FLOW)
		now.eta = steps_left(&now, own, elapsed);
	else if (now.fraction > LEAST)
		now.eta = elapsed * (1 - now.fraction) / now.fraction;
	return now;
}
