/* A shape to train on: a clean analytic cloud, sampled once and kept in a folder.
 *
 * A file (array_file.h) that is not there or that cannot be used, as another version's or a damaged one, is made anew.
 */
#ifndef GNP_WEIGHTS_TRAIN_SHAPE_H
#define GNP_WEIGHTS_TRAIN_SHAPE_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

/* Which cloud: a member of the radial family; the seed is of the shape and of its sampling. */
struct gnp_train_shape_key {
	uint64_t seed;
	unsigned degree; /* L */
	size_t points;
};

/* Owned; freed by gnp_train_shape_clear. Points in curve order. */
struct gnp_train_shape {
	size_t count;
	double *exact;      /* (count, 3) on the surface */
	float *normals;     /* (count, 3) outward unit */
	float *second_form; /* (count, 6) II as an ambient symmetric tensor: xx, xy, xz, yy, yz, zz [1/length] */
};

/* Reads the shape from the folder, or samples it and writes it there; the folder is made when it is not there.
 * GNP_IO naming the file. On failure *out is unchanged. */
gnp_status gnp_train_shape_load(const char *folder, const struct gnp_train_shape_key *key, struct gnp_pool *pool,
                                struct gnp_task *task, struct gnp_train_shape *out, struct gnp_error *error);
void gnp_train_shape_clear(struct gnp_train_shape *shape);

/* Samples the shape unless a file of its name and size is in the folder: what is there is looked into only when it is loaded. */
gnp_status gnp_train_shape_ensure(const char *folder, const struct gnp_train_shape_key *key, struct gnp_pool *pool,
                                  struct gnp_task *task, struct gnp_error *error);

#endif
