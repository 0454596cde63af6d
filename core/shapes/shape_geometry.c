/* Normals and curvatures of a surface from the derivatives of a chart or of a level set (shape_family.h). */
#include "core/shapes/shape_family.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"

static double normalize(double a[3])
{
	double length = sqrt(gnp_dot(a, a));
	for (int i = 0; i < 3; i++)
		a[i] /= length;
	return length;
}

/* a^T W b for a symmetric W given as xx, xy, xz, yy, yz, zz. */
static double form(const double w[6], const double a[3], const double b[3])
{
	return a[0] * (w[0] * b[0] + w[1] * b[1] + w[2] * b[2]) + a[1] * (w[1] * b[0] + w[3] * b[1] + w[4] * b[2]) +
	       a[2] * (w[2] * b[0] + w[4] * b[1] + w[5] * b[2]);
}

/* Sign-stable frame of Duff et al. (2017): no direction of n is special. */
void gnp_geometry_tangents(const double n[3], double t1[3], double t2[3])
{
	double sign = copysign(1, n[2]);
	double a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
	t1[0] = 1 + sign * n[0] * n[0] * a;
	t1[1] = sign * b;
	t1[2] = -sign * n[0];
	t2[0] = b;
	t2[1] = sign + n[1] * n[1] * a;
	t2[2] = -n[1];
}

/* From II in the orthonormal frame (t1, t2) of the tangent plane. The eigenvalues come from the 2x2 form, not from
 * H and K, which would lose half the digits where k1 and k2 are close. */
static void finish(const double x[3], const double n[3], const double t1[3], const double t2[3], double l11, double l12,
                   double l22, struct gnp_geometry *out)
{
	memcpy(out->point, x, sizeof out->point);
	memcpy(out->normal, n, sizeof out->normal);
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			out->second_form[3 * i + j] =
				l11 * t1[i] * t1[j] + l12 * (t1[i] * t2[j] + t2[i] * t1[j]) + l22 * t2[i] * t2[j];
	double half = (l11 - l22) / 2, root = sqrt(half * half + l12 * l12);
	out->mean = (l11 + l22) / 2;
	out->gaussian = l11 * l22 - l12 * l12;
	out->principal[0] = out->mean + root;
	out->principal[1] = out->mean - root;
}

void gnp_geometry_from_chart(const double x[3], double derivative[5][3], struct gnp_geometry *out)
{
	const double *v = derivative[1];
	double n[3], t1[3], t2[3];
	gnp_cross(derivative[0], v, n);
	normalize(n);
	memcpy(t1, derivative[0], sizeof t1);
	double length = normalize(t1);
	gnp_cross(n, t1, t2);

	/* sigma_u = length t1, sigma_v = slope sigma_u + height t2 */
	double slope = gnp_dot(v, t1) / length, height = gnp_dot(v, t2);
	double l = gnp_dot(derivative[2], n), m = gnp_dot(derivative[3], n), nn = gnp_dot(derivative[4], n);
	double l11 = l / (length * length), l12 = (m - slope * l) / (length * height);
	double l22 = (nn - 2 * slope * m + slope * slope * l) / (height * height);
	finish(x, n, t1, t2, l11, l12, l22, out);
}

void gnp_geometry_from_level(const double x[3], const double gradient[3], const double hessian[6],
                             struct gnp_geometry *out)
{
	double n[3] = {gradient[0], gradient[1], gradient[2]}, t1[3], t2[3];
	double length = normalize(n);
	gnp_geometry_tangents(n, t1, t2);
	double l11 = -form(hessian, t1, t1) / length, l12 = -form(hessian, t1, t2) / length;
	double l22 = -form(hessian, t2, t2) / length;
	finish(x, n, t1, t2, l11, l12, l22, out);
}
