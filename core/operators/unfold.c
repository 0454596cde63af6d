#include "core/operators/unfold.h"

#include <math.h>

#include "core/base/vector.h"
#include "core/cloud/patch.h"

/* d becomes its part at right angles to the mean normal, turned with it onto n. */
static void turn(const double n[3], const double m[3], double d[3])
{
	double mean[3] = {n[0] + m[0], n[1] + m[1], n[2] + m[2]};
	double inverse = 1 / sqrt(gnp_dot(mean, mean));
	for (int c = 0; c < 3; c++)
		mean[c] *= inverse;
	double along = gnp_dot(d, mean);
	for (int c = 0; c < 3; c++)
		d[c] -= along * mean[c];
	double share = gnp_dot(d, n) / (1 + gnp_dot(mean, n));
	for (int c = 0; c < 3; c++)
		d[c] -= share * (mean[c] + n[c]);
}

void gnp_unfold(const double from[3], const double n[3], double tangents[2][3], const double to[3], const double m[3],
                double *u, double *v)
{
	double d[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
	if (gnp_same_sheet(n, m))
		turn(n, m, d);
	*u = gnp_dot(d, tangents[0]);
	*v = gnp_dot(d, tangents[1]);
}
