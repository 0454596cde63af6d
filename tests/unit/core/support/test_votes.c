/* Votes of pieces on the points about them: counted by hand. */
#include "core/support/votes.h"
#include "tests/unit/core/support/flat_piece.h"

static struct flat_piece piece;

static struct gnp_votes *cast(int times)
{
	struct gnp_votes *votes = gnp_votes_create(FLAT_COUNT);
	CHECK(votes);
	for (int i = 0; i < times; i++)
		gnp_votes_cast(votes, &piece.near, piece.points);
	return votes;
}

static void check_only(const struct gnp_votes *votes, size_t outlier)
{
	for (size_t i = 0; i < FLAT_COUNT; i++)
		CHECK(gnp_votes_outlier(votes, i) == (i == outlier));
}

static void who_is_off_by_himself_is_an_outlier(void)
{
	flat_piece_make(1e-3, &piece);
	piece.residual[7] = 0.1;
	struct gnp_votes *votes = cast(3);
	check_only(votes, 7);
	gnp_votes_free(votes);
}

static void noise_and_the_centre_are_not_voted_on(void)
{
	flat_piece_make(1e-3, &piece);
	piece.residual[0] = 0.1;
	struct gnp_votes *votes = cast(5);
	check_only(votes, FLAT_COUNT);
	gnp_votes_free(votes);
}

static void two_are_too_few_and_half_no_majority(void)
{
	flat_piece_make(1e-3, &piece);
	piece.residual[7] = 0.1;
	struct gnp_votes *votes = cast(2);
	check_only(votes, FLAT_COUNT);
	piece.residual[7] = 1e-3;
	gnp_votes_cast(votes, &piece.near, piece.points);
	gnp_votes_cast(votes, &piece.near, piece.points);
	check_only(votes, FLAT_COUNT);
	piece.residual[7] = 0.1;
	gnp_votes_cast(votes, &piece.near, piece.points);
	check_only(votes, 7);
	gnp_votes_free(votes);
}

static void points_that_are_off_together_are_another_piece(void)
{
	flat_piece_make(1e-3, &piece);
	for (size_t i = 0; i < FLAT_COUNT; i++)
		if (piece.points[3 * i] > 0.5)
			piece.residual[i] = 0.1;
	struct gnp_votes *votes = cast(4);
	check_only(votes, FLAT_COUNT);
	gnp_votes_free(votes);
}

static void pieces_at_creases_or_unsolved_have_no_vote(void)
{
	flat_piece_make(1e-3, &piece);
	piece.residual[7] = 0.1;
	piece.outputs[GNP_WEIGHTED_CREASE] = 0;
	struct gnp_votes *votes = cast(4);
	check_only(votes, FLAT_COUNT);
	gnp_votes_free(votes);
	piece.outputs[GNP_WEIGHTED_CREASE] = -5;
	piece.fit.solved = false;
	votes = cast(4);
	check_only(votes, FLAT_COUNT);
	gnp_votes_free(votes);
}

/* With a leverage of 0.96 at the centre residuals tell a fifth of the noise. */
static void a_surface_through_all_points_says_little_of_noise(void)
{
	flat_piece_make(1e-3, &piece);
	piece.residual[7] = 6e-3;
	struct gnp_votes *votes = cast(3);
	check_only(votes, 7);
	gnp_votes_free(votes);
	piece.fit.factor[0] = sqrt(0.96);
	votes = cast(3);
	check_only(votes, FLAT_COUNT);
	gnp_votes_free(votes);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(who_is_off_by_himself_is_an_outlier),
		TEST(noise_and_the_centre_are_not_voted_on),
		TEST(two_are_too_few_and_half_no_majority),
		TEST(points_that_are_off_together_are_another_piece),
		TEST(pieces_at_creases_or_unsolved_have_no_vote),
		TEST(a_surface_through_all_points_says_little_of_noise),
	};
	return RUN_TESTS(tests);
}
