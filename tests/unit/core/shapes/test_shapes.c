#include "tests/unit/test.h"

#include <stdint.h>
#include <sys/resource.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/shapes/shape_family.h"
#include "core/shapes/shapes.h"

enum { COUNT = 2000 };

static struct gnp_pool *pool; /* of two workers, for every test */

static struct gnp_shape *shape_new(const char *name, uint64_t seed, unsigned degree)
{
	struct gnp_error error = {0};
	struct gnp_shape *shape = NULL;
	if (gnp_shape_create(name, seed, degree, &shape, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return shape;
}

static struct gnp_sample sample_of(const struct gnp_shape *shape, const struct gnp_sample_options *options)
{
	struct gnp_error error = {0};
	struct gnp_sample sample = {0};
	if (gnp_sample_create(shape, options, pool, NULL, &sample, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return sample;
}

static struct gnp_sample sample_named(const char *name, size_t count)
{
	struct gnp_shape *shape = shape_new(name, 5, 0);
	struct gnp_sample sample = sample_of(shape, &(struct gnp_sample_options){.count = count, .seed = 11});
	gnp_shape_free(shape);
	return sample;
}

static double worse(double worst, double error)
{
	return error <= worst ? worst : error; /* NaN stays */
}

/* ---- Closed formulas ---- */

static void sphere_has_unit_curvatures(void)
{
	struct gnp_sample s = sample_named("sphere", COUNT);
	double worst = 0;
	for (size_t i = 0; i < s.count; i++) {
		const double *n = s.normals + 3 * i, *x = s.exact + 3 * i;
		worst = worse(worst, fabs(s.mean_curvature[i] + 1) + fabs(s.gaussian_curvature[i] - 1));
		worst = worse(worst, fabs(gnp_dot(x, n) - 1) + fabs(gnp_dot(x, x) - 1));
		for (int r = 0; r < 3; r++)
			for (int c = 0; c < 3; c++)
				worst = worse(worst, fabs(s.second_form[9 * i + 3 * r + c] + (r == c) - n[r] * n[c]));
	}
	CHECK_AT_MOST(worst, 1e-13);
	gnp_sample_clear(&s);
}

static void ellipsoid_follows_its_formulas(void)
{
	struct gnp_sample s = sample_named("ellipsoid", COUNT);
	const double a2 = 1, b2 = 0.64, c2 = 0.36;
	double worst = 0;
	for (size_t i = 0; i < s.count; i++) {
		double x = s.exact[3 * i], y = s.exact[3 * i + 1], z = s.exact[3 * i + 2];
		double w = x * x / (a2 * a2) + y * y / (b2 * b2) + z * z / (c2 * c2), volume2 = a2 * b2 * c2;
		double h = (x * x + y * y + z * z - a2 - b2 - c2) / (2 * volume2 * pow(w, 1.5));
		worst = worse(worst, fabs(x * x / a2 + y * y / b2 + z * z / c2 - 1));
		worst = worse(worst, fabs(s.mean_curvature[i] - h));
		worst = worse(worst, fabs(s.gaussian_curvature[i] - 1 / (volume2 * w * w)));
	}
	CHECK_AT_MOST(worst, 1e-12);
	gnp_sample_clear(&s);
}

static void torus_follows_its_formulas(void)
{
	struct gnp_sample s = sample_named("torus", COUNT);
	const double a = 1.0 / 3, b = 2.0 / 3;
	double worst = 0;
	for (size_t i = 0; i < s.count; i++) {
		const double *p = s.exact + 3 * i, *n = s.normals + 3 * i;
		double w = sqrt(p[0] * p[0] + p[1] * p[1]), c = (w - b) / a;
		worst = worse(worst, fabs((w - b) * (w - b) + p[2] * p[2] - a * a));
		worst = worse(worst, fabs(s.gaussian_curvature[i] - c / (a * w)));
		worst = worse(worst, fabs(s.mean_curvature[i] + (b + 2 * a * c) / (2 * a * w)));
		for (int k = 0; k < 3; k++)
			worst = worse(worst, fabs(n[k] - (k < 2 ? c * p[k] / w : p[2] / a)));
	}
	CHECK_AT_MOST(worst, 1e-12);
	gnp_sample_clear(&s);
}

static void open_patches_follow_their_formulas(void)
{
	struct gnp_sample plane = sample_named("plane", COUNT), tube = sample_named("cylinder", COUNT);
	struct gnp_sample saddle = sample_named("saddle", COUNT);
	double worst = 0;
	for (size_t i = 0; i < COUNT; i++) {
		worst = worse(worst, fabs(plane.mean_curvature[i]) + fabs(plane.gaussian_curvature[i]) + fabs(plane.exact[3 * i + 2]));
		worst = worse(worst, fabs(plane.normals[3 * i + 2] - 1));
		worst = worse(worst, fabs(tube.mean_curvature[i] + 1) + fabs(tube.gaussian_curvature[i]));
		worst = worse(worst, fabs(tube.principal_curvatures[2 * i]) + fabs(tube.principal_curvatures[2 * i + 1] + 2));
		worst = worse(worst, fabs(tube.normals[3 * i] - 2 * tube.exact[3 * i]));
		double u = saddle.exact[3 * i], v = saddle.exact[3 * i + 1], w = 1 + u * u + v * v;
		worst = worse(worst, fabs(saddle.exact[3 * i + 2] - (u * u - v * v) / 2));
		worst = worse(worst, fabs(saddle.gaussian_curvature[i] + 1 / (w * w)));
		worst = worse(worst, fabs(saddle.mean_curvature[i] - (v * v - u * u) / (2 * pow(w, 1.5))));
	}
	CHECK_AT_MOST(worst, 1e-12);
	gnp_sample_clear(&plane);
	gnp_sample_clear(&tube);
	gnp_sample_clear(&saddle);
}

/* ---- Every family against finite differences of its own position ---- */

/* Two directions in which the parameters of a shape move. */
static void parameter_directions(const struct gnp_shape *shape, const double *p, double e1[3], double e2[3])
{
	const char *name = shape->family->name;
	bool chart = strstr(name, "tor") || !strcmp(name, "plane") || !strcmp(name, "cylinder") || !strcmp(name, "saddle");
	double n[3] = {0, 0, 1};
	if (!chart) {
		struct gnp_geometry geometry;
		shape->family->evaluate(shape, 1, p, &geometry);
		memcpy(n, strncmp(name, "genus", 5) ? p : geometry.normal, sizeof n);
		double length = sqrt(gnp_dot(n, n));
		for (int c = 0; c < 3; c++)
			n[c] /= length;
	}
	gnp_geometry_tangents(n, e1, e2);
}

/* Derivatives u, v, uu, uv, vv of the position, central, of fourth order. */
static void difference_jet(const struct gnp_shape *shape, const double *p, double d[5][3])
{
	static const double first[5] = {1.0 / 12, -8.0 / 12, 0, 8.0 / 12, -1.0 / 12};
	static const double second[5] = {-1.0 / 12, 16.0 / 12, -30.0 / 12, 16.0 / 12, -1.0 / 12};
	const double h = 5e-4;
	double e1[3], e2[3];
	parameter_directions(shape, p, e1, e2);
	memset(d, 0, 5 * sizeof d[0]);
	for (int i = 0; i < 5; i++)
		for (int j = 0; j < 5; j++) {
			double q[3], x[3];
			for (int c = 0; c < 3; c++)
				q[c] = p[c] + h * ((i - 2) * e1[c] + (j - 2) * e2[c]);
			shape->family->place(shape, 1, q, x);
			for (int c = 0; c < 3; c++) {
				d[0][c] += j == 2 ? first[i] * x[c] / h : 0;
				d[1][c] += i == 2 ? first[j] * x[c] / h : 0;
				d[2][c] += j == 2 ? second[i] * x[c] / (h * h) : 0;
				d[3][c] += first[i] * first[j] * x[c] / (h * h);
				d[4][c] += i == 2 ? second[j] * x[c] / (h * h) : 0;
			}
		}
}

/* Largest misfit of the exact geometry at p, with the textbook formulas on the differences; relative to the curvature. */
static double difference_error(const struct gnp_shape *shape, const double *p)
{
	struct gnp_geometry g;
	double d[5][3], n[3], worst = 0;
	shape->family->evaluate(shape, 1, p, &g);
	difference_jet(shape, p, d);
	gnp_cross(d[0], d[1], n);
	double length = sqrt(gnp_dot(n, n));
	for (int c = 0; c < 3; c++) {
		n[c] /= length;
		worst = worse(worst, fabs(n[c] - g.normal[c]));
	}
	double e = gnp_dot(d[0], d[0]), f = gnp_dot(d[0], d[1]), gg = gnp_dot(d[1], d[1]), det = e * gg - f * f;
	double l = gnp_dot(d[2], n), m = gnp_dot(d[3], n), nn = gnp_dot(d[4], n);
	double size = 1 + fabs(g.principal[0]) + fabs(g.principal[1]);
	worst = worse(worst, fabs((l * gg - 2 * m * f + nn * e) / (2 * det) - g.mean) / size);
	worst = worse(worst, fabs((l * nn - m * m) / det - g.gaussian) / (size * size));
	const double want[3] = {l, m, nn};
	for (int k = 0; k < 3; k++) {
		const double *a = d[k / 2], *b = d[(k + 1) / 2];
		double sb[3] = {gnp_dot(g.second_form, b), gnp_dot(g.second_form + 3, b), gnp_dot(g.second_form + 6, b)};
		worst = worse(worst, fabs(gnp_dot(a, sb) - want[k]) / (size * sqrt(gnp_dot(a, a) * gnp_dot(b, b))));
	}
	return worst;
}

static double difference_error_over(const struct gnp_shape *shape, size_t points)
{
	struct gnp_random random;
	gnp_random_seed(&random, 77, 0);
	double worst = 0;
	for (size_t i = 0; i < points; i++) {
		double p[3];
		double t = gnp_random_uniform(&random), a = gnp_random_uniform(&random), b = gnp_random_uniform(&random);
		gnp_shape_mesh_pick(&shape->mesh, t, a, b, p);
		worst = worse(worst, difference_error(shape, p));
	}
	return worst;
}

static void geometry_is_the_derivative_of_position(void)
{
	for (size_t i = 0; gnp_shape_name(i); i++) {
		struct gnp_shape *shape = shape_new(gnp_shape_name(i), 2, 0);
		double worst = difference_error_over(shape, 200);
		CHECK_AT_MOST(worst, 1e-6);
		if (worst > 1e-6)
			fprintf(stderr, "  of %s\n", gnp_shape_name(i));
		gnp_shape_free(shape);
	}
}

static void random_families_hold_for_many_members(void)
{
	for (unsigned seed = 0; seed < 12; seed++) {
		struct gnp_shape *toroidal = shape_new("toroidal", seed, 0), *radial = shape_new("radial", seed, 22 - seed);
		CHECK_AT_MOST(difference_error_over(toroidal, 40), 1e-6);
		CHECK_AT_MOST(difference_error_over(radial, 40), 1e-6);
		gnp_shape_free(toroidal);
		gnp_shape_free(radial);
	}
}

static void poles_are_ordinary_points(void)
{
	static const double pole[][3] = {{0, 0, 1}, {0, 0, -1}, {1e-9, 0, 1}, {0, -1e-7, -1}, {1, 0, 0}, {0, 1, 0}};
	for (unsigned seed = 0; seed < 6; seed++) {
		struct gnp_shape *shape = shape_new("radial", seed, 22);
		for (size_t i = 0; i < sizeof pole / sizeof pole[0]; i++)
			CHECK_AT_MOST(difference_error(shape, pole[i]), 1e-6);
		gnp_shape_free(shape);
	}
}

/* ---- The tensor, the topology, the orientation ---- */

static double tensor_error(const struct gnp_sample *s, size_t i)
{
	const double *t = s->second_form + 9 * i, *n = s->normals + 3 * i, *k = s->principal_curvatures + 2 * i;
	double trace = t[0] + t[4] + t[8], square = 0, size = 1 + fabs(k[0]) + fabs(k[1]);
	double worst = fabs(gnp_dot(n, n) - 1) + (k[0] >= k[1] ? 0 : 1);
	for (int r = 0; r < 3; r++) {
		worst = worse(worst, fabs(gnp_dot(t + 3 * r, n)) / size);
		for (int c = 0; c < 3; c++) {
			square += t[3 * r + c] * t[3 * c + r];
			worst = worse(worst, fabs(t[3 * r + c] - t[3 * c + r]) / size);
		}
	}
	worst = worse(worst, fabs(trace / 2 - s->mean_curvature[i]) / size);
	worst = worse(worst, fabs((k[0] + k[1]) / 2 - s->mean_curvature[i]) / size);
	worst = worse(worst, fabs(k[0] * k[1] - s->gaussian_curvature[i]) / (size * size));
	return worse(worst, fabs((trace * trace - square) / 2 - s->gaussian_curvature[i]) / (size * size));
}

static void second_form_agrees_with_the_curvatures(void)
{
	for (size_t shape = 0; gnp_shape_name(shape); shape++) {
		struct gnp_sample s = sample_named(gnp_shape_name(shape), COUNT);
		double worst = 0;
		for (size_t i = 0; i < s.count; i++)
			worst = worse(worst, tensor_error(&s, i));
		CHECK_AT_MOST(worst, 1e-12);
		gnp_sample_clear(&s);
	}
}

/* Adds the flat triangle's share of the integrals of K and of x . n / 3, both taken at its centre. */
static void triangle_integrals(const struct gnp_shape *shape, const double *a, const double *b, const double *c, double sum[2])
{
	struct gnp_geometry g;
	double parameters[9], x[9], u[3], v[3], n[3], center[3];
	memcpy(parameters, a, 3 * sizeof *a);
	memcpy(parameters + 3, b, 3 * sizeof *b);
	memcpy(parameters + 6, c, 3 * sizeof *c);
	shape->family->place(shape, 3, parameters, x);
	for (int k = 0; k < 3; k++) {
		u[k] = x[3 + k] - x[k];
		v[k] = x[6 + k] - x[k];
		center[k] = (a[k] + b[k] + c[k]) / 3;
	}
	gnp_cross(u, v, n);
	shape->family->evaluate(shape, 1, center, &g);
	double area = sqrt(gnp_dot(n, n)) / 2;
	sum[0] += g.gaussian * area;
	sum[1] += gnp_dot(g.point, g.normal) / 3 * area;
}

/* Integral of K and enclosed volume: every triangle whole and in four, extrapolated to fourth order. */
static void surface_integrals(const struct gnp_shape *shape, double out[2])
{
	double whole[2] = {0}, four[2] = {0};
	for (size_t t = 0; t < shape->mesh.triangles; t++) {
		const double *a = shape->mesh.corners + 9 * t, *b = a + 3, *c = a + 6;
		double ab[3], bc[3], ca[3];
		for (int k = 0; k < 3; k++) {
			ab[k] = (a[k] + b[k]) / 2;
			bc[k] = (b[k] + c[k]) / 2;
			ca[k] = (c[k] + a[k]) / 2;
		}
		triangle_integrals(shape, a, b, c, whole);
		triangle_integrals(shape, a, ab, ca, four);
		triangle_integrals(shape, ab, b, bc, four);
		triangle_integrals(shape, ca, bc, c, four);
		triangle_integrals(shape, ab, bc, ca, four);
	}
	for (int k = 0; k < 2; k++)
		out[k] = (4 * four[k] - whole[k]) / 3;
}

/* Gauss-Bonnet; and the divergence theorem, whose sign tells inward from outward. */
static void closed_shapes_have_their_genus_and_point_outward(void)
{
	static const struct {
		const char *name;
		int genus;
		double volume; /* 0: unknown, but positive */
	} shapes[] = {
		{"sphere", 0, 4 * M_PI / 3}, {"ellipsoid", 0, 4 * M_PI / 3 * 0.48}, {"torus", 1, 4 * M_PI * M_PI / 27},
		{"bumpy_torus", 1, 0},       {"toroidal", 1, 0},                    {"radial", 0, 0},
		{"genus2", 2, 0},            {"genus3", 3, 0},
	};
	for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
		struct gnp_shape *shape = shape_new(shapes[i].name, 4, 10);
		double integral[2];
		surface_integrals(shape, integral);
		CHECK_NEAR(integral[0] / (4 * M_PI), 1 - shapes[i].genus, 6e-3);
		if (shapes[i].volume > 0)
			CHECK_NEAR(integral[1], shapes[i].volume, 1e-5);
		CHECK(integral[1] > 0.5);
		gnp_shape_free(shape);
	}
}

/* The same theorem by the samples alone: each stands for an equal share of the area. */
static void samples_are_spread_by_area(void)
{
	static const struct {
		const char *name;
		int genus;
	} shapes[] = {{"ellipsoid", 0}, {"torus", 1}, {"bumpy_torus", 1}, {"genus2", 2}, {"genus3", 3}};
	for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
		struct gnp_shape *shape = shape_new(shapes[i].name, 0, 0);
		struct gnp_sample s = sample_of(shape, &(struct gnp_sample_options){.count = 8000});
		double sum = 0, area = shape->mesh.area[shape->mesh.triangles];
		for (size_t k = 0; k < s.count; k++)
			sum += s.gaussian_curvature[k] / (double)s.count;
		CHECK_NEAR(sum * area / (4 * M_PI), 1 - shapes[i].genus, 0.06);
		gnp_sample_clear(&s);
		gnp_shape_free(shape);
	}
}

/* ---- The radial family ---- */

/* Unit direction i of count, on a Fibonacci spiral. */
static void spiral(size_t i, size_t count, double d[3])
{
	double z = 1 - (2.0 * (double)i + 1) / (double)count, angle = M_PI * (1 + sqrt(5)) * (double)i;
	d[0] = sqrt(1 - z * z) * cos(angle);
	d[1] = sqrt(1 - z * z) * sin(angle);
	d[2] = z;
}

static double radius(const struct gnp_shape *shape, const double *d)
{
	double x[3];
	shape->family->place(shape, 1, d, x);
	return sqrt(gnp_dot(x, x));
}

static void radial_has_mean_one_and_fills_its_range(void)
{
	enum { DIRECTIONS = 100000 };
	for (unsigned degree = 1; degree <= 22; degree += 7) {
		struct gnp_shape *shape = shape_new("radial", degree, degree);
		double low = INFINITY, high = 0, mean = 0;
		for (size_t i = 0; i < DIRECTIONS; i++) {
			double d[3];
			spiral(i, DIRECTIONS, d);
			double r = radius(shape, d);
			low = fmin(low, r);
			high = fmax(high, r);
			mean += r / DIRECTIONS;
		}
		CHECK_NEAR(mean, 1, 1e-6);
		CHECK_NEAR(fmax(high - 1, 1 - low), 0.3, 2e-4);
		CHECK_AT_MOST(fmax(high - 1, 1 - low), 0.3 + 1e-12);
		gnp_shape_free(shape);
	}
}

/* Along any great circle a sum of harmonics up to L is a trigonometric polynomial of degree L, and no less. */
static void radial_is_band_limited_at_its_degree(void)
{
	enum { ANGLES = 64, L = 9 };
	struct gnp_shape *shape = shape_new("radial", 8, L);
	double power[ANGLES / 2] = {0}, n[3] = {0.3, -0.8, sqrt(1 - 0.73)}, t1[3], t2[3];
	gnp_geometry_tangents(n, t1, t2);
	for (int k = 0; k < ANGLES / 2; k++) {
		double re = 0, im = 0;
		for (int i = 0; i < ANGLES; i++) {
			double angle = 2 * M_PI * i / ANGLES, d[3];
			for (int c = 0; c < 3; c++)
				d[c] = cos(angle) * t1[c] + sin(angle) * t2[c];
			double r = radius(shape, d);
			re += r * cos(k * angle) / ANGLES;
			im += r * sin(k * angle) / ANGLES;
		}
		power[k] = hypot(re, im);
	}
	CHECK(power[L] > 1e-4);
	for (int k = L + 1; k < ANGLES / 2; k++)
		CHECK_AT_MOST(power[k], 1e-14);
	gnp_shape_free(shape);
}

static void seeds_select_members(void)
{
	static const char *const families[] = {"radial", "toroidal"};
	const double p[3] = {0.4, 0.5, 0.6};
	for (int f = 0; f < 2; f++) {
		struct gnp_shape *a = shape_new(families[f], 1, 0), *b = shape_new(families[f], 2, 0), *c = shape_new(families[f], 1, 0);
		double xa[3], xb[3], xc[3];
		a->family->place(a, 1, p, xa);
		b->family->place(b, 1, p, xb);
		c->family->place(c, 1, p, xc);
		CHECK(memcmp(xa, xb, sizeof xa) != 0);
		CHECK(memcmp(xa, xc, sizeof xa) == 0);
		gnp_shape_free(a);
		gnp_shape_free(b);
		gnp_shape_free(c);
	}
}

/* ---- Sampling ---- */

static int compare_x(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return x < y ? -1 : x > y;
}

/* Distance to the nearest neighbour of every point: least and mean. Sorts the points. */
static void spacing(double *x, size_t count, double *least, double *mean)
{
	*least = INFINITY;
	*mean = 0;
	qsort(x, count, 3 * sizeof *x, compare_x);
	for (size_t i = 0; i < count; i++) {
		double nearest = INFINITY;
		for (int side = -1; side <= 1; side += 2)
			for (size_t j = i + (size_t)side; j < count && fabs(x[3 * j] - x[3 * i]) < nearest; j += (size_t)side) {
				double d[3] = {x[3 * j] - x[3 * i], x[3 * j + 1] - x[3 * i + 1], x[3 * j + 2] - x[3 * i + 2]};
				nearest = fmin(nearest, sqrt(gnp_dot(d, d)));
			}
		*least = fmin(*least, nearest);
		*mean += nearest / (double)count;
	}
}

static void spacing_is_even_on_every_shape(void)
{
	static const size_t counts[] = {500, 5000};
	for (size_t shape = 0; gnp_shape_name(shape); shape++)
		for (int c = 0; c < 2; c++) {
			struct gnp_sample s = sample_named(gnp_shape_name(shape), counts[c]);
			double least, mean;
			spacing(s.exact, s.count, &least, &mean);
			CHECK(least >= 0.6 * mean);
			if (getenv("GNP_TEST_VERBOSE") || !(least >= 0.6 * mean))
				fprintf(stderr, "%s, %zu points: spacing least %g, mean %g, ratio %g\n", gnp_shape_name(shape), s.count, least,
				        mean, least / mean);
			gnp_sample_clear(&s);
		}
}

static void count_is_exact(void)
{
	struct gnp_shape *shape = shape_new("genus2", 0, 0);
	for (size_t count = 1; count < 300; count = 2 * count + 1) {
		struct gnp_sample s = sample_of(shape, &(struct gnp_sample_options){.count = count});
		CHECK(s.count == count);
		for (size_t i = 0; i < count; i++)
			CHECK(memcmp(s.points + 3 * i, s.exact + 3 * i, 3 * sizeof(double)) == 0 && isfinite(s.mean_curvature[i]));
		gnp_sample_clear(&s);
	}
	gnp_shape_free(shape);
}

static void noise_and_outliers_are_as_asked(void)
{
	struct gnp_shape *shape = shape_new("torus", 0, 0);
	const struct gnp_sample_options options = {.count = 20000, .seed = 3, .noise = 0.01, .outlier_fraction = 0.05, .outlier_noise = 0.2};
	struct gnp_sample s = sample_of(shape, &options);
	double square[2] = {0}, sum[2] = {0}, covariance = 0;
	size_t many[2] = {0};
	for (size_t i = 0; i < s.count; i++) {
		int kind = s.outlier[i];
		double d[3];
		many[kind]++;
		for (size_t c = 0; c < 3; c++) {
			d[c] = s.points[3 * i + c] - s.exact[3 * i + c];
			square[kind] += d[c] * d[c];
			sum[kind] += d[c];
		}
		covariance += kind ? 0 : d[0] * d[1];
	}
	CHECK(many[1] == 1000);
	CHECK_NEAR(sqrt(square[0] / (3.0 * (double)many[0])), 0.01, 2e-4);
	CHECK_NEAR(sqrt(square[1] / (3.0 * (double)many[1])), 0.2, 0.015);
	CHECK_NEAR(sum[0] / (3.0 * (double)many[0]), 0, 2e-4);
	CHECK_NEAR(covariance / (double)many[0], 0, 4e-6);
	gnp_sample_clear(&s);
	gnp_shape_free(shape);
}

static bool same_sample(const struct gnp_sample *a, const struct gnp_sample *b)
{
	size_t row = a->count * sizeof(double);
	return a->count == b->count && !memcmp(a->points, b->points, 3 * row) && !memcmp(a->exact, b->exact, 3 * row) &&
	       !memcmp(a->normals, b->normals, 3 * row) && !memcmp(a->mean_curvature, b->mean_curvature, row) &&
	       !memcmp(a->gaussian_curvature, b->gaussian_curvature, row) &&
	       !memcmp(a->principal_curvatures, b->principal_curvatures, 2 * row) &&
	       !memcmp(a->second_form, b->second_form, 9 * row) && !memcmp(a->outlier, b->outlier, a->count);
}

static void displacing_anew_is_sampling_anew(void)
{
	struct gnp_sample_options options = {.count = COUNT, .seed = 8, .noise = 0.02};
	struct gnp_shape *shape = shape_new("bumpy_torus", 0, 0);
	struct gnp_sample sample = sample_of(shape, &options);
	options.noise = 0.001;
	options.outlier_fraction = 0.2;
	options.outlier_noise = 0.05;
	struct gnp_sample want = sample_of(shape, &options);
	CHECK(gnp_sample_displace(&options, &sample, NULL) == GNP_OK);
	CHECK(memcmp(sample.points, want.points, 3 * COUNT * sizeof(double)) == 0);
	CHECK(memcmp(sample.outlier, want.outlier, COUNT) == 0);
	options = (struct gnp_sample_options){.count = COUNT, .seed = 8};
	CHECK(gnp_sample_displace(&options, &sample, NULL) == GNP_OK);
	CHECK(memcmp(sample.points, sample.exact, 3 * COUNT * sizeof(double)) == 0);
	struct gnp_error error = {0};
	options.count--;
	CHECK(gnp_sample_displace(&options, &sample, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "count: got 1999, the sample has 2000");
	gnp_sample_clear(&sample);
	gnp_sample_clear(&want);
	gnp_shape_free(shape);
}

static void area_is_that_of_the_surface(void)
{
	struct gnp_shape *sphere = shape_new("sphere", 0, 0), *torus = shape_new("torus", 0, 0);
	CHECK_NEAR(gnp_shape_area(sphere) / (4 * M_PI), 1, 5e-3);
	CHECK_NEAR(gnp_shape_area(torus) / (4 * M_PI * M_PI * 2 / 9), 1, 5e-3);
	gnp_shape_free(sphere);
	gnp_shape_free(torus);
}

static void workers_do_not_change_a_byte(void)
{
	static const char *const names[] = {"radial", "toroidal", "genus3"};
	struct gnp_error error = {0};
	struct gnp_pool *one = NULL, *four = NULL;
	CHECK(gnp_pool_create(1, &one, &error) == GNP_OK && gnp_pool_create(4, &four, &error) == GNP_OK);
	for (int i = 0; i < 3; i++) {
		struct gnp_shape *shape = shape_new(names[i], 9, 0);
		struct gnp_sample_options options = {.count = 10000, .seed = 5, .noise = 1e-3, .outlier_fraction = 0.1, .outlier_noise = 0.1};
		struct gnp_sample a, b, other;
		CHECK(gnp_sample_create(shape, &options, one, NULL, &a, &error) == GNP_OK);
		CHECK(gnp_sample_create(shape, &options, four, NULL, &b, &error) == GNP_OK);
		options.seed = 6;
		CHECK(gnp_sample_create(shape, &options, four, NULL, &other, &error) == GNP_OK);
		CHECK(same_sample(&a, &b));
		CHECK(!same_sample(&a, &other));
		gnp_sample_clear(&a);
		gnp_sample_clear(&b);
		gnp_sample_clear(&other);
		gnp_shape_free(shape);
	}
	gnp_pool_free(one);
	gnp_pool_free(four);
}

/* ---- Errors ---- */

static void unknown_shapes_are_named(void)
{
	struct gnp_error error = {0};
	struct gnp_shape *shape = NULL;
	CHECK(gnp_shape_create("klein_bottle", 0, 0, &shape, &error) == GNP_NOT_FOUND);
	CHECK(shape == NULL);
	CHECK_STRING(error.text, "shape: got \"klein_bottle\", need one of sphere, ellipsoid, torus, bumpy_torus, toroidal, plane, "
	                         "cylinder, saddle, radial, genus2, genus3");
	error = (struct gnp_error){0};
	CHECK(gnp_shape_create("radial", 0, 23, &shape, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "degree: got 23, need at most 22");
	gnp_shape_free(NULL);
}

static void bad_options_are_refused(void)
{
	static const struct {
		struct gnp_sample_options options;
		const char *text;
	} cases[] = {
		{{.count = 0}, "count: got 0, need 1..2147483648"},
		{{.count = ((size_t)1 << 31) + 1}, "count: got 2147483649, need 1..2147483648"},
		{{.count = SIZE_MAX}, "count: got 18446744073709551615, need 1..2147483648"},
		{{.count = 9, .noise = -1}, "noise: got -1, need a finite number of at least 0"},
		{{.count = 9, .noise = NAN}, "noise: got nan, need a finite number of at least 0"},
		{{.count = 9, .outlier_noise = INFINITY}, "outlier_noise: got inf, need a finite number of at least 0"},
		{{.count = 9, .outlier_fraction = 1.5}, "outlier_fraction: got 1.5, need 0..1"},
		{{.count = 9, .outlier_fraction = -0.1}, "outlier_fraction: got -0.1, need 0..1"},
		{{.count = 9, .outlier_fraction = NAN}, "outlier_fraction: got nan, need 0..1"},
	};
	struct gnp_shape *shape = shape_new("sphere", 0, 0);
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct gnp_error error = {0};
		struct gnp_sample sample = {.count = 123};
		CHECK(gnp_sample_create(shape, &cases[i].options, pool, NULL, &sample, &error) == GNP_INVALID_ARGUMENT);
		CHECK_STRING(error.text, cases[i].text);
		CHECK(sample.count == 123);
	}
	gnp_shape_free(shape);
}

static void cancelled_sampling_stops(void)
{
	struct gnp_shape *shape = shape_new("sphere", 0, 0);
	struct gnp_task task;
	struct gnp_error error = {0};
	struct gnp_sample sample = {.count = 123};
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_sample_create(shape, &(struct gnp_sample_options){.count = 100000}, pool, &task, &sample, &error) == GNP_CANCELLED);
	CHECK(sample.count == 123);
	gnp_shape_free(shape);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
static size_t address_space(void)
{
	size_t pages = 0;
	FILE *file = fopen("/proc/self/statm", "r");
	CHECK(file && fscanf(file, "%zu", &pages) == 1);
	if (file)
		fclose(file);
	return pages * 4096;
}

/* At several limits, so that different allocations are the one that fails. */
static void exhausted_memory_is_reported(void)
{
	static const size_t room[] = {4, 25, 45, 65, 85}; /* MiB; 400,000 points need some 300 */
	struct gnp_shape *shape = shape_new("sphere", 0, 0);
	struct rlimit limit;
	getrlimit(RLIMIT_AS, &limit);
	for (size_t i = 0; i < sizeof room / sizeof room[0]; i++) {
		struct gnp_error error = {0};
		struct gnp_sample sample = {.count = 123};
		setrlimit(RLIMIT_AS, &(struct rlimit){address_space() + (room[i] << 20), limit.rlim_max});
		gnp_status status = gnp_sample_create(shape, &(struct gnp_sample_options){.count = 400000}, pool, NULL, &sample, &error);
		setrlimit(RLIMIT_AS, &limit);
		CHECK(status == GNP_OUT_OF_MEMORY);
		CHECK_CONTAINS(error.text, "sample: no memory");
		CHECK(sample.count == 123);
	}
	gnp_shape_free(shape);
}
#endif

/* ---- Random numbers ---- */

static void random_numbers_have_their_moments(void)
{
	enum { DRAWS = 200000 };
	struct gnp_random random, other;
	gnp_random_seed(&random, 1, 2);
	gnp_random_seed(&other, 1, 3);
	double mean = 0, square = 0, fourth = 0, uniform = 0, product = 0;
	int faces[6] = {0};
	for (int i = 0; i < DRAWS; i++) {
		double n = gnp_random_normal(&random), u = gnp_random_uniform(&random);
		mean += n / DRAWS;
		square += n * n / DRAWS;
		fourth += n * n * n * n / DRAWS;
		uniform += u / DRAWS;
		product += n * gnp_random_normal(&other) / DRAWS;
		faces[gnp_random_below(&random, 6)]++;
	}
	CHECK_NEAR(mean, 0, 0.01);
	CHECK_NEAR(square, 1, 0.015);
	CHECK_NEAR(fourth, 3, 0.12);
	CHECK_NEAR(uniform, 0.5, 0.003);
	CHECK_NEAR(product, 0, 0.01);
	for (int f = 0; f < 6; f++)
		CHECK_NEAR(faces[f], DRAWS / 6.0, 800);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(sphere_has_unit_curvatures),
		TEST(ellipsoid_follows_its_formulas),
		TEST(torus_follows_its_formulas),
		TEST(open_patches_follow_their_formulas),
		TEST(geometry_is_the_derivative_of_position),
		TEST(random_families_hold_for_many_members),
		TEST(poles_are_ordinary_points),
		TEST(second_form_agrees_with_the_curvatures),
		TEST(closed_shapes_have_their_genus_and_point_outward),
		TEST(samples_are_spread_by_area),
		TEST(radial_has_mean_one_and_fills_its_range),
		TEST(radial_is_band_limited_at_its_degree),
		TEST(seeds_select_members),
		TEST(spacing_is_even_on_every_shape),
		TEST(count_is_exact),
		TEST(noise_and_outliers_are_as_asked),
		TEST(displacing_anew_is_sampling_anew),
		TEST(area_is_that_of_the_surface),
		TEST(workers_do_not_change_a_byte),
		TEST(unknown_shapes_are_named),
		TEST(bad_options_are_refused),
		TEST(cancelled_sampling_stops),
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
		TEST(exhausted_memory_is_reported),
#endif
		TEST(random_numbers_have_their_moments),
	};
	struct gnp_error error = {0};
	if (gnp_pool_create(2, &pool, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		return 1;
	}
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
