/* Empty disks that touch a point of a cloud in its tangent plane: how wide the gap beside the point is, and between
 * whom it lies.
 *
 * All that is near counts, whichever way it faces: across a crease and around a fold the surface goes on. Radii are
 * over the distance of the last of GNP_DISK_NEIGHBORS nearest points. */
#ifndef GNP_CORE_DISK_H
#define GNP_CORE_DISK_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

enum { GNP_DISK_NEIGHBORS = 64 };

#define GNP_DISK_NOBODY UINT32_MAX

/* Nearest points of one point, ascending by distance; borrowed. */
struct gnp_disk_row {
	size_t count;
	const uint32_t *index; /* (count) itself among them */
	double farthest;       /* distance of the last */
};

struct gnp_disk {
	double radius;      /* of the widest [length]; 0 where all is cut away */
	uint32_t across[2]; /* between which points it lies, beside the one it touches; or NOBODY */
	uint32_t along[2];  /* whom the disk touches, rolled as far as it stays wider than `wide`; or NOBODY */
};

/* The widest empty disk at points[centre]. wide [length]. */
void gnp_disk_find(const double *points, size_t centre, const double normal[3], const struct gnp_disk_row *row,
                   double wide, struct gnp_disk *out);

/* How wide gaps within the cloud are at most: those of points at random are wide, those of lattices narrow. Judged by
 * some of the points; a rim among them does no harm. task may be NULL. Deterministic for any worker count. */
gnp_status gnp_disk_usual(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                          double *usual, struct gnp_error *error);

/* A quick look in 24 directions: whether a disk at (u, v) may be wider than usual among points x, y (count) of its
 * plane. Mostly true where one is, and mostly false where none is. */
bool gnp_disk_may_exceed(const double *x, const double *y, size_t count, double u, double v, double usual);

#endif
