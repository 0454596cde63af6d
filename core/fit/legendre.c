#include "core/fit/legendre.h"

#include "core/base/simd.h"
#include "core/fit/taylor.h"

static const double reciprocal[GNP_DEGREE_MAX + 1] = {0, 1.0, 1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7};

size_t gnp_basis_size(struct gnp_basis basis)
{
	size_t d = basis.degree;
	return basis.kind == GNP_BASIS_TENSOR ? (d + 1) * (d + 1) : (d + 1) * (d + 2) / 2;
}

/* Highest b that goes with a. */
GNP_INLINE unsigned last_column(struct gnp_basis basis, unsigned a)
{
	return basis.kind == GNP_BASIS_TENSOR ? basis.degree : basis.degree - a;
}

void gnp_basis_embed(struct gnp_basis part, struct gnp_basis whole, size_t *index)
{
	size_t row = 0, n = 0;
	for (unsigned a = 0; a <= part.degree; a++) {
		for (unsigned b = 0; b <= last_column(part, a); b++)
			index[n++] = row + b;
		row += last_column(whole, a) + 1;
	}
}

/* Bonnet's recurrence (n+1) P_{n+1} = (2n+1) x P_n - n P_{n-1} and its derivatives. */
void gnp_legendre(double x, unsigned degree, double *p, double *dp, double *ddp)
{
	p[0] = 1;
	dp[0] = ddp[0] = 0;
	if (degree == 0)
		return;
	p[1] = x;
	dp[1] = 1;
	ddp[1] = 0;
	for (unsigned n = 1; n < degree; n++) {
		p[n + 1] = ((2 * n + 1) * x * p[n] - n * p[n - 1]) * reciprocal[n + 1];
		dp[n + 1] = dp[n - 1] + (2 * n + 1) * p[n];
		ddp[n + 1] = ddp[n - 1] + (2 * n + 1) * dp[n];
	}
}

GNP_INLINE void values(double x, unsigned degree, double *p)
{
	p[0] = 1;
	p[1] = x;
	for (unsigned n = 1; n < degree; n++)
		p[n + 1] = ((2 * n + 1) * x * p[n] - n * p[n - 1]) * reciprocal[n + 1];
}

GNP_INLINE void rows_body(struct gnp_basis basis, const double *u, const double *v, size_t count, size_t stride, double *phi)
{
	for (size_t i = 0; i < count; i++, phi += stride) {
		double pu[GNP_DEGREE_MAX + 2], pv[GNP_DEGREE_MAX + 2];
		values(u[i], basis.degree, pu);
		values(v[i], basis.degree, pv);
		size_t n = 0;
		for (unsigned a = 0; a <= basis.degree; a++)
			for (unsigned b = 0; b <= last_column(basis, a); b++)
				phi[n++] = pv[a] * pu[b];
		for (; n < stride; n++)
			phi[n] = 0;
	}
}

/* The paper's basis is worth a copy whose loops the compiler unrolls. */
GNP_INLINE void rows_choose(struct gnp_basis basis, const double *u, const double *v, size_t count, size_t stride, double *phi)
{
	if (basis.kind == GNP_BASIS_TENSOR && basis.degree == 3 && stride == 16)
		rows_body((struct gnp_basis){GNP_BASIS_TENSOR, 3}, u, v, count, 16, phi);
	else
		rows_body(basis, u, v, count, stride, phi);
}

GNP_SIMD_DISPATCH(, gnp_basis_rows, rows_choose,
                  (struct gnp_basis basis, const double *u, const double *v, size_t count, size_t stride, double *phi),
                  (basis, u, v, count, stride, phi))

void gnp_basis_jets(struct gnp_basis basis, double u, double v, size_t stride, double *rows)
{
	if (basis.kind == GNP_BASIS_TAYLOR) {
		gnp_taylor_jets(basis.degree, u, v, stride, rows);
		return;
	}
	double pu[GNP_DEGREE_MAX + 1], du[GNP_DEGREE_MAX + 1], ddu[GNP_DEGREE_MAX + 1];
	double pv[GNP_DEGREE_MAX + 1], dv[GNP_DEGREE_MAX + 1], ddv[GNP_DEGREE_MAX + 1];
	gnp_legendre(u, basis.degree, pu, du, ddu);
	gnp_legendre(v, basis.degree, pv, dv, ddv);
	double *row = rows;
	for (unsigned a = 0; a <= basis.degree; a++)
		for (unsigned b = 0; b <= last_column(basis, a); b++, row++) {
			row[0] = pv[a] * pu[b];
			row[stride] = pv[a] * du[b];
			row[2 * stride] = dv[a] * pu[b];
			row[3 * stride] = pv[a] * ddu[b];
			row[4 * stride] = dv[a] * du[b];
			row[5 * stride] = ddv[a] * pu[b];
		}
}

struct gnp_jet gnp_basis_jet(struct gnp_basis basis, const double *coefficients, double u, double v)
{
	if (basis.kind == GNP_BASIS_TAYLOR)
		return gnp_taylor_jet(basis.degree, coefficients, u, v);
	double pu[GNP_DEGREE_MAX + 1], du[GNP_DEGREE_MAX + 1], ddu[GNP_DEGREE_MAX + 1];
	double pv[GNP_DEGREE_MAX + 1], dv[GNP_DEGREE_MAX + 1], ddv[GNP_DEGREE_MAX + 1];
	gnp_legendre(u, basis.degree, pu, du, ddu);
	gnp_legendre(v, basis.degree, pv, dv, ddv);
	struct gnp_jet jet = {0};
	const double *c = coefficients;
	for (unsigned a = 0; a <= basis.degree; a++) {
		double f = 0, fu = 0, fuu = 0;
		for (unsigned b = 0; b <= last_column(basis, a); b++, c++) {
			f += *c * pu[b];
			fu += *c * du[b];
			fuu += *c * ddu[b];
		}
		jet.f += pv[a] * f;
		jet.u += pv[a] * fu;
		jet.uu += pv[a] * fuu;
		jet.v += dv[a] * f;
		jet.uv += dv[a] * fu;
		jet.vv += ddv[a] * f;
	}
	return jet;
}
