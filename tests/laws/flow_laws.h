/* Clouds and measures that flows are judged by. */
#ifndef GNP_TESTS_FLOW_LAWS_H
#define GNP_TESTS_FLOW_LAWS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/vector.h"

struct cloud {
	size_t count;
	double *points, *normals;
	unsigned char *fixed;
};

static inline struct cloud cloud_new(size_t count)
{
	return (struct cloud){count, calloc(count, 3 * sizeof(double)), calloc(count, 3 * sizeof(double)), calloc(count, 1)};
}

static inline void cloud_free(struct cloud *cloud)
{
	free(cloud->points);
	free(cloud->normals);
	free(cloud->fixed);
}

/* A cylinder, rows of staggered points `h` apart, the rings at its ends held. */
static inline struct cloud cylinder(double radius, double half, double h)
{
	size_t rows = 2 * (size_t)(half / (h * sqrt(0.75)) + 0.5), columns = (size_t)(2 * acos(-1) * radius / h + 0.5), i = 0;
	struct cloud cloud = cloud_new((rows + 1) * columns);
	for (size_t r = 0; r <= rows; r++)
		for (size_t c = 0; c < columns; c++, i++) {
			double angle = 2 * acos(-1) * ((double)c + 0.5 * (double)(r % 2)) / (double)columns;
			double row[3] = {cos(angle), sin(angle), 0}, z = half * (2 * (double)r / (double)rows - 1);
			for (size_t k = 0; k < 3; k++) {
				cloud.normals[3 * i + k] = row[k];
				cloud.points[3 * i + k] = k < 2 ? radius * row[k] : z;
			}
			cloud.fixed[i] = r == 0 || r == rows;
		}
	return cloud;
}

/* Of distances from a centre: mean, and the largest relative difference from it. */
struct spread {
	double mean, worst;
};

/* About the centre of the sphere that suits points and normals best: the points' mean is off it where they crowd on one side. */
static inline struct spread radii(const double *points, const double *normals, size_t count)
{
	double centre[3] = {0}, sum = 0;
	struct spread spread = {0};
	/* least squares: p - r n is the centre of a sphere, for some r */
	double mean[3] = {0}, normal[3] = {0}, pn = 0, nn = 0;
	for (size_t i = 0; i < count; i++)
		for (size_t c = 0; c < 3; c++) {
			mean[c] += points[3 * i + c] / (double)count;
			normal[c] += normals[3 * i + c] / (double)count;
		}
	for (size_t i = 0; i < 3 * count; i++) {
		pn += (points[i] - mean[i % 3]) * (normals[i] - normal[i % 3]);
		nn += (normals[i] - normal[i % 3]) * (normals[i] - normal[i % 3]);
	}
	for (size_t c = 0; c < 3; c++)
		centre[c] = mean[c] - pn / nn * normal[c];
	for (size_t i = 0; i < count; i++) {
		const double *p = points + 3 * i, d[3] = {p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]};
		sum += sqrt(gnp_dot(d, d));
	}
	spread.mean = sum / (double)count;
	for (size_t i = 0; i < count; i++) {
		const double *p = points + 3 * i, d[3] = {p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]};
		spread.worst = fmax(spread.worst, fabs(sqrt(gnp_dot(d, d)) / spread.mean - 1));
	}
	return spread;
}

/* The bumps of `bumpy_torus`, as the coefficient of their wave in the tube's radius; the ring is half way between the extremes. */
static inline double bumps(const double *points, size_t count)
{
	double inner = INFINITY, outer = 0, sum = 0, tube = 0;
	for (size_t i = 0; i < count; i++) {
		double out = hypot(points[3 * i], points[3 * i + 1]);
		inner = fmin(inner, out);
		outer = fmax(outer, out);
	}
	for (size_t i = 0; i < count; i++)
		tube += hypot(hypot(points[3 * i], points[3 * i + 1]) - (inner + outer) / 2, points[3 * i + 2]) / (double)count;
	for (size_t i = 0; i < count; i++) {
		const double *p = points + 3 * i;
		double out = hypot(p[0], p[1]) - (inner + outer) / 2;
		sum += (hypot(out, p[2]) - tube) * sin(5 * atan2(p[1], p[0])) * cos(4 * atan2(p[2], out));
	}
	return 4 * fabs(sum) / (double)count;
}

/* Largest relative distance of points from the catenoid rho = a cosh(z / a) through rings of radius 1 at z = +-1/2. */
static inline double off_catenoid(const double *points, size_t count)
{
	static const double a = 0.848338; /* 1 = a cosh(0.5 / a) */
	double worst = 0;
	for (size_t i = 0; i < count; i++)
		worst = fmax(worst, fabs(hypot(points[3 * i], points[3 * i + 1]) / (a * cosh(points[3 * i + 2] / a)) - 1));
	return worst;
}

#endif
