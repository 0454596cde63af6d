/* How far normals are from the truth: the angles' figures of the real table. */
#ifndef GNP_WEIGHTS_REAL_SCORE_H
#define GNP_WEIGHTS_REAL_SCORE_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

enum { GNP_REAL_WITHIN = 3 };
extern const double gnp_real_score_limits[GNP_REAL_WITHIN]; /* 5, 10, 15 [degrees] */

/* Angles are between lines, so that sides do not count, in degrees; a normal that is not finite or 0 counts as 90. */
struct gnp_real_score {
	double rms; /* root mean square angle; NAN: not judged */
	double median;
	double within[GNP_REAL_WITHIN]; /* share of the points below each limit */
	double sided;                   /* share of the points whose normal is on the truth's side */
	double curvature;               /* relative L2 error of H, both on the truth's side; NAN: not known */
	size_t lost;                    /* points without a normal */
};
struct gnp_real_score gnp_real_score_none(void);

/* Row i of normals (count, 3), of any length, is of the point at[i]; truth (points, 3) unit. curvature is left NAN. On
 * failure *out is unchanged. */
gnp_status gnp_real_score_normals(const double *truth, const uint32_t *at, size_t count, const double *normals,
                                  struct gnp_real_score *out, struct gnp_error *error);

/* The relative error of mean curvatures estimated (count) at the same points, whose sign goes with the side of normals;
 * NAN where the truth is 0 throughout. */
double gnp_real_score_curvature(const double *truth, const double *truth_curvature, const uint32_t *at, size_t count,
                                const double *normals, const double *curvature);

#endif
