/* A sample of a cloud's points and what is seen about each: what clouds (belief.h) and answers
 * (core/estimate/belief_answer.h) are judged by.
 *
 * At most 512 points are looked at, so that judging takes a constant time but for one array of looks. Deterministic. */
#ifndef GNP_CORE_BELIEF_SAMPLE_H
#define GNP_CORE_BELIEF_SAMPLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* Neighbours looked at: of a point's surface, and of the patches that estimators make. */
enum { GNP_BELIEF_NEAR = 16, GNP_BELIEF_WIDE = 96 };

/* Of so many points in curve order one is looked at, and which one of the s-th so many: not always the first, as points
 * that lie on grids have strides of their own. */
size_t gnp_belief_sample_stride(size_t count);
static inline size_t gnp_belief_sample_point(size_t stride, size_t count, size_t s)
{
	size_t begin = s * stride, width = count - begin < stride ? count - begin : stride;
	return begin + (s * 2654435761U >> 8) % width;
}

/* The nearest of a point, in its order. */
struct gnp_belief_row {
	size_t count;
	uint32_t index[GNP_BELIEF_WIDE];
	double distance[GNP_BELIEF_WIDE];
};

/* What is seen at a point. Lengths in local spacings, angles in degrees. */
struct gnp_belief_look {
	double spacing;      /* [length] the root of the area a point stands for */
	double flat;         /* third variance over the second, of a neighbourhood that spans two directions */
	size_t spanned;      /* how many points that took */
	double tilt;         /* of a normal, the cloud's or an answer's, against that neighbourhood's plane */
	double rough;        /* root mean square distance from the plane of the nearest */
	double small;        /* what quadratics leave of the heights of the nearest; NAN where it cannot be told */
	/* Where the cloud itself is looked at: */
	double turn;         /* the third quartile of the angles to the normals of the nearest */
	double sheets;       /* share of the GNP_BELIEF_WIDE nearest on another sheet that faces the same way */
	bool in_row;         /* the nearest lie on a line */
	bool opposite;       /* a normal beside this one is opposite to it */
};

struct gnp_belief_sample {
	const struct gnp_prepared *prepared;
	size_t stride, count;
	struct gnp_belief_look *looks; /* (count), owned: free() */
};

/* Finds the row of the s-th point looked at and fills its look, but for spacing, rough and small, which follow from the
 * row. */
typedef gnp_status (*gnp_belief_look_fn)(const struct gnp_belief_sample *sample, const void *context, size_t s,
                                         struct gnp_scratch *scratch, struct gnp_belief_row *row,
                                         struct gnp_error *error);
gnp_status gnp_belief_sample_make(const struct gnp_prepared *prepared, gnp_belief_look_fn look, const void *context,
                                  struct gnp_pool *pool, struct gnp_task *task, struct gnp_belief_sample *out,
                                  struct gnp_error *error);

/* The share of the points looked at of which something holds, in per cent; 0 of fewer than 3. */
double gnp_belief_sample_share(const struct gnp_belief_sample *sample, bool (*holds)(const void *context, size_t s),
                               const void *context);

/* The median of what is finite; 0 of nothing. values (count): room. */
double gnp_belief_sample_median(const struct gnp_belief_sample *sample, double (*of)(const void *context, size_t s),
                                const void *context, double *values);

/* ---- For functions that look ---- */

static inline size_t gnp_belief_at_most(size_t wanted, const struct gnp_belief_row *row)
{
	return wanted < row->count ? wanted : row->count;
}

double gnp_belief_angle(double cosine); /* [degrees] */
gnp_status gnp_belief_find_row(const struct gnp_prepared *prepared, size_t i, size_t count, struct gnp_scratch *scratch,
                               struct gnp_belief_row *row, struct gnp_error *error);

/* Fills flat, spanned and tilt. False when the points of the row lie on one line, whose plane means nothing. */
bool gnp_belief_see_plane(const struct gnp_prepared *prepared, const struct gnp_belief_row *row, const double normal[3],
                          struct gnp_belief_look *look);

/* Whether the normal is off the plane by more than GNP_BELIEF_TILT; nothing is said where the neighbourhood has no
 * clear plane. Of sound clouds and answers less than GNP_BELIEF_TILTED_MOST per cent are. */
enum { GNP_BELIEF_TILT = 30, GNP_BELIEF_TILTED_MOST = 5 };
bool gnp_belief_tilted(const struct gnp_belief_look *look);

#endif
