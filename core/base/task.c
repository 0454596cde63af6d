#include "core/base/task.h"

#include <time.h>

static const char *const stage_names[GNP_STAGE_COUNT] = {
#define GNP_STAGE_NAME(id, name) [id] = name,
	GNP_STAGE_TABLE(GNP_STAGE_NAME)
#undef GNP_STAGE_NAME
};

double gnp_clock(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void gnp_task_init(struct gnp_task *task)
{
	task->parent = NULL;
	atomic_init(&task->cancelled, GNP_OK);
	atomic_init(&task->stage, GNP_STAGE_WAITING);
	atomic_init(&task->done, 0);
	atomic_init(&task->total, 0);
	atomic_init(&task->skipped, 0);
	atomic_init(&task->served, 0);
	task->started = gnp_clock();
	for (int i = 0; i < GNP_STAGE_COUNT; i++)
		task->seconds[i] = 0;
	task->warnings = (struct gnp_warnings){0};
}

void gnp_task_init_part(struct gnp_task *task, const struct gnp_task *parent)
{
	gnp_task_init(task);
	task->parent = parent;
}

/* parent is const because a part may not change it otherwise; its account is atomic, its warnings are the coordinator's. */
static struct gnp_task *outermost(const struct gnp_task *task)
{
	while (task && task->parent)
		task = task->parent;
	return (struct gnp_task *)task;
}

void gnp_task_serve(struct gnp_task *task, uint64_t nanoseconds)
{
	struct gnp_task *whole = outermost(task);
	if (whole)
		atomic_fetch_add_explicit(&whole->served, nanoseconds, memory_order_relaxed);
}

uint64_t gnp_task_served(const struct gnp_task *task)
{
	const struct gnp_task *whole = outermost(task);
	return whole ? atomic_load_explicit(&whole->served, memory_order_relaxed) : 0;
}

struct gnp_warnings *gnp_task_warnings(const struct gnp_task *task)
{
	return task ? &outermost(task)->warnings : NULL;
}

void gnp_task_stop(struct gnp_task *task, gnp_status reason)
{
	int none = GNP_OK;
	atomic_compare_exchange_strong(&task->cancelled, &none, (int)reason);
}

void gnp_task_cancel(struct gnp_task *task)
{
	gnp_task_stop(task, GNP_CANCELLED);
}

gnp_status gnp_task_check(const struct gnp_task *task, struct gnp_error *error)
{
	gnp_status reason = GNP_OK;
	for (; task && reason == GNP_OK; task = task->parent)
		reason = (gnp_status)atomic_load_explicit(&task->cancelled, memory_order_relaxed);
	if (reason != GNP_OK)
		gnp_error_set(error, reason, "%s", gnp_status_text(reason));
	return reason;
}

void gnp_task_stage(struct gnp_task *task, enum gnp_stage stage, size_t total)
{
	if (!task)
		return;
	double now = gnp_clock();
	task->seconds[atomic_load(&task->stage)] += now - task->started;
	task->started = now;
	atomic_store(&task->done, 0);
	atomic_store(&task->skipped, 0);
	atomic_store(&task->total, total);
	atomic_store(&task->stage, (int)stage);
}

void gnp_task_advance(struct gnp_task *task, size_t items)
{
	if (task)
		atomic_fetch_add_explicit(&task->done, items, memory_order_relaxed);
}

void gnp_task_skip(struct gnp_task *task, size_t items)
{
	if (!task)
		return;
	atomic_store(&task->skipped, items);
	gnp_task_advance(task, items);
}

void gnp_task_rebook(struct gnp_task *task, enum gnp_stage from, enum gnp_stage to, double seconds)
{
	if (!task)
		return;
	task->seconds[from] -= seconds;
	task->seconds[to] += seconds;
}

void gnp_task_book_part(struct gnp_task *task, const struct gnp_task *part)
{
	if (!task)
		return;
	/* The current stage is still open: what is taken from it now, its closing adds. */
	for (int i = 0; i < GNP_STAGE_COUNT; i++)
		if (part->seconds[i] > 0 && i != GNP_STAGE_WAITING && i != GNP_STAGE_DONE)
			gnp_task_rebook(task, (enum gnp_stage)atomic_load(&task->stage), (enum gnp_stage)i, part->seconds[i]);
}

double gnp_task_fraction(const struct gnp_task *task)
{
	size_t total = atomic_load(&task->total), done = atomic_load(&task->done);
	if (!total)
		return 0;
	return done >= total ? 1 : (double)done / (double)total;
}

enum gnp_stage gnp_task_current(const struct gnp_task *task)
{
	return (enum gnp_stage)atomic_load(&task->stage);
}

const char *gnp_stage_name(enum gnp_stage stage)
{
	return (unsigned)stage < GNP_STAGE_COUNT ? stage_names[stage] : "unknown";
}
