#include "core/base/vector.h"
#include "core/fit/surface.h"
#include "tests/unit/test.h"

/* A patch in a turned frame, with anisotropic scales, whose height is a known polynomial of degree 4. */
static const struct gnp_surface patch = {.basis = {GNP_BASIS_TENSOR, 4}, .origin = {1, -2, 3},
                                       .frame = {{0.6, 0.8, 0}, {0, 0, 1}, {0.8, -0.6, 0}},
                                       .scale_xy = 0.5, .scale_w = 0.07};
static double coefficients[25];

static struct gnp_surface surface(void)
{
	for (int i = 0; i < 25; i++)
		coefficients[i] = 0.4 * cos(2.0 * i + 1);
	struct gnp_surface s = patch;
	s.coefficients = coefficients;
	return s;
}

/* All quantities at scaled (u, v), one array of 16 doubles each. */
static double store[GNP_QUANTITY_COUNT][16];
static void evaluate(double u, double v)
{
	double *values[GNP_QUANTITY_COUNT];
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		values[q] = store[q];
	struct gnp_surface s = surface();
	gnp_surface_evaluate(&s, u, v, GNP_QUANTITY_ALL & ~(GNP_QUANTITY_BIT(GNP_SURFACE_COEFFICIENTS) | GNP_QUANTITY_STDERR), 0, values);
}

/* sigma at physical in-plane coordinates. */
static void position(double x, double y, double out[3])
{
	struct gnp_surface s = surface();
	double h = gnp_surface_jet(&s, x / patch.scale_xy, y / patch.scale_xy).f;
	for (int c = 0; c < 3; c++)
		out[c] = patch.origin[c] + x * patch.frame[0][c] + y * patch.frame[1][c] + h * patch.frame[2][c];
}

/* Oracle: first and second derivatives of the position by central differences, then the textbook formulas. */
static void forms_match_differences_of_the_position(void)
{
	const double x = 0.11, y = -0.07, h = 1e-4;
	double p[3][3][3], su[3], sv[3], suu[3], suv[3], svv[3], n[3];
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			position(x + (i - 1) * h, y + (j - 1) * h, p[i][j]);
	for (int c = 0; c < 3; c++) {
		su[c] = (p[2][1][c] - p[0][1][c]) / (2 * h);
		sv[c] = (p[1][2][c] - p[1][0][c]) / (2 * h);
		suu[c] = (p[2][1][c] - 2 * p[1][1][c] + p[0][1][c]) / (h * h);
		svv[c] = (p[1][2][c] - 2 * p[1][1][c] + p[1][0][c]) / (h * h);
		suv[c] = (p[2][2][c] - p[2][0][c] - p[0][2][c] + p[0][0][c]) / (4 * h * h);
	}
	for (int c = 0; c < 3; c++)
		n[c] = su[(c + 1) % 3] * sv[(c + 2) % 3] - su[(c + 2) % 3] * sv[(c + 1) % 3];
	double length = sqrt(gnp_dot(n, n));
	for (int c = 0; c < 3; c++)
		n[c] /= length;
	double E = gnp_dot(su, su), F = gnp_dot(su, sv), G = gnp_dot(sv, sv), L = gnp_dot(suu, n), M = gnp_dot(suv, n), N = gnp_dot(svv, n);
	double det = E * G - F * F, K = (L * N - M * M) / det, H = (L * G - 2 * M * F + N * E) / (2 * det);

	evaluate(x / patch.scale_xy, y / patch.scale_xy);
	for (int c = 0; c < 3; c++) {
		CHECK_NEAR(store[GNP_POINTS][c], p[1][1][c], 1e-15);
		CHECK_NEAR(store[GNP_NORMALS][c], n[c], 1e-7);
		CHECK_NEAR(store[GNP_TANGENTS][c], su[c], 1e-7);
		CHECK_NEAR(store[GNP_TANGENTS][3 + c], sv[c], 1e-7);
	}
	CHECK_NEAR(store[GNP_METRIC][0], E, 1e-7);
	CHECK_NEAR(store[GNP_METRIC][1], F, 1e-7);
	CHECK_NEAR(store[GNP_METRIC][3], G, 1e-7);
	CHECK_NEAR(store[GNP_METRIC_DETERMINANT][0], det, 1e-7);
	CHECK_NEAR(store[GNP_SECOND_FUNDAMENTAL_FORM][0], L, 1e-5);
	CHECK_NEAR(store[GNP_SECOND_FUNDAMENTAL_FORM][1], M, 1e-5);
	CHECK_NEAR(store[GNP_SECOND_FUNDAMENTAL_FORM][2], M, 1e-5);
	CHECK_NEAR(store[GNP_SECOND_FUNDAMENTAL_FORM][3], N, 1e-5);
	CHECK_NEAR(store[GNP_GAUSSIAN_CURVATURE][0], K, 1e-4);
	CHECK_NEAR(store[GNP_MEAN_CURVATURE][0], H, 1e-5);
}

static void inverse_metric_and_its_derivatives(void)
{
	const double u = 0.3, v = -0.2, h = 1e-5;
	double plus[4], minus[4];
	evaluate(u, v);
	const double *g = store[GNP_METRIC], *inverse = store[GNP_INVERSE_METRIC];
	CHECK_NEAR(g[0] * inverse[0] + g[1] * inverse[2], 1, 1e-14);
	CHECK_NEAR(g[0] * inverse[1] + g[1] * inverse[3], 0, 1e-14);
	CHECK_NEAR(g[2] * inverse[1] + g[3] * inverse[3], 1, 1e-14);
	double derivatives[8];
	memcpy(derivatives, store[GNP_INVERSE_METRIC_DERIVATIVES], sizeof derivatives);
	for (int k = 0; k < 2; k++) {
		evaluate(u + (k == 0) * h, v + (k == 1) * h);
		memcpy(plus, store[GNP_INVERSE_METRIC], sizeof plus);
		evaluate(u - (k == 0) * h, v - (k == 1) * h);
		memcpy(minus, store[GNP_INVERSE_METRIC], sizeof minus);
		for (int i = 0; i < 4; i++)
			CHECK_NEAR(derivatives[4 * k + i], (plus[i] - minus[i]) / (2 * h * patch.scale_xy), 1e-8);
	}
}

static void principal_curvatures_diagonalise_the_shape_operator(void)
{
	for (int trial = 0; trial < 50; trial++) {
		evaluate(0.9 * sin(trial), 0.9 * cos(2.0 * trial));
		const double *k = store[GNP_PRINCIPAL_CURVATURES], *d = store[GNP_PRINCIPAL_DIRECTIONS];
		const double *second = store[GNP_SECOND_FUNDAMENTAL_FORM], *inverse = store[GNP_INVERSE_METRIC];
		const double *tangent = store[GNP_TANGENTS];
		CHECK(k[0] >= k[1]);
		CHECK_NEAR(k[0] * k[1], store[GNP_GAUSSIAN_CURVATURE][0], 1e-12);
		CHECK_NEAR((k[0] + k[1]) / 2, store[GNP_MEAN_CURVATURE][0], 1e-13);
		CHECK_NEAR(store[GNP_SHAPE_OPERATOR][0] + store[GNP_SHAPE_OPERATOR][3], k[0] + k[1], 1e-13);
		CHECK_NEAR(gnp_dot(d, d), 1, 1e-14);
		CHECK_NEAR(gnp_dot(d + 3, d + 3), 1, 1e-14);
		CHECK_NEAR(gnp_dot(d, d + 3), 0, 1e-13);
		CHECK_NEAR(gnp_dot(d, store[GNP_NORMALS]), 0, 1e-14);
		for (int i = 0; i < 2; i++) { /* II(d, d) with the direction's contravariant components */
			double low[2] = {gnp_dot(d + 3 * i, tangent), gnp_dot(d + 3 * i, tangent + 3)};
			double a = inverse[0] * low[0] + inverse[1] * low[1], b = inverse[2] * low[0] + inverse[3] * low[1];
			CHECK_NEAR(second[0] * a * a + 2 * second[1] * a * b + second[3] * b * b, k[i], 1e-12);
		}
	}
}

/* On a sphere cap z = sqrt(R^2 - x^2 - y^2) with outward normal up: Delta z = 2 H n_z = -2 z / R^2, and likewise for x. */
static void laplace_beltrami_of_coordinates_on_a_sphere(void)
{
	const double R = 2, x = 0.5, y = -0.3, z = sqrt(R * R - x * x - y * y);
	struct gnp_jet h = {z, -x / z, -y / z, -1 / z - x * x / (z * z * z), -x * y / (z * z * z), -1 / z - y * y / (z * z * z)};
	struct gnp_jet along_x = {x, 1, 0, 0, 0, 0};
	CHECK_NEAR(gnp_laplace_beltrami(&h, &h), -2 * z / (R * R), 1e-14);
	CHECK_NEAR(gnp_laplace_beltrami(&h, &along_x), -2 * x / (R * R), 1e-14);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(forms_match_differences_of_the_position), TEST(inverse_metric_and_its_derivatives),
	                                    TEST(principal_curvatures_diagonalise_the_shape_operator),
	                                    TEST(laplace_beltrami_of_coordinates_on_a_sphere)};
	return RUN_TESTS(tests);
}
