/* What an estimator says of its own answers on exact bodies, against the truth: which points it takes for near an
 * edge, and how far its error bars hold. */
#ifndef GNP_WEIGHTS_REAL_DETAIL_H
#define GNP_WEIGHTS_REAL_DETAIL_H

#include "weights/validate/real_method.h"

enum { GNP_REAL_BARS = 2 }; /* 1 and 2 standard errors */

/* Far points are those farther than a spacing from every edge, rim or tip. */
struct gnp_real_detail {
	size_t centres;              /* 0: not judged */
	size_t near, flagged, found; /* within a spacing of an edge; taken for that (crease = 1); both. 0 of those that do
	                                not say, and on open surfaces whose rims are not known */
	size_t far;
	double angle;          /* root mean square of far points [degree] */
	double mean_curvature; /* relative L2 errors over far points; NAN where the truth is 0 (below 1e-3) throughout */
	double gaussian_curvature;
	size_t normals_within[GNP_REAL_BARS],
		curvature_within[GNP_REAL_BARS]; /* far points with an error of normal and of H
	                                        of at most 1 and 2 standard errors */
};

/* Judges an estimator at `most` points spread over the cloud (0: all), whose curvatures are known. On failure *out is
 * unchanged. */
gnp_status gnp_real_detail_judge(const struct gnp_real_method *method, const struct gnp_real_cloud *cloud,
                                 size_t most, struct gnp_pool *pool, struct gnp_real_detail *out,
                                 struct gnp_error *error);

#endif
