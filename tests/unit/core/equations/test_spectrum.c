#include "core/equations/spectrum.h"
#include "core/linear/linalg.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

/* l (l + 1), 2 l + 1 times each, up to l = 8; the first vector is constant. */
static void the_sphere_has_its_eigenvalues(void)
{
	enum { N = 8000, L = 8, COUNT = (L + 1) * (L + 1) };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = {N, sample.points, sample.normals};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_spectrum spectrum;
	struct gnp_error error = {0};
	options.laplacian.domain.estimate.cover = GNP_COVER_ALL;
	const struct gnp_spectrum_wanted wanted = {COUNT, 0, 1e-8};
	if (gnp_spectrum_run(&cloud, &options, &wanted, pool, NULL, &spectrum, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		CHECK(!"the spectrum was found");
		return;
	}
	CHECK_AT_MOST(fabs(spectrum.value[0]), 1e-8);
	for (int l = 1, k = 1; l <= L; l++)
		for (int m = -l; m <= l; m++, k++) {
			CHECK_NEAR(spectrum.value[k], l * (l + 1), 0.005 * l * (l + 1));
			CHECK_AT_MOST(spectrum.imaginary[k], 0.005 * l * (l + 1));
			CHECK_AT_MOST(spectrum.residual[k], 1e-8);
		}
	for (size_t i = 1; i < N; i++)
		CHECK_NEAR(spectrum.vector[i], spectrum.vector[0], 1e-7);
	gnp_spectrum_clear(&spectrum);
	gnp_sample_clear(&sample);
}

static void askings_that_cannot_be_met_are_refused(void)
{
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = 200, .seed = 7}, pool);
	struct gnp_cloud cloud = {200, sample.points, sample.normals};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_spectrum spectrum;
	struct gnp_error error = {0}, other = {0};
	const struct gnp_spectrum_wanted many = {50, 0, 1e-8}, exact = {5, 0, 0};
	options.laplacian.system = GNP_SYSTEM_SQUARE;
	CHECK(gnp_spectrum_run(&cloud, &options, &many, pool, NULL, &spectrum, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "points: got 200, need at least 296, 4 count + 96 where count is 50");
	CHECK(gnp_spectrum_run(&cloud, &options, &exact, pool, NULL, &spectrum, &other) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(other.text, "tolerance: got 0, need 1e-12..0.1");
	gnp_sample_clear(&sample);
}

/* A shift that nobody had given was said to be infinite. */
static void clouds_too_small_for_their_square_are_named(void)
{
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = 200, .seed = 7}, pool);
	struct gnp_cloud cloud = {200, sample.points, sample.normals};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_spectrum spectrum;
	struct gnp_error error = {0};
	for (size_t i = 0; i < 600; i++)
		sample.points[i] *= 1e-300;
	const struct gnp_spectrum_wanted wanted = {5, 0, 1e-8};
	CHECK(gnp_spectrum_run(&cloud, &options, &wanted, pool, NULL, &spectrum, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "points: the mean square of their distance from their middle is 0, ");
	CHECK_CONTAINS(error.text, "scale them up");
	gnp_sample_clear(&sample);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(the_sphere_has_its_eigenvalues), TEST(askings_that_cannot_be_met_are_refused),
	                                    TEST(clouds_too_small_for_their_square_are_named)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
