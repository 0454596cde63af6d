/* The clouds of the real table that come from meshes: samples of their triangles and their vertices, with the truth at
 * every point.
 *
 * Samples follow PCPNet's protocol (Guerrero et al. 2018): points drawn by area, isotropic Gaussian noise in units of
 * the bounding box's diagonal, or density in stripes or as a gradient; the truth is the normal of the triangle a point
 * was drawn on. */
#ifndef GNP_WEIGHTS_REAL_CLOUD_H
#define GNP_WEIGHTS_REAL_CLOUD_H

#include <stdbool.h>

#include "weights/validate/real_mesh.h"

/* Of exact bodies: what makes them hard, the last that holds. */
enum gnp_real_hardness { GNP_REAL_SMOOTH, GNP_REAL_EDGES, GNP_REAL_NOISE, GNP_REAL_UNEVEN, GNP_REAL_HARDNESSES };

/* Owned; gnp_real_cloud_clear frees the arrays. */
struct gnp_real_cloud {
	size_t count;
	double *points;          /* (count, 3) [length] */
	double *normals;         /* (count, 3) the truth: unit, outward */
	double *mean_curvature;  /* (count) the truth; NULL: not known */
	double *gaussian_curvature; /* (count) likewise */
	double *edge;            /* (count) distance to the nearest edge, rim or tip, in spacings; NULL: none known */
	bool open;               /* there are rims that edge does not know */
	bool detailed;           /* error bars and edges are looked at too (real_detail.h); then curvatures are known */
	enum gnp_real_hardness hardness; /* of detailed ones */
	unsigned char *unjudged; /* (count) 1: never a centre; NULL: none is that */
	size_t centre_count;
	uint32_t *centres; /* (centre_count) the points judged */
};
void gnp_real_cloud_clear(struct gnp_real_cloud *cloud);

/* Arrays for count points, without curvature and centres. On failure *out is unchanged. */
gnp_status gnp_real_cloud_create(size_t count, struct gnp_real_cloud *out, struct gnp_error *error);

/* The seed of what has a name: in the range GNP_SEED_REAL of the protocol, the same wherever the name stands in a list.
 */
uint64_t gnp_real_cloud_seed(const char *name);

/* The points that are judged: of those that may be, all when most is 0 or they are not more than it, else `most` drawn
 * at random. Once a cloud. GNP_INVALID_ARGUMENT: there are none. */
gnp_status gnp_real_cloud_choose(struct gnp_real_cloud *cloud, size_t most, uint64_t seed, struct gnp_error *error);

/* stripes: twenty across the box's longest side, every other one with a tenth of the points; gradient: falls along that
 * side to a tenth, linearly. */
enum gnp_real_density { GNP_REAL_EVEN, GNP_REAL_STRIPES, GNP_REAL_GRADIENT };

struct gnp_real_sampling {
	size_t count;
	double noise; /* standard deviation on every coordinate in units of the diagonal */
	enum gnp_real_density density;
	uint64_t seed; /* the same places with another noise */
};
gnp_status gnp_real_cloud_sample(const struct gnp_real_mesh *mesh, const struct gnp_real_sampling *sampling,
                                 struct gnp_real_cloud *out, struct gnp_error *error);

/* The vertices that have a normal; the truth is the mean of the triangles' about each, weighed by area. */
gnp_status gnp_real_cloud_vertices(const struct gnp_real_mesh *mesh, struct gnp_real_cloud *out,
                                   struct gnp_error *error);

#endif
