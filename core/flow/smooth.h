/* Takes the noise off a cloud and leaves its surface where it was: the operation `smooth`.
 *
 * In each round points go onto the surfaces fitted about them, which are as wide as the noise asks for; what fits leave
 * is evened out by an implicit step of diffusion, of radius sqrt(2 noise h) for points h apart, a quarter
 * of the root of the area at most; then what all points
 * about a place have moved the same way is taken back, since noise has no such part: fits lie inside of what bends, and
 * diffusion shrinks. So the volume is kept, and also that of every thin part by itself. Points move along the normal
 * alone: open edges stay where they are. */
#ifndef GNP_CORE_SMOOTH_H
#define GNP_CORE_SMOOTH_H

#include "core/estimate/estimate.h"

enum gnp_smooth_features {
	GNP_SMOOTH_ROUND, /* edges are evened out as all else */
	GNP_SMOOTH_KEEP   /* nothing is evened out across an edge: less, the more the normals of two points differ */
};

struct gnp_smooth_options {
	struct gnp_estimate_options estimate; /* whose surfaces; its quantities are ignored */
	double noise;    /* standard deviation [length], > 0: points go at most four times as far; NAN: what the fits say */
	int features;    /* enum gnp_smooth_features */
	bool preserve;   /* the volume: take back what places have moved as a whole */
	int rounds;      /* 1..20 */
};

/* Noise NAN, features round, volume kept, 2 rounds. */
struct gnp_smooth_options gnp_smooth_defaults(void);
gnp_status gnp_smooth_check(const struct gnp_smooth_options *options, struct gnp_error *error);

/* Owned by the caller; gnp_smooth_clear frees it. Rows are in the caller's order. */
struct gnp_smooth {
	size_t count;
	double *points;    /* (count, 3) */
	double *normals;   /* (count, 3) outward unit normals of the surfaces */
	double *moved;     /* (count) how far along the normal [length] */
	double spacing;    /* root of the mean area of the points' cells [length] */
	double noise;      /* that was asked for or found: of the distances from the fits, by their median [length] */
	double radius;     /* of the diffusion [length] */
	int normals_estimated; /* as in struct gnp_estimate, as are these: */
	size_t components;
	const struct gnp_model *model;
};

/* fixed: (cloud->count) 1 where a point stays, or NULL. Deterministic for any worker count. On failure *out is
 * unchanged. task may be NULL. */
gnp_status gnp_smooth_run(const struct gnp_cloud *cloud, const unsigned char *fixed,
                          const struct gnp_smooth_options *options, struct gnp_pool *pool, struct gnp_task *task,
                          struct gnp_smooth *out, struct gnp_error *error);
void gnp_smooth_clear(struct gnp_smooth *smooth);

/* Peak bytes gnp_smooth_run may allocate for count points. given: the cloud comes with normals. */
size_t gnp_smooth_memory(size_t count, bool given, const struct gnp_smooth_options *options);

#endif
