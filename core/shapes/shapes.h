/* Analytic surfaces with exact geometry: the truth every estimator is judged by.
 *
 * Signs: outward unit normals n; second fundamental form L = sigma_uu . n; H = (k1 + k2)/2 with k1 >= k2, so the unit
 * sphere has H = -1 and both principal curvatures -1; K = k1 k2. */
#ifndef GNP_CORE_SHAPES_H
#define GNP_CORE_SHAPES_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

/* A surface: opaque, immutable, safe to share between threads. */
struct gnp_shape;

/* Names (and their default sizes): sphere (radius 1), ellipsoid (1, 0.8, 0.6), torus (2/3, 1/3), bumpy_torus, toroidal
 * (the paper's random family, eq. torus radii; seed), radial (the paper's random family: real spherical harmonics up to
 * degree, coefficients N(0, 1/l), shifted and scaled to mean 1 and range within [0.7, 1.3]; seed and degree), genus2, genus3
 * (implicit, compact, outward = grad F), plane, cylinder, saddle (open patches, for boundaries).
 * seed selects a member of a random family and is ignored by fixed shapes; degree is L of the radial family (0: chosen
 * from {3,6,8,10,12,15,18,22} by seed), ignored by others. Unknown name: GNP_NOT_FOUND listing the known ones. */
gnp_status gnp_shape_create(const char *name, uint64_t seed, unsigned degree, struct gnp_shape **out,
                            struct gnp_error *error);
void gnp_shape_free(struct gnp_shape *shape);

/* Area of the fine triangulation that samples are drawn from: the surface's to about a hundredth. */
double gnp_shape_area(const struct gnp_shape *shape);

/* The i-th known name, or NULL past the last. */
const char *gnp_shape_name(size_t i);

/* An analytic cloud. Owned by the caller; gnp_sample_clear frees the arrays. */
struct gnp_sample {
	size_t count;
	double *points;     /* (count, 3), with noise and outliers when asked for */
	double *exact;      /* (count, 3) the point on the surface each was displaced from */
	double *normals;    /* (count, 3) exact outward unit normals at `exact` */
	double *mean_curvature;     /* (count) H */
	double *gaussian_curvature; /* (count) K */
	double *principal_curvatures; /* (count, 2) k1 >= k2 */
	double *second_form; /* (count, 3, 3) II as an ambient symmetric tensor S: II(a, b) = a^T S b for tangent a, b; S n = 0 */
	unsigned char *outlier; /* (count) 1 where a point was displaced as an outlier */
};

struct gnp_sample_options {
	size_t count;        /* points wanted, exactly this many are returned */
	uint64_t seed;       /* of the sampling and the noise; independent of the shape's seed */
	double noise;        /* standard deviation of Gaussian noise on every coordinate, 0 for none */
	double outlier_fraction; /* in [0, 1]: chosen points get Gaussian noise of outlier_noise instead */
	double outlier_noise;
};

/* Quasi-uniform samples (blue noise, by sample elimination or relaxation; min spacing at least 0.6 of the mean one).
 * Deterministic in (shape, options) for any worker count. 100,000 points take about a second on two cores. */
gnp_status gnp_sample_create(const struct gnp_shape *shape, const struct gnp_sample_options *options,
                             struct gnp_pool *pool, struct gnp_task *task, struct gnp_sample *out,
                             struct gnp_error *error);
void gnp_sample_clear(struct gnp_sample *sample);

/* Displaces the points of a sample anew: with the seed and count it was made with, `points` and `outlier` become those
 * that gnp_sample_create gives for these options, at a hundredth of its cost. On failure the sample is unchanged. */
gnp_status gnp_sample_displace(const struct gnp_sample_options *options, struct gnp_sample *sample, struct gnp_error *error);

#endif
