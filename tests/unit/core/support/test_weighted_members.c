/* Whom a piece serves, the patch it is seen in, and whether it ends near its centre. */
#include "core/support/weighted_members.h"
#include "tests/unit/core/support/flat_piece.h"

static struct flat_piece piece;
static struct gnp_scratch *scratch;

/* Of points, and that none farther than `reach` are among them. */
static size_t served(double reach)
{
	const uint32_t *member = NULL;
	size_t count = 0;
	CHECK(gnp_weighted_near_members(&piece.near, piece.points, &member, &count, scratch, NULL) == GNP_OK);
	CHECK(count >= 1 && member[0] == 0);
	for (size_t m = 0; m < count; m++)
		CHECK(piece.support.distance[member[m]] <= reach);
	return count;
}

static void a_sure_surface_serves_far_points(void)
{
	flat_piece_make(1e-6, &piece);
	piece.near.error.slope = 1e-8;
	CHECK(served(2.12) == 13); /* half of the farthest, 3 sqrt 2: a grid's points within that */
	piece.near.scale = 3;
	CHECK(served(1.5) == 9); /* half of the scale */
}

static void one_in_doubt_serves_only_the_nearest(void)
{
	flat_piece_make(1e-6, &piece);
	piece.near.error.slope = 1e-2;
	CHECK(served(0.5) == 1);
	piece.near.scale = 9;
	CHECK(served(1.2) == 5);
}

static void service_ends_half_way_to_what_is_off(void)
{
	flat_piece_make(1e-6, &piece);
	piece.near.error.slope = 1e-8;
	piece.residual[9] = 5; /* at (2, 0) or so */
	CHECK_NEAR(piece.support.distance[9], 2, 1e-12);
	CHECK(served(1) == 5);
}

static void at_creases_and_outliers_it_serves_its_centre(void)
{
	static const int outputs[2] = {GNP_WEIGHTED_CREASE, GNP_WEIGHTED_OUTLIER};
	for (int i = 0; i < 2; i++) {
		flat_piece_make(1e-6, &piece);
		piece.near.error.slope = 1e-8;
		piece.outputs[outputs[i]] = 0;
		CHECK(served(0) == 1);
	}
	flat_piece_make(1e-6, &piece);
	piece.fit.solved = false;
	CHECK(served(0) == 1);
}

static void the_patch_has_the_points_on_the_surface(void)
{
	struct gnp_patch patch;
	flat_piece_make(1e-6, &piece);
	piece.residual[11] = 5;
	CHECK(gnp_weighted_near_patch(&piece.near, piece.points, &patch, scratch, NULL) == GNP_OK);
	CHECK(patch.count == FLAT_COUNT - 1 && patch.centre == 0 && patch.index[0] == 0);
	for (size_t i = 0; i < patch.count; i++) {
		CHECK(patch.index[i] != 11);
		CHECK_NEAR(patch.u[i] * patch.scale_xy, piece.points[3 * (size_t)patch.index[i]], 1e-12);
		CHECK_NEAR(patch.v[i] * patch.scale_xy, piece.points[3 * (size_t)patch.index[i] + 1], 1e-12);
	}
}

static void ends_are_points_off_or_none_to_one_side(void)
{
	struct gnp_patch patch;
	flat_piece_make(1e-6, &piece);
	CHECK(gnp_weighted_near_patch(&piece.near, piece.points, &patch, scratch, NULL) == GNP_OK);
	CHECK(!gnp_weighted_near_ends(&piece.near, &patch));
	piece.residual[20] = 0.5;
	CHECK(gnp_weighted_near_ends(&piece.near, &patch));
	piece.residual[20] = 0;
	for (size_t i = 0; i < patch.count; i++)
		patch.u[i] = fabs(patch.u[i]);
	CHECK(gnp_weighted_near_ends(&piece.near, &patch));
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(a_sure_surface_serves_far_points),
		TEST(one_in_doubt_serves_only_the_nearest),
		TEST(service_ends_half_way_to_what_is_off),
		TEST(at_creases_and_outliers_it_serves_its_centre),
		TEST(the_patch_has_the_points_on_the_surface),
		TEST(ends_are_points_off_or_none_to_one_side),
	};
	scratch = gnp_scratch_create();
	int failed = RUN_TESTS(tests);
	gnp_scratch_free(scratch);
	return failed;
}
