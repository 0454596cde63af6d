/* Points of a cloud that lie where another one does: an equation has one unknown a place, and what is found there
 * holds for all of them. */
#ifndef GNP_CORE_COPIES_H
#define GNP_CORE_COPIES_H

#include <stdint.h>

#include "core/base/task.h"
#include "core/cloud/cloud.h"

#define GNP_COPY_OUTSIDE UINT32_MAX

struct gnp_copy {
	uint32_t index;    /* of the copy in the cloud */
	uint32_t original; /* the lowest index there */
	uint32_t row;      /* the place among those of a domain; GNP_COPY_OUTSIDE: it takes no part */
	uint32_t points;   /* at the place, the original among them */
	unsigned char fixed, original_fixed; /* where values are given */
};

/* Owned; freed by gnp_copies_clear. */
struct gnp_copies {
	size_t count;
	struct gnp_copy *copy; /* (count) by index, ascending; NULL: there are none */
};
void gnp_copies_clear(struct gnp_copies *copies);

/* A cloud without its copies. Where there are none, points is NULL and the cloud is as good. */
struct gnp_places {
	size_t count;
	double *points, *normals; /* (count, 3); normals NULL: the cloud has none */
	uint32_t *index;          /* (count) in the cloud */
};
void gnp_places_clear(struct gnp_places *places);

/* rows of the copies are GNP_COPY_OUTSIDE. O(n). On failure *places and *copies are unchanged. */
gnp_status gnp_copies_part(const struct gnp_cloud *cloud, struct gnp_task *task, struct gnp_places *places,
                           struct gnp_copies *copies, struct gnp_error *error);
/* Fills in rows: order (count) is the index in the cloud, of cloud_count points, of each row. */
gnp_status gnp_copies_find_rows(struct gnp_copies *copies, const uint32_t *order, size_t count, size_t cloud_count,
                                struct gnp_error *error);

/* In a column of values (cloud_count, width), gives copies what their originals have. */
void gnp_copies_spread(const struct gnp_copies *copies, double *values, size_t width, size_t column);
/* In a column of values (cloud_count, width), gives all points of a place the mean of theirs. */
void gnp_copies_merge(const struct gnp_copies *copies, double *values, size_t width, size_t column);
/* rows (count of a domain) hold what a column of values (cloud_count, width) says of the originals: where there are
 * copies it becomes the mean of them all. */
void gnp_copies_average(const struct gnp_copies *copies, const double *values, size_t width, size_t column,
                        double *rows);

#endif
