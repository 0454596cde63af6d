/* Pictures of a sphere whose every pixel is known, colours and limits, and the PNG's own bytes. */
#include "clients/plot/colormap.h"
#include "clients/plot/render.h"
#include "tests/unit/test.h"

enum { COUNT = 20000, SIZE = 300 };

static double points[COUNT][3], values[COUNT], radii[COUNT];

/* A Fibonacci sphere of radius 2 about (5, -3, 1); the value is a coordinate of the unit sphere. */
static void make_sphere(int axis)
{
	for (int i = 0; i < COUNT; i++) {
		double z = 1 - (2 * i + 1.0) / COUNT, r = sqrt(1 - z * z), a = i * M_PI * (3 - sqrt(5));
		double p[3] = {r * cos(a), r * sin(a), z};
		points[i][0] = 5 + 2 * p[0];
		points[i][1] = -3 + 2 * p[1];
		points[i][2] = 1 + 2 * p[2];
		values[i] = p[axis];
		radii[i] = 2 * 3.0 / sqrt(COUNT);
	}
}

static struct gnp_scene scene_of_sphere(const double *coloured, const double *normals)
{
	return (struct gnp_scene){.count = COUNT, .points = points[0], .normals = normals, .radii = radii, .values = coloured,
	                          .range = {-1, 1}, .azimuth = 0, .elevation = 0, .up = 2, .width = SIZE, .height = SIZE};
}

static struct gnp_color pixel(const struct gnp_picture *picture, size_t x, size_t y)
{
	return picture->rgb[y * picture->width + x];
}

static bool is_white(struct gnp_color c)
{
	return c.r == 255 && c.g == 255 && c.b == 255;
}

static bool is_blue(struct gnp_color c)
{
	return c.b > c.r + 30;
}

static bool is_red(struct gnp_color c)
{
	return c.r > c.b + 30;
}

static double directions[COUNT][3];

static const double *sphere_normals(void)
{
	for (int i = 0; i < COUNT; i++)
		for (int j = 0; j < 3; j++)
			directions[i][j] = points[i][j] - (double[3]){5, -3, 1}[j];
	return directions[0];
}

static void sphere_without_values_fills_its_disc_and_nothing_else(void)
{
	make_sphere(2);
	struct gnp_scene scene = scene_of_sphere(NULL, sphere_normals());
	struct gnp_picture picture = {0};
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	double radius = SIZE / 2.0 - 24, wrong = 0;
	for (size_t y = 0; y < SIZE; y++) {
		for (size_t x = 0; x < SIZE; x++) {
			double distance = hypot((double)x + 0.5 - SIZE / 2.0, (double)y + 0.5 - SIZE / 2.0);
			if (fabs(distance - radius) > 4)
				wrong += is_white(pixel(&picture, x, y)) != (distance > radius);
		}
	}
	CHECK_NEAR(wrong, 0, 0);
	gnp_picture_clear(&picture);
}

static void up_is_up_and_colours_follow_values(void)
{
	make_sphere(2);
	struct gnp_scene scene = scene_of_sphere(values, sphere_normals());
	struct gnp_picture picture = {0};
	scene.width = SIZE + 150; /* room for the colour bar */
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	CHECK(is_red(pixel(&picture, SIZE / 2, 50)));
	CHECK(is_blue(pixel(&picture, SIZE / 2, SIZE - 50)));
	struct gnp_color middle = pixel(&picture, SIZE / 2, SIZE / 2);
	CHECK(abs(middle.r - middle.b) < 12);
	gnp_picture_clear(&picture);
}

static void nearer_points_hide_farther_ones(void)
{
	/* Looking along -x, the value is x: all that is seen is its positive half. */
	make_sphere(0);
	struct gnp_scene scene = scene_of_sphere(values, sphere_normals());
	struct gnp_picture picture = {0};
	scene.width = SIZE + 150;
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	int blue = 0;
	for (size_t y = 0; y < SIZE; y++)
		for (size_t x = 0; x < SIZE; x++)
			blue += is_blue(pixel(&picture, x, y));
	CHECK_NEAR(blue, 0, 0);
	CHECK(is_red(pixel(&picture, SIZE / 2, SIZE / 2)));
	gnp_picture_clear(&picture);
}

static void azimuth_and_up_axis_turn_the_view(void)
{
	/* Value y: from azimuth 0 its red half is on the right; with y up it is at the top. */
	make_sphere(1);
	struct gnp_scene scene = scene_of_sphere(values, sphere_normals());
	struct gnp_picture picture = {0};
	scene.width = SIZE + 150;
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	CHECK(is_red(pixel(&picture, SIZE - 50, SIZE / 2)));
	CHECK(is_blue(pixel(&picture, 50, SIZE / 2)));
	gnp_picture_clear(&picture);
	scene.azimuth = 180;
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	CHECK(is_blue(pixel(&picture, SIZE - 50, SIZE / 2)));
	gnp_picture_clear(&picture);
	scene.up = 1;
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	CHECK(is_red(pixel(&picture, SIZE / 2, 50)));
	gnp_picture_clear(&picture);
}

static void missing_values_are_grey_and_clouds_without_normals_are_drawn(void)
{
	make_sphere(2);
	for (int i = 0; i < COUNT; i++)
		values[i] = NAN;
	struct gnp_scene scene = scene_of_sphere(values, NULL);
	struct gnp_picture picture = {0};
	scene.width = SIZE + 150;
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	struct gnp_color middle = pixel(&picture, SIZE / 2, SIZE / 2);
	CHECK(middle.r == middle.g && middle.g == middle.b && middle.r < 200);
	gnp_picture_clear(&picture);
}

static void one_point_and_equal_points_are_drawn(void)
{
	const double same[6] = {1, 2, 3, 1, 2, 3}, none[2] = {0, 0};
	struct gnp_scene scene = {.count = 2, .points = same, .radii = none, .up = 2, .width = 64, .height = 64};
	struct gnp_picture picture = {0};
	CHECK(gnp_render(&scene, &picture, NULL) == GNP_OK);
	CHECK(!is_white(pixel(&picture, 32, 32)));
	CHECK(is_white(pixel(&picture, 2, 2)));
	gnp_picture_clear(&picture);
}

static void limits_are_robust_and_symmetric_for_signed_values(void)
{
	struct gnp_value_range range;
	static double v[1000];
	for (int i = 0; i < 1000; i++)
		v[i] = -1 + i / 250.0; /* -1 .. 2.996 */
	v[0] = -1e9;
	v[999] = 1e9;
	v[500] = NAN;
	CHECK(gnp_colormap_limits(v, 1000, &range, NULL) == GNP_OK);
	CHECK_NEAR(range.high, 2.92, 0.03);
	CHECK_NEAR(range.low, -range.high, 0);
	for (int i = 0; i < 1000; i++)
		v[i] = 5 + i / 250.0;
	CHECK(gnp_colormap_limits(v, 1000, &range, NULL) == GNP_OK);
	CHECK_NEAR(range.low, 5.08, 0.01);
	CHECK_NEAR(range.high, 8.92, 0.01);
	for (int i = 0; i < 1000; i++)
		v[i] = -1;
	CHECK(gnp_colormap_limits(v, 1000, &range, NULL) == GNP_OK);
	CHECK(range.low < -1 && range.high > -1);
	CHECK(gnp_colormap_limits(NULL, 0, &range, NULL) == GNP_OK);
	CHECK(range.low == 0 && range.high == 1);
}

static void ticks_are_round_and_within_the_limits(void)
{
	double ticks[7];
	struct gnp_value_range range = {-2.92, 2.92};
	size_t count = gnp_colormap_ticks(&range, 7, ticks);
	CHECK(count == 5);
	CHECK_NEAR(ticks[0], -2, 1e-12);
	CHECK_NEAR(ticks[2], 0, 1e-12);
	range = (struct gnp_value_range){0.00012, 0.00031};
	count = gnp_colormap_ticks(&range, 7, ticks);
	CHECK(count >= 3 && count <= 7);
	CHECK(ticks[0] >= range.low && ticks[count - 1] <= range.high);
}

static void a_picture_becomes_a_png(void)
{
	static const unsigned char magic[8] = {0x89, 'P', 'N', 'G', 13, 10, 26, 10};
	struct gnp_picture picture = {0};
	struct gnp_buffer png = {0};
	CHECK(gnp_picture_create(33, 17, &picture, NULL) == GNP_OK);
	gnp_picture_text(&picture, -3, 14, 2, (struct gnp_color){0, 0, 0}, "x1"); /* over both edges */
	CHECK(gnp_picture_encode(&picture, &png, NULL) == GNP_OK);
	CHECK(png.size > 40 && memcmp(png.data, magic, 8) == 0);
	CHECK(png.size > 40 && png.data[19] == 33 && png.data[23] == 17);
	gnp_buffer_clear(&png);
	gnp_picture_clear(&picture);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(sphere_without_values_fills_its_disc_and_nothing_else),
		TEST(up_is_up_and_colours_follow_values),
		TEST(nearer_points_hide_farther_ones),
		TEST(azimuth_and_up_axis_turn_the_view),
		TEST(missing_values_are_grey_and_clouds_without_normals_are_drawn),
		TEST(one_point_and_equal_points_are_drawn),
		TEST(limits_are_robust_and_symmetric_for_signed_values),
		TEST(ticks_are_round_and_within_the_limits),
		TEST(a_picture_becomes_a_png),
	};
	return RUN_TESTS(tests);
}
