/* Thins candidates to an even sample by weighted sample elimination (Yuksel, Sample Elimination for Generating Poisson
 * Disk Sample Sets, 2015): takes the most crowded candidate away, again and again, until the wanted number is left.
 * Crowding is told apart in steps of a sixteenth octave, within which the order is that of memory. Time and memory are
 * linear in count. */
#ifndef GNP_CORE_ELIMINATE_H
#define GNP_CORE_ELIMINATE_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

/* points (count, 3): candidates on a surface of the given area, spread in proportion to it; 1 <= wanted <= count < 2^32.
 * kept (wanted): indices of the survivors, ascending. Deterministic for any worker count. On failure kept is undefined. */
gnp_status gnp_eliminate(const float *points, size_t count, size_t wanted, double area, struct gnp_pool *pool,
                         struct gnp_task *task, uint32_t *kept, struct gnp_error *error);

#endif
