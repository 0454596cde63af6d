/* The projection head: what it reproduces exactly, what it must not depend on, and its derivatives by differences. */
#include "core/base/random.h"
#include "core/estimators/projection_fit.h"
#include "core/fit/least_squares.h"
#include "core/linear/linalg.h"
#include "tests/unit/test.h"

enum { SIZE = GNP_TAYLOR_SIZE, ORDERS = GNP_TAYLOR_DEGREE + 1, SHELLS = 3, LAST = 240, POINTS_MAX = 300, K = 30 };

static const struct gnp_architecture shape = {.trunk = GNP_TRUNK_EDGE, .head = GNP_HEAD_PROJECTION, .features = 4, .width = 12,
	.channels = 3, .neurons = 10, .layers = 2, .quadrature = 9, .head_width = 14, .outputs = ORDERS + SHELLS, .shells = SHELLS,
	.shell = {60, 120, LAST}, .ridge = 2e-5};

/* Points in ascending order of distance, of density K to the unit disk. Heights are in units of scale_xy. */
struct points {
	size_t count;
	double u[POINTS_MAX], v[POINTS_MAX], w[POINTS_MAX];
	uint32_t index[POINTS_MAX];
	struct gnp_patch patch;
};

static void close_points(struct points *p, double scale_xy, double scale_w)
{
	for (size_t i = 0; i < p->count; i++) {
		p->w[i] *= scale_xy / scale_w;
		p->index[i] = (uint32_t)i;
	}
	p->patch = (struct gnp_patch){.k = K, .count = K, .buffer_count = p->count, .index = p->index, .u = p->u, .v = p->v, .w = p->w,
	                              .epsilon = scale_xy, .scale_xy = scale_xy, .scale_w = scale_w};
}

static void spread_points(struct points *p, size_t count)
{
	p->count = count;
	for (size_t i = 0; i < count; i++) {
		double r = sqrt(((double)i + 0.5) / K), angle = 2.399963 * (double)i;
		p->u[i] = r * cos(angle);
		p->v[i] = r * sin(angle);
		p->w[i] = 0;
	}
}

/* A bent sheet with noise. */
static void rough_points(struct points *p, uint64_t seed)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 0);
	spread_points(p, POINTS_MAX);
	for (size_t i = 0; i < p->count; i++)
		p->w[i] = 0.1 * p->u[i] * p->v[i] - 0.07 * p->v[i] * p->v[i] + 0.03 * sin(2 * p->u[i] + p->v[i]) +
		          0.01 * gnp_random_normal(&random);
}

struct described {
	struct gnp_projection sums;
	float summary[SHELLS * ORDERS], nodes[GNP_PROJECTION_NODES * 4];
};

static void describe(const struct points *p, struct described *out)
{
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_projection_work work;
	CHECK(gnp_projection_work_take(&shape, &work, scratch));
	gnp_projection_gather(&shape, &p->patch, p->index, p->count, &work, &out->sums);
	gnp_projection_describe(&shape, K, &out->sums, &work, out->summary, out->nodes);
	gnp_scratch_free(scratch);
}

static void usual_outputs(float *outputs)
{
	gnp_projection_begin(&shape, (double)LAST / K, outputs);
}

/* ---- Exactness ---- */

static void polynomials_are_reproduced(void)
{
	static struct points p;
	static struct described d;
	struct gnp_projection_fit fit;
	struct gnp_random random;
	double factor[SIZE], row[GNP_TAYLOR_STRIDE], wanted[SIZE], size = 0;
	unsigned order[SIZE];
	float outputs[ORDERS + SHELLS];
	gnp_random_seed(&random, 3, 0);
	gnp_taylor_indices(factor, order);
	spread_points(&p, POINTS_MAX);
	double radius = sqrt((double)LAST / K);
	for (size_t i = 0; i < SIZE; i++)
		wanted[i] = 0.3 * gnp_random_normal(&random) / pow(radius, order[i]);
	for (size_t n = 0; n < p.count; n++) {
		gnp_taylor_rows(GNP_TAYLOR_DEGREE, &p.u[n], &p.v[n], 1, GNP_TAYLOR_STRIDE, row);
		for (size_t i = 0; i < SIZE; i++)
			p.w[n] += row[i] * wanted[i];
		size = fmax(size, fabs(p.w[n]));
	}
	close_points(&p, 0.02, 0.007);
	describe(&p, &d);
	for (int o = 0; o < ORDERS + SHELLS; o++)
		outputs[o] = o < ORDERS ? -10 : 0.2f;
	CHECK(gnp_projection_solve(&d.sums, outputs, &fit));
	for (size_t i = 0; i < SIZE; i++)
		CHECK_NEAR(fit.coefficients[i] * pow(radius, order[i]), wanted[i] * pow(radius, order[i]), 1e-8);
	CHECK_AT_MOST(sqrt(fit.misfit / fit.weight), 1e-6 * size);
	for (unsigned l = 0; l < SHELLS; l++) /* the first fits' ridge is not tiny, but they see it nearly */
		CHECK_AT_MOST(d.summary[l * ORDERS], log(0.05 * size));
}

/* The solution against the definition: the misfit with penalties, whose gradient vanishes and which any step makes larger. */
static void the_solution_is_the_minimum(void)
{
	static struct points p;
	static struct described d;
	struct gnp_projection_fit fit;
	double factor[SIZE], row[GNP_TAYLOR_STRIDE], gradient[SIZE] = {0}, scale[SIZE] = {0}, misfit = 0, weight = 0;
	unsigned order[SIZE];
	float outputs[ORDERS + SHELLS];
	gnp_taylor_indices(factor, order);
	rough_points(&p, 8);
	close_points(&p, 3, 0.5);
	describe(&p, &d);
	usual_outputs(outputs);
	CHECK(gnp_projection_solve(&d.sums, outputs, &fit));
	for (size_t n = 0; n < LAST; n++) {
		double share = 1, left = p.w[n] * 0.5 / 3;
		for (unsigned l = 0; l == 0 || (l < SHELLS && n >= shape.shell[l - 1]); l++)
			share /= 1 + exp(2 * (double)outputs[ORDERS + l]); /* exp(-softplus) */
		gnp_taylor_rows(GNP_TAYLOR_DEGREE, &p.u[n], &p.v[n], 1, GNP_TAYLOR_STRIDE, row);
		for (size_t i = 0; i < SIZE; i++)
			left -= row[i] * fit.coefficients[i];
		for (size_t i = 0; i < SIZE; i++) {
			gradient[i] += share * row[i] * left;
			scale[i] += share * fabs(row[i] * left);
		}
		misfit += share * left * left;
		weight += share;
	}
	for (size_t i = 0; i < SIZE; i++) {
		double penalty = exp(4 * (double)outputs[order[i]]) * factor[i] * fit.coefficients[i];
		CHECK_NEAR(gradient[i], penalty, 1e-9 * scale[i]);
		misfit += penalty * fit.coefficients[i];
	}
	CHECK_NEAR(fit.misfit, misfit, 1e-9 * misfit);
	CHECK_NEAR(fit.weight, weight, 1e-12 * weight);
}

/* ---- Derivatives of the solution ---- */

static double form(const struct gnp_projection *sums, const float *outputs, const double *d)
{
	struct gnp_projection_fit fit;
	double sum = 0;
	CHECK(gnp_projection_solve(sums, outputs, &fit));
	for (size_t i = 0; i < SIZE; i++)
		sum += d[i] * fit.coefficients[i];
	return sum;
}

/* Of fourth order. Steps are powers of two and outputs multiples of them, so that floats hold them. */
static double slope_of(const struct gnp_projection *sums, float *outputs, int o, const double *d)
{
	const float was = outputs[o], h = 0x1p-7f;
	double difference[2];
	for (int far = 0; far < 2; far++) {
		outputs[o] = was + (float)(far + 1) * h;
		difference[far] = form(sums, outputs, d);
		outputs[o] = was - (float)(far + 1) * h;
		difference[far] -= form(sums, outputs, d);
	}
	outputs[o] = was;
	return (8 * difference[0] - difference[1]) / (12 * (double)h);
}

static void derivatives_of_the_solution_are_differences(void)
{
	static struct points p;
	static struct described d;
	struct gnp_random random;
	gnp_random_seed(&random, 5, 0);
	rough_points(&p, 9);
	close_points(&p, 1, 1);
	describe(&p, &d);
	for (int trial = 0; trial < 6; trial++) {
		struct gnp_projection_fit fit;
		float outputs[ORDERS + SHELLS], got[ORDERS + SHELLS];
		double along[SIZE], want[ORDERS + SHELLS], size = 0;
		usual_outputs(outputs);
		for (int o = 0; o < ORDERS + SHELLS; o++)
			outputs[o] = (float)(round(256 * ((o < 3 ? -1 : outputs[o]) + 0.7 * gnp_random_normal(&random))) / 256);
		for (size_t i = 0; i < SIZE; i++)
			along[i] = gnp_random_normal(&random);
		CHECK(gnp_projection_solve(&d.sums, outputs, &fit));
		gnp_projection_solve_backward(&d.sums, outputs, &fit, along, got);
		for (int o = 0; o < ORDERS + SHELLS; o++) {
			want[o] = slope_of(&d.sums, outputs, o, along);
			size = fmax(size, fabs(want[o]));
		}
		for (int o = 0; o < ORDERS + SHELLS; o++)
			CHECK_NEAR(got[o], want[o], 1e-5 * fabs(want[o]) + 1e-6 * size);
	}
}

/* Beyond a limit a penalty stays as it is, and its output has no say. */
static void penalties_stay_finite_at_any_output(void)
{
	static struct points p;
	static struct described d;
	rough_points(&p, 10);
	close_points(&p, 1, 1);
	describe(&p, &d);
	for (int o = 0; o < ORDERS + SHELLS; o++)
		for (int sign = -1; sign <= 1; sign += 2) {
			struct gnp_projection_fit fit;
			float outputs[ORDERS + SHELLS], slopes[ORDERS + SHELLS];
			double along[SIZE] = {1, 1, 1, 1, 1, 1};
			usual_outputs(outputs);
			outputs[o] = (float)(sign * 1e4);
			CHECK(gnp_projection_solve(&d.sums, outputs, &fit) || fit.coefficients[3] == 0);
			gnp_projection_solve_backward(&d.sums, outputs, &fit, along, slopes);
			for (size_t i = 0; i < SIZE; i++)
				CHECK(isfinite(fit.coefficients[i]));
			for (int i = 0; i < ORDERS + SHELLS; i++)
				CHECK(isfinite(slopes[i]));
			CHECK(o >= ORDERS || slopes[o] == 0);
			CHECK(isfinite(fit.misfit) && isfinite(fit.weight));
		}
}

/* ---- What it must not depend on ---- */

static void check_same_description(const struct described *a, const struct described *b, double tolerance)
{
	for (size_t i = 0; i < SHELLS * ORDERS; i++)
		CHECK_NEAR(a->summary[i], b->summary[i], tolerance);
}

static void units_of_length_change_nothing(void)
{
	static struct points p, q;
	static struct described a, b;
	float outputs[ORDERS + SHELLS];
	struct gnp_projection_fit fits[2];
	rough_points(&p, 11);
	q = p;
	close_points(&p, 0.03, 0.002);
	describe(&p, &a);
	usual_outputs(outputs);
	CHECK(gnp_projection_solve(&a.sums, outputs, &fits[0]));
	for (int i = 0; i < 3; i++) {
		static const double scales[] = {1e-3, 1e3, 0x1p-10};
		struct points r = q;
		close_points(&r, 0.03 * scales[i], 0.002 * scales[i]);
		describe(&r, &b);
		CHECK(gnp_projection_solve(&b.sums, outputs, &fits[1]));
		check_same_description(&a, &b, 1e-5);
		for (size_t n = 0; n < GNP_PROJECTION_NODES * 4; n++)
			CHECK_NEAR(a.nodes[n], b.nodes[n], 1e-6 * fmax(1, fabs(b.nodes[n])));
		for (size_t c = 0; c < SIZE; c++)
			CHECK_NEAR(fits[1].coefficients[c], fits[0].coefficients[c], 1e-10);
	}
	struct points r = q; /* by how much a patch divides its heights means nothing either */
	close_points(&r, 0.03, 0.11);
	describe(&r, &b);
	check_same_description(&a, &b, 1e-5);
}

/* H and K at the origin, in units of scale_xy. */
static void curvatures(const struct gnp_projection_fit *fit, double out[2])
{
	struct gnp_jet j = gnp_taylor_jet(GNP_TAYLOR_DEGREE, fit->coefficients, 0, 0);
	double det = 1 + j.u * j.u + j.v * j.v;
	out[0] = ((1 + j.v * j.v) * j.uu - 2 * j.u * j.v * j.uv + (1 + j.u * j.u) * j.vv) / (2 * det * sqrt(det));
	out[1] = (j.uu * j.vv - j.uv * j.uv) / (det * det);
}

static void turning_the_patch_in_its_plane_changes_nothing(void)
{
	static struct points p;
	static struct described a, b;
	struct gnp_projection_fit fits[2];
	float outputs[ORDERS + SHELLS];
	double want[2], got[2];
	rough_points(&p, 12);
	close_points(&p, 1, 1);
	describe(&p, &a);
	usual_outputs(outputs);
	CHECK(gnp_projection_solve(&a.sums, outputs, &fits[0]));
	curvatures(&fits[0], want);
	for (int turn = 1; turn < 7; turn++) {
		static struct points q;
		q = p;
		for (size_t i = 0; i < q.count; i++) {
			q.u[i] = cos(turn) * p.u[i] - sin(turn) * p.v[i];
			q.v[i] = sin(turn) * p.u[i] + cos(turn) * p.v[i];
		}
		q.patch.u = q.u, q.patch.v = q.v, q.patch.w = q.w, q.patch.index = q.index;
		describe(&q, &b);
		check_same_description(&a, &b, 1e-5);
		CHECK(gnp_projection_solve(&b.sums, outputs, &fits[1]));
		curvatures(&fits[1], got);
		CHECK_NEAR(got[0], want[0], 1e-10);
		CHECK_NEAR(got[1], want[1], 1e-10);
		CHECK_NEAR(fits[1].misfit, fits[0].misfit, 1e-10 * fits[0].misfit);
	}
}

/* Nodes hold what they say: places in units of the last shell's radius, heights, residuals in units of their size, 0 beyond. */
static void nodes_are_spread_over_the_shells(void)
{
	static struct points p;
	static struct described d;
	double square = 0;
	rough_points(&p, 13);
	close_points(&p, 1, 1);
	describe(&p, &d);
	for (size_t n = 0; n < GNP_PROJECTION_NODES; n++) {
		size_t i = n * (LAST - 1) / (GNP_PROJECTION_NODES - 1);
		double radius = sqrt((double)LAST / K);
		CHECK_NEAR(d.nodes[4 * n], p.u[i] / radius, 1e-6);
		CHECK_NEAR(d.nodes[4 * n + 1], p.v[i] / radius, 1e-6);
		CHECK_NEAR(d.nodes[4 * n + 2], p.w[i] / radius, 1e-6);
		if (i < shape.shell[SHELLS / 2])
			square += (double)d.nodes[4 * n + 3] * (double)d.nodes[4 * n + 3];
		CHECK(fabsf(d.nodes[4 * n + 3]) <= 8);
	}
	CHECK(square > 6 && square < 60); /* 24 of them */
}

/* ---- Poor patches ---- */

static void check_finite(const struct points *p)
{
	static struct described d;
	struct gnp_projection_fit fit;
	float outputs[ORDERS + SHELLS], slopes[ORDERS + SHELLS];
	double along[SIZE] = {1, 1, 1, 1};
	describe(p, &d);
	for (size_t i = 0; i < SHELLS * ORDERS; i++)
		CHECK(isfinite(d.summary[i]));
	for (size_t i = 0; i < GNP_PROJECTION_NODES * 4; i++)
		CHECK(isfinite(d.nodes[i]));
	for (int tiny = 0; tiny < 2; tiny++) {
		usual_outputs(outputs);
		for (int j = 0; tiny && j < ORDERS; j++)
			outputs[j] = -15;
		bool solved = gnp_projection_solve(&d.sums, outputs, &fit);
		for (size_t i = 0; i < SIZE; i++)
			CHECK(isfinite(fit.coefficients[i]) && (solved || fit.coefficients[i] == 0));
		CHECK(isfinite(fit.misfit) && fit.misfit >= 0 && isfinite(fit.weight));
		gnp_projection_solve_backward(&d.sums, outputs, &fit, along, slopes);
		for (int o = 0; o < ORDERS + SHELLS; o++)
			CHECK(isfinite(slopes[o]));
	}
}

static void poor_patches_give_finite_answers(void)
{
	static const size_t counts[] = {0, 1, 2, 5, 36, 59, 60, 61, 121};
	static struct points p;
	for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
		rough_points(&p, 14);
		p.count = counts[i];
		close_points(&p, 1, 1);
		check_finite(&p);
		for (size_t n = 0; n < p.count; n++)
			p.v[n] = 0; /* on a line */
		check_finite(&p);
		for (size_t n = 0; n < p.count; n++)
			p.u[n] = p.w[n] = 0; /* at one place */
		check_finite(&p);
	}
	rough_points(&p, 15); /* every place taken ten times */
	for (size_t n = 0; n < p.count; n++) {
		p.u[n] = p.u[n / 10 * 10];
		p.v[n] = p.v[n / 10 * 10];
	}
	close_points(&p, 1, 1);
	check_finite(&p);
}

/* ---- Through head and trunk ---- */

enum { PATCHES = 3, DIRECTIONS = 3 };

static size_t all_usable(const void *context, const struct gnp_patch *patch, size_t most, uint32_t *positions)
{
	size_t count = patch->buffer_count < most ? patch->buffer_count : most;
	(void)context;
	for (size_t i = 0; i < count; i++)
		positions[i] = (uint32_t)i;
	return count;
}

struct chain {
	struct gnp_architecture architecture;
	struct gnp_layout layout;
	float *parameters;
	struct gnp_patch patches[PATCHES];
	double along[PATCHES * SIZE];
	struct gnp_scratch *scratch;
};

/* The loss, a linear form of all coefficients; its gradient is added where one is given. */
static double chain_loss(const struct chain *c, float *gradient)
{
	struct gnp_scratch_mark mark = gnp_scratch_mark(c->scratch);
	struct gnp_network *network = NULL;
	struct gnp_projected projected;
	double sum = 0;
	CHECK(gnp_network_create(&c->architecture, c->parameters, &network, NULL) == GNP_OK);
	CHECK(gnp_projected_describe(&c->architecture, c->patches, PATCHES, all_usable, NULL, &projected, c->scratch, NULL) == GNP_OK);
	CHECK(gnp_projected_solve(network, gradient != NULL, &projected, c->scratch, NULL) == GNP_OK);
	for (size_t i = 0; i < PATCHES * SIZE; i++)
		sum += c->along[i] * projected.fits[i / SIZE].coefficients[i % SIZE];
	if (gradient)
		CHECK(gnp_projected_backward(network, &projected, c->along, gradient, c->scratch, NULL) == GNP_OK);
	gnp_network_free(network);
	gnp_scratch_release(c->scratch, mark);
	return sum;
}

static void fill_parameters(struct chain *c, struct gnp_random *random)
{
	for (size_t r = 0; r < c->layout.rows; r++) {
		const struct gnp_parameter_row *row = &c->layout.row[r];
		for (size_t i = 0; i < row->count; i++)
			c->parameters[row->offset + i] = (float)((row->rank == 2 ? 2.5 / sqrt((double)row->shape[1]) : 0.2) *
			                                         (2 * gnp_random_uniform(random) - 1));
	}
	for (size_t i = 0; i < gnp_layout_find(&c->layout, "head.mean")->count; i++) {
		c->parameters[gnp_layout_find(&c->layout, "head.mean")->offset + i] = -5;
		c->parameters[gnp_layout_find(&c->layout, "head.deviation")->offset + i] = 2;
	}
	float *bias = c->parameters + gnp_layout_find(&c->layout, "head.4.bias")->offset;
	usual_outputs(bias);
	bias[0] = bias[1] = bias[2] = -1; /* so that all of them matter */
}

/* The derivative along a direction, by a difference. */
static double difference(struct chain *c, const struct gnp_parameter_row *row, const float *was, const double *direction, double h)
{
	float *at = c->parameters + row->offset;
	double loss[2];
	for (int side = 0; side < 2; side++) {
		for (size_t i = 0; i < row->count; i++)
			at[i] = (float)((double)was[i] + (side ? h : -h) * direction[i]);
		loss[side] = chain_loss(c, NULL);
	}
	memcpy(at, was, row->count * sizeof *was);
	return (loss[1] - loss[0]) / (2 * h);
}

/* Along random directions. Of several steps the best counts: bends of the network spoil long ones, floats short ones. */
static void check_row(struct chain *c, const struct gnp_parameter_row *row, const float *gradient, struct gnp_random *random)
{
	static const double steps[] = {4e-3, 1e-3, 2.5e-4, 6e-5};
	float *was = malloc(row->count * sizeof *was);
	double *direction = malloc(row->count * sizeof *direction), square = 0;
	memcpy(was, c->parameters + row->offset, row->count * sizeof *was);
	for (size_t i = 0; i < row->count; i++)
		square += (double)gradient[row->offset + i] * (double)gradient[row->offset + i];
	for (int d = 0; d < DIRECTIONS; d++) {
		double got = 0, off = INFINITY;
		for (size_t i = 0; i < row->count; i++) {
			direction[i] = gnp_random_uniform(random) < 0.5 ? -1 : 1;
			got += direction[i] * (double)gradient[row->offset + i];
		}
		for (size_t s = 0; s < sizeof steps / sizeof *steps; s++)
			off = fmin(off, fabs(difference(c, row, was, direction, steps[s] / sqrt((double)row->count)) - got));
		if (!(off <= 2e-2 * sqrt(square)) || !(square > 0)) {
			test_failures++;
			fprintf(stderr, "%s: %s: %g off, the gradient's size is %g\n", gnp_trunk_name(c->architecture.trunk), row->name, off,
			        sqrt(square));
		}
	}
	free(was);
	free(direction);
}

static void check_chain(enum gnp_trunk_kind trunk)
{
	static struct points points[PATCHES];
	struct gnp_random random;
	struct chain c = {.architecture = shape, .scratch = gnp_scratch_create()};
	c.architecture.trunk = trunk;
	if (trunk == GNP_TRUNK_NONE) {
		struct gnp_architecture *a = &c.architecture;
		a->features = a->width = a->channels = a->neurons = a->layers = a->quadrature = 0;
	}
	gnp_random_seed(&random, 21, 0);
	CHECK(gnp_architecture_layout(&c.architecture, &c.layout, NULL) == GNP_OK);
	c.parameters = malloc(c.layout.total * sizeof *c.parameters);
	float *gradient = calloc(c.layout.total, sizeof *gradient);
	fill_parameters(&c, &random);
	for (size_t p = 0; p < PATCHES; p++) {
		rough_points(&points[p], 30 + p);
		points[p].count -= 70 * p; /* the last lacks points of the last shell */
		close_points(&points[p], 1, 1);
		c.patches[p] = points[p].patch;
	}
	for (size_t i = 0; i < PATCHES * SIZE; i++)
		c.along[i] = i % SIZE < 6 ? gnp_random_normal(&random) : 0;
	chain_loss(&c, gradient);
	for (size_t r = 0; r < c.layout.rows; r++)
		if (strcmp(c.layout.row[r].name, "head.mean") != 0 && strcmp(c.layout.row[r].name, "head.deviation") != 0)
			check_row(&c, &c.layout.row[r], gradient, &random);
	for (size_t i = 0; i < gnp_layout_find(&c.layout, "head.mean")->count; i++) /* of the training data; not trained */
		CHECK(gradient[gnp_layout_find(&c.layout, "head.mean")->offset + i] == 0 &&
		      gradient[gnp_layout_find(&c.layout, "head.deviation")->offset + i] == 0);
	gnp_scratch_free(c.scratch);
	free(c.parameters);
	free(gradient);
}

static void derivatives_through_the_edge_trunk_are_differences(void)
{
	check_chain(GNP_TRUNK_EDGE);
}

static void derivatives_through_the_separable_trunk_are_differences(void)
{
	check_chain(GNP_TRUNK_SEPARABLE);
}

static void derivatives_without_a_trunk_are_differences(void)
{
	check_chain(GNP_TRUNK_NONE);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(polynomials_are_reproduced), TEST(the_solution_is_the_minimum), TEST(derivatives_of_the_solution_are_differences),
		TEST(penalties_stay_finite_at_any_output), TEST(units_of_length_change_nothing),
		TEST(turning_the_patch_in_its_plane_changes_nothing), TEST(nodes_are_spread_over_the_shells),
		TEST(poor_patches_give_finite_answers), TEST(derivatives_through_the_edge_trunk_are_differences),
		TEST(derivatives_through_the_separable_trunk_are_differences),
		TEST(derivatives_without_a_trunk_are_differences),
	};
	gnp_linalg_init();
	return RUN_TESTS(tests);
}
