#include "job_progress.h"

/* Where each stage begins and ends in the whole, as seen on clouds of 100,000 points. */
static const struct {
	double from, to;
} shares[GNP_STAGE_COUNT] = {
	[GNP_STAGE_WAITING] = {0, 0},          [GNP_STAGE_DECODE] = {0, 0.02},     [GNP_STAGE_ORDER] = {0.02, 0.03},
	[GNP_STAGE_NEIGHBORS] = {0.03, 0.04},  [GNP_STAGE_ORIENT] = {0.04, 0.07},  [GNP_STAGE_PREPARE] = {0.04, 0.1},
	[GNP_STAGE_ESTIMATE] = {0.1, 0.9},     [GNP_STAGE_FILTER] = {0.5, 0.95},   [GNP_STAGE_FLOW] = {0.1, 0.97},
	[GNP_STAGE_ASSEMBLE] = {0.4, 0.5},     [GNP_STAGE_FACTOR] = {0.5, 0.85},   [GNP_STAGE_SOLVE] = {0.85, 0.95},
	[GNP_STAGE_ENCODE] = {0.95, 0.99},     [GNP_STAGE_DONE] = {0.99, 1}};

/* Less than this is no measure of the rest. */
static const double LEAST = 0.05;

/* The share of the whole that was there before: what a flow took from its checkpoint. */
static double skipped_of(const struct gnp_task *task, enum gnp_stage stage)
{
	size_t skipped = atomic_load(&task->skipped), total = atomic_load(&task->total);
	return skipped && total ? (shares[stage].to - shares[stage].from) * (double)skipped / (double)total : 0;
}

struct gnpd_job_progress gnpd_job_progress_of(const struct gnp_task *task, double elapsed, const struct gnpd_job_progress *before)
{
	enum gnp_stage stage = gnp_task_current(task);
	struct gnpd_job_progress now = {.stage = gnp_stage_name(stage), .eta = -1};
	now.steps = atomic_load(&task->total);
	now.step = atomic_load(&task->done);
	if (now.step > now.steps)
		now.step = now.steps;
	now.fraction = shares[stage].from + (shares[stage].to - shares[stage].from) * gnp_task_fraction(task);
	if (now.fraction < before->fraction)
		now.fraction = before->fraction;
	double gained = now.fraction - skipped_of(task, stage);
	if (gained >= LEAST && elapsed > 0)
		now.eta = elapsed * (1 - now.fraction) / gained;
	return now;
}
