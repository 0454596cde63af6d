/* One set of worker threads for every job of the process.
 *
 * A job is a loop over [0, count) cut into fixed chunks. Workers take chunks round-robin over the running jobs, so one
 * large job uses all cores and many share them. Three chunks of four are of young tasks, where there are any: those
 * the workers have spent less than half a second on. So a small request waits for the chunks under way, not for its
 * turn among large ones, and what is large still goes on. The calling thread (the job's coordinator) blocks until its
 * loop is done and does the serial parts of its pipeline itself. Chunk boundaries depend on count and chunk alone,
 * never on the number of workers: results whose chunks write disjoint outputs are bit-equal for any worker count. */
#ifndef GNP_CORE_POOL_H
#define GNP_CORE_POOL_H

#include <stddef.h>

#include "core/base/scratch.h"
#include "core/base/status.h"
#include "core/base/task.h"

struct gnp_pool;

/* Runs items [begin, end). Called concurrently by several workers with different ranges. */
typedef gnp_status (*gnp_chunk_fn)(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                   struct gnp_error *error);

/* workers = 0: the number of cores this process may use. On failure *out is unchanged. */
gnp_status gnp_pool_create(unsigned workers, struct gnp_pool **out, struct gnp_error *error);

/* Waits for running loops to end, joins the threads. NULL is allowed. No gnp_pool_run may be in progress or follow. */
void gnp_pool_free(struct gnp_pool *pool);

unsigned gnp_pool_workers(const struct gnp_pool *pool);

/* Runs fn over [0, count) in chunks of `chunk` items and returns when no chunk is running any more. After the
 * first failure, or once task (may be NULL) is cancelled, no further chunk starts; the error of the lowest
 * failed chunk among those run is reported. Adds finished items to the task's progress.
 * Not to be called from inside a chunk. */
gnp_status gnp_pool_run(struct gnp_pool *pool, struct gnp_task *task, size_t count, size_t chunk,
                        gnp_chunk_fn fn, void *context, struct gnp_error *error);

#endif
