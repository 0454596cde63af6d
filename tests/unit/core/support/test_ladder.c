/* The ladder against principal axes of the same points and the formulas of its looks. */
#include "core/cloud/patch.h"
#include "core/linear/pca.h"
#include "core/support/ladder.h"
#include "tests/unit/core/support/small_cloud.h"

enum { STEPS = GNP_LADDER_STEPS, LOOKS = GNP_LADDER_LOOKS };

/* Up to sign: axes of distinct variances. */
static void check_axes(double got[3][3], double want[3][3], double tolerance)
{
	for (int a = 0; a < 3; a++) {
		double along = gnp_dot(got[a], want[a]);
		CHECK_NEAR(along * along, 1, tolerance);
	}
}

/* A ladder by its definition: axes of the points that count, a step at a time. */
static void check_ladder(const struct small_cloud *cloud, const struct small_row *row, const struct gnp_ladder *ladder)
{
	double before[3] = {0};
	uint32_t kept[GNP_LADDER_REACH];
	size_t used = 0, i = 0;
	int steps = 0;
	for (int l = 0; l < STEPS && gnp_ladder_points[l] <= row->count; l++, steps++) {
		struct gnp_pca pca;
		for (; i < gnp_ladder_points[l]; i++)
			if (!cloud->cloud.given ||
			    gnp_dot(cloud->normals + 3 * (size_t)row->index[i], cloud->normals + 3 * (size_t)row->index[0]) > 0.1)
				kept[used++] = row->index[i];
		gnp_pca_fit(cloud->points, kept, used, &pca);
		double turn = l ? gnp_dot(before, pca.axes[2]) : 1;
		check_axes((double(*)[3])ladder->frames[l], pca.axes, 1e-9);
		CHECK_NEAR(ladder->looks[l], 0.5 * log(pca.values[2] / pca.values[1] + 1e-12), 1e-6);
		CHECK_NEAR(ladder->looks[STEPS + l], 0.5 * log(pca.values[1] / pca.values[0] + 1e-12), 1e-6);
		CHECK_NEAR(ladder->looks[2 * STEPS + l], 0.5 * log(fmax(1 - turn * turn, 0) + 1e-6), 1e-5);
		memcpy(before, pca.axes[2], sizeof before);
	}
	CHECK(ladder->steps == steps);
}

static void look(const struct small_cloud *cloud, uint32_t centre, struct small_row *row, struct gnp_ladder *ladder)
{
	small_cloud_search(cloud, centre, row);
	gnp_ladder_look(cloud->points, cloud->cloud.given ? cloud->normals : NULL, &cloud->roughness, row->index,
	                row->count, ladder);
}

static void steps_are_principal_axes_of_the_nearest(void)
{
	static struct small_row row;
	struct gnp_ladder ladder;
	struct small_cloud cloud;
	small_cloud_make(900, 0.01, false, &cloud);
	for (uint32_t centre = 3; centre < 900; centre += 111) {
		look(&cloud, centre, &row, &ladder);
		check_ladder(&cloud, &row, &ladder);
		CHECK(ladder.steps == STEPS);
	}
	small_cloud_clear(&cloud);
}

static void given_normals_keep_out_what_faces_away(void)
{
	static struct small_row row;
	struct gnp_ladder with, without;
	struct small_cloud cloud;
	double moved = 0;
	small_cloud_make(900, 0.01, true, &cloud);
	for (uint32_t centre = 3; centre < 900; centre += 111) {
		look(&cloud, centre, &row, &with);
		check_ladder(&cloud, &row, &with);
		gnp_ladder_look(cloud.points, NULL, &cloud.roughness, row.index, row.count, &without);
		moved = fmax(moved, fabs((double)with.looks[STEPS - 1] - (double)without.looks[STEPS - 1]));
	}
	CHECK(moved > 0.1); /* there were such points, and they mattered */
	small_cloud_clear(&cloud);
}

static void steps_without_points_repeat_the_last(void)
{
	static struct small_row row;
	struct gnp_ladder ladder;
	struct small_cloud cloud;
	small_cloud_make(40, 0.01, false, &cloud);
	look(&cloud, 5, &row, &ladder);
	CHECK(ladder.steps == 5); /* 8, 12, 16, 24, 32 */
	check_ladder(&cloud, &row, &ladder);
	for (int l = 5; l < STEPS; l++) {
		for (int part = 0; part < 3; part++)
			CHECK(ladder.looks[part * STEPS + l] == ladder.looks[part * STEPS + 4]);
		CHECK(memcmp(ladder.frames[l], ladder.frames[4], sizeof ladder.frames[l]) == 0);
	}
	small_cloud_clear(&cloud);
}

/* Fewer points than the first step wants: there is one step all the same. */
static void few_points_make_one_step(void)
{
	static struct small_row row;
	struct small_cloud cloud;
	small_cloud_make(16, 0.01, false, &cloud);
	for (size_t count = 1; count < 8; count++) {
		struct gnp_ladder ladder;
		struct gnp_pca pca;
		small_cloud_search(&cloud, 4, &row);
		gnp_ladder_look(cloud.points, NULL, &cloud.roughness, row.index, count, &ladder);
		CHECK(ladder.steps == 1);
		gnp_pca_fit(cloud.points, row.index, count, &pca);
		if (count > 3)
			check_axes(ladder.frames[STEPS - 1], pca.axes, 1e-9);
		for (int i = 0; i < LOOKS; i++)
			CHECK(isfinite(ladder.looks[i]));
	}
	small_cloud_clear(&cloud);
}

static void the_region_is_told_by_mean_and_deviation(void)
{
	static const size_t about[2] = {48, 432};
	static struct small_row row;
	static const size_t counts[] = {900, 200, 20};
	for (int c = 0; c < 3; c++) {
		struct small_cloud cloud;
		struct gnp_ladder ladder;
		small_cloud_make(counts[c], 0.03, false, &cloud);
		look(&cloud, 9, &row, &ladder);
		const float *got = ladder.looks + 3 * STEPS;
		for (int a = 0; a < 2; a++)
			for (int s = 0; s < 2; s++, got += 2) {
				size_t n = about[a] < row.count ? about[a] : row.count;
				double mean = 0, square = 0;
				for (size_t i = 0; i < n; i++)
					mean += (double)cloud.roughness.value[s][row.index[i] / 4] / (double)n;
				for (size_t i = 0; i < n; i++)
					square += pow((double)cloud.roughness.value[s][row.index[i] / 4] - mean, 2) / (double)n;
				CHECK_NEAR(got[0], mean, 1e-6);
				CHECK_NEAR(got[1], sqrt(square), 1e-6);
			}
		CHECK(got == ladder.looks + LOOKS);
		small_cloud_clear(&cloud);
	}
}

/* Looks of points on a line, at one place, and of a flat grid are numbers of the usual size. */
static void thin_clouds_have_looks_of_the_usual_size(void)
{
	static struct small_row row;
	for (int dimension = 0; dimension <= 2; dimension++) {
		struct small_cloud cloud;
		struct gnp_ladder ladder;
		double *points = calloc(1500, sizeof *points);
		for (size_t i = 0; i < 500; i++) {
			points[3 * i] = dimension > 0 ? 0.1 * (double)(i % 25) : 1. / 3;
			points[3 * i + 1] = points[3 * i] / 3;
			points[3 * i + 2] = dimension > 1 ? 0.1 * (double)(i / 25) : 1e3;
		}
		small_cloud_take(500, points, NULL, false, &cloud);
		look(&cloud, 250, &row, &ladder);
		for (int i = 0; i < LOOKS; i++)
			CHECK(fabs((double)ladder.looks[i]) < 20);
		for (int l = 0; l < STEPS; l++)
			for (int a = 0; a < 3; a++)
				CHECK_NEAR(gnp_dot(ladder.frames[l][a], ladder.frames[l][a]), 1, 1e-12);
		small_cloud_clear(&cloud);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(steps_are_principal_axes_of_the_nearest), TEST(given_normals_keep_out_what_faces_away),
		TEST(steps_without_points_repeat_the_last),    TEST(few_points_make_one_step),
		TEST(the_region_is_told_by_mean_and_deviation), TEST(thin_clouds_have_looks_of_the_usual_size)};
	return RUN_TESTS(tests);
}
