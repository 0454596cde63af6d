#include "core/support/ladder.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"
#include "core/cloud/patch.h"
#include "core/support/moments.h"

enum { STEPS = GNP_LADDER_STEPS };

const unsigned gnp_ladder_points[STEPS] = {8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 288, 432};

/* Step l has no more points than the one before: it looks the same. */
static void repeat(struct gnp_ladder *out, int l)
{
	for (int part = 0; part < 3; part++)
		out->looks[part * STEPS + l] = out->looks[part * STEPS + l - 1];
	memcpy(out->frames[l], out->frames[l - 1], sizeof out->frames[l]);
}

static void look_at_step(struct gnp_ladder *out, int l, const struct gnp_moments *moments)
{
	double variance[3];
	gnp_moments_axes(moments, variance, out->frames[l]);
	double turn = l ? gnp_dot(out->frames[l][2], out->frames[l - 1][2]) : 1;
	out->looks[l] = (float)(0.5 * log(gnp_moments_flatness(variance) + 1e-12));
	out->looks[STEPS + l] = (float)(0.5 * log(gnp_moments_span(variance) + 1e-12));
	out->looks[2 * STEPS + l] = (float)(0.5 * log(fmax(1 - turn * turn, 0) + 1e-6));
	out->steps = l + 1;
}

/* Mean and standard deviation of roughness over the nearest points. */
static void look_around(const struct gnp_roughness *roughness, const uint32_t *index, size_t count, float *looks)
{
	static const size_t about[2] = {48, GNP_LADDER_REACH};
	for (int a = 0; a < 2; a++)
		for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++) {
			double sum = 0, square = 0, n = (double)(about[a] < count ? about[a] : count);
			for (size_t i = 0; i < about[a] && i < count; i++) {
				double value = (double)gnp_roughness_at(roughness, s, index[i]);
				sum += value;
				square += value * value;
			}
			*looks++ = (float)(sum / n);
			*looks++ = (float)sqrt(fmax(square / n - sum / n * (sum / n), 0));
		}
}

void gnp_ladder_look(const double *points, const double *normals, const struct gnp_roughness *roughness,
                     const uint32_t *index, size_t count, struct gnp_ladder *out)
{
	struct gnp_moments moments = {0};
	const double *origin = points + 3 * (size_t)index[0];
	size_t i = 0;
	out->steps = 0;
	for (int l = 0; l < STEPS; l++) {
		if (l && gnp_ladder_points[l] > count) {
			repeat(out, l);
			continue;
		}
		for (; i < gnp_ladder_points[l] && i < count; i++)
			if (!normals || gnp_same_sheet(normals + 3 * (size_t)index[i], normals + 3 * (size_t)index[0]))
				gnp_moments_add(&moments, origin, points + 3 * (size_t)index[i]);
		look_at_step(out, l, &moments);
	}
	look_around(roughness, index, count, out->looks + 3 * STEPS);
}
