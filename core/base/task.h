/* A unit of work as its observers see it: cancel token, progress, stage, the seconds of each stage, and warnings of
 * its answer.
 *
 * One thread (the coordinator) drives a task through its stages; pool workers add to its progress and poll its cancel
 * flag; any thread may cancel it or read it at any moment without a lock. */
#ifndef GNP_CORE_TASK_H
#define GNP_CORE_TASK_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/base/warning.h"

/* Stages of the pipeline; the name is what progress reports and timings show. */
#define GNP_STAGE_TABLE(X)        \
	X(GNP_STAGE_WAITING, "waiting")   \
	X(GNP_STAGE_DECODE, "decode")     \
	X(GNP_STAGE_ORDER, "order")       \
	X(GNP_STAGE_NEIGHBORS, "neighbors") \
	X(GNP_STAGE_ORIENT, "orient")     \
	X(GNP_STAGE_PREPARE, "prepare")   \
	X(GNP_STAGE_ESTIMATE, "estimate") \
	X(GNP_STAGE_FILTER, "filter")     \
	X(GNP_STAGE_FLOW, "flow")         \
	X(GNP_STAGE_ASSEMBLE, "assemble") \
	X(GNP_STAGE_FACTOR, "factor")     \
	X(GNP_STAGE_SOLVE, "solve")       \
	X(GNP_STAGE_ENCODE, "encode")     \
	X(GNP_STAGE_DONE, "done")

enum gnp_stage {
#define GNP_STAGE_ENUM(id, name) id,
	GNP_STAGE_TABLE(GNP_STAGE_ENUM)
#undef GNP_STAGE_ENUM
	GNP_STAGE_COUNT
};

struct gnp_task {
	const struct gnp_task *parent; /* NULL, or the task this one is a part of: what stops that one stops this one */
	atomic_int cancelled;      /* 0, or the gnp_status to stop with */
	atomic_int stage;          /* enum gnp_stage */
	atomic_size_t done, total; /* work items of the current stage */
	atomic_size_t skipped;     /* of those done: done before this task began */
	atomic_uint_fast64_t served; /* nanoseconds of the pool's workers, of this task and its parts */
	double started;            /* monotonic seconds when the current stage began (coordinator only) */
	double seconds[GNP_STAGE_COUNT]; /* wall seconds spent in each finished stage (coordinator only) */
	struct gnp_warnings warnings; /* of this task and its parts (coordinator only) */
};

void gnp_task_init(struct gnp_task *task);

/* A part of parent (which outlives it; may be NULL), with stages and progress of its own. */
void gnp_task_init_part(struct gnp_task *task, const struct gnp_task *parent);

/* Coordinator: books the seconds of a part's stages, which passed during the task's current stage, on those stages of the task. */
void gnp_task_book_part(struct gnp_task *task, const struct gnp_task *part);

/* Asks the work to stop; it ends with GNP_CANCELLED within one chunk (milliseconds). Idempotent. */
void gnp_task_cancel(struct gnp_task *task);
/* The same with another reason, for example GNP_DEADLINE. The first reason wins. */
void gnp_task_stop(struct gnp_task *task, gnp_status reason);

/* GNP_OK, or the reason set by gnp_task_cancel / gnp_task_stop. task may be NULL (never cancelled). */
gnp_status gnp_task_check(const struct gnp_task *task, struct gnp_error *error);

/* Coordinator: closes the current stage's clock and opens the next. total may be 0 when unknown. task may be NULL. */
void gnp_task_stage(struct gnp_task *task, enum gnp_stage stage, size_t total);
void gnp_task_advance(struct gnp_task *task, size_t items);
/* Coordinator: the same for items that an earlier task did, which say nothing of this one's pace. */
void gnp_task_skip(struct gnp_task *task, size_t items);

/* Workers: books nanoseconds spent on a chunk; task may be NULL. What the task and those it is a part of have had, of the outermost. */
void gnp_task_serve(struct gnp_task *task, uint64_t nanoseconds);
uint64_t gnp_task_served(const struct gnp_task *task);

/* Coordinator: where work for the task records what is wrong with its answer (gnp_warnings_add): the warnings of the outermost of those it
 * is a part of. NULL without a task. */
struct gnp_warnings *gnp_task_warnings(const struct gnp_task *task);

/* Coordinator: books part of a finished stage's seconds on another one, where one loop did the work of both. */
void gnp_task_rebook(struct gnp_task *task, enum gnp_stage from, enum gnp_stage to, double seconds);

/* Any thread: fraction of the current stage in [0, 1], and the stage's name. */
double gnp_task_fraction(const struct gnp_task *task);
enum gnp_stage gnp_task_current(const struct gnp_task *task);
const char *gnp_stage_name(enum gnp_stage stage);

/* Monotonic clock in seconds. */
double gnp_clock(void);

#endif
