/* The paper's radial family: x = r(d) d over unit directions d, with r = 1 + s sum_{l=1..L} sum_{m=0..l} (alpha_lm cos
 * m phi - beta_lm sin m phi) k_m N_lm P_lm(cos theta), k_0 = 1, k_m = 2: the real part of complex coefficients alpha +
 * i beta ~ N(0, 1/l) closed by conjugacy. The mean over the sphere is exactly 1 since only l = 0 has one.
 *
 * The sum is evaluated as a polynomial in the Cartesian components of d: with A_m + i B_m = (x + i y)^m and Q_lm(z) =
 * N_lm P_lm / sin^m theta, each harmonic is Q_lm(z) A_m or Q_lm(z) B_m. No angle and no 1/sin theta appears, so the
 * poles are ordinary points. */
#include "core/shapes/shape_family.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"

enum { DEGREE_MAX = 22, LANES = 4 };

/* A few directions at once, for the vector unit. */
typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));

/* Q_l = up z Q_{l-1} - down Q_{l-2} at fixed m, from Q_m = start[m]; c multiplies Q A_m, s multiplies Q B_m. */
struct term {
	double up, down, c, s;
};

struct radial {
	unsigned degree;
	double start[DEGREE_MAX + 1];
	struct term terms[(DEGREE_MAX + 1) * (DEGREE_MAX + 2) / 2]; /* m = 0..L, then l = m..L */
};

/* The polynomial and, where asked for, its derivatives in space. */
struct jet {
	lanes value;
	lanes gradient[3];
	lanes hessian[6]; /* xx, xy, xz, yy, yz, zz */
};

/* The sums over l at fixed m: g goes with A_m, h with B_m; derivatives in z. */
struct column {
	lanes g[3], h[3];
};

static inline __attribute__((always_inline)) void column_sum(const struct term *term, size_t count, double start,
                                                             const lanes *height, bool derivatives, struct column *out)
{
	lanes zero = {0}, z = *height, q = start + zero, before = zero;
	lanes dq = zero, dbefore = zero, ddq = zero, ddbefore = zero;
	lanes g = zero, h = zero, dg = zero, dh = zero, ddg = zero, ddh = zero;
	for (size_t i = 0; i < count; i++, term++) {
		if (i > 0) {
			lanes uz = term->up * z;
			if (derivatives) {
				lanes ddnext = uz * ddq + 2 * term->up * dq - term->down * ddbefore;
				lanes dnext = uz * dq + term->up * q - term->down * dbefore;
				ddbefore = ddq, ddq = ddnext;
				dbefore = dq, dq = dnext;
			}
			lanes next = uz * q - term->down * before;
			before = q, q = next;
		}
		g += term->c * q, h += term->s * q;
		if (derivatives) {
			dg += term->c * dq, dh += term->s * dq;
			ddg += term->c * ddq, ddh += term->s * ddq;
		}
	}
	*out = (struct column){{g, dg, ddg}, {h, dh, ddh}};
}

/* Sums the columns at d; the gradient and Hessian are of the polynomial in space, not yet tangential. */
static inline __attribute__((always_inline)) void polynomial(const struct radial *radial, const lanes d[3],
                                                             bool derivatives, struct jet *out)
{
	lanes zero = {0};
	lanes a = 1 + zero, b = zero, a1 = zero, b1 = zero, a2 = zero, b2 = zero; /* powers m, m - 1, m - 2 */
	lanes *gradient = out->gradient, *hessian = out->hessian;
	const struct term *term = radial->terms;
	memset(out, 0, sizeof *out);
	for (unsigned m = 0; m <= radial->degree; m++) {
		struct column sum;
		size_t count = radial->degree - m + 1;
		column_sum(term, count, radial->start[m], &d[2], derivatives, &sum);
		term += count;
		out->value += sum.g[0] * a + sum.h[0] * b;
		if (derivatives) {
			double first = m, second = m * (m - 1.0);
			gradient[0] += first * (sum.g[0] * a1 + sum.h[0] * b1);
			gradient[1] += first * (sum.h[0] * a1 - sum.g[0] * b1);
			gradient[2] += sum.g[1] * a + sum.h[1] * b;
			lanes xx = second * (sum.g[0] * a2 + sum.h[0] * b2);
			hessian[0] += xx;
			hessian[1] += second * (sum.h[0] * a2 - sum.g[0] * b2);
			hessian[2] += first * (sum.g[1] * a1 + sum.h[1] * b1);
			hessian[3] -= xx;
			hessian[4] += first * (sum.h[1] * a1 - sum.g[1] * b1);
			hessian[5] += sum.g[2] * a + sum.h[2] * b;
		}
		a2 = a1, b2 = b1, a1 = a, b1 = b;
		a = d[0] * a1 - d[1] * b1;
		b = d[0] * b1 + d[1] * a1;
	}
}

static void polynomial_value(const struct radial *radial, const lanes d[3], struct jet *out)
{
	polynomial(radial, d, false, out);
}

static void polynomial_jet(const struct radial *radial, const lanes d[3], struct jet *out)
{
	polynomial(radial, d, true, out);
}

/* Up to LANES unit directions from (count, 3) vectors; lanes past the count repeat the last. */
static void directions_load(const double *vectors, size_t count, lanes d[3])
{
	for (size_t k = 0; k < LANES; k++) {
		const double *v = vectors + 3 * (k < count ? k : count - 1);
		double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
		for (int c = 0; c < 3; c++)
			d[c][k] = v[c] / length;
	}
}

/* Derivatives on the unit sphere of the polynomial's restriction to it, from the jet in space (lane k):
 * tangent t = P g, and the symmetric P W P - (g . d) P, with P = I - d d^T. */
static void sphere_derivatives(const struct jet *jet, size_t k, const double d[3], double t[3], double second[6])
{
	static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
	static const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
	double along = 0, wd[3] = {0}, dwd = 0;
	for (int i = 0; i < 3; i++) {
		along += jet->gradient[i][k] * d[i];
		for (int j = 0; j < 3; j++)
			wd[i] += jet->hessian[at[i][j]][k] * d[j];
		dwd += wd[i] * d[i];
	}
	for (int i = 0; i < 3; i++)
		t[i] = jet->gradient[i][k] - along * d[i];
	for (int e = 0; e < 6; e++) {
		int i = row[e], j = column[e];
		double projector = (i == j) - d[i] * d[j];
		second[e] = jet->hessian[e][k] - wd[i] * d[j] - d[i] * wd[j] + dwd * d[i] * d[j] - along * projector;
	}
}

/* The surface is the level set |x| - r(x / |x|) = 0. In space the Hessian of r(x / |x|) at radius r is
 * (second - d t^T - t d^T) / r^2 and its gradient t / r. */
static void radial_geometry(const struct jet *jet, size_t k, const double d[3], struct gnp_geometry *out)
{
	static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
	double t[3], second[6], gradient[3], hessian[6], x[3];
	double r = 1 + jet->value[k];
	sphere_derivatives(jet, k, d, t, second);
	for (int i = 0; i < 3; i++) {
		x[i] = r * d[i];
		gradient[i] = d[i] - t[i] / r;
	}
	for (int e = 0; e < 6; e++) {
		int i = row[e], j = column[e];
		double projector = (i == j) - d[i] * d[j];
		hessian[e] = projector / r - (second[e] - d[i] * t[j] - t[i] * d[j]) / (r * r);
	}
	gnp_geometry_from_level(x, gradient, hessian, out);
}

static void radial_place(const struct gnp_shape *shape, size_t count, const double *parameters, double *points)
{
	for (size_t begin = 0; begin < count; begin += LANES) {
		size_t some = count - begin < LANES ? count - begin : LANES;
		lanes d[3];
		struct jet jet;
		directions_load(parameters + 3 * begin, some, d);
		polynomial_value(shape->data, d, &jet);
		for (size_t k = 0; k < some; k++)
			for (int c = 0; c < 3; c++)
				points[3 * (begin + k) + (size_t)c] = (1 + jet.value[k]) * d[c][k];
	}
}

static void radial_evaluate(const struct gnp_shape *shape, size_t count, const double *parameters,
                            struct gnp_geometry *out)
{
	for (size_t begin = 0; begin < count; begin += LANES) {
		size_t some = count - begin < LANES ? count - begin : LANES;
		lanes d[3];
		struct jet jet;
		directions_load(parameters + 3 * begin, some, d);
		polynomial_jet(shape->data, d, &jet);
		for (size_t k = 0; k < some; k++)
			radial_geometry(&jet, k, (double[]){d[0][k], d[1][k], d[2][k]}, out + begin + k);
	}
}

/* ---- Creation ---- */

/* Factors of the orthonormal recurrence, coefficients not yet set. */
static void recurrence_fill(struct radial *radial)
{
	struct term *term = radial->terms;
	radial->start[0] = sqrt(1 / (4 * M_PI));
	for (unsigned m = 0; m <= radial->degree; m++) {
		if (m > 0)
			radial->start[m] = radial->start[m - 1] * sqrt((2.0 * m + 1) / (2.0 * m));
		term++;
		for (unsigned l = m + 1; l <= radial->degree; l++, term++) {
			double n = l, mm = (double)m * m, k = n - 1;
			term->up = sqrt((4 * n * n - 1) / (n * n - mm));
			term->down = l == m + 1 ? 0 : term->up * sqrt((k * k - mm) / (4 * k * k - 1));
		}
	}
}

/* Draws in the order l, m, so that a lower degree of the same seed has the same leading coefficients. */
static void coefficients_draw(struct radial *radial, struct gnp_random *random)
{
	for (unsigned l = 1; l <= radial->degree; l++) {
		size_t at = l;
		for (unsigned m = 0; m <= l; m++) {
			double alpha = gnp_random_normal(random) / l, beta = gnp_random_normal(random) / l;
			radial->terms[at].c = m ? 2 * alpha : alpha;
			radial->terms[at].s = m ? -2 * beta : 0;
			at += radial->degree - m; /* from (l, m) to (l, m + 1) */
		}
	}
}

/* One Newton step on the sphere towards an extremum of the given sign (1 maximum, -1 minimum); false where the second
 * derivative does not have that sign and the step would lead elsewhere. */
static bool newton_step(const struct jet *jet, size_t k, double sign, double d[3])
{
	double t[3], second[6], t1[3], t2[3];
	sphere_derivatives(jet, k, d, t, second);
	gnp_geometry_tangents(d, t1, t2);
	double g1 = 0, g2 = 0, h11 = 0, h12 = 0, h22 = 0;
	static const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
	for (int i = 0; i < 3; i++) {
		g1 += t[i] * t1[i];
		g2 += t[i] * t2[i];
		for (int j = 0; j < 3; j++) {
			h11 += t1[i] * second[at[i][j]] * t1[j];
			h12 += t1[i] * second[at[i][j]] * t2[j];
			h22 += t2[i] * second[at[i][j]] * t2[j];
		}
	}
	double determinant = h11 * h22 - h12 * h12;
	if (!(determinant > 0) || sign * h11 >= 0)
		return false;
	double s1 = -(h22 * g1 - h12 * g2) / determinant, s2 = -(h11 * g2 - h12 * g1) / determinant;
	for (int i = 0; i < 3; i++)
		d[i] += s1 * t1[i] + s2 * t2[i];
	return true;
}

/* The largest value of sign * polynomial met on Newton's way from one direction. */
static double refine(const struct radial *radial, double sign, const double start[3])
{
	enum { STEPS = 6 };
	double best = -INFINITY, at[3] = {start[0], start[1], start[2]};
	for (int step = 0; step < STEPS; step++) {
		lanes d[3];
		struct jet jet;
		directions_load(at, 1, d);
		polynomial_jet(radial, d, &jet);
		best = fmax(best, sign * jet.value[0]);
		for (int c = 0; c < 3; c++)
			at[c] = d[c][0];
		if (!newton_step(&jet, 0, sign, at))
			break;
	}
	return best;
}

/* The polynomial at the first corner of every triangle, (triangles). */
static void corner_values(const struct radial *radial, const struct gnp_shape_mesh *mesh, double *value)
{
	for (size_t begin = 0; begin < mesh->triangles; begin += LANES) {
		size_t some = mesh->triangles - begin < LANES ? mesh->triangles - begin : LANES;
		double corner[3 * LANES];
		for (size_t k = 0; k < some; k++)
			memcpy(corner + 3 * k, mesh->corners + 9 * (begin + k), 3 * sizeof *corner);
		lanes d[3];
		struct jet jet;
		directions_load(corner, some, d);
		polynomial_value(radial, d, &jet);
		for (size_t k = 0; k < some; k++)
			value[begin + k] = jet.value[k];
	}
}

/* The largest value of sign * polynomial: from the mesh's corners, then by Newton's method from every corner close to the
 * extreme, since a second hill may be higher than the one of the best corner. */
static double extreme_find(const struct radial *radial, const struct gnp_shape_mesh *mesh, const double *value, double sign)
{
	double most = -INFINITY, least = INFINITY;
	for (size_t i = 0; i < mesh->triangles; i++) {
		most = fmax(most, sign * value[i]);
		least = fmin(least, sign * value[i]);
	}
	double found = most, close = most - 0.03 * (most - least);
	for (size_t i = 0; i < mesh->triangles; i++)
		if (sign * value[i] >= close)
			found = fmax(found, refine(radial, sign, mesh->corners + 9 * i));
	return found;
}

static void coefficients_scale(struct radial *radial, double factor)
{
	for (size_t i = 0; i < sizeof radial->terms / sizeof radial->terms[0]; i++) {
		radial->terms[i].c *= factor;
		radial->terms[i].s *= factor;
	}
}

/* The largest scale that keeps r within [0.7, 1.3]. */
static gnp_status range_fit(struct gnp_shape *shape, struct gnp_error *error)
{
	static const double REACH = 0.3;
	struct radial *radial = shape->data;
	double *value = gnp_array_new(shape->mesh.triangles, sizeof *value);
	if (!value)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "shape radial: no memory for its range");
	corner_values(radial, &shape->mesh, value);
	double up = extreme_find(radial, &shape->mesh, value, 1), down = extreme_find(radial, &shape->mesh, value, -1);
	coefficients_scale(radial, REACH / fmax(up, down));
	free(value);
	return GNP_OK;
}

static gnp_status radial_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	static const unsigned char choices[] = {3, 6, 8, 10, 12, 15, 18, 22};
	if (degree > DEGREE_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "degree: got %u, need at most %d", degree, DEGREE_MAX);
	struct radial *radial = gnp_shape_data_new(shape, sizeof *radial, error);
	if (!radial)
		return GNP_OUT_OF_MEMORY;
	struct gnp_random choice, coefficients;
	gnp_random_seed(&choice, seed, 0);
	gnp_random_seed(&coefficients, seed, 1);
	radial->degree = degree ? degree : choices[gnp_random_below(&choice, sizeof choices)];
	recurrence_fill(radial);
	coefficients_draw(radial, &coefficients);
	gnp_status status = gnp_shape_mesh_sphere(shape, 64, error);
	return status == GNP_OK ? range_fit(shape, error) : status;
}

const struct gnp_shape_family gnp_shapes_radial[] = {
	{"radial", radial_create, radial_place, radial_evaluate},
	{NULL, NULL, NULL, NULL},
};
