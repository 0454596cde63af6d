/* Rough sheets, smooth and as triangles: that their geometry is that of their heights, and that they are drawn evenly
 * by area. */
#include "tests/unit/test.h"

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/solids/solid.h"
#include "core/solids/solid_draw.h"
#include "core/solids/solid_kinds.h"

static struct gnp_pool *pool; /* of two workers, for every test */
static struct gnp_solid_body body; /* large */

/* The one face of a body of the kind. */
static const struct gnp_solid_face *face_make(int kind, uint64_t seed, double count)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 1);
	gnp_solid_kinds_build(kind, &body, &random, count);
	CHECK(body.faces == 1);
	return &body.face[0];
}

static void place_draw(const struct gnp_solid_face *face, struct gnp_random *random, double p[2])
{
	for (int c = 0; c < 2; c++)
		p[c] = face->graph.half[c] * (2 * gnp_random_uniform(random) - 1);
}

static double height_at(const struct gnp_solid_face *face, double x, double y)
{
	double point[3];
	gnp_solid_face_point(face, (double[2]){x, y}, point);
	return point[2]; /* the frame of the kinds is that of the body */
}

static void unit_normal(const double a[3], const double b[3], double normal[3])
{
	gnp_cross(a, b, normal);
	double length = sqrt(gnp_dot(normal, normal));
	for (int i = 0; i < 3; i++)
		normal[i] /= length;
}

/* ---- Geometry ---- */

/* Of the smallest detail: a wave's radian, of ridges that of their crest; and how strongly the field may bend. */
static double detail_of(const struct gnp_solid_graph *graph, double *bend)
{
	double least = INFINITY;
	*bend = 0;
	for (int w = 0; w < graph->waves; w++) {
		double number = hypot(graph->wave[w][0], graph->wave[w][1]);
		double length = (graph->soft[w] > 0 ? graph->soft[w] : 1) / number;
		least = fmin(least, length);
		*bend += graph->height[w] * number / length;
	}
	return least;
}

/* The normal and second form there by central differences of heights alone. */
static void check_geometry(const struct gnp_solid_face *face, const double p[2], double detail, double bend)
{
	double step = 0.003 * detail, z[3][3], tangent[2][3] = {{1, 0, 0}, {0, 1, 0}}, second[2][2], normal[3];
	struct gnp_solid_geometry here;
	gnp_solid_face_evaluate(face, p, &here);
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			z[i][j] = height_at(face, p[0] + (i - 1) * step, p[1] + (j - 1) * step);
	tangent[0][2] = (z[2][1] - z[0][1]) / (2 * step);
	tangent[1][2] = (z[1][2] - z[1][0]) / (2 * step);
	second[0][0] = (z[2][1] - 2 * z[1][1] + z[0][1]) / (step * step);
	second[1][1] = (z[1][2] - 2 * z[1][1] + z[1][0]) / (step * step);
	second[0][1] = second[1][0] = (z[2][2] - z[2][0] - z[0][2] + z[0][0]) / (4 * step * step);
	unit_normal(tangent[0], tangent[1], normal);
	CHECK_NEAR(gnp_dot(here.normal, here.normal), 1, 1e-13);
	for (int i = 0; i < 3; i++) {
		CHECK_NEAR(here.normal[i], normal[i], 1e-4);
		CHECK_AT_MOST(fabs(gnp_dot(here.form + 3 * i, here.normal)), 1e-12 * (1 + bend));
	}
	for (int a = 0; a < 2; a++)
		for (int b = 0; b < 2; b++) {
			double form = 0;
			for (int i = 0; i < 3; i++)
				form += tangent[a][i] * gnp_dot(here.form + 3 * i, tangent[b]);
			CHECK_NEAR(form, second[a][b] * normal[2], 1e-4 * bend);
		}
}

static void geometry_is_that_of_the_heights(void)
{
	int ridged = 0;
	for (uint64_t seed = 0; seed < 40; seed++) {
		const struct gnp_solid_face *face = face_make(GNP_SOLID_ROUGH, seed, 3000);
		struct gnp_random random;
		double p[2], bend, detail = detail_of(&face->graph, &bend);
		gnp_random_seed(&random, seed, 2);
		for (int i = 0; i < 40; i++) {
			place_draw(face, &random, p);
			check_geometry(face, p, detail, bend);
		}
		int ridges = 0;
		for (int w = 0; w < face->graph.waves; w++)
			ridges += face->graph.soft[w] > 0;
		ridged += ridges > 0;
	}
	CHECK(ridged >= 6 && ridged <= 24); /* about a third */
}

/* sqrt(sin^2 + e^2) has a ridge turned down at 0, of curvature 1/e, and at a quarter turn a crest of slope 0. */
static void ridges_are_as_sharp_as_told(void)
{
	const double k = 7, h = 0.3, e = 0.05;
	struct gnp_solid_graph graph = {
		.half = {1, 1}, .waves = 1, .wave = {{k, 0}}, .height = {h}, .soft = {e}};
	double slope[2], second[3];
	CHECK_NEAR(gnp_solid_graph_height(&graph, (double[2]){0, 0.4}, slope, second), h * e, 1e-15);
	CHECK_NEAR(slope[0], 0, 1e-15);
	CHECK_NEAR(second[0], h * k * k / e, 1e-9);
	CHECK_NEAR(gnp_solid_graph_height(&graph, (double[2]){M_PI / 2 / k, 0}, slope, second), h * hypot(1, e), 1e-15);
	CHECK_NEAR(slope[0], 0, 1e-12);
	CHECK_NEAR(second[0], -h * k * k / hypot(1, e), 1e-9);
}

/* ---- Triangles ---- */

/* The point a part s to the second corner and t to the third. */
static void within(double corner[3][2], double s, double t, double p[2])
{
	for (int c = 0; c < 2; c++)
		p[c] = corner[0][c] + s * (corner[1][c] - corner[0][c]) + t * (corner[2][c] - corner[0][c]);
}

/* Every place in a triangle has this triangle and no other, with one normal: that of the three points of the field
 * above its corners. */
static void check_triangle(const struct gnp_solid_face *face, const struct gnp_solid_face *smooth, const double p[2],
                           struct gnp_random *random)
{
	double corner[3][2], other[3][2], x[3][3], a[3], b[3], normal[3], q[2];
	struct gnp_solid_geometry here;
	gnp_solid_grid_find(&face->graph.grid, p, corner);
	for (int c = 0; c < 3; c++)
		gnp_solid_face_point(smooth, corner[c], x[c]);
	for (int i = 0; i < 3; i++) {
		a[i] = x[1][i] - x[0][i];
		b[i] = x[2][i] - x[0][i];
	}
	CHECK(a[0] * b[1] - a[1] * b[0] > 0.1 * face->graph.grid.cell * face->graph.grid.cell);
	unit_normal(a, b, normal);
	for (int i = 0; i < 5; i++) {
		double s = gnp_random_uniform(random), t = (1 - s) * gnp_random_uniform(random);
		within(corner, i ? s : 1.0 / 3, i ? t : 1.0 / 3, q);
		gnp_solid_grid_find(&face->graph.grid, q, other);
		CHECK(memcmp(corner, other, sizeof corner) == 0);
		gnp_solid_face_evaluate(face, q, &here);
		double d[3] = {here.point[0] - x[0][0], here.point[1] - x[0][1], here.point[2] - x[0][2]};
		CHECK_AT_MOST(fabs(gnp_dot(d, normal)), 1e-13);
		for (int c = 0; c < 3; c++)
			CHECK_NEAR(here.normal[c], normal[c], 1e-10);
		for (int c = 0; c < 9; c++)
			CHECK(here.form[c] == 0);
	}
	const double away[2] = {p[0] + 1e-9, p[1] - 1e-9}; /* maybe another triangle: there is no step */
	CHECK_NEAR(height_at(face, away[0], away[1]), height_at(face, p[0], p[1]), 1e-7);
}

static void facets_are_triangles_of_the_field(void)
{
	for (uint64_t seed = 0; seed < 40; seed++) {
		const struct gnp_solid_face *face = face_make(GNP_SOLID_FACETS, seed, 3000);
		struct gnp_solid_face smooth = *face;
		struct gnp_random random;
		smooth.graph.grid.cell = 0;
		gnp_random_seed(&random, seed, 3);
		for (int i = 0; i < 60; i++) {
			double p[2];
			place_draw(face, &random, p);
			check_triangle(face, &smooth, p, &random);
		}
	}
}

/* Where a vertex was moved as far as may be, and far outside of any body. */
static void triangles_are_found_anywhere(void)
{
	const struct gnp_solid_grid grid = {0.01, 0.24, 5};
	static const double far[][2] = {{1e300, -1e300}, {NAN, 0}, {INFINITY, 3}, {-0.0, 0.01}};
	double corner[3][2];
	for (size_t i = 0; i < sizeof far / sizeof *far; i++) {
		for (int c = 0; c < 3; c++)
			corner[c][0] = corner[c][1] = NAN;
		gnp_solid_grid_find(&grid, far[i], corner);
		for (int c = 0; c < 3; c++)
			CHECK(isfinite(corner[c][0]) && isfinite(corner[c][1]));
	}
	for (int i = 0; i < 40000; i++) { /* turned over, a triangle would overlap others */
		const double p[2] = {0.01 * (i % 200) + 0.0031, 0.01 * (i / 200) + 0.0057};
		gnp_solid_grid_find(&grid, p, corner);
		double a = (corner[1][0] - corner[0][0]) * (corner[2][1] - corner[0][1]);
		CHECK(a - (corner[1][1] - corner[0][1]) * (corner[2][0] - corner[0][0]) > 0);
	}
}

/* What has the same normal lies in one plane, and there are as many normals as the cells say. */
static void samples_of_facets_lie_in_planes(void)
{
	enum { COUNT = 1500 };
	int coarse = 0;
	for (uint64_t seed = 0; seed < 12; seed++) {
		const int sampling = (int)(seed % GNP_SOLID_SAMPLING_COUNT);
		const struct gnp_solid_options options = {seed, GNP_SOLID_FACETS, COUNT, sampling};
		struct gnp_solid_sample s;
		struct gnp_error error = {0};
		CHECK(gnp_solid_sample_create(&options, pool, NULL, &s, &error) == GNP_OK);
		size_t shared = 0;
		double worst = 0;
		for (size_t i = 0; i < COUNT; i++) {
			bool first = true;
			for (size_t j = 0; j < i; j++) {
				const double *x = s.points + 3 * i, *y = s.points + 3 * j, *n = s.normals + 3 * i;
				const double d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
				if (memcmp(n, s.normals + 3 * j, 3 * sizeof *n) != 0)
					continue;
				first = false;
				worst = fmax(worst, fabs(gnp_dot(d, n)));
			}
			shared += !first;
		}
		CHECK_AT_MOST(worst, 1e-12);
		coarse += shared > COUNT * 3 / 4; /* two triangles a cell: cells of more than three spacings */
		gnp_solid_sample_clear(&s);
	}
	CHECK(coarse >= 2 && coarse <= 9);
}

/* ---- Sheets ---- */

/* One piece that looks to one side, and of the proportions told. */
static void samples_are_one_sheet(void)
{
	for (int run = 0; run < 2 * 12; run++) {
		const struct gnp_solid_options options = {(uint64_t)run / 2, run % 2 ? GNP_SOLID_FACETS : GNP_SOLID_ROUGH, 1000,
		                                          GNP_SOLID_RANDOM};
		struct gnp_solid_sample s;
		struct gnp_error error = {0};
		double mean[3] = {0}, least = INFINITY, far = 0, near = INFINITY;
		CHECK(gnp_solid_sample_create(&options, pool, NULL, &s, &error) == GNP_OK);
		for (size_t i = 0; i < s.count; i++)
			for (int c = 0; c < 3; c++)
				mean[c] += s.normals[3 * i + (size_t)c] / (double)s.count;
		for (size_t i = 0; i < s.count; i++) {
			const double *x = s.points + 3 * i;
			least = fmin(least, gnp_dot(mean, s.normals + 3 * i));
			far = fmax(far, sqrt(gnp_dot(x, x)));
			near = fmin(near, s.edge[i]);
			CHECK(s.piece[i] == 0);
			CHECK(isfinite(s.edge[i])); /* to the rim */
		}
		CHECK(least > 0);
		CHECK(far > 0.4 && far < 1.01); /* half a diagonal of 1 to 2 */
		CHECK_AT_MOST(near, s.spacing);
		gnp_solid_sample_clear(&s);
	}
}

/* Slopes are measured on the surface, wavelengths and cells read off. */
static void proportions_are_as_told(void)
{
	double flattest = INFINITY, steepest = 0, shortest = INFINITY, finest = INFINITY, coarsest = 0, count = 10000;
	for (uint64_t seed = 0; seed < 60; seed++) {
		const struct gnp_solid_face *face = face_make(GNP_SOLID_FACETS, seed, count);
		const struct gnp_solid_graph *graph = &face->graph;
		struct gnp_random random;
		double square = 0, slope[2], second[3], p[2], stretch = 0;
		struct gnp_solid_graph smooth = *graph;
		smooth.grid.cell = 0;
		gnp_random_seed(&random, seed, 4);
		for (int i = 0; i < 4000; i++) {
			place_draw(face, &random, p);
			gnp_solid_graph_height(&smooth, p, slope, second);
			double steep = slope[0] * slope[0] + slope[1] * slope[1];
			square += steep / 4000;
			stretch += sqrt(1 + steep) / 4000;
		}
		double spacing = sqrt(4 * graph->half[0] * graph->half[1] * stretch / count);
		for (int w = 0; w < graph->waves; w++)
			shortest = fmin(shortest, 2 * M_PI / hypot(graph->wave[w][0], graph->wave[w][1]) / spacing);
		flattest = fmin(flattest, sqrt(square));
		steepest = fmax(steepest, sqrt(square));
		finest = fmin(finest, graph->grid.cell / spacing);
		coarsest = fmax(coarsest, graph->grid.cell / spacing);
		CHECK(graph->waves >= 20 && graph->waves <= 64);
	}
	CHECK(flattest > 0.035 && flattest < 0.08 && steepest > 0.6 && steepest < 1);
	CHECK(shortest > 2.4 && shortest < 3.5);
	CHECK(finest > 0.68 && finest < 0.9 && coarsest > 4.5 && coarsest < 6.3);
}

/* ---- Samplings ---- */

enum { ACROSS = 8, UP = 4, CLASSES = ACROSS * UP };

static int class_of(const struct gnp_solid_graph *graph, const double p[2])
{
	int i = (int)(ACROSS * (p[0] / graph->half[0] + 1) / 2), j = (int)(UP * (p[1] / graph->half[1] + 1) / 2);
	return ACROSS * j + i;
}

/* Of each class its part of the area, by small triangles between points; the area over that of the shadow. */
static double areas_measure(const struct gnp_solid_face *face, double area[CLASSES])
{
	enum { FINE = 160 };
	const double *half = face->graph.half, step[2] = {2 * half[0] / FINE, 2 * half[1] / FINE};
	double total = 0;
	memset(area, 0, CLASSES * sizeof *area);
	for (int i = 0; i < FINE; i++)
		for (int j = 0; j < FINE; j++) {
			const double p[2] = {(i + 0.5) * step[0] - half[0], (j + 0.5) * step[1] - half[1]}, tiny = 1e-3;
			double z = height_at(face, p[0], p[1]);
			double u = (height_at(face, p[0] + tiny * step[0], p[1]) - z) / (tiny * step[0]);
			double v = (height_at(face, p[0], p[1] + tiny * step[1]) - z) / (tiny * step[1]);
			double stretch = sqrt(1 + u * u + v * v);
			area[class_of(&face->graph, p)] += stretch;
			total += stretch;
		}
	for (int c = 0; c < CLASSES; c++)
		area[c] /= total;
	return total / (FINE * FINE);
}

/* The parts have draws by their area, and so has what is steep: the mean of 1 / stretch is shadow / area. */
static void random_draws_are_uniform_by_area(void)
{
	enum { COUNT = 20000 };
	for (int kind = GNP_SOLID_ROUGH; kind <= GNP_SOLID_FACETS; kind++)
		for (uint64_t seed = 0; seed < 6; seed++) {
			const struct gnp_solid_face *face = face_make(kind, seed, COUNT / 10);
			const struct gnp_solid_options options = {seed, kind, COUNT, GNP_SOLID_RANDOM};
			struct gnp_solid_survey survey;
			struct gnp_solid_draws draws;
			double area[CLASSES], found[CLASSES] = {0}, misfit = 0, mean = 0, square = 0;
			double stretch = areas_measure(face, area);
			gnp_solid_draws_survey(&body, seed, &survey);
			CHECK(gnp_solid_draws_create(&body, &options, &survey, pool, NULL, &draws, NULL) == GNP_OK);
			CHECK_NEAR(survey.area, 4 * face->graph.half[0] * face->graph.half[1] * stretch, 0.03 * survey.area);
			for (size_t i = 0; i < COUNT; i++) {
				struct gnp_solid_geometry here;
				gnp_solid_face_evaluate(face, draws.draw[i].p, &here);
				found[class_of(&face->graph, draws.draw[i].p)]++;
				mean += here.normal[2] / COUNT;
				square += here.normal[2] * here.normal[2] / COUNT;
			}
			for (int c = 0; c < CLASSES; c++)
				misfit += (found[c] - COUNT * area[c]) * (found[c] - COUNT * area[c]) / (COUNT * area[c]);
			CHECK_AT_MOST(misfit, CLASSES + 4 * sqrt(2 * CLASSES)); /* chi-square */
			CHECK_NEAR(mean, 1 / stretch, 4 * sqrt((square - mean * mean) / COUNT) + 1e-3 * (1 - 1 / stretch));
			gnp_solid_draws_clear(&draws);
		}
}

static double nearest_share(const struct gnp_solid_sample *s, double share)
{
	enum { COUNT = 2000 };
	static double near[COUNT];
	for (size_t i = 0; i < COUNT; i++) {
		near[i] = INFINITY;
		for (size_t j = 0; j < COUNT; j++) {
			const double *x = s->points + 3 * i, *y = s->points + 3 * j;
			const double d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
			near[i] = i == j ? near[i] : fmin(near[i], sqrt(gnp_dot(d, d)) / s->spacing);
		}
	}
	qsort(near, COUNT, sizeof *near, gnp_double_compare);
	return near[(size_t)(share * COUNT)];
}

/* Even points keep their distance, random ones are those of a Poisson process, rows are denser along than across, and
 * densities that vary spread the distances (but where they vary across the sheet: so the mean counts). */
static void samplings_are_what_they_are_called(void)
{
	double spread[GNP_SOLID_SAMPLING_COUNT] = {0};
	for (int run = 0; run < 2 * 3; run++) {
		double low[GNP_SOLID_SAMPLING_COUNT], middle[GNP_SOLID_SAMPLING_COUNT], high[GNP_SOLID_SAMPLING_COUNT];
		for (int sampling = 0; sampling < GNP_SOLID_SAMPLING_COUNT; sampling++) {
			const struct gnp_solid_options options = {(uint64_t)run / 2, run % 2 ? GNP_SOLID_FACETS : GNP_SOLID_ROUGH,
			                                          2000, sampling};
			struct gnp_solid_sample s;
			CHECK(gnp_solid_sample_create(&options, pool, NULL, &s, NULL) == GNP_OK);
			low[sampling] = nearest_share(&s, 0.02);
			middle[sampling] = nearest_share(&s, 0.5);
			high[sampling] = nearest_share(&s, 0.9);
			gnp_solid_sample_clear(&s);
		}
		CHECK(low[GNP_SOLID_EVEN] > 0.45);
		CHECK_NEAR(middle[GNP_SOLID_EVEN], 0.8, 0.12);
		CHECK_NEAR(middle[GNP_SOLID_RANDOM], sqrt(log(2) / M_PI), 0.05);
		CHECK_AT_MOST(middle[GNP_SOLID_LINES], 0.85);
		CHECK_AT_MOST(high[GNP_SOLID_LINES], 1.5 * middle[GNP_SOLID_LINES]); /* even steps */
		for (int sampling = 0; sampling < GNP_SOLID_SAMPLING_COUNT; sampling++)
			spread[sampling] += high[sampling] / middle[sampling] / 6;
	}
	CHECK_NEAR(spread[GNP_SOLID_RANDOM], sqrt(log(10) / log(2)), 0.05);
	CHECK_AT_MOST(1.05 * spread[GNP_SOLID_RANDOM], spread[GNP_SOLID_GRADIENT]);
	CHECK_AT_MOST(1.05 * spread[GNP_SOLID_RANDOM], spread[GNP_SOLID_STRIPES]);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(geometry_is_that_of_the_heights),
		TEST(ridges_are_as_sharp_as_told),
		TEST(facets_are_triangles_of_the_field),
		TEST(triangles_are_found_anywhere),
		TEST(samples_of_facets_lie_in_planes),
		TEST(samples_are_one_sheet),
		TEST(proportions_are_as_told),
		TEST(random_draws_are_uniform_by_area),
		TEST(samplings_are_what_they_are_called),
	};
	struct gnp_error error = {0};
	if (gnp_pool_create(2, &pool, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		return 1;
	}
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
