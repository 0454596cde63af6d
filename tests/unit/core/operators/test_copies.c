/* Points that coincide are found, left out, and given what their places have. */
#include "core/operators/copies.h"

#include <string.h>

#include "tests/unit/test.h"

/* Places 0, 1, 2 and again 1, 0, 1. */
static const double points[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 0, 0, -0.0, 0, 0, 1, 0, 0};
static const double normals[] = {0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0, 5, 0, 0, 6};

static void places_are_parted_from_copies(void)
{
	const struct gnp_cloud cloud = {6, points, normals};
	struct gnp_places places;
	struct gnp_copies copies = {.count = 0};
	CHECK(gnp_copies_part(&cloud, NULL, &places, &copies, NULL) == GNP_OK);
	CHECK(places.count == 3 && copies.count == 3);
	CHECK(memcmp(places.points, points, 9 * sizeof(double)) == 0 && memcmp(places.normals, normals, 9 * sizeof(double)) == 0);
	const uint32_t index[] = {3, 4, 5}, original[] = {1, 0, 1}, there[] = {3, 2, 3};
	for (size_t k = 0; k < 3; k++) {
		CHECK(places.index[k] == k);
		CHECK(copies.copy[k].index == index[k] && copies.copy[k].original == original[k]);
		CHECK(copies.copy[k].points == there[k] && copies.copy[k].row == GNP_COPY_OUTSIDE);
	}
	/* the domain has place 2 and then place 1; place 0 was dropped */
	CHECK(gnp_copies_find_rows(&copies, (const uint32_t[]){2, 1}, 2, 6, NULL) == GNP_OK);
	CHECK(copies.copy[0].row == 1 && copies.copy[1].row == GNP_COPY_OUTSIDE && copies.copy[2].row == 1);
	gnp_copies_clear(&copies);
	gnp_places_clear(&places);
}

static void a_cloud_without_copies_stays_as_it_is(void)
{
	const struct gnp_cloud cloud = {3, points, NULL};
	struct gnp_places places;
	struct gnp_copies copies = {.count = 0};
	CHECK(gnp_copies_part(&cloud, NULL, &places, &copies, NULL) == GNP_OK);
	CHECK(places.count == 3 && !places.points && copies.count == 0 && !copies.copy);
}

/* Two columns, of which the second is looked at. */
static void what_is_said_of_a_place_is_averaged_and_given_back(void)
{
	const struct gnp_cloud cloud = {6, points, NULL};
	struct gnp_places places;
	struct gnp_copies copies = {.count = 0};
	double values[] = {9, 1, 9, 2, 9, 3, 9, 4, 9, 5, 9, 9}, rows[] = {3, 2};
	const double merged[] = {3, 5, 3, 5, 3, 5};
	CHECK(gnp_copies_part(&cloud, NULL, &places, &copies, NULL) == GNP_OK);
	CHECK(gnp_copies_find_rows(&copies, (const uint32_t[]){2, 1}, 2, 6, NULL) == GNP_OK);
	gnp_copies_average(&copies, values, 2, 1, rows);
	CHECK_NEAR(rows[0], 3, 0);
	CHECK_NEAR(rows[1], 5, 1e-15);
	gnp_copies_merge(&copies, values, 2, 1);
	for (size_t i = 0; i < 6; i++) {
		CHECK_NEAR(values[2 * i + 1], merged[i], 1e-15);
		CHECK(values[2 * i] == 9);
	}
	gnp_copies_clear(&copies);
	gnp_places_clear(&places);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(places_are_parted_from_copies), TEST(a_cloud_without_copies_stays_as_it_is),
	                                    TEST(what_is_said_of_a_place_is_averaged_and_given_back)};
	return RUN_TESTS(tests);
}
