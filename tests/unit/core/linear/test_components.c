#include "core/linear/components.h"
#include "tests/unit/test.h"

/* A matrix whose rows mention the unknowns listed, each list closed by -1. */
static struct gnp_csr matrix_of(size_t n, const int *lists)
{
	struct gnp_csr matrix;
	size_t at = 0;
	CHECK(gnp_csr_allocate(n, n, n * n, &matrix, NULL) == GNP_OK);
	for (size_t i = 0; i < n; i++) {
		for (; *lists >= 0; lists++)
			matrix.column[at++] = (uint32_t)*lists;
		lists++;
		matrix.row_offsets[i + 1] = at;
	}
	return matrix;
}

static void sets_that_stand_alone_are_told_from_those_that_follow(void)
{
	/* 0-2-4 a ring, 1-3 a pair, 5 mentions both, 6 mentions 5 and is mentioned by 5 */
	static const int lists[] = {0, 2, -1, 1, 3, -1, 2, 4, -1, 1, -1, 0, 4, -1, 0, 1, 6, -1, 5, -1};
	struct gnp_csr matrix = matrix_of(7, lists);
	struct gnp_components found;
	CHECK(gnp_components_find(&matrix, NULL, &found, NULL) == GNP_OK);
	CHECK(found.count == 2 && found.following == 2);
	CHECK(found.label[0] == 0 && found.label[2] == 0 && found.label[4] == 0 && found.size[0] == 3 && found.anchor[0] == 0);
	CHECK(found.label[1] == 1 && found.label[3] == 1 && found.size[1] == 2 && found.anchor[1] == 1);
	CHECK(found.label[5] == GNP_COMPONENT_NONE && found.label[6] == GNP_COMPONENT_NONE);
	gnp_components_clear(&found);
	gnp_csr_clear(&matrix);
}

static void what_a_given_unknown_determines_has_no_constant(void)
{
	static const int lists[] = {0, 1, -1, 0, 1, -1, 3, -1, 2, 3, -1};
	static const unsigned char given[] = {1, 0, 0, 0};
	struct gnp_csr matrix = matrix_of(4, lists);
	struct gnp_components found;
	CHECK(gnp_components_find(&matrix, given, &found, NULL) == GNP_OK);
	CHECK(found.count == 1 && found.following == 2 && found.anchor[0] == 2 && found.size[0] == 2);
	gnp_components_clear(&found);
	gnp_csr_clear(&matrix);
}

/* A path as long as a big cloud must not need a deep stack. */
static void a_long_chain_is_no_trouble(void)
{
	enum { N = 300000 };
	struct gnp_csr matrix;
	struct gnp_components found;
	CHECK(gnp_csr_allocate(N, N, N, &matrix, NULL) == GNP_OK);
	for (uint32_t i = 0; i < N; i++) {
		matrix.column[i] = (i + 1) % N;
		matrix.row_offsets[i + 1] = i + 1;
	}
	CHECK(gnp_components_find(&matrix, NULL, &found, NULL) == GNP_OK);
	CHECK(found.count == 1 && found.size[0] == N);
	gnp_components_clear(&found);
	gnp_csr_clear(&matrix);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(sets_that_stand_alone_are_told_from_those_that_follow),
	                                    TEST(what_a_given_unknown_determines_has_no_constant), TEST(a_long_chain_is_no_trouble)};
	return RUN_TESTS(tests);
}
