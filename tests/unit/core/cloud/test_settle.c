/* Closed surfaces whose parts the spanning tree turns inside out, and open ones that have to stay as the tree has
 * them. */
#include <math.h>

#include "core/base/random.h"
#include "core/base/warning.h"
#include "core/cloud/cluster_signs.h"
#include "core/cloud/orient.h"
#include "core/cloud/winding.h"
#include "core/search/order.h"
#include "tests/unit/test.h"

static const double pi = 3.14159265358979323846;

/* Points with true outward normals, in curve order once they are sorted. */
struct truth {
	size_t count;
	double *points, *normals; /* (room, 3) */
};

enum { ROOM = 60000 };

static void begin(struct truth *truth)
{
	*truth = (struct truth){.points = malloc(3 * ROOM * sizeof(double)), .normals = malloc(3 * ROOM * sizeof(double))};
}

static void end(struct truth *truth)
{
	free(truth->points);
	free(truth->normals);
}

static void add(struct truth *truth, double x, double y, double z, double nx, double ny, double nz)
{
	double length = sqrt(nx * nx + ny * ny + nz * nz);
	memcpy(truth->points + 3 * truth->count, (double[3]){x, y, z}, 3 * sizeof(double));
	memcpy(truth->normals + 3 * truth->count++, (double[3]){nx / length, ny / length, nz / length}, 3 * sizeof(double));
}

/* Fibonacci points on an ellipsoid of semiaxes a, b, b about (x, y, 0). */
static void add_ellipsoid(struct truth *truth, size_t count, double x, double y, double a, double b)
{
	for (size_t i = 0; i < count; i++) {
		double u = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - u * u), angle = pi * (1 + sqrt(5)) * (double)i;
		double c = r * cos(angle), s = r * sin(angle);
		add(truth, x + a * u, y + b * c, b * s, u / a, c / b, s / b);
	}
}

/* A torus about the z axis through (0, y, 0), its points spread by area. */
static void add_torus(struct truth *truth, size_t count, double y, double large, double tube, struct gnp_random *random)
{
	while (count > 0) {
		double u = 2 * pi * gnp_random_uniform(random), v = 2 * pi * gnp_random_uniform(random);
		double r = large + tube * cos(v);
		if (gnp_random_uniform(random) * (large + tube) > r)
			continue;
		add(truth, r * cos(u), y + r * sin(u), tube * sin(v), cos(u) * cos(v), sin(u) * cos(v), sin(v));
		count--;
	}
}

static void sort(struct truth *truth)
{
	uint32_t *order = malloc(truth->count * sizeof *order);
	struct truth sorted;
	begin(&sorted);
	CHECK(gnp_order_compute(truth->points, truth->count, order, NULL) == GNP_OK);
	for (size_t i = 0; i < truth->count; i++) {
		memcpy(sorted.points + 3 * i, truth->points + 3 * (size_t)order[i], 3 * sizeof(double));
		memcpy(sorted.normals + 3 * i, truth->normals + 3 * (size_t)order[i], 3 * sizeof(double));
	}
	sorted.count = truth->count;
	free(order);
	end(truth);
	*truth = sorted;
}

/* Sorts and orients; normals (count, 3) is the caller's to free. */
static double *orient(struct truth *truth, unsigned workers, struct gnp_task *task)
{
	struct gnp_pool *pool = NULL;
	struct gnp_neighbors *neighbors = NULL;
	struct gnp_error error = {0};
	size_t components;
	sort(truth);
	double *normals = malloc(3 * truth->count * sizeof *normals);
	CHECK(gnp_pool_create(workers, &pool, NULL) == GNP_OK);
	CHECK(gnp_neighbors_build(truth->points, truth->count, &neighbors, NULL) == GNP_OK);
	gnp_orient_normals(truth->points, truth->count, neighbors, 0, pool, task, normals, &components, &error);
	CHECK_STRING(error.text, "");
	gnp_neighbors_free(neighbors);
	gnp_pool_free(pool);
	return normals;
}

/* The share of points on the wrong side. Of an open surface both sides are right. */
static double wrong(struct truth *truth, bool open)
{
	double *normals = orient(truth, 2, NULL), share = 0;
	for (size_t i = 0; i < truth->count; i++) {
		const double *n = normals + 3 * i, *t = truth->normals + 3 * i;
		share += n[0] * t[0] + n[1] * t[1] + n[2] * t[2] > 0 ? 0 : 1.0 / (double)truth->count;
	}
	free(normals);
	end(truth);
	return open ? fmin(share, 1 - share) : share;
}

/* The tree goes through the place where two touch and takes one for the inside of the other. */
static void touching_bodies_come_out_right(void)
{
	struct truth truth;
	begin(&truth);
	add_ellipsoid(&truth, 8000, 0, 0, 1, 1);
	add_ellipsoid(&truth, 8000, 2.02, 0, 1, 1);
	CHECK_AT_MOST(wrong(&truth, false), 0.002);
	begin(&truth);
	add_ellipsoid(&truth, 8000, 0, 0, 1, 1);
	add_ellipsoid(&truth, 8000, 1.98, 0, 1, 1);
	CHECK_AT_MOST(wrong(&truth, false), 0.01);
}

static void touching_tori_come_out_right(void)
{
	struct truth truth;
	struct gnp_random random;
	gnp_random_seed(&random, 3, 0);
	begin(&truth);
	add_torus(&truth, 12000, 0, 1, 0.3, &random);
	add_torus(&truth, 12000, 2.63, 1, 0.3, &random);
	CHECK_AT_MOST(wrong(&truth, false), 0.002);
}

/* Two legs side by side, from one body, as near to each other as their points. */
static void thin_legs_come_out_right(void)
{
	struct truth truth;
	begin(&truth);
	add_ellipsoid(&truth, 9000, 0, 0.205, 2, 0.2);
	add_ellipsoid(&truth, 9000, 0, -0.205, 2, 0.2);
	CHECK_AT_MOST(wrong(&truth, false), 0.02);
}

/* A tenth of outliers about a sphere used to turn all of it. */
static void outliers_turn_nothing(void)
{
	struct truth truth;
	struct gnp_random random;
	size_t wrongs = 0;
	gnp_random_seed(&random, 4, 0);
	begin(&truth);
	add_ellipsoid(&truth, 8000, 0, 0, 1, 1);
	for (int i = 0; i < 800; i++)
		add(&truth, 3 * gnp_random_uniform(&random) - 1.5, 3 * gnp_random_uniform(&random) - 1.5,
		    3 * gnp_random_uniform(&random) - 1.5, 0, 0, 1);
	double *normals = orient(&truth, 2, NULL);
	for (size_t i = 0; i < truth.count; i++) {
		const double *n = normals + 3 * i, *p = truth.points + 3 * i;
		double radius = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
		wrongs += fabs(radius - 1) < 1e-9 && n[0] * p[0] + n[1] * p[1] + n[2] * p[2] < 0;
	}
	CHECK_AT_MOST((double)wrongs, 8);
	free(normals);
	end(&truth);
}

/* Its layers, turned one against the other, would have winding numbers of nearly 1/2: cut along its flat places. */
static void a_roll_stays_one_sheet(void)
{
	struct truth truth;
	struct gnp_random random;
	gnp_random_seed(&random, 5, 0);
	begin(&truth);
	for (int i = 0; i < 10000; i++) {
		double angle = 6 * pi * sqrt(gnp_random_uniform(&random)), r = 0.3 + 0.1 * angle;
		double c = cos(angle), s = sin(angle);
		add(&truth, r * c, r * s, 2 * gnp_random_uniform(&random), r * c + 0.1 * s, r * s - 0.1 * c, 0);
	}
	CHECK_AT_MOST(wrong(&truth, true), 0);
}

/* Ground with hills: its winding number is nowhere 1/2 and cannot be brought there without cuts. */
static void ground_stays_one_sheet(void)
{
	for (double height = 0.05; height < 0.3; height *= 2) {
		struct truth truth;
		struct gnp_random random;
		gnp_random_seed(&random, 6, 0);
		begin(&truth);
		for (int i = 0; i < 8000; i++) {
			double x = gnp_random_uniform(&random), y = gnp_random_uniform(&random), s = 12 * height;
			add(&truth, x, y, height * sin(12 * x) * cos(12 * y), -s * cos(12 * x) * cos(12 * y),
			    s * sin(12 * x) * sin(12 * y), 1);
		}
		CHECK_AT_MOST(wrong(&truth, true), 0);
	}
}

/* Points all about in a shell, a third of its radius thick: they have neither rims nor sides. */
static void points_without_sides_are_warned_of(void)
{
	struct truth truth;
	struct gnp_task task;
	struct gnp_random random;
	gnp_random_seed(&random, 7, 0);
	gnp_task_init(&task);
	begin(&truth);
	add_ellipsoid(&truth, 8000, 0, 0, 1, 1);
	for (size_t i = 0; i < truth.count; i++) {
		double r = 1 + gnp_random_uniform(&random) / 3;
		for (int c = 0; c < 3; c++)
			truth.points[3 * i + c] *= r;
	}
	free(orient(&truth, 2, &task));
	CHECK_CONTAINS(gnp_task_warnings(&task)->text[GNP_WARNING_NORMALS], "winding number");
	end(&truth);
	gnp_task_init(&task);
	begin(&truth);
	add_ellipsoid(&truth, 8000, 0, 0, 1, 1);
	free(orient(&truth, 2, &task));
	CHECK_STRING(gnp_task_warnings(&task)->text[GNP_WARNING_NORMALS], "");
	end(&truth);
}

static void any_number_of_workers_mends_alike(void)
{
	struct truth truth;
	begin(&truth);
	add_ellipsoid(&truth, 3000, 0, 0, 1, 1);
	add_ellipsoid(&truth, 3000, 2.02, 0, 1, 1);
	double *one = orient(&truth, 1, NULL), *three = orient(&truth, 3, NULL);
	CHECK(memcmp(one, three, 3 * truth.count * sizeof *one) == 0);
	free(one);
	free(three);
	end(&truth);
}

/* Half at the points of a sphere, whatever the clusters, and near nothing at those of a plane. */
static void winding_numbers_are_half_at_a_closed_surface(void)
{
	struct truth truth;
	begin(&truth);
	add_ellipsoid(&truth, 4000, 0, 0, 1, 1);
	sort(&truth);
	double *radius = malloc(truth.count * sizeof *radius);
	uint32_t *members = malloc(truth.count * sizeof *members);
	for (uint32_t i = 0; i < truth.count; i++) {
		members[i] = i;
		radius[i] = sqrt(16 * 4 / (double)truth.count);
	}
	for (size_t each = 1; each <= 4000; each *= 20) {
		size_t clusters = (truth.count + each - 1) / each, *start = malloc((clusters + 1) * sizeof *start);
		float *shares = malloc(clusters * sizeof *shares);
		for (size_t c = 0; c <= clusters; c++)
			start[c] = c < clusters ? c * each : truth.count;
		struct gnp_winding winding = {.points = truth.points, .normals = truth.normals, .radius = radius,
		                              .neighbors = 16, .members = members, .start = start, .clusters = clusters};
		CHECK(gnp_winding_init(&winding, NULL) == GNP_OK);
		double worst = 0;
		for (uint32_t i = 0; i < truth.count; i += 97) {
			double sum = 0;
			gnp_winding_at(&winding, i, shares, 1);
			for (size_t c = 0; c < clusters; c++)
				sum += shares[c];
			worst = fmax(worst, fabs(sum - 0.5));
		}
		CHECK_AT_MOST(worst, 0.05);
		gnp_winding_clear(&winding);
		free(shares);
		free(start);
	}
	free(radius);
	free(members);
	end(&truth);
}

/* Rows that each want one sign, and a link between the first two that is stronger than the second's row. */
static void signs_follow_rows_and_links(void)
{
	static const float shares[] = {0.5f, 0, 0, 0, -0.1f, 0, 0, 0, -0.5f};
	static const size_t link_start[] = {0, 1, 2, 2};
	static const uint32_t link_to[] = {1, 0};
	static const double trust[] = {1, 1};
	struct gnp_cluster_signs problem = {3, 3, shares, link_start, link_to, trust, 0};
	signed char sign[3] = {-1, 1, 1};
	CHECK(gnp_cluster_signs_find(&problem, NULL, sign, NULL) == GNP_OK);
	CHECK(sign[0] == 1 && sign[1] == -1 && sign[2] == -1);
	CHECK_NEAR(gnp_cluster_signs_energy(&problem, sign), 0.16 / 3, 1e-6);
	problem.weight = 1;
	CHECK(gnp_cluster_signs_find(&problem, NULL, sign, NULL) == GNP_OK);
	CHECK(sign[0] == 1 && sign[1] == 1 && sign[2] == -1);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(touching_bodies_come_out_right),
		TEST(touching_tori_come_out_right),
		TEST(thin_legs_come_out_right),
		TEST(outliers_turn_nothing),
		TEST(a_roll_stays_one_sheet),
		TEST(ground_stays_one_sheet),
		TEST(points_without_sides_are_warned_of),
		TEST(any_number_of_workers_mends_alike),
		TEST(winding_numbers_are_half_at_a_closed_surface),
		TEST(signs_follow_rows_and_links),
	};
	return RUN_TESTS(tests);
}
