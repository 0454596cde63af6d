#include "core/fit/surface.h"

#include <math.h>
#include <string.h>

#include "core/fit/regression.h"

/* First and second fundamental forms at a point and what follows from them; 2 x 2 tensors row-major. */
struct forms {
	struct gnp_jet h;
	double determinant, root; /* det g and its square root */
	double metric[4], inverse[4], second[4], shape[4];
};

static struct forms forms_at(const struct gnp_jet *h)
{
	struct forms f = {.h = *h};
	f.determinant = 1 + h->u * h->u + h->v * h->v;
	f.root = sqrt(f.determinant);
	f.metric[0] = 1 + h->u * h->u;
	f.metric[1] = f.metric[2] = h->u * h->v;
	f.metric[3] = 1 + h->v * h->v;
	double reciprocal = 1 / f.determinant;
	f.inverse[0] = f.metric[3] * reciprocal;
	f.inverse[1] = f.inverse[2] = -f.metric[1] * reciprocal;
	f.inverse[3] = f.metric[0] * reciprocal;
	double root = 1 / f.root;
	f.second[0] = h->uu * root;
	f.second[1] = f.second[2] = h->uv * root;
	f.second[3] = h->vv * root;
	for (int i = 0; i < 2; i++)
		for (int j = 0; j < 2; j++)
			f.shape[2 * i + j] = f.inverse[2 * i] * f.second[j] + f.inverse[2 * i + 1] * f.second[2 + j];
	return f;
}

/* a psi1 + b psi2 + c psi3. */
static void to_space(const struct gnp_surface *surface, double a, double b, double c, double out[3])
{
	for (int i = 0; i < 3; i++)
		out[i] = a * surface->frame[0][i] + b * surface->frame[1][i] + c * surface->frame[2][i];
}

/* k1 >= k2 and the tangent coefficients of their unit directions. With g = L L^T the Weingarten map is similar to the
 * symmetric L^-1 II L^-T, whose eigenvectors y give directions L^-T y that are orthonormal in g. */
static void principal(const struct forms *f, double k[2], double direction[2][2])
{
	double l00 = sqrt(f->metric[0]), l10 = f->metric[1] / l00, l11 = f->root / l00;
	double a = f->second[0] / f->metric[0];
	double b = (f->second[1] - l10 * f->second[0] / l00) / (l00 * l11);
	double c = (f->second[3] - 2 * l10 / l00 * f->second[1] + l10 * l10 / f->metric[0] * f->second[0]) / (l11 * l11);
	double mean = (a + c) / 2, half = (a - c) / 2, radius = hypot(half, b);
	k[0] = mean + radius;
	k[1] = mean - radius;
	/* Half of the angle of (half, b), each time from the sum that does not cancel; any direction will do at an umbilic. */
	double x = 1, y = 0;
	if (radius > 0 && half >= 0) {
		x = sqrt((1 + half / radius) / 2);
		y = b / (2 * radius * x);
	} else if (radius > 0) {
		y = sqrt((1 - half / radius) / 2);
		x = b / (2 * radius * y);
	}
	double e[2][2] = {{x, y}, {-y, x}};
	for (int i = 0; i < 2; i++) {
		direction[i][1] = e[i][1] / l11;
		direction[i][0] = (e[i][0] - l10 * direction[i][1]) / l00;
	}
}

/* d_k g_ij = h_ik h_j + h_i h_jk, then d_k g^-1 = -g^-1 (d_k g) g^-1; out[4 k + 2 i + j]. */
static void inverse_metric_derivatives(const struct forms *f, double out[8])
{
	const double d[2] = {f->h.u, f->h.v};
	const double hessian[2][2] = {{f->h.uu, f->h.uv}, {f->h.uv, f->h.vv}};
	for (int k = 0; k < 2; k++) {
		double dg[4], left[4];
		for (int i = 0; i < 2; i++)
			for (int j = 0; j < 2; j++)
				dg[2 * i + j] = hessian[i][k] * d[j] + d[i] * hessian[j][k];
		for (int i = 0; i < 2; i++)
			for (int j = 0; j < 2; j++)
				left[2 * i + j] = f->inverse[2 * i] * dg[j] + f->inverse[2 * i + 1] * dg[2 + j];
		for (int i = 0; i < 2; i++)
			for (int j = 0; j < 2; j++)
				out[4 * k + 2 * i + j] = -(left[2 * i] * f->inverse[j] + left[2 * i + 1] * f->inverse[2 + j]);
	}
}

struct gnp_jet gnp_surface_jet(const struct gnp_surface *surface, double u, double v)
{
	struct gnp_jet jet = gnp_basis_jet(surface->basis, surface->coefficients, u, v);
	double value = surface->scale_w, first = value / surface->scale_xy;
	double second = first / surface->scale_xy;
	return (struct gnp_jet){jet.f * value, jet.u * first, jet.v * first, jet.uu * second, jet.uv * second, jet.vv * second};
}

void gnp_surface_locate(const struct gnp_surface *surface, const double point[3], double *u, double *v)
{
	double x = 0, y = 0;
	for (int c = 0; c < 3; c++) {
		x += (point[c] - surface->origin[c]) * surface->frame[0][c];
		y += (point[c] - surface->origin[c]) * surface->frame[1][c];
	}
	*u = x / surface->scale_xy;
	*v = y / surface->scale_xy;
}

static double *at(double *const values[], uint64_t mask, enum gnp_quantity quantity, size_t row)
{
	return mask & GNP_QUANTITY_BIT(quantity) ? values[quantity] + row * gnp_quantity_info(quantity)->width : NULL;
}

static void write_vectors(const struct gnp_surface *surface, const struct forms *f, double u, double v, uint64_t mask,
                          size_t row, double *const values[])
{
	double *out;
	if ((out = at(values, mask, GNP_POINTS, row))) {
		to_space(surface, u * surface->scale_xy, v * surface->scale_xy, f->h.f, out);
		for (int i = 0; i < 3; i++)
			out[i] += surface->origin[i];
	}
	if ((out = at(values, mask, GNP_NORMALS, row)))
		to_space(surface, -f->h.u / f->root, -f->h.v / f->root, 1 / f->root, out);
	if ((out = at(values, mask, GNP_TANGENTS, row))) {
		to_space(surface, 1, 0, f->h.u, out);
		to_space(surface, 0, 1, f->h.v, out + 3);
	}
}

static void write_curvatures(const struct gnp_surface *surface, const struct forms *f, uint64_t mask, size_t row,
                             double *const values[])
{
	double *out;
	if ((out = at(values, mask, GNP_GAUSSIAN_CURVATURE, row)))
		*out = (f->h.uu * f->h.vv - f->h.uv * f->h.uv) / (f->determinant * f->determinant);
	if ((out = at(values, mask, GNP_MEAN_CURVATURE, row)))
		*out = (f->shape[0] + f->shape[3]) / 2;
	if (!(mask & (GNP_QUANTITY_BIT(GNP_PRINCIPAL_CURVATURES) | GNP_QUANTITY_BIT(GNP_PRINCIPAL_DIRECTIONS))))
		return;
	double k[2], direction[2][2];
	principal(f, k, direction);
	if ((out = at(values, mask, GNP_PRINCIPAL_CURVATURES, row)))
		memcpy(out, k, sizeof k);
	if ((out = at(values, mask, GNP_PRINCIPAL_DIRECTIONS, row)))
		for (int i = 0; i < 2; i++)
			to_space(surface, direction[i][0], direction[i][1],
			         direction[i][0] * f->h.u + direction[i][1] * f->h.v, out + 3 * i);
}

static void write_forms(const struct forms *f, uint64_t mask, size_t row, double *const values[])
{
	double *out;
	if ((out = at(values, mask, GNP_METRIC, row)))
		memcpy(out, f->metric, sizeof f->metric);
	if ((out = at(values, mask, GNP_INVERSE_METRIC, row)))
		memcpy(out, f->inverse, sizeof f->inverse);
	if ((out = at(values, mask, GNP_METRIC_DETERMINANT, row)))
		*out = f->determinant;
	if ((out = at(values, mask, GNP_INVERSE_METRIC_DERIVATIVES, row)))
		inverse_metric_derivatives(f, out);
	if ((out = at(values, mask, GNP_SECOND_FUNDAMENTAL_FORM, row)))
		memcpy(out, f->second, sizeof f->second);
	if ((out = at(values, mask, GNP_SHAPE_OPERATOR, row)))
		memcpy(out, f->shape, sizeof f->shape);
}

/* Covariance (6, 6) of the height's jet in length units. */
static void jet_covariance(const struct gnp_surface *surface, double u, double v, double covariance[36])
{
	double rows[6 * GNP_TAYLOR_STRIDE];
	gnp_taylor_jets(surface->basis.degree, u, v, GNP_TAYLOR_STRIDE, rows);
	gnp_regression_covariance(surface->factor, rows, covariance);
	const double value = surface->scale_w, first = value / surface->scale_xy, second = first / surface->scale_xy;
	const double *d = surface->doubt;
	const double unit[6] = {value * sqrt(d[0]),  first * sqrt(d[1]),  first * sqrt(d[1]),
	                        second * sqrt(d[2]), second * sqrt(d[2]), second * sqrt(d[2])};
	for (int i = 0; i < 6; i++)
		for (int j = 0; j < 6; j++)
			covariance[6 * i + j] *= surface->variance * unit[i] * unit[j];
}

/* Standard error of a quantity with this gradient by (h, h_u, h_v, h_uu, h_uv, h_vv), to first order. */
static double propagate(const double covariance[36], const double gradient[6])
{
	double sum = 0;
	for (int i = 0; i < 6; i++)
		for (int j = 0; j < 6; j++)
			sum += gradient[i] * covariance[6 * i + j] * gradient[j];
	return sqrt(fmax(sum, 0));
}

/* K and H of a height's jet. */
static void curvatures(const struct gnp_jet *h, double *gaussian, double *mean)
{
	struct forms f = forms_at(h);
	*gaussian = (h->uu * h->vv - h->uv * h->uv) / (f.determinant * f.determinant);
	*mean = (f.shape[0] + f.shape[3]) / 2;
}

/* The point was itself displaced by the noise, along the surface too: how far that moves K and H, to first order. */
static void slide(const struct gnp_surface *surface, double u, double v, double *gaussian, double *mean)
{
	static const double step = 0.02;
	double noise = surface->noise / (2 * step * surface->scale_xy), K[4], H[4];
	const double at[4][2] = {{u + step, v}, {u - step, v}, {u, v + step}, {u, v - step}};
	for (int i = 0; i < 4; i++) {
		struct gnp_jet h = gnp_surface_jet(surface, at[i][0], at[i][1]);
		curvatures(&h, &K[i], &H[i]);
	}
	*gaussian = noise * hypot(K[0] - K[1], K[2] - K[3]);
	*mean = noise * hypot(H[0] - H[1], H[2] - H[3]);
}

static void write_errors(const struct gnp_surface *surface, double u, double v, const struct forms *f, uint64_t mask,
                         size_t row, double *const values[])
{
	const struct gnp_jet *h = &f->h;
	double c[36], det = f->determinant, cube = det * f->root, K, H, slide_K, slide_H, k[2], d[2][2], *out;
	double noise = surface->noise;
	jet_covariance(surface, u, v, c);
	curvatures(h, &K, &H);
	slide(surface, u, v, &slide_K, &slide_H);
	principal(f, k, d);
	if ((out = at(values, mask, GNP_POINTS_STDERR, row)))
		*out = sqrt(c[0]);
	if ((out = at(values, mask, GNP_NORMALS_STDERR, row))) { /* |dn|^2 = d(h_u, h_v) g^-1 d(h_u, h_v) / det g */
		double fit = (f->inverse[0] * c[7] + 2 * f->inverse[1] * c[8] + f->inverse[3] * c[14]) / det;
		*out = sqrt(fit + noise * noise * (k[0] * k[0] + k[1] * k[1]));
	}
	if ((out = at(values, mask, GNP_GAUSSIAN_CURVATURE_STDERR, row))) {
		const double gradient[6] = {0, -4 * h->u * K / det, -4 * h->v * K / det, h->vv / (det * det),
		                            -2 * h->uv / (det * det), h->uu / (det * det)};
		*out = hypot(propagate(c, gradient), slide_K);
	}
	if ((out = at(values, mask, GNP_MEAN_CURVATURE_STDERR, row))) {
		const double gradient[6] = {0, (h->u * h->vv - h->v * h->uv) / cube - 3 * h->u * H / det,
		                            (h->v * h->uu - h->u * h->uv) / cube - 3 * h->v * H / det,
		                            f->metric[3] / (2 * cube), -h->u * h->v / cube, f->metric[0] / (2 * cube)};
		*out = hypot(propagate(c, gradient), slide_H);
	}
	if ((out = at(values, mask, GNP_PRINCIPAL_CURVATURES_STDERR, row)))
		for (int i = 0; i < 2; i++) { /* dk = dII(d, d) */
			const double gradient[6] = {0, 0, 0, d[i][0] * d[i][0] / f->root, 2 * d[i][0] * d[i][1] / f->root,
			                            d[i][1] * d[i][1] / f->root};
			out[i] = hypot(propagate(c, gradient), slide_H);
		}
}

void gnp_surface_evaluate(const struct gnp_surface *surface, double u, double v, uint64_t mask, size_t row,
                          double *const values[GNP_QUANTITY_COUNT])
{
	struct gnp_jet jet = gnp_surface_jet(surface, u, v);
	struct forms f = forms_at(&jet);
	write_vectors(surface, &f, u, v, mask, row, values);
	write_forms(&f, mask, row, values);
	write_curvatures(surface, &f, mask, row, values);
	if (mask & GNP_QUANTITY_STDERR)
		write_errors(surface, u, v, &f, mask, row, values);
	double *out;
	if ((out = at(values, mask, GNP_FRAME, row)))
		memcpy(out, surface->frame, sizeof surface->frame);
	if ((out = at(values, mask, GNP_ORIGIN, row)))
		memcpy(out, surface->origin, sizeof surface->origin);
	if ((out = at(values, mask, GNP_SCALE, row))) {
		out[0] = surface->scale_xy;
		out[1] = surface->scale_w;
	}
}

double gnp_laplace_beltrami(const struct gnp_jet *height, const struct gnp_jet *p)
{
	struct forms f = forms_at(height);
	double hessian = f.inverse[0] * p->uu + 2 * f.inverse[1] * p->uv + f.inverse[3] * p->vv;
	double bend = f.inverse[0] * height->uu + 2 * f.inverse[1] * height->uv + f.inverse[3] * height->vv;
	return hessian - bend * (height->u * p->u + height->v * p->v) / f.determinant;
}
