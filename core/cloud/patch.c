#include "core/cloud/patch.h"

#include <math.h>

#include "core/linear/eigen.h"

/* Whether the i-th point of the patch has a say in its frame. */
static bool frames(const struct gnp_patch_source *source, const struct gnp_patch *patch, size_t i)
{
	return !source->one_sheet || gnp_same_sheet(source->normals + 3 * (size_t)patch->index[i],
	                                            source->normals + 3 * (size_t)patch->centre);
}

/* Returns how many points there are to frame by; the centre is always one. */
static size_t mean_point(const struct gnp_patch_source *source, const struct gnp_patch *patch, double mean[3])
{
	/* About the centre, so that a cloud far from the origin loses no digits. */
	const double *o = source->points + 3 * (size_t)patch->centre;
	double sum[3] = {0};
	size_t count = 0;
	for (size_t i = 0; i < patch->count; i++) {
		bool counts = frames(source, patch, i);
		count += counts;
		for (int c = 0; counts && c < 3; c++)
			sum[c] += source->points[3 * (size_t)patch->index[i] + c] - o[c];
	}
	for (int c = 0; c < 3; c++)
		mean[c] = o[c] + sum[c] / (double)count;
	return count;
}

static void covariance(const struct gnp_patch_source *source, const struct gnp_patch *patch, size_t count, double upper[6])
{
	double s[6] = {0};
	for (size_t i = 0; i < patch->count; i++) {
		if (!frames(source, patch, i))
			continue;
		const double *p = source->points + 3 * (size_t)patch->index[i];
		double x = p[0] - patch->origin[0], y = p[1] - patch->origin[1], z = p[2] - patch->origin[2];
		s[0] += x * x;
		s[1] += x * y;
		s[2] += x * z;
		s[3] += y * y;
		s[4] += y * z;
		s[5] += z * z;
	}
	for (int c = 0; c < 6; c++)
		upper[c] = s[c] / (double)count;
}

static void mean_normal(const struct gnp_patch_source *source, const struct gnp_patch *patch, double mean[3])
{
	mean[0] = mean[1] = mean[2] = 0;
	for (size_t i = 0; i < patch->count; i++)
		for (int c = 0; frames(source, patch, i) && c < 3; c++)
			mean[c] += source->normals[3 * (size_t)patch->index[i] + c];
}

/* psi3 to the side of the normals; psi1's sign by the third moment along it, a choice that turns with the cloud. */
static void orient_frame(const struct gnp_patch_source *source, struct gnp_patch *patch)
{
	double normal[3], skew = 0;
	double(*psi)[3] = patch->frame;
	mean_normal(source, patch, normal);
	if (gnp_dot(normal, psi[2]) < 0)
		for (int c = 0; c < 3; c++)
			psi[2][c] = -psi[2][c];
	for (size_t i = 0; i < patch->count; i++) {
		if (!frames(source, patch, i))
			continue;
		const double *p = source->points + 3 * (size_t)patch->index[i];
		double along = (p[0] - patch->origin[0]) * psi[0][0] + (p[1] - patch->origin[1]) * psi[0][1] +
		               (p[2] - patch->origin[2]) * psi[0][2];
		skew += along * along * along;
	}
	if (skew < 0)
		for (int c = 0; c < 3; c++)
			psi[0][c] = -psi[0][c];
	psi[1][0] = psi[2][1] * psi[0][2] - psi[2][2] * psi[0][1];
	psi[1][1] = psi[2][2] * psi[0][0] - psi[2][0] * psi[0][2];
	psi[1][2] = psi[2][0] * psi[0][1] - psi[2][1] * psi[0][0];
}

static void project(const struct gnp_patch_source *source, const struct gnp_patch *patch)
{
	for (size_t i = 0; i < patch->buffer_count; i++) {
		const double *p = source->points + 3 * (size_t)patch->index[i];
		double d[3] = {p[0] - patch->origin[0], p[1] - patch->origin[1], p[2] - patch->origin[2]};
		patch->u[i] = gnp_dot(d, patch->frame[0]);
		patch->v[i] = gnp_dot(d, patch->frame[1]);
		patch->w[i] = gnp_dot(d, patch->frame[2]);
	}
}

static void scale(struct gnp_patch *patch)
{
	double xy = 1 / patch->scale_xy, w = 1 / patch->scale_w;
	for (size_t i = 0; i < patch->buffer_count; i++) {
		patch->u[i] *= xy;
		patch->v[i] *= xy;
		patch->w[i] *= w;
	}
}

static double largest_radius(const struct gnp_patch *patch)
{
	double square = 0;
	for (size_t i = 0; i < patch->count; i++)
		square = fmax(square, patch->u[i] * patch->u[i] + patch->v[i] * patch->v[i]);
	return sqrt(square);
}

gnp_status gnp_patch_build(const struct gnp_patch_source *source, const struct gnp_neighborhoods *neighborhoods,
                           size_t row, uint32_t centre, double *u, double *v, double *w, struct gnp_patch *patch,
                           struct gnp_error *error)
{
	size_t start = neighborhoods->start[row], length = neighborhoods->start[row + 1] - start;
	const double *distance = neighborhoods->distance + start;
	*patch = (struct gnp_patch){.centre = centre, .k = source->k, .buffer_count = length, .index = neighborhoods->index + start,
	                            .u = u, .v = v, .w = w, .epsilon = GNP_PATCH_TAU * distance[source->k - 1]};
	while (patch->count < length && distance[patch->count] <= patch->epsilon)
		patch->count++;
	if (!(patch->epsilon > 0))
		return gnp_error_set(error, GNP_DEGENERATE, "points: more points coincide at (%g, %g, %g) than a neighbourhood has, remove duplicates",
		                     source->points[3 * (size_t)centre], source->points[3 * (size_t)centre + 1],
		                     source->points[3 * (size_t)centre + 2]);
	double upper[6], variance[3];
	size_t framing = mean_point(source, patch, patch->origin);
	covariance(source, patch, framing, upper);
	gnp_eigen_symmetric3(upper, variance, patch->frame);
	orient_frame(source, patch);
	project(source, patch);
	patch->scale_xy = largest_radius(patch);
	double deviations = source->height_scale > 0 ? source->height_scale : 2;
	double smallest = source->delta0 > 0 ? source->delta0 : source->delta0_ratio * patch->epsilon;
	patch->scale_w = fmax(deviations * sqrt(fmax(variance[2], 0)), smallest);
	scale(patch);
	return GNP_OK;
}

void gnp_patch_locate(const struct gnp_patch *patch, const double point[3], double *u, double *v)
{
	double d[3] = {point[0] - patch->origin[0], point[1] - patch->origin[1], point[2] - patch->origin[2]};
	*u = gnp_dot(d, patch->frame[0]) / patch->scale_xy;
	*v = gnp_dot(d, patch->frame[1]) / patch->scale_xy;
}

bool gnp_patch_one_sided(const struct gnp_patch *patch, double u, double v)
{
	/* Sectors of equal length round the diamond |x| + |y| = 1, about 6 degrees each: no arc tangent a point. */
	enum { SECTORS = 60, GAP = 20 };
	bool seen[SECTORS] = {false};
	static const double near = 1e-6; /* the point itself and its duplicates point nowhere */
	for (size_t i = 0; i < patch->count; i++) {
		double x = patch->u[i] - u, y = patch->v[i] - v, size = fabs(x) + fabs(y);
		if (size <= near)
			continue;
		double turn = x >= 0 ? (y >= 0 ? y : 4 * size + y) / size : 2 - y / size; /* quarter turns, 0..4 */
		seen[(int)(turn * (SECTORS / 4 - 1e-9))] = true;
	}
	int run = 0;
	for (int s = 0; s < 2 * SECTORS; s++) {
		run = seen[s % SECTORS] ? 0 : run + 1;
		if (run >= GAP)
			return true;
	}
	return false;
}
