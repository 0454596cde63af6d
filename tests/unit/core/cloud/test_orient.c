#include <math.h>

#include "core/base/forest.h"
#include "core/cloud/distinct.h"
#include "core/cloud/orient.h"
#include "core/cloud/outward.h"
#include "core/linear/pca.h"
#include "core/search/order.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

static const double pi = 3.14159265358979323846;

/* A cloud with the true outward normals; points and normals grow by add_*. */
struct truth {
	size_t count, room;
	double *points, *normals; /* (count, 3) */
};

static void add(struct truth *truth, const double point[3], const double normal[3])
{
	if (truth->count == truth->room) {
		truth->room = truth->room ? 2 * truth->room : 1024;
		truth->points = realloc(truth->points, truth->room * 3 * sizeof(double));
		truth->normals = realloc(truth->normals, truth->room * 3 * sizeof(double));
	}
	double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
	for (int c = 0; c < 3; c++) {
		truth->points[3 * truth->count + c] = point[c];
		truth->normals[3 * truth->count + c] = normal[c] / length;
	}
	truth->count++;
}

static void clear(struct truth *truth)
{
	free(truth->points);
	free(truth->normals);
	*truth = (struct truth){0};
}

/* Fibonacci points on an ellipsoid about (x, 0, 0). */
static void add_ellipsoid(struct truth *truth, size_t count, double x, double a, double b, double c)
{
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z), angle = pi * (1 + sqrt(5)) * (double)i;
		double u[3] = {r * cos(angle), r * sin(angle), z};
		add(truth, (double[3]){x + a * u[0], b * u[1], c * u[2]}, (double[3]){u[0] / a, u[1] / b, u[2] / c});
	}
}

/* A torus whose tube swells and shrinks `bumps` times along and across: tube radius r (1 + 0.3 sin(bumps u) cos(v)). */
static void add_torus(struct truth *truth, size_t count, double large, double tube, double bumps)
{
	for (size_t i = 0; i < count; i++) {
		double u = 2 * pi * (double)i / (double)count, v = 2 * pi * fmod(0.61803398874989485 * (double)i, 1);
		double r = tube * (1 + 0.3 * sin(bumps * u) * cos(v)), ru = tube * 0.3 * bumps * cos(bumps * u) * cos(v),
		       rv = -tube * 0.3 * sin(bumps * u) * sin(v), R = large + r * cos(v), Ru = ru * cos(v),
		       Rv = rv * cos(v) - r * sin(v);
		double du[3] = {Ru * cos(u) - R * sin(u), Ru * sin(u) + R * cos(u), ru * sin(v)};
		double dv[3] = {Rv * cos(u), Rv * sin(u), rv * sin(v) + r * cos(v)};
		add(truth, (double[3]){R * cos(u), R * sin(u), r * sin(v)},
		    (double[3]){du[1] * dv[2] - du[2] * dv[1], du[2] * dv[0] - du[0] * dv[2], du[0] * dv[1] - du[1] * dv[0]});
	}
}

static double uniform(uint64_t *state)
{
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return (double)(*state >> 11) * 0x1p-53;
}

static void add_noise(struct truth *truth, double sigma)
{
	uint64_t state = 7;
	for (size_t i = 0; i < 3 * truth->count; i++)
		truth->points[i] += sigma * sqrt(-2 * log(1 - uniform(&state))) * cos(2 * pi * uniform(&state));
}

/* Orients the cloud (in curve order, as the contract wants) and puts normals back into the caller's order. */
static gnp_status orient(const struct truth *truth, size_t k, unsigned workers, struct gnp_task *task, double *normals,
                         size_t *components, struct gnp_error *error)
{
	size_t n = truth->count;
	struct gnp_pool *pool = NULL;
	struct gnp_neighbors *neighbors = NULL;
	uint32_t *order = malloc(n * sizeof *order + 1);
	double *points = malloc(3 * n * sizeof *points + 1), *found = malloc(3 * n * sizeof *found + 1);
	CHECK(gnp_pool_create(workers, &pool, NULL) == GNP_OK);
	CHECK(gnp_order_compute(truth->points, n, order, NULL) == GNP_OK);
	for (size_t i = 0; i < n; i++)
		memcpy(points + 3 * i, truth->points + 3 * (size_t)order[i], 3 * sizeof *points);
	CHECK(gnp_neighbors_build(points, n, &neighbors, NULL) == GNP_OK);
	gnp_status status = gnp_orient_normals(points, n, neighbors, k, pool, task, found, components, error);
	for (size_t i = 0; i < n && status == GNP_OK; i++)
		memcpy(normals + 3 * (size_t)order[i], found + 3 * i, 3 * sizeof *found);
	gnp_neighbors_free(neighbors);
	gnp_pool_free(pool);
	free(order);
	free(points);
	free(found);
	return status;
}

/* How many of the first `among` points got a normal on the wrong side; checks unit length of all. */
static size_t wrong(const struct truth *truth, size_t among, size_t k, size_t components)
{
	size_t count = 0, got = 0;
	double *normals = malloc(3 * truth->count * sizeof *normals);
	struct gnp_error error = {0};
	CHECK(orient(truth, k, 2, NULL, normals, &got, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK_NEAR((double)got, (double)components, 0);
	double worst = 0;
	for (size_t i = 0; i < truth->count; i++) {
		const double *n = normals + 3 * i, *t = truth->normals + 3 * i;
		worst = fmax(worst, fabs(sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) - 1));
		count += i < among && !(n[0] * t[0] + n[1] * t[1] + n[2] * t[2] > 0);
	}
	CHECK_AT_MOST(worst, 1e-12);
	free(normals);
	return count;
}

static size_t wrong_of_all(const struct truth *truth, size_t components)
{
	return wrong(truth, truth->count, 0, components);
}

static void closed_surfaces_get_outward_normals(void)
{
	struct truth truth = {0};
	add_ellipsoid(&truth, 5000, 0, 1, 1, 1);
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
	add_ellipsoid(&truth, 20000, 0, 1, 0.8, 0.6);
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
	add_ellipsoid(&truth, 20000, 0, 1, 0.8, 0.1);
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
	add_torus(&truth, 20000, 2.0 / 3, 1.0 / 3, 0);
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
	add_torus(&truth, 60000, 1, 0.45, 9);
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
}

/* Handles, necks and the deepest folds of the random families. */
static void every_kind_of_closed_shape_comes_out_right(void)
{
	static const struct {
		const char *name;
		uint64_t seed;
		unsigned degree;
	} shapes[] = {{"genus2", 0, 0},   {"genus3", 0, 0},  {"bumpy_torus", 0, 0}, {"toroidal", 3, 0},
	              {"toroidal", 7, 0}, {"radial", 5, 22}, {"radial", 6, 22}};
	struct gnp_pool *pool = NULL;
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
		struct gnp_shape *shape = NULL;
		struct gnp_sample sample = {0};
		struct gnp_sample_options options = {.count = 10000, .seed = 1, .noise = 1e-3};
		CHECK(gnp_shape_create(shapes[i].name, shapes[i].seed, shapes[i].degree, &shape, NULL) == GNP_OK);
		CHECK(gnp_sample_create(shape, &options, pool, NULL, &sample, NULL) == GNP_OK);
		struct truth truth = {.count = sample.count, .points = sample.points, .normals = sample.normals};
		CHECK_AT_MOST((double)wrong_of_all(&truth, 1), 0);
		gnp_sample_clear(&sample);
		gnp_shape_free(shape);
	}
	gnp_pool_free(pool);
}

static void normals_are_close_to_the_truth(void)
{
	struct truth truth = {0};
	add_ellipsoid(&truth, 20000, 3, 1, 0.8, 0.6);
	double *normals = malloc(3 * truth.count * sizeof *normals), worst = 0;
	CHECK(orient(&truth, 0, 2, NULL, normals, NULL, NULL) == GNP_OK);
	for (size_t i = 0; i < truth.count; i++) {
		double d = 0;
		for (int c = 0; c < 3; c++)
			d += (normals[3 * i + c] - truth.normals[3 * i + c]) * (normals[3 * i + c] - truth.normals[3 * i + c]);
		worst = fmax(worst, sqrt(d));
	}
	CHECK_AT_MOST(worst, 0.03);
	free(normals);
	clear(&truth);
}

static void noise_leaves_the_orientation(void)
{
	struct truth truth = {0};
	add_torus(&truth, 60000, 2.0 / 3, 1.0 / 3, 0);
	add_noise(&truth, 1e-3);
	CHECK_AT_MOST((double)wrong_of_all(&truth, 1), 0);
	clear(&truth);
	/* Noise as large as half the spacing: weights that ignore the tangent planes lose half the surface. */
	add_torus(&truth, 60000, 2.0 / 3, 1.0 / 3, 0);
	add_noise(&truth, 5e-3);
	CHECK_AT_MOST((double)wrong_of_all(&truth, 1), 1e-3 * (double)truth.count);
	clear(&truth);
}

static void each_component_is_oriented_by_itself(void)
{
	struct truth truth = {0};
	add_ellipsoid(&truth, 4000, 0, 1, 1, 1);
	add_ellipsoid(&truth, 4000, 2.5, 1, 1, 1);
	add_ellipsoid(&truth, 500, 1.25, 0.05, 0.05, 0.05);
	CHECK(wrong_of_all(&truth, 3) == 0);
	clear(&truth);
}

/* Closer than their points are spaced twice over: the few normals spoilt in between used to decide. */
static void nearly_touching_surfaces_come_out_right(void)
{
	struct truth truth = {0};
	add_ellipsoid(&truth, 50000, 0, 1, 1, 1);
	add_ellipsoid(&truth, 50000, 2.03, 1, 1, 1);
	CHECK_AT_MOST((double)wrong_of_all(&truth, 1), 5);
	clear(&truth);
}

static void any_scale_and_place_gives_the_same(void)
{
	static const double scales[] = {1e-140, 1e-12, 1e-3, 1e3, 1e15, 1e90};
	for (size_t s = 0; s < sizeof scales / sizeof *scales; s++) {
		struct truth truth = {0};
		add_torus(&truth, 4000, 2.0 / 3, 1.0 / 3, 0);
		for (size_t i = 0; i < 3 * truth.count; i++)
			truth.points[i] = (truth.points[i] + 5) * scales[s];
		CHECK(wrong_of_all(&truth, 1) == 0);
		clear(&truth);
	}
}

/* A far point used to decide what is outward, by its huge area and by being extreme everywhere. */
static void a_far_outlier_turns_nothing(void)
{
	for (int c = 0; c < 3; c++)
		for (double sign = -1; sign <= 1; sign += 2) {
			struct truth truth = {0};
			double first[3] = {0.3, -0.7, 0.2}, second[3] = {0.1, 0.3, -0.8};
			first[c] = sign * 1e6;
			second[(c + 1) % 3] = sign * 1e3;
			add_ellipsoid(&truth, 5000, 0, 1, 0.9, 0.8);
			add(&truth, first, first);
			add(&truth, second, second);
			CHECK(wrong(&truth, 5000, 0, 1) == 0);
			clear(&truth);
		}
}

static void an_outlier_does_not_bridge_two_surfaces(void)
{
	struct truth truth = {0};
	add_ellipsoid(&truth, 5000, 0, 1, 1, 1);
	add_ellipsoid(&truth, 5000, 3, 1, 1, 1);
	for (double x = 1.45; x < 1.56; x += 0.05)
		add(&truth, (double[3]){x, 0, 0.01 * x}, (double[3]){0, 0, 1});
	CHECK(wrong(&truth, 10000, 0, 2) == 0);
	clear(&truth);
}

static void coincident_points_share_a_normal(void)
{
	struct truth truth = {0};
	for (int copy = 0; copy < 30; copy++)
		add_torus(&truth, 3000, 2.0 / 3, 1.0 / 3, 0);
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
	for (int copy = 0; copy < 2; copy++) /* few copies stay in the neighbourhoods */
		add_torus(&truth, 3000, 2.0 / 3, 1.0 / 3, 0);
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
}

/* Points along a scan's rows lie ten times closer than the rows: every neighbourhood is a line. */
static void rows_of_a_scan_hold_together(void)
{
	struct truth truth = {0};
	for (int row = 3; row < 58; row++) {
		double t = pi * row / 60, points = ceil(1200 * sin(t));
		for (double i = 0; i < points; i++) {
			double u = 2 * pi * i / points, p[3] = {sin(t) * cos(u), sin(t) * sin(u), cos(t)};
			add(&truth, p, p);
		}
	}
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
}

static void open_surfaces_follow_the_rule(void)
{
	struct truth truth = {0};
	for (int x = 0; x < 60; x++)
		for (int y = 0; y < 60; y++) { /* a plane, tilted: the largest component of the normal is positive */
			double p[3] = {0.01 * x, 0.01 * y, -0.002 * x};
			add(&truth, p, (double[3]){0.2, 0, 1});
		}
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
	for (int x = -30; x < 30; x++)
		for (int y = -30; y < 30; y++) { /* a bowl, open to +z: its outside looks down */
			double a = 0.03 * x, b = 0.03 * y, p[3] = {a, b, 0.5 * (a * a + b * b)};
			add(&truth, p, (double[3]){a, b, -1});
		}
	CHECK(wrong_of_all(&truth, 1) == 0);
	clear(&truth);
}

static void few_and_degenerate_points_get_unit_normals(void)
{
	for (size_t n = 1; n < 40; n++) {
		struct truth truth = {0};
		for (size_t i = 0; i < n; i++) /* a line; then the same point over and over */
			add(&truth, (double[3]){(double)i, 2 * (double)i, -(double)i}, (double[3]){0, 0, 1});
		wrong(&truth, 0, 0, 1);
		clear(&truth);
		for (size_t i = 0; i < n; i++)
			add(&truth, (double[3]){1, 2, 3}, (double[3]){0, 0, 1});
		wrong(&truth, 0, 0, 1);
		clear(&truth);
	}
	struct truth octahedron = {0};
	for (int c = 0; c < 3; c++)
		for (double s = -1; s < 2; s += 2) {
			double p[3] = {0};
			p[c] = s;
			add(&octahedron, p, p);
		}
	wrong(&octahedron, 0, 200, 1);
	clear(&octahedron);
}

static void any_number_of_workers_gives_the_same_bytes(void)
{
	struct truth truth = {0};
	add_torus(&truth, 20000, 1, 0.4, 5);
	add_noise(&truth, 5e-3);
	size_t bytes = 3 * truth.count * sizeof(double);
	double *one = malloc(bytes), *many = malloc(bytes);
	CHECK(orient(&truth, 0, 1, NULL, one, NULL, NULL) == GNP_OK);
	for (unsigned workers = 2; workers <= 5; workers++) {
		memset(many, 0, bytes);
		CHECK(orient(&truth, 0, workers, NULL, many, NULL, NULL) == GNP_OK);
		CHECK(memcmp(one, many, bytes) == 0);
	}
	free(one);
	free(many);
	clear(&truth);
}

static void cancelled_and_wrong_requests_say_so(void)
{
	struct truth truth = {0};
	add_ellipsoid(&truth, 3000, 0, 1, 1, 1);
	double *normals = malloc(3 * truth.count * sizeof *normals);
	struct gnp_task task;
	struct gnp_error error = {0};
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(orient(&truth, 0, 2, &task, normals, NULL, &error) == GNP_CANCELLED);
	CHECK_STRING(error.text, "the work was cancelled");
	error = (struct gnp_error){0};
	CHECK(orient(&truth, 257, 2, NULL, normals, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "k: got 257, need at most 256");
	free(normals);
	clear(&truth);
}

static void pca_finds_the_axes_at_any_scale(void)
{
	static const double scales[] = {1e-200, 1, 1e99};
	static const uint32_t index[] = {0, 1, 2, 3, 4};
	for (int s = 0; s < 3; s++) {
		double h = scales[s], points[15] = {3 * h, 4 * h, 7 * h, -3 * h, -4 * h, 7 * h, 0.8 * h, -0.6 * h, 7 * h,
		                                    -0.8 * h, 0.6 * h, 7 * h, 0, 0, 7 * h};
		struct gnp_pca pca;
		gnp_pca_fit(points, index, 5, &pca);
		CHECK_NEAR(fabs(pca.axes[2][2]), 1, 1e-14);
		CHECK_NEAR(fabs(pca.axes[0][0] * 0.6 + pca.axes[0][1] * 0.8), 1, 1e-14);
		CHECK_NEAR(pca.values[0] / pca.values[1], 25, 1e-12);
		CHECK_AT_MOST(fabs(pca.values[2]), 1e-15);
	}
}

static void forest_remembers_signs(void)
{
	enum { N = 2000 };
	struct gnp_forest forest;
	uint64_t state = 3;
	bool sign[N], flip_a, flip_b;
	CHECK(gnp_forest_init(&forest, N));
	for (int i = 0; i < N; i++)
		sign[i] = uniform(&state) < 0.5;
	for (int e = 0; e < 4 * N; e++) { /* joins among even and among odd points only */
		uint32_t a = (uint32_t)(uniform(&state) * N), b = (uint32_t)(uniform(&state) * N) / 2 * 2 + a % 2;
		gnp_forest_join(&forest, a, b, sign[a] != sign[b], SIZE_MAX);
	}
	uint32_t evens = gnp_forest_find(&forest, 0, &flip_a), odds = gnp_forest_find(&forest, 1, &flip_a);
	CHECK(evens != odds);
	CHECK(!gnp_forest_join(&forest, 0, 1, true, 5));
	for (uint32_t i = 2; i < N; i++) {
		uint32_t root = gnp_forest_find(&forest, i, &flip_a);
		if (forest.size[root] < 2)
			continue;
		CHECK(root == gnp_forest_find(&forest, i % 2, &flip_b));
		CHECK((flip_a != flip_b) == (sign[i] != sign[i % 2]));
	}
	gnp_forest_clear(&forest);
}

static void distinct_numbers_places_by_first_appearance(void)
{
	static const double points[] = {1, 2, 3, 0.0, 0, 0, 1, 2, 3, -0.0, 0, 0, 1, 2, 4};
	static const uint32_t want_which[] = {0, 1, 0, 1, 2}, want_first[] = {0, 1, 4};
	uint32_t which[5], first[5];
	size_t places = 0;
	CHECK(gnp_distinct_find(points, 5, NULL, which, first, &places, NULL) == GNP_OK);
	CHECK(places == 3);
	CHECK(memcmp(which, want_which, sizeof which) == 0);
	CHECK(memcmp(first, want_first, sizeof want_first) == 0);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(closed_surfaces_get_outward_normals),
		TEST(every_kind_of_closed_shape_comes_out_right),
		TEST(normals_are_close_to_the_truth),
		TEST(noise_leaves_the_orientation),
		TEST(each_component_is_oriented_by_itself),
		TEST(nearly_touching_surfaces_come_out_right),
		TEST(any_scale_and_place_gives_the_same),
		TEST(a_far_outlier_turns_nothing),
		TEST(an_outlier_does_not_bridge_two_surfaces),
		TEST(coincident_points_share_a_normal),
		TEST(rows_of_a_scan_hold_together),
		TEST(open_surfaces_follow_the_rule),
		TEST(few_and_degenerate_points_get_unit_normals),
		TEST(any_number_of_workers_gives_the_same_bytes),
		TEST(cancelled_and_wrong_requests_say_so),
		TEST(pca_finds_the_axes_at_any_scale),
		TEST(forest_remembers_signs),
		TEST(distinct_numbers_places_by_first_appearance),
	};
	return RUN_TESTS(tests);
}
