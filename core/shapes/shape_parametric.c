/* Surfaces given by charts: sphere, ellipsoid, tori, the paper's toroidal family, plane, cylinder, saddle
 * (shape_family.h). */
#include "core/shapes/shape_family.h"

#include <math.h>
#include <string.h>

#include "core/base/random.h"

/* ---- Quadrics: axes times a direction. The level set x^2/a^2 + y^2/b^2 + z^2/c^2 = 1 has no poles. ---- */

struct quadric {
	double axes[3];
};

static gnp_status quadric_create(struct gnp_shape *shape, double a, double b, double c, struct gnp_error *error)
{
	struct quadric *quadric = gnp_shape_data_new(shape, sizeof *quadric, error);
	if (!quadric)
		return GNP_OUT_OF_MEMORY;
	*quadric = (struct quadric){{a, b, c}};
	return gnp_shape_mesh_sphere(shape, 48, error);
}

static gnp_status sphere_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	return quadric_create(shape, 1, 1, 1, error);
}

static gnp_status ellipsoid_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	return quadric_create(shape, 1, 0.8, 0.6, error);
}

static void quadric_place(const struct gnp_shape *shape, size_t count, const double *parameters, double *points)
{
	const double *axes = ((const struct quadric *)shape->data)->axes;
	for (size_t i = 0; i < count; i++) {
		const double *d = parameters + 3 * i;
		double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
		for (int c = 0; c < 3; c++)
			points[3 * i + c] = axes[c] * d[c] / length;
	}
}

static void quadric_evaluate(const struct gnp_shape *shape, size_t count, const double *parameters,
                             struct gnp_geometry *out)
{
	const double *axes = ((const struct quadric *)shape->data)->axes;
	double hessian[6] = {2 / (axes[0] * axes[0]), 0, 0, 2 / (axes[1] * axes[1]), 0, 2 / (axes[2] * axes[2])};
	for (size_t i = 0; i < count; i++) {
		double x[3];
		quadric_place(shape, 1, parameters + 3 * i, x);
		double gradient[3] = {hessian[0] * x[0], hessian[3] * x[1], hessian[5] * x[2]};
		gnp_geometry_from_level(x, gradient, hessian, out + i);
	}
}

/* ---- Charts sigma(u, v): position and derivatives u, v, uu, uv, vv ---- */

/* mean + amplitude sin(p u) cos(q v), eq. torus radii */
struct wave {
	double mean, amplitude, p, q;
};

struct chart {
	void (*jet)(const struct chart *chart, double u, double v, double out[6][3]);
	struct wave a, b; /* the tori's radii: tube, ring */
};

static void chart_place(const struct gnp_shape *shape, size_t count, const double *parameters, double *points)
{
	const struct chart *chart = shape->data;
	for (size_t i = 0; i < count; i++) {
		double jet[6][3];
		chart->jet(chart, parameters[3 * i], parameters[3 * i + 1], jet);
		memcpy(points + 3 * i, jet[0], sizeof jet[0]);
	}
}

static void chart_evaluate(const struct gnp_shape *shape, size_t count, const double *parameters,
                           struct gnp_geometry *out)
{
	const struct chart *chart = shape->data;
	for (size_t i = 0; i < count; i++) {
		double jet[6][3];
		chart->jet(chart, parameters[3 * i], parameters[3 * i + 1], jet);
		gnp_geometry_from_chart(jet[0], jet + 1, out + i);
	}
}

static void wave_jet(const struct wave *wave, double u, double v, double f[6])
{
	double p = wave->p, q = wave->q;
	double su = wave->amplitude * sin(p * u), cu = wave->amplitude * cos(p * u), sv = sin(q * v), cv = cos(q * v);
	f[0] = wave->mean + su * cv;
	f[1] = p * cu * cv;
	f[2] = -q * su * sv;
	f[3] = -p * p * su * cv;
	f[4] = -p * q * cu * sv;
	f[5] = -q * q * su * cv;
}

/* Jet of (w cos u, w sin u, z) from the jets of w and z in (u, v). */
static void revolve(const double w[6], const double z[6], double u, double out[6][3])
{
	double c = cos(u), s = sin(u);
	/* components along (cos u, sin u) and (-sin u, cos u) */
	double along[6] = {w[0], w[1], w[2], w[3] - w[0], w[4], w[5]};
	double across[6] = {0, w[0], 0, 2 * w[1], w[2], 0};
	for (int i = 0; i < 6; i++) {
		out[i][0] = along[i] * c - across[i] * s;
		out[i][1] = along[i] * s + across[i] * c;
		out[i][2] = z[i];
	}
}

/* eq. toroidal manifold: w = a cos v + b, z = a sin v */
static void torus_jet(const struct chart *chart, double u, double v, double out[6][3])
{
	double a[6], b[6], c = cos(v), s = sin(v);
	wave_jet(&chart->a, u, v, a);
	wave_jet(&chart->b, u, v, b);
	double w[6] = {
		a[0] * c + b[0],
		a[1] * c + b[1],
		a[2] * c - a[0] * s + b[2],
		a[3] * c + b[3],
		a[4] * c - a[1] * s + b[4],
		a[5] * c - 2 * a[2] * s - a[0] * c + b[5],
	};
	double z[6] = {
		a[0] * s,
		a[1] * s,
		a[2] * s + a[0] * c,
		a[3] * s,
		a[4] * s + a[1] * c,
		a[5] * s + 2 * a[2] * c - a[0] * s,
	};
	revolve(w, z, u, out);
}

static void plane_jet(const struct chart *chart, double u, double v, double out[6][3])
{
	(void)chart;
	const double jet[6][3] = {{u, v, 0}, {1, 0, 0}, {0, 1, 0}};
	memcpy(out, jet, sizeof jet);
}

static void cylinder_jet(const struct chart *chart, double u, double v, double out[6][3])
{
	const double w[6] = {chart->a.mean}, z[6] = {v, 0, 1};
	revolve(w, z, u, out);
}

static void saddle_jet(const struct chart *chart, double u, double v, double out[6][3])
{
	(void)chart;
	const double jet[6][3] = {{u, v, (u * u - v * v) / 2}, {1, 0, u}, {0, 1, -v}, {0, 0, 1}, {0, 0, 0}, {0, 0, -1}};
	memcpy(out, jet, sizeof jet);
}

static gnp_status torus_create(struct gnp_shape *shape, struct wave a, struct wave b, struct gnp_error *error)
{
	struct chart *chart = gnp_shape_data_new(shape, sizeof *chart, error);
	if (!chart)
		return GNP_OUT_OF_MEMORY;
	*chart = (struct chart){torus_jet, a, b};
	return gnp_shape_mesh_rectangle(shape, (double[]){0, 0}, (double[]){2 * M_PI, 2 * M_PI}, 160, 112, error);
}

static const double TUBE = 1.0 / 3, RING = 2.0 / 3;

static gnp_status plain_torus_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	return torus_create(shape, (struct wave){.mean = TUBE}, (struct wave){.mean = RING}, error);
}

static gnp_status bumpy_torus_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	return torus_create(shape, (struct wave){TUBE, 0.035, 5, 4}, (struct wave){.mean = RING}, error);
}

/* The family as published. Where the ring's ripple r1 B1 approaches the tube's radius a0 a member folds sharply: about one in
 * four has principal curvatures beyond 100, more than the usual 100,000 points resolve. */
static gnp_status toroidal_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)degree;
	struct gnp_random random;
	gnp_random_seed(&random, seed, 0);
	struct wave a = {.mean = TUBE}, b = {.mean = RING};
	a.amplitude = TUBE * (0.05 + 0.15 * gnp_random_uniform(&random));
	b.amplitude = RING * 0.08 * gnp_random_uniform(&random);
	a.p = 1 + (double)gnp_random_below(&random, 5);
	b.p = 1 + (double)gnp_random_below(&random, 5);
	a.q = 3 + (double)gnp_random_below(&random, 5);
	b.q = 3 + (double)gnp_random_below(&random, 5);
	return torus_create(shape, a, b, error);
}

static gnp_status plane_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	struct chart *chart = gnp_shape_data_new(shape, sizeof *chart, error);
	if (!chart)
		return GNP_OUT_OF_MEMORY;
	chart->jet = plane_jet;
	return gnp_shape_mesh_rectangle(shape, (double[]){-1, -1}, (double[]){1, 1}, 1, 1, error);
}

static gnp_status cylinder_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	struct chart *chart = gnp_shape_data_new(shape, sizeof *chart, error);
	if (!chart)
		return GNP_OUT_OF_MEMORY;
	*chart = (struct chart){.jet = cylinder_jet, .a = {.mean = 0.5}};
	return gnp_shape_mesh_rectangle(shape, (double[]){0, -1}, (double[]){2 * M_PI, 1}, 64, 1, error);
}

static gnp_status saddle_create(struct gnp_shape *shape, uint64_t seed, unsigned degree, struct gnp_error *error)
{
	(void)seed;
	(void)degree;
	struct chart *chart = gnp_shape_data_new(shape, sizeof *chart, error);
	if (!chart)
		return GNP_OUT_OF_MEMORY;
	chart->jet = saddle_jet;
	return gnp_shape_mesh_rectangle(shape, (double[]){-1, -1}, (double[]){1, 1}, 64, 64, error);
}

const struct gnp_shape_family gnp_shapes_parametric[] = {
	{"sphere", sphere_create, quadric_place, quadric_evaluate},
	{"ellipsoid", ellipsoid_create, quadric_place, quadric_evaluate},
	{"torus", plain_torus_create, chart_place, chart_evaluate},
	{"bumpy_torus", bumpy_torus_create, chart_place, chart_evaluate},
	{"toroidal", toroidal_create, chart_place, chart_evaluate},
	{"plane", plane_create, chart_place, chart_evaluate},
	{"cylinder", cylinder_create, chart_place, chart_evaluate},
	{"saddle", saddle_create, chart_place, chart_evaluate},
	{NULL, NULL, NULL, NULL},
};
