/* Supports against a plain rebuild of nodes, features and summary, and what must not change them. */
#include "core/base/select.h"
#include "core/fit/taylor.h"
#include "core/support/support.h"
#include "tests/unit/core/support/small_cloud.h"

enum {
	SIZE = GNP_TAYLOR_SIZE,
	STRIDE = GNP_TAYLOR_STRIDE,
	FEATURES = GNP_SUPPORT_FEATURES,
	ORDERS = GNP_TAYLOR_DEGREE + 1
};

static struct small_row row;
static struct gnp_ladder ladder;
static struct gnp_support support, other;

/* ---- Nodes ---- */

static int compare(const void *a, const void *b)
{
	uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	return (x > y) - (x < y);
}

/* Members by the definition: rings of neighbours, each along the curve. */
static size_t gather(const struct small_row *from, size_t points, uint32_t *member, size_t *start)
{
	static const size_t end[4] = {48, 144, 432, 1296}, group[4] = {1, 3, 9, 27};
	size_t nodes = 0, begin = 0;
	memcpy(member, from->index, points * sizeof *member);
	for (int ring = 0; ring < 4 && begin < points; ring++) {
		size_t stop = end[ring] < points ? end[ring] : points;
		if (ring)
			qsort(member + begin, stop - begin, sizeof *member, compare);
		for (; begin < stop; begin += group[ring])
			start[nodes++] = begin;
		begin = stop;
	}
	start[nodes] = points;
	return nodes;
}

static void check_near(double got, double want)
{
	CHECK_NEAR(got, want, 1e-12 * (1 + fabs(want)));
}

/* A node: means over its members of monomials, height, distance and normal. */
static void check_node(const struct small_cloud *cloud, size_t n, const uint32_t *member, size_t many)
{
	const double *o = cloud->points + 3 * (size_t)support.centre;
	double mean[STRIDE] = {0}, y = 0, distance = 0, normal[3] = {0};
	for (size_t i = 0; i < many; i++) {
		const double *p = cloud->points + 3 * (size_t)member[i];
		double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]}, at[3];
		for (int a = 0; a < 3; a++) {
			at[a] = gnp_dot(d, support.frame[a]) / support.radius;
			normal[a] += gnp_dot(cloud->normals + 3 * (size_t)member[i], support.frame[a]) / (double)many;
		}
		for (unsigned degree = 0, c = 0; degree < ORDERS; degree++)
			for (unsigned b = 0; b <= degree; b++, c++)
				mean[c] += pow(at[0], degree - b) * pow(at[1], b) / (double)many;
		y += at[2] / (double)many;
		distance += sqrt(gnp_dot(d, d)) / support.radius / (double)many;
	}
	CHECK(support.weight[n] == (double)many);
	for (size_t c = 0; c < STRIDE; c++)
		check_near(support.rows[n * STRIDE + c], mean[c]);
	check_near(support.u[n], mean[1]);
	check_near(support.v[n], mean[2]);
	check_near(support.y[n], y);
	check_near(support.distance[n], distance);
	for (size_t a = 0; a < 3; a++)
		CHECK_NEAR(support.features[n * FEATURES + 5 + a], normal[a], 1e-6);
}

static void check_nodes(const struct small_cloud *cloud)
{
	static uint32_t member[GNP_SUPPORT_POINTS];
	size_t start[GNP_SUPPORT_NODES + 1];
	CHECK(support.points <= row.count && support.radius == row.distance[support.points - 1]);
	CHECK(gather(&row, support.points, member, start) == support.nodes);
	CHECK(memcmp(member, support.member, support.points * sizeof *member) == 0);
	for (size_t n = 0; n <= support.nodes; n++)
		CHECK(support.start[n] == start[n]);
	for (size_t n = 0; n < support.nodes; n++)
		check_node(cloud, n, member + start[n], start[n + 1] - start[n]);
	qsort(member, support.points, sizeof *member, compare);
	for (size_t i = 1; i < support.points; i++)
		CHECK(member[i] > member[i - 1]); /* each once */
	CHECK(support.member[0] == support.centre && support.distance[0] == 0);
}

static void check_frame(const struct small_cloud *cloud, double turn)
{
	double cross[3];
	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++)
			CHECK_NEAR(gnp_dot(support.frame[a], support.frame[b]), a == b, 1e-12);
	gnp_cross(support.frame[0], support.frame[1], cross);
	CHECK_NEAR(gnp_dot(cross, support.frame[2]), 1, 1e-12);
	CHECK(gnp_dot(support.frame[2], cloud->normals + 3 * (size_t)support.centre) >= 0);
	double along = gnp_dot(support.frame[2], ladder.frames[support.step][2]);
	double first = gnp_dot(support.frame[0], ladder.frames[support.step][0]);
	if (!cloud->cloud.given) {
		CHECK_NEAR(along * along, 1, 1e-12);
		CHECK_NEAR(first * first, cos(turn) * cos(turn), 1e-12);
	}
}

static void nodes_gather_the_points_that_are_reached(void)
{
	static const unsigned steps[] = {0, 1, 2, 4, 5, 11};
	static const size_t reach[] = {144, 144, 432, 432, 1296, 1296};
	struct small_cloud cloud;
	small_cloud_make(2000, 0.01, false, &cloud);
	for (size_t k = 0; k < 6; k++) {
		double turn = (double)k;
		CHECK(gnp_support_reach(steps[k]) == reach[k]);
		CHECK(small_cloud_support(&cloud, (uint32_t)(300 * k + 5), steps[k], turn, &ladder, &row, &support));
		CHECK(support.points == reach[k] && support.step == steps[k]);
		check_nodes(&cloud);
		check_frame(&cloud, turn);
	}
	CHECK(support.nodes == GNP_SUPPORT_NODES);
	small_cloud_clear(&cloud);
}

static void small_clouds_are_reached_whole(void)
{
	for (size_t count = 1; count <= 40; count++) {
		struct small_cloud cloud;
		small_cloud_make(count, 0.01, count % 2, &cloud);
		bool built = small_cloud_support(&cloud, (uint32_t)(count / 2), 11, 0.3, &ladder, &row, &support);
		CHECK(built == (count > 1));
		if (built) {
			check_nodes(&cloud);
			CHECK(support.points == count && support.nodes == count);
		}
		for (size_t i = 0; built && i < support.nodes * FEATURES; i++)
			CHECK(isfinite(support.features[i]));
		for (size_t i = 0; built && i < GNP_SUPPORT_SUMMARY; i++)
			CHECK(isfinite(support.summary[i]));
		small_cloud_clear(&cloud);
	}
}

static void last_nodes_of_a_ring_have_what_is_left(void)
{
	static const size_t counts[] = {49, 50, 100, 145, 150, 441, 433, 450, 1000};
	for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
		struct small_cloud cloud;
		small_cloud_make(counts[k], 0.01, false, &cloud);
		CHECK(small_cloud_support(&cloud, 7, 11, 0, &ladder, &row, &support));
		CHECK(support.points == counts[k]);
		check_nodes(&cloud);
		small_cloud_clear(&cloud);
	}
}

/* ---- Features and summary ---- */

/* In place, by elimination; what is left of b is the solution. */
static void solve(long double a[SIZE][SIZE], long double b[SIZE])
{
	for (int k = 0; k < SIZE; k++)
		for (int i = k + 1; i < SIZE; i++) {
			long double share = a[i][k] / a[k][k];
			for (int j = k; j < SIZE; j++)
				a[i][j] -= share * a[k][j];
			b[i] -= share * b[k];
		}
	for (int i = SIZE; i-- > 0;) {
		for (int j = i + 1; j < SIZE; j++)
			b[i] -= a[i][j] * b[j];
		b[i] /= a[i][i];
	}
}

/* A first fit of the nearest nodes by the definition: coefficients, mean square, and 8 numbers of a summary. */
static double first_fit(size_t nodes, long double *coefficients, double *summary)
{
	static long double a[SIZE][SIZE];
	double factor[SIZE], energy[ORDERS] = {0}, points = 0, misfit = 0;
	unsigned order[SIZE];
	nodes = nodes < support.nodes ? nodes : support.nodes;
	gnp_taylor_indices(factor, order);
	memset(a, 0, sizeof a);
	memset(coefficients, 0, SIZE * sizeof *coefficients);
	for (size_t n = 0; n < nodes; n++) {
		const double *x = support.rows + n * STRIDE;
		points += support.weight[n];
		for (int i = 0; i < SIZE; i++) {
			for (int j = 0; j < SIZE; j++)
				a[i][j] += (long double)support.weight[n] * x[i] * x[j];
			coefficients[i] += (long double)support.weight[n] * x[i] * support.y[n];
		}
	}
	double radius = sqrt(points / (double)support.points);
	for (int i = 0; i < SIZE; i++)
		a[i][i] += pow(radius, 2 * order[i]) * (order[i] < 3 ? 1e-12 : 1e-6 * (points + 1) * factor[i]);
	solve(a, coefficients);
	for (size_t n = 0; n < nodes; n++)
		for (int i = 0; i < SIZE; i++)
			misfit -= (double)coefficients[i] * support.weight[n] * support.rows[n * STRIDE + (size_t)i] * support.y[n];
	for (size_t n = 0; n < nodes; n++)
		misfit += support.weight[n] * support.y[n] * support.y[n];
	misfit /= points + 1;
	for (int i = 0; i < SIZE; i++)
		energy[order[i]] += pow((double)coefficients[i] * pow(radius, order[i]), 2) * factor[i];
	summary[0] = 0.5 * log(misfit + 1e-20);
	for (int j = 1; j < ORDERS; j++)
		summary[j] = 0.5 * log(energy[j] + 1e-16);
	return misfit;
}

static double left_over(const long double *coefficients, size_t n)
{
	double r = support.y[n];
	for (size_t i = 0; i < SIZE; i++)
		r -= (double)coefficients[i] * support.rows[n * STRIDE + i];
	return r;
}

static double centre_off(const long double *coefficients, size_t nodes)
{
	double size[GNP_SUPPORT_SINGLES];
	size_t count = nodes < gnp_support_singles(&support) ? nodes : gnp_support_singles(&support);
	for (size_t n = 0; n < count; n++)
		size[n] = fabs(left_over(coefficients, n));
	return asinh(fabs(left_over(coefficients, 0)) / (1.4826 * gnp_median(size, count) + 1e-6));
}

static void check_description(bool given)
{
	static const size_t nodes[GNP_SUPPORT_FITS] = {16, 48, 80, 144};
	long double fit[GNP_SUPPORT_FITS][SIZE];
	double misfit[GNP_SUPPORT_FITS], summary[ORDERS], height = 1e-15;
	for (size_t f = 0; f < GNP_SUPPORT_FITS; f++) {
		misfit[f] = first_fit(nodes[f], fit[f], summary);
		for (size_t j = 0; j < ORDERS; j++)
			CHECK_NEAR(support.summary[f * ORDERS + j], summary[j], 2e-5);
	}
	const float *rest = support.summary + GNP_SUPPORT_FITS * ORDERS;
	CHECK(memcmp(rest, ladder.looks, sizeof ladder.looks) == 0);
	CHECK_NEAR(rest[GNP_LADDER_LOOKS], log(gnp_ladder_points[support.step]), 1e-6);
	CHECK_NEAR(rest[GNP_LADDER_LOOKS + 1], log((double)support.points), 1e-6);
	CHECK(rest[GNP_LADDER_LOOKS + 2] == (float)given &&
	      rest + GNP_LADDER_LOOKS + 3 + GNP_SUPPORT_FITS == support.summary + GNP_SUPPORT_SUMMARY);
	for (size_t f = 0; f < GNP_SUPPORT_FITS; f++)
		CHECK_NEAR(rest[GNP_LADDER_LOOKS + 3 + f], centre_off(fit[f], nodes[f]), 2e-4);
	for (size_t n = 0; n < 16; n++)
		height += support.y[n] * support.y[n];
	for (size_t n = 0; n < support.nodes; n++) {
		const float *x = support.features + n * FEATURES;
		double r = left_over(fit[1], n) / sqrt(misfit[1]) / 2;
		CHECK_NEAR(x[0], support.u[n], 1e-7);
		CHECK_NEAR(x[1], support.v[n], 1e-7);
		CHECK_NEAR(x[2], 2 * support.y[n], 1e-7);
		CHECK_NEAR(x[3], r > 4 ? 4 : r < -4 ? -4 : r, 2e-5);
		CHECK_NEAR(x[4], asinh(support.y[n] / sqrt(height / 16)) / 2, 1e-6);
		CHECK_NEAR(x[8], asinh(left_over(fit[0], n) / sqrt(misfit[0]) / 2) / 2, 2e-4);
		CHECK_NEAR(x[9], log(support.distance[n] + 0.01) / 2, 1e-6);
	}
}

static void features_and_summary_follow_their_formulas(void)
{
	struct small_cloud cloud;
	small_cloud_make(1500, 0.02, true, &cloud);
	for (unsigned step = 0; step < GNP_LADDER_STEPS; step += 3) {
		CHECK(small_cloud_support(&cloud, 100 + step, step, 1.1, &ladder, &row, &support));
		check_description(true);
	}
	small_cloud_clear(&cloud);
}

static void check_same_description(double tolerance)
{
	CHECK(support.nodes == other.nodes);
	for (size_t i = 0; i < support.nodes * FEATURES; i++)
		CHECK_NEAR(other.features[i], support.features[i], tolerance);
	for (size_t i = 0; i < GNP_SUPPORT_SUMMARY; i++)
		CHECK_NEAR(other.summary[i], support.summary[i], tolerance);
}

/* Of the points in the same order, turned by a rotation, scaled and moved. */
static void transform(const struct small_cloud *cloud, double scale, double far, struct small_cloud *out)
{
	static const double turn[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
	double *points = malloc(3 * cloud->count * sizeof *points), *normals = malloc(3 * cloud->count * sizeof *normals);
	for (size_t i = 0; i < 3 * cloud->count; i++) {
		points[i] = scale * (gnp_dot(turn[i % 3], cloud->points + i / 3 * 3) + far);
		normals[i] = gnp_dot(turn[i % 3], cloud->normals + i / 3 * 3);
	}
	small_cloud_take(cloud->count, points, normals, cloud->cloud.given, out);
}

static void moving_turning_and_scaling_change_nothing(void)
{
	static const double scales[] = {1, 1e-30, 3e30};
	for (size_t k = 0; k < 6; k++) {
		struct small_cloud cloud, moved;
		small_cloud_make(700, 0.02, k % 2, &cloud);
		transform(&cloud, scales[k / 2], k / 2 ? 1000 : 0, &moved);
		for (uint32_t centre = 0; centre < 700; centre += 99)
			for (unsigned step = 0; step < 12; step += 5) {
				CHECK(small_cloud_support(&cloud, centre, step, 0, &ladder, &row, &support));
				CHECK(small_cloud_support(&moved, centre, step, 0, &ladder, &row, &other));
				CHECK_NEAR(other.radius / scales[k / 2], support.radius, 1e-10);
				check_same_description(1e-5);
			}
		small_cloud_clear(&moved);
		small_cloud_clear(&cloud);
	}
}

/* ---- Edges ---- */

static void the_centre_is_first_among_duplicates(void)
{
	struct small_cloud cloud;
	double *points = malloc(1200 * sizeof *points), *normals = malloc(1200 * sizeof *normals);
	small_cloud_make(400, 0.01, false, &cloud);
	memcpy(points, cloud.points, 1200 * sizeof *points);
	memcpy(normals, cloud.normals, 1200 * sizeof *normals);
	small_cloud_clear(&cloud);
	for (size_t i = 100; i < 120; i++)
		memcpy(points + 3 * i, points + 300, 3 * sizeof *points);
	small_cloud_take(400, points, normals, false, &cloud);
	for (uint32_t centre = 100; centre < 120; centre++) {
		CHECK(small_cloud_support(&cloud, centre, 3, 0, &ladder, &row, &support));
		check_nodes(&cloud);
		CHECK(row.index[0] == centre);
		for (size_t i = 0; i < support.nodes * FEATURES; i++)
			CHECK(isfinite(support.features[i]));
	}
	small_cloud_clear(&cloud);
}

static void coincident_points_have_no_support(void)
{
	struct small_cloud cloud;
	double *points = malloc(6000 * sizeof *points), *normals = calloc(6000, sizeof *normals);
	for (size_t i = 0; i < 2000; i++) {
		points[3 * i] = points[3 * i + 1] = points[3 * i + 2] = i < 1900 ? 0.7 : (double)i;
		normals[3 * i] = 1;
	}
	small_cloud_take(2000, points, normals, true, &cloud);
	CHECK(!small_cloud_support(&cloud, 0, 11, 0, &ladder, &row, &support)); /* more of them than are reached */
	CHECK(!small_cloud_support(&cloud, 1899, 11, 0, &ladder, &row, &support)); /* the centre may not be in its row */
	CHECK(small_cloud_support(&cloud, 1999, 0, 0, &ladder, &row, &support));
	small_cloud_clear(&cloud);
}

/* All points on a line: nothing is well determined, and nothing is off the scale. */
static void collinear_points_have_numbers_of_the_usual_size(void)
{
	struct small_cloud cloud;
	double *points = malloc(1800 * sizeof *points), *normals = calloc(1800, sizeof *normals);
	for (size_t i = 0; i < 600; i++) {
		points[3 * i] = (double)i / 7;
		points[3 * i + 1] = points[3 * i] * 0.3;
		points[3 * i + 2] = points[3 * i] * 0.9;
		normals[3 * i + 2] = 1;
	}
	small_cloud_take(600, points, normals, false, &cloud);
	for (unsigned step = 0; step < GNP_LADDER_STEPS; step++) {
		CHECK(small_cloud_support(&cloud, 300, step, 0, &ladder, &row, &support));
		for (size_t i = 0; i < support.nodes * FEATURES; i++)
			CHECK(fabs((double)support.features[i]) < 40);
		for (size_t i = 0; i < GNP_SUPPORT_SUMMARY; i++)
			CHECK(fabs((double)support.summary[i]) < 40);
	}
	small_cloud_clear(&cloud);
}

/* A plane with normals that lie in it, as at the rim of a plate seen by its edge: the frame goes by them. */
static void given_normals_that_contradict_the_plane_decide(void)
{
	struct small_cloud cloud;
	struct gnp_random random;
	double *points = calloc(1500, sizeof *points), *normals = calloc(1500, sizeof *normals);
	gnp_random_seed(&random, 4, 0);
	for (size_t i = 0; i < 500; i++) {
		points[3 * i] = gnp_random_uniform(&random);
		points[3 * i + 1] = gnp_random_uniform(&random);
		double angle = 0.1 * gnp_random_normal(&random);
		normals[3 * i] = (i % 5 ? 1 : -1) * cos(angle); /* some face away, and do not count */
		normals[3 * i + 2] = sin(angle);
	}
	small_cloud_take(500, points, normals, true, &cloud);
	for (uint32_t centre = 0; centre < 500; centre += 33) {
		double mean[3] = {0};
		const double *own = normals + 3 * (size_t)centre;
		CHECK(small_cloud_support(&cloud, centre, 4, 0.4, &ladder, &row, &support));
		check_frame(&cloud, 0.4);
		check_nodes(&cloud);
		for (size_t i = 0; i < 12; i++)
			for (int c = 0; gnp_dot(normals + 3 * (size_t)row.index[i], own) > 0.5 && c < 3; c++)
				mean[c] += normals[3 * (size_t)row.index[i] + (size_t)c];
		CHECK_NEAR(gnp_dot(mean, support.frame[2]) / sqrt(gnp_dot(mean, mean)), 1, 1e-12);
		cloud.cloud.given = false;
		CHECK(small_cloud_support(&cloud, centre, 4, 0.4, &ladder, &row, &support));
		CHECK_NEAR(support.frame[2][2] * support.frame[2][2], 1, 1e-12);
		cloud.cloud.given = true;
	}
	small_cloud_clear(&cloud);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(nodes_gather_the_points_that_are_reached),   TEST(small_clouds_are_reached_whole),
		TEST(last_nodes_of_a_ring_have_what_is_left),     TEST(features_and_summary_follow_their_formulas),
		TEST(moving_turning_and_scaling_change_nothing),  TEST(the_centre_is_first_among_duplicates),
		TEST(coincident_points_have_no_support),          TEST(collinear_points_have_numbers_of_the_usual_size),
		TEST(given_normals_that_contradict_the_plane_decide)};
	return RUN_TESTS(tests);
}
