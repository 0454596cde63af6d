#include "weights/validate/real_score.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"

const double gnp_real_score_limits[GNP_REAL_WITHIN] = {5, 10, 15};

struct gnp_real_score gnp_real_score_none(void)
{
	return (struct gnp_real_score){
		.rms = NAN, .median = NAN, .within = {NAN, NAN, NAN}, .sided = NAN, .curvature = NAN};
}

/* From the sine too, so that small angles are exact. False where there is no direction. */
static bool angle_between(const double *truth, const double *normal, double *degrees)
{
	double cross[3], along = fabs(gnp_dot(truth, normal));
	gnp_cross(truth, normal, cross);
	double across = sqrt(gnp_dot(cross, cross));
	*degrees = 90;
	if (!isfinite(along) || !isfinite(across) || !(along + across > 0))
		return false;
	*degrees = atan2(across, along) * 180 / M_PI;
	return true;
}

gnp_status gnp_real_score_normals(const double *truth, const uint32_t *at, size_t count, const double *normals,
                                  struct gnp_real_score *out, struct gnp_error *error)
{
	struct gnp_real_score score = {.curvature = NAN};
	double *angles = gnp_array_new(count, sizeof *angles);
	double squares = 0;
	if (!angles)
		return gnp_no_memory("score", count, "angles", error);
	for (size_t i = 0; i < count; i++) {
		const double *own = truth + 3 * (size_t)at[i], *normal = normals + 3 * i;
		score.lost += !angle_between(own, normal, &angles[i]);
		squares += angles[i] * angles[i];
		score.sided += gnp_dot(own, normal) > 0 ? 1 / (double)count : 0;
		for (int limit = 0; limit < GNP_REAL_WITHIN; limit++)
			score.within[limit] += angles[i] < gnp_real_score_limits[limit] ? 1 / (double)count : 0;
	}
	score.rms = sqrt(squares / (double)count);
	score.median = gnp_median(angles, count);
	free(angles);
	*out = score;
	return GNP_OK;
}

double gnp_real_score_curvature(const double *truth, const double *truth_curvature, const uint32_t *at, size_t count,
                                const double *normals, const double *curvature)
{
	double error = 0, size = 0;
	for (size_t i = 0; i < count; i++) {
		double wanted = truth_curvature[at[i]], side = gnp_dot(truth + 3 * (size_t)at[i], normals + 3 * i) < 0 ? -1 : 1;
		error += (side * curvature[i] - wanted) * (side * curvature[i] - wanted);
		size += wanted * wanted;
	}
	return size > 0 ? sqrt(error / size) : NAN;
}
