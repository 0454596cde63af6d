#include "core/cloud/outward.h"

#include <math.h>

#include "core/base/vector.h"

static const double undecided = 0.05;

struct surface {
	const double *points, *normals, *radius;
	const uint32_t *members;
	size_t count;
	double largest; /* radius */
};

/* The relative area of a member; the largest is 1. */
static double weight(const struct surface *surface, size_t member)
{
	if (surface->largest == 0)
		return 1;
	double ratio = surface->radius[surface->members[member]] / surface->largest;
	return ratio * ratio;
}

static double flux(const struct surface *surface)
{
	const double *origin = surface->points + 3 * (size_t)surface->members[0];
	double centre[3] = {0}, total = 0, through = 0, most = 0;
	for (size_t m = 0; m < surface->count; m++) {
		const double *p = surface->points + 3 * (size_t)surface->members[m];
		double w = weight(surface, m);
		total += w;
		for (int c = 0; c < 3; c++)
			centre[c] += w * (p[c] - origin[c]);
	}
	for (int c = 0; c < 3; c++)
		centre[c] = origin[c] + centre[c] / total;
	for (size_t m = 0; m < surface->count; m++) {
		const double *p = surface->points + 3 * (size_t)surface->members[m];
		double w = weight(surface, m), arm[3] = {p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]};
		through += w * gnp_dot(arm, surface->normals + 3 * (size_t)surface->members[m]);
		most += w * sqrt(gnp_dot(arm, arm));
	}
	return most > 0 ? through / most : 0;
}

static double extremes(const struct surface *surface)
{
	enum { AXES = 7 };
	const double s = sqrt(1.0 / 3);
	const double axes[AXES][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {s, s, s}, {s, s, -s}, {s, -s, s}, {-s, s, s}};
	double low[AXES], high[AXES], sum = 0;
	uint32_t lowest[AXES] = {0}, highest[AXES] = {0};
	for (int a = 0; a < AXES; a++) {
		low[a] = INFINITY;
		high[a] = -INFINITY;
	}
	for (size_t m = 0; m < surface->count; m++) {
		uint32_t i = surface->members[m];
		if (weight(surface, m) == 0)
			continue;
		for (int a = 0; a < AXES; a++) {
			double along = gnp_dot(axes[a], surface->points + 3 * (size_t)i);
			if (along < low[a]) {
				low[a] = along;
				lowest[a] = i;
			}
			if (along > high[a]) {
				high[a] = along;
				highest[a] = i;
			}
		}
	}
	for (int a = 0; a < AXES; a++)
		sum += gnp_dot(axes[a], surface->normals + 3 * (size_t)highest[a]) -
		       gnp_dot(axes[a], surface->normals + 3 * (size_t)lowest[a]);
	return sum / (2 * AXES);
}

static bool faces_negative(const struct surface *surface)
{
	double mean[3] = {0};
	for (size_t m = 0; m < surface->count; m++)
		for (int c = 0; c < 3; c++)
			mean[c] += weight(surface, m) * surface->normals[3 * (size_t)surface->members[m] + c];
	int largest = 2; /* z before y before x among equals: ground is seen from above */
	for (int c = 1; c >= 0; c--)
		largest = fabs(mean[c]) > fabs(mean[largest]) ? c : largest;
	return mean[largest] < 0;
}

bool gnp_outward_flips(const double *points, const double *normals, const double *radius, const uint32_t *members,
                       size_t count)
{
	struct surface surface = {points, normals, radius, members, count, 0};
	for (size_t m = 0; m < count; m++)
		surface.largest = fmax(surface.largest, radius[members[m]]);
	double score = flux(&surface) + extremes(&surface);
	return fabs(score) < undecided ? faces_negative(&surface) : score < 0;
}
