#include "core/operators/unfold.h"

#include <math.h>

#include "core/base/vector.h"
#include "tests/unit/test.h"

static double tangents[2][3] = {{1, 0, 0}, {0, 1, 0}};
static const double origin[3] = {0, 0, 0}, up[3] = {0, 0, 1};

/* On a unit sphere about (0, 0, -1) the chord keeps its length and the direction of the great circle. */
static void chords_of_a_sphere_keep_length_and_direction(void)
{
	for (double angle = 0.01; angle < 1.4; angle += 0.1)
		for (double turn = 0; turn < 6; turn += 0.7) {
			double m[3] = {sin(angle) * cos(turn), sin(angle) * sin(turn), cos(angle)}, to[3] = {m[0], m[1], m[2] - 1}, u, v;
			gnp_unfold(origin, up, tangents, to, m, &u, &v);
			CHECK_NEAR(hypot(u, v), 2 * sin(angle / 2), 1e-14);
			CHECK_NEAR(u * sin(turn) - v * cos(turn), 0, 1e-14);
		}
}

/* w = a u^2 / 2 + b u v + c v^2 / 2 + d u^3: its coordinates are the projection's but for terms of third order. */
static double difference(double r, double turn)
{
	double u = r * cos(turn), v = r * sin(turn), a = 1.3, b = 0.4, c = -0.8, d = 0.7;
	double to[3] = {u, v, a * u * u / 2 + b * u * v + c * v * v / 2 + d * u * u * u};
	double m[3] = {-(a * u + b * v + 3 * d * u * u), -(b * u + c * v), 1}, length = sqrt(gnp_dot(m, m)), x, y;
	for (int i = 0; i < 3; i++)
		m[i] /= length;
	gnp_unfold(origin, up, tangents, to, m, &x, &y);
	return hypot(x - u, y - v);
}

static void coordinates_agree_with_the_projection_to_third_order(void)
{
	for (double turn = 0.2; turn < 6; turn += 0.7) {
		double near = difference(0.005, turn), far = difference(0.01, turn);
		CHECK(far > 1e-9);
		CHECK_NEAR(far / near, 8, 0.4);
	}
}

static void a_plane_and_another_sheet_are_projected(void)
{
	const double to[3] = {0.3, -0.2, 0.1}, down[3] = {0, 0, -1};
	double u, v;
	gnp_unfold(origin, up, tangents, (double[3]){0.3, -0.2, 0}, up, &u, &v);
	CHECK(u == 0.3 && v == -0.2);
	gnp_unfold(origin, up, tangents, to, down, &u, &v);
	CHECK(u == 0.3 && v == -0.2);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(chords_of_a_sphere_keep_length_and_direction),
	                                    TEST(coordinates_agree_with_the_projection_to_third_order),
	                                    TEST(a_plane_and_another_sheet_are_projected)};
	return RUN_TESTS(tests);
}
