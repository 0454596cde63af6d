#include "core/search/neighborhoods.h"

#include <malloc.h>

#include "core/search/order.h"
#include "tests/oracles/index_plain.h"
#include "tests/unit/test.h"

struct entry {
	double distance;
	uint32_t index;
};

static uint64_t random_state;

static double uniform(void)
{
	random_state = random_state * 6364136223846793005u + 1442695040888963407u;
	return (double)(random_state >> 11) * 0x1p-53;
}

/* The clouds: each (count, 3), in curve order. */
static void uniform_cube(double *points, size_t count)
{
	for (size_t i = 0; i < 3 * count; i++)
		points[i] = uniform();
}

static void sphere(double *points, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z), u = 10.166407384630519 * (double)i;
		points[3 * i] = r * cos(u);
		points[3 * i + 1] = r * sin(u);
		points[3 * i + 2] = z;
	}
}

/* Blobs whose sizes differ by powers of ten. */
static void clusters(double *points, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		double size = pow(10, -(double)(i % 6));
		for (int c = 0; c < 3; c++)
			points[3 * i + c] = (double)(i % 6) + size * (uniform() + uniform() + uniform());
	}
}

static void duplicates(double *points, size_t count)
{
	for (size_t i = 0; i < count; i++)
		for (int c = 0; c < 3; c++)
			points[3 * i + c] = i < 30 ? uniform() : points[3 * (i % 30) + c];
}

static void outlier(double *points, size_t count)
{
	sphere(points, count);
	points[0] = 1e6;
}

/* Every distance is shared by many pairs. */
static void lattice(double *points, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		points[3 * i] = (double)(i % 11);
		points[3 * i + 1] = (double)(i / 11 % 11);
		points[3 * i + 2] = (double)(i / 121);
	}
}

static void tiny(double *points, size_t count)
{
	uniform_cube(points, count);
	for (size_t i = 0; i < 3 * count; i++)
		points[i] *= 1e-30;
}

static void huge(double *points, size_t count)
{
	sphere(points, count);
	for (size_t i = 0; i < 3 * count; i++)
		points[i] *= 1e90;
}

static const struct {
	const char *name;
	void (*fill)(double *points, size_t count);
} clouds[] = {
	{"uniform", uniform_cube}, {"sphere", sphere}, {"clusters", clusters}, {"duplicates", duplicates},
	{"outlier", outlier},      {"lattice", lattice}, {"tiny", tiny},       {"huge", huge},
};
enum { CLOUDS = sizeof clouds / sizeof *clouds };

static double *make_cloud(size_t which, size_t count)
{
	double *raw = malloc(3 * count * sizeof *raw), *points = malloc(3 * count * sizeof *points);
	uint32_t *order = malloc(count * sizeof *order);
	random_state = which + 1;
	clouds[which].fill(raw, count);
	CHECK(gnp_order_compute(raw, count, order, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++)
		memcpy(points + 3 * i, raw + 3 * (size_t)order[i], 3 * sizeof *points);
	free(raw);
	free(order);
	return points;
}

static int compare(const void *a, const void *b)
{
	const struct entry *x = a, *y = b;
	if (x->distance != y->distance)
		return x->distance < y->distance ? -1 : 1;
	return x->index < y->index ? -1 : 1;
}

/* All points ascending by (distance from centre, index). */
static void brute_force(const double *points, size_t count, const double *centre, struct entry *out)
{
	for (size_t j = 0; j < count; j++) {
		double x = centre[0] - points[3 * j], y = centre[1] - points[3 * j + 1], z = centre[2] - points[3 * j + 2];
		out[j] = (struct entry){sqrt(x * x + y * y + z * z), (uint32_t)j};
	}
	qsort(out, count, sizeof *out, compare);
}

/* How many faults a row has: entries are those of `want` in order, except that a tie at the last distance of a row cut
 * short may fall either way. */
static int row_faults(const struct entry *want, const uint32_t *index, const double *distance, size_t length, bool cut)
{
	int faults = 0;
	for (size_t e = 0; e < length; e++) {
		bool tied = cut && distance[e] == distance[length - 1];
		faults += distance[e] != want[e].distance || (!tied && index[e] != want[e].index);
		faults += e > 0 && !(distance[e - 1] < distance[e] || (distance[e - 1] == distance[e] && index[e - 1] < index[e]));
	}
	return faults;
}

static void check_neighborhoods(size_t cloud, size_t count, size_t k, double ratio, size_t most)
{
	double *points = make_cloud(cloud, count);
	struct gnp_neighbors *neighbors = NULL;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_neighborhoods rows;
	struct gnp_error error = {0};
	struct entry *want = malloc(count * sizeof *want);
	uint32_t *centres = malloc(count * sizeof *centres);
	int faults = 0;
	for (size_t i = 0; i < count; i++)
		centres[i] = (uint32_t)i;
	CHECK(gnp_neighbors_build(points, count, &neighbors, &error) == GNP_OK);
	CHECK(gnp_neighborhoods_find(neighbors, centres, count, k, ratio, most, scratch, &rows, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(rows.count == count && rows.start[0] == 0);
	/* Every row of a small cloud, a sample of a large one's. */
	for (size_t r = 0; r < rows.count; r += count < 500 ? 1 : 11) {
		size_t at = rows.start[r], length = rows.start[r + 1] - at, within = 0;
		brute_force(points, count, points + 3 * (size_t)centres[r], want);
		while (within < count && want[within].distance <= ratio * want[k - 1].distance)
			within++;
		size_t expected = within < most ? within : most;
		faults += rows.r_k[r] != want[k - 1].distance;
		faults += length != expected;
		if (length == expected)
			faults += row_faults(want, rows.index + at, rows.distance + at, length, within > most);
	}
	if (faults)
		fprintf(stderr, "%s: count %zu, k %zu, ratio %g, most %zu: %d faults\n", clouds[cloud].name, count, k, ratio,
		        most, faults);
	CHECK(faults == 0);
	gnp_neighbors_free(neighbors);
	gnp_scratch_free(scratch);
	free(points);
	free(want);
	free(centres);
}

static void neighborhoods_are_those_of_brute_force(void)
{
	for (size_t cloud = 0; cloud < CLOUDS; cloud++) {
		check_neighborhoods(cloud, 1331, 30, 1.65, 1331);
		check_neighborhoods(cloud, 1331, 13, 1, 60);
		check_neighborhoods(cloud, 700, 1, 2, 700);
	}
}

static void small_clouds_and_large_k_work(void)
{
	for (size_t cloud = 0; cloud < CLOUDS; cloud++) {
		for (size_t count = 1; count < 30; count += 3)
			for (size_t k = 1; k <= count; k += 4)
				check_neighborhoods(cloud, count, k, 1.1, count);
		check_neighborhoods(cloud, 200, 200, 1.5, 200);
	}
	check_neighborhoods(1, 1300, 1200, 1.1, 1300);
}

static void rows_are_cut_to_the_nearest(void)
{
	for (size_t cloud = 0; cloud < CLOUDS; cloud++) {
		check_neighborhoods(cloud, 1000, 20, 2, 20);
		check_neighborhoods(cloud, 1000, 20, 2, 45);
		check_neighborhoods(cloud, 1000, 20, 1e3, 100);
	}
}

/* Centres far apart share no candidates. */
static void centres_may_come_in_any_order(void)
{
	enum { COUNT = 2000, CENTRES = 97 };
	double *points = make_cloud(1, COUNT);
	struct gnp_neighbors *neighbors = NULL;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_neighborhoods rows;
	struct entry *want = malloc(COUNT * sizeof *want);
	uint32_t centres[CENTRES];
	for (uint32_t i = 0; i < CENTRES; i++)
		centres[i] = i * 911 % COUNT;
	CHECK(gnp_neighbors_build(points, COUNT, &neighbors, NULL) == GNP_OK);
	CHECK(gnp_neighborhoods_find(neighbors, centres, CENTRES, 25, 1.1, SIZE_MAX, scratch, &rows, NULL) == GNP_OK);
	for (size_t r = 0; r < CENTRES; r++) {
		size_t at = rows.start[r], length = rows.start[r + 1] - at;
		brute_force(points, COUNT, points + 3 * (size_t)centres[r], want);
		CHECK(length >= 25 && row_faults(want, rows.index + at, rows.distance + at, length, false) == 0);
		CHECK(rows.index[at] == centres[r]);
	}
	gnp_neighbors_free(neighbors);
	gnp_scratch_free(scratch);
	free(points);
	free(want);
}

static void nearest_neighbours_of_any_place_are_those_of_brute_force(void)
{
	enum { COUNT = 1331, QUERIES = 60 };
	static const size_t ks[] = {1, 7, 50, COUNT};
	uint32_t *index = malloc(QUERIES * COUNT * sizeof *index);
	double *distance = malloc(QUERIES * COUNT * sizeof *distance), queries[3 * QUERIES];
	struct entry want[COUNT];
	struct gnp_scratch *scratch = gnp_scratch_create();
	for (size_t cloud = 0; cloud < CLOUDS; cloud++) {
		double *points = make_cloud(cloud, COUNT);
		struct gnp_neighbors *neighbors = NULL;
		CHECK(gnp_neighbors_build(points, COUNT, &neighbors, NULL) == GNP_OK);
		for (size_t q = 0; q < 3 * QUERIES; q++) /* half of them points of the cloud, half elsewhere */
			queries[q] = q < 3 * QUERIES / 2 ? points[q] : points[q] * 1.01 + points[3 * COUNT - 1] * uniform();
		for (size_t s = 0; s < sizeof ks / sizeof *ks; s++) {
			size_t k = ks[s];
			int faults = 0;
			CHECK(gnp_neighbors_knn(neighbors, queries, QUERIES, k, index, distance, scratch, NULL) == GNP_OK);
			for (size_t q = 0; q < QUERIES; q++) {
				brute_force(points, COUNT, queries + 3 * q, want);
				faults += row_faults(want, index + q * k, distance + q * k, k, true);
			}
			if (faults)
				fprintf(stderr, "%s, k %zu: %d faults\n", clouds[cloud].name, k, faults);
			CHECK(faults == 0);
		}
		gnp_neighbors_free(neighbors);
		free(points);
	}
	gnp_scratch_free(scratch);
	free(index);
	free(distance);
}

/* How many entries of two answers differ; a tie at the end of a row cut to `most` may fall either way. */
static int differences(const struct gnp_neighborhoods *a, const struct gnp_neighborhoods *b, size_t most)
{
	int faults = memcmp(a->start, b->start, (a->count + 1) * sizeof *a->start) != 0;
	faults += memcmp(a->r_k, b->r_k, a->count * sizeof *a->r_k) != 0;
	for (size_t r = 0; r < a->count && !faults; r++) {
		size_t end = a->start[r + 1];
		bool cut = end - a->start[r] == most;
		for (size_t e = a->start[r]; e < end; e++) {
			bool tied = cut && a->distance[e] == a->distance[end - 1];
			faults += a->distance[e] != b->distance[e] || (!tied && a->index[e] != b->index[e]);
		}
	}
	return faults;
}

static void check_kinds(size_t cloud, size_t count, size_t k, double ratio, size_t most)
{
	static const struct gnp_index_kind *const kinds[2] = {&gnp_index_flann, &plain_index};
	double *points = make_cloud(cloud, count);
	uint32_t *centres = malloc(count * sizeof *centres);
	struct gnp_neighbors *neighbors[2] = {NULL};
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_neighborhoods rows[2];
	for (size_t i = 0; i < count; i++)
		centres[i] = (uint32_t)i;
	for (int n = 0; n < 2; n++) {
		CHECK(gnp_neighbors_build_on(kinds[n], points, count, &neighbors[n], NULL) == GNP_OK);
		CHECK(gnp_neighborhoods_find(neighbors[n], centres, count, k, ratio, most, scratch, &rows[n], NULL) == GNP_OK);
	}
	int faults = differences(&rows[0], &rows[1], most);
	if (faults)
		fprintf(stderr, "%s: k %zu, ratio %g, most %zu: %d differences\n", clouds[cloud].name, k, ratio, most, faults);
	CHECK(faults == 0);
	for (int n = 0; n < 2; n++)
		gnp_neighbors_free(neighbors[n]);
	gnp_scratch_free(scratch);
	free(points);
	free(centres);
}

/* Ties included: a lattice and coincident points have hardly anything else. */
static void another_search_tree_gives_the_same_rows(void)
{
	for (size_t cloud = 0; cloud < CLOUDS; cloud++) {
		check_kinds(cloud, 1331, 30, 1.65, 1331);
		check_kinds(cloud, 1331, 17, 1, 68);
		check_kinds(cloud, 900, 20, 2, 25);
	}
}

/* In use by the C library, as far as it tells. */
static size_t bytes_in_use(void)
{
	struct mallinfo2 info = mallinfo2();
	return info.uordblks + info.hblkhd;
}

static void memory_is_what_is_said(void)
{
	enum { COUNT = 40000 };
	for (size_t cloud = 0; cloud < 2; cloud++) {
		double *points = make_cloud(cloud, COUNT);
		struct gnp_neighbors *neighbors = NULL;
		size_t before = bytes_in_use();
		CHECK(gnp_neighbors_build(points, COUNT, &neighbors, NULL) == GNP_OK);
		size_t taken = bytes_in_use() - before, said = gnp_neighbors_bytes(neighbors);
		if (before) /* sanitizers do not tell */
			CHECK(said >= taken && said < 2 * taken);
		CHECK(gnp_neighbors_count(neighbors) == COUNT && gnp_neighbors_points(neighbors) == points);
		gnp_neighbors_free(neighbors);
		free(points);
	}
}

/* The search read and wrote by the numbers of points that nobody had given. */
static void places_that_are_not_finite_are_refused(void)
{
	enum { COUNT = 40 };
	static const double bad[] = {NAN, INFINITY, -INFINITY, 2e100};
	double *points = make_cloud(1, COUNT), distance[5];
	uint32_t index[5];
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_neighbors *neighbors = NULL, *none = NULL;
	CHECK(gnp_neighbors_build(points, COUNT, &neighbors, NULL) == GNP_OK);
	for (size_t b = 0; b < sizeof bad / sizeof bad[0]; b++) {
		double query[6] = {0, 0, 0, 0, bad[b], 0}, kept = points[3 * 17 + 2];
		struct gnp_error error = {0};
		CHECK(gnp_neighbors_knn(neighbors, query, 2, 5, index, distance, scratch, &error) == GNP_DEGENERATE);
		CHECK_CONTAINS(error.text, "neighbors: coordinate 1 of point 1 is ");
		points[3 * 17 + 2] = bad[b];
		error = (struct gnp_error){0};
		CHECK(gnp_neighbors_build(points, COUNT, &none, &error) == GNP_DEGENERATE && !none);
		CHECK_CONTAINS(error.text, "neighbors: coordinate 2 of point 17 is ");
		points[3 * 17 + 2] = kept;
	}
	gnp_neighbors_free(neighbors);
	gnp_scratch_free(scratch);
	free(points);
}

static void wrong_requests_name_value_and_limit(void)
{
	double points[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
	uint32_t index[5], centre = 0;
	double distance[5];
	struct gnp_neighbors *neighbors = NULL;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_neighborhoods rows;
	struct gnp_error error = {0};
	CHECK(gnp_neighbors_build(points, 0, &neighbors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "points: got 0, need 1..2147483647");
	CHECK(!neighbors);
	CHECK(gnp_neighbors_build(points, 5, &neighbors, NULL) == GNP_OK);
	error = (struct gnp_error){0};
	CHECK(gnp_neighbors_knn(neighbors, points, 1, 6, index, distance, scratch, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "k: got 6, need 1..5");
	error = (struct gnp_error){0};
	CHECK(gnp_neighbors_knn(neighbors, points, 1, 0, index, distance, scratch, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "k: got 0, need 1..5");
	error = (struct gnp_error){0};
	CHECK(gnp_neighborhoods_find(neighbors, &centre, 1, 4, 1, 3, scratch, &rows, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "k: got 4, need 1..3");
	CHECK(gnp_neighborhoods_find(neighbors, &centre, 0, 4, 1, 5, scratch, &rows, NULL) == GNP_OK);
	CHECK(rows.count == 0 && rows.start[0] == 0);
	gnp_neighbors_free(neighbors);
	gnp_neighbors_free(NULL);
	gnp_scratch_free(scratch);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(neighborhoods_are_those_of_brute_force),
		TEST(small_clouds_and_large_k_work),
		TEST(rows_are_cut_to_the_nearest),
		TEST(centres_may_come_in_any_order),
		TEST(nearest_neighbours_of_any_place_are_those_of_brute_force),
		TEST(another_search_tree_gives_the_same_rows),
		TEST(memory_is_what_is_said),
		TEST(places_that_are_not_finite_are_refused),
		TEST(wrong_requests_name_value_and_limit),
	};
	return RUN_TESTS(tests);
}
