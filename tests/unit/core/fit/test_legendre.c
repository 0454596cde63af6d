#include "core/fit/legendre.h"
#include "tests/unit/test.h"

static void values_match_closed_forms(void)
{
	for (double x = -1; x <= 1; x += 0.125) {
		double p[8], d[8], dd[8];
		gnp_legendre(x, 7, p, d, dd);
		CHECK_NEAR(p[3], (5 * x * x * x - 3 * x) / 2, 1e-15);
		CHECK_NEAR(d[3], (15 * x * x - 3) / 2, 1e-14);
		CHECK_NEAR(dd[3], 15 * x, 1e-14);
		CHECK_NEAR(p[5], (63 * pow(x, 5) - 70 * pow(x, 3) + 15 * x) / 8, 1e-14);
		CHECK_NEAR(p[7], (429 * pow(x, 7) - 693 * pow(x, 5) + 315 * pow(x, 3) - 35 * x) / 16, 1e-13);
		CHECK_NEAR(dd[7], (429 * 42 * pow(x, 5) - 693 * 20 * pow(x, 3) + 315 * 6 * x) / 16, 1e-11);
	}
}

static void tensor_index_is_rows_of_v(void)
{
	double u = 0.3, v = -0.7, phi[16];
	struct gnp_basis basis = {GNP_BASIS_TENSOR, 3};
	gnp_basis_rows(basis, &u, &v, 1, 16, phi);
	CHECK(gnp_basis_size(basis) == 16);
	CHECK_NEAR(phi[4 * 2 + 1], (3 * v * v - 1) / 2 * u, 1e-15);
	CHECK_NEAR(phi[4 * 1 + 3], v * (5 * u * u * u - 3 * u) / 2, 1e-15);
}

static void total_basis_holds_the_lower_products(void)
{
	double u = 0.3, v = -0.7, phi[16];
	struct gnp_basis basis = {GNP_BASIS_TOTAL, 3};
	gnp_basis_rows(basis, &u, &v, 1, 16, phi);
	CHECK(gnp_basis_size(basis) == 10);
	CHECK_NEAR(phi[4], v, 1e-16);               /* a = 1, b = 0 */
	CHECK_NEAR(phi[6], v * (3 * u * u - 1) / 2, 1e-15); /* a = 1, b = 2 */
	CHECK_NEAR(phi[9], (5 * v * v * v - 3 * v) / 2, 1e-15);
	for (int i = 10; i < 16; i++)
		CHECK(phi[i] == 0);
}

static void jet_matches_rows_and_differences(void)
{
	for (int kind = 0; kind < 2; kind++)
		for (unsigned degree = 1; degree <= GNP_DEGREE_MAX; degree++) {
			struct gnp_basis basis = {(enum gnp_basis_kind)kind, degree};
			double c[GNP_BASIS_MAX], phi[GNP_BASIS_MAX], u = 0.21, v = -0.43, h = 1e-5;
			size_t size = gnp_basis_size(basis);
			for (size_t i = 0; i < size; i++)
				c[i] = sin(1.0 + (double)(i * i));
			struct gnp_jet jet = gnp_basis_jet(basis, c, u, v);
			gnp_basis_rows(basis, &u, &v, 1, GNP_BASIS_MAX, phi);
			double sum = 0;
			for (size_t i = 0; i < size; i++)
				sum += c[i] * phi[i];
			CHECK_NEAR(jet.f, sum, 1e-13);
			struct gnp_jet up = gnp_basis_jet(basis, c, u + h, v), um = gnp_basis_jet(basis, c, u - h, v);
			struct gnp_jet vp = gnp_basis_jet(basis, c, u, v + h), vm = gnp_basis_jet(basis, c, u, v - h);
			CHECK_NEAR(jet.u, (up.f - um.f) / (2 * h), 1e-6);
			CHECK_NEAR(jet.v, (vp.f - vm.f) / (2 * h), 1e-6);
			CHECK_NEAR(jet.uu, (up.u - um.u) / (2 * h), 1e-5);
			CHECK_NEAR(jet.uv, (up.v - um.v) / (2 * h), 1e-5);
			CHECK_NEAR(jet.vv, (vp.v - vm.v) / (2 * h), 1e-5);
		}
}

static void jets_of_the_functions_add_up_to_the_jet(void)
{
	enum { STRIDE = GNP_BASIS_MAX };
	for (int kind = 0; kind <= GNP_BASIS_TAYLOR; kind++) {
		struct gnp_basis basis = {(enum gnp_basis_kind)kind, 4};
		double c[GNP_BASIS_MAX], rows[6 * STRIDE], sum[6] = {0};
		gnp_basis_jets(basis, 0.21, -0.43, STRIDE, rows);
		for (size_t i = 0; i < gnp_basis_size(basis); i++) {
			c[i] = sin(1.0 + (double)(i * i));
			for (int d = 0; d < 6; d++)
				sum[d] += c[i] * rows[d * STRIDE + i];
		}
		struct gnp_jet jet = gnp_basis_jet(basis, c, 0.21, -0.43);
		const double want[6] = {jet.f, jet.u, jet.v, jet.uu, jet.uv, jet.vv};
		for (int d = 0; d < 6; d++)
			CHECK_NEAR(sum[d], want[d], 1e-12);
	}
}

static void embedding_keeps_the_function(void)
{
	for (int kind = 0; kind < 2; kind++) {
		struct gnp_basis part = {(enum gnp_basis_kind)kind, 2}, whole = {(enum gnp_basis_kind)kind, 5};
		size_t index[GNP_BASIS_MAX];
		double low[GNP_BASIS_MAX], high[GNP_BASIS_MAX] = {0};
		gnp_basis_embed(part, whole, index);
		for (size_t i = 0; i < gnp_basis_size(part); i++)
			high[index[i]] = low[i] = 1.0 / (double)(i + 1);
		CHECK_NEAR(gnp_basis_jet(whole, high, 0.4, 0.1).f, gnp_basis_jet(part, low, 0.4, 0.1).f, 1e-15);
		CHECK_NEAR(gnp_basis_jet(whole, high, 0.4, 0.1).uv, gnp_basis_jet(part, low, 0.4, 0.1).uv, 1e-15);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(values_match_closed_forms), TEST(tensor_index_is_rows_of_v),
	                                    TEST(total_basis_holds_the_lower_products), TEST(jet_matches_rows_and_differences),
	                                    TEST(jets_of_the_functions_add_up_to_the_jet), TEST(embedding_keeps_the_function)};
	return RUN_TESTS(tests);
}
