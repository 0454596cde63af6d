#include "core/cells/carry.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"

/* v, tangent where the normal is n, as it is where the normal is m. */
static void turn_plane(const double n[3], const double m[3], const double v[3], double out[3])
{
	double cosine = 1 + gnp_dot(n, m), part = cosine > 0 ? gnp_dot(m, v) / cosine : 0;
	for (int c = 0; c < 3; c++)
		out[c] = v[c] - part * (n[c] + m[c]);
}

static void turn_about(const double n[3], double angle, const double v[3], double out[3])
{
	double side[3];
	gnp_cross(n, v, side);
	for (int c = 0; c < 3; c++)
		out[c] = cos(angle) * v[c] + sin(angle) * side[c];
}

static void scale_to(double length, double v[3])
{
	double now = sqrt(gnp_dot(v, v));
	for (int c = 0; c < 3; c++)
		v[c] = now > 0 ? v[c] * (length / now) : 0;
}

static void carry_vector(const struct gnp_carried *carried, const double *normals, uint32_t from, uint32_t to)
{
	if (carried->vector)
		turn_plane(normals + 3 * (size_t)from, normals + 3 * (size_t)to, carried->vector + 3 * (size_t)from,
		           carried->vector + 3 * (size_t)to);
}

void gnp_carry_along(const struct gnp_carried *carried, const double *points, const double *normals, uint32_t from,
                     uint32_t to)
{
	carry_vector(carried, normals, from, to);
	if (!carried->start)
		return;
	const double *o = points + 3 * (size_t)from, *p = points + 3 * (size_t)to, *n = normals + 3 * (size_t)from;
	double *start = carried->start + 3 * (size_t)to, *before = carried->start + 3 * (size_t)from;
	memcpy(start, before, 3 * sizeof *start);
	if (gnp_dot(before, before) > 0)
		return;
	double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]}, height = gnp_dot(d, n);
	for (int c = 0; c < 3; c++)
		start[c] = d[c] - height * n[c];
	scale_to(1, start);
}

void gnp_carry_between(const struct gnp_carried *carried, const double *normals, const uint32_t side[2], double share,
                       uint32_t source, uint32_t to)
{
	const double *n = normals + 3 * (size_t)source, *m = normals + 3 * (size_t)to;
	if (carried->start) {
		const double *a = carried->start + 3 * (size_t)side[0], *b = carried->start + 3 * (size_t)side[1];
		double across[3];
		gnp_cross(a, b, across);
		turn_about(n, share * atan2(gnp_dot(across, n), gnp_dot(a, b)), a, carried->start + 3 * (size_t)to);
	}
	if (carried->vector) {
		const double *a = carried->vector + 3 * (size_t)side[0], *b = carried->vector + 3 * (size_t)side[1];
		double from_a[3], from_b[3], *v = carried->vector + 3 * (size_t)to;
		turn_plane(normals + 3 * (size_t)side[0], m, a, from_a);
		turn_plane(normals + 3 * (size_t)side[1], m, b, from_b);
		for (int c = 0; c < 3; c++)
			v[c] = (1 - share) * from_a[c] + share * from_b[c];
		scale_to(sqrt(gnp_dot(a, a)), v);
	}
}

void gnp_carry_turned(const struct gnp_carried *carried, const double *normals, uint32_t from, double angle,
                      uint32_t source, uint32_t to)
{
	carry_vector(carried, normals, from, to);
	if (carried->start)
		turn_about(normals + 3 * (size_t)source, angle, carried->start + 3 * (size_t)from,
		           carried->start + 3 * (size_t)to);
}
