/* Bodies with creases: that points, normals, second forms, pieces and edge distances are true, and samplings what
 * they are called. */
#include "tests/unit/test.h"

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/solids/solid.h"
#include "core/solids/solid_crease.h"
#include "core/solids/solid_draw.h"
#include "core/solids/solid_kinds.h"

static struct gnp_pool *pool; /* of two workers, for every test */

static struct gnp_solid_sample sample_with(struct gnp_pool *workers, int kind, int sampling, uint64_t seed,
                                           size_t count)
{
	const struct gnp_solid_options options = {seed, kind, count, sampling};
	struct gnp_error error = {0};
	struct gnp_solid_sample sample = {0};
	if (gnp_solid_sample_create(&options, workers, NULL, &sample, &error) != GNP_OK) {
		fprintf(stderr, "%s, %s, seed %d: %s\n", gnp_solid_kind_name(kind), gnp_solid_sampling_name(sampling),
		        (int)seed, error.text);
		exit(1);
	}
	return sample;
}

static struct gnp_solid_sample sample_of(int kind, int sampling, uint64_t seed, size_t count)
{
	return sample_with(pool, kind, sampling, seed, count);
}

static double worse(double worst, double error)
{
	return error <= worst ? worst : error; /* NaN stays */
}

static double distance(const double a[3], const double b[3])
{
	const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
	return sqrt(gnp_dot(d, d));
}

static double norm(const double form[9])
{
	return sqrt(gnp_dot(form, form) + gnp_dot(form + 3, form + 3) + gnp_dot(form + 6, form + 6));
}

static double quadratic(const double form[9], const double a[3], const double b[3])
{
	double sum = 0;
	for (int i = 0; i < 3; i++)
		sum += a[i] * gnp_dot(form + 3 * i, b);
	return sum;
}

/* A body of the kind, from a stream of the test's own. */
static struct gnp_solid_body body; /* large */
static struct gnp_solid_survey body_make(int kind, uint64_t seed, double count)
{
	struct gnp_solid_survey survey;
	struct gnp_random random;
	for (uint64_t attempt = 0; attempt < 50; attempt++) {
		gnp_random_seed(&random, seed, attempt);
		gnp_solid_kinds_build(kind, &body, &random, count);
		gnp_solid_draws_survey(&body, seed, &survey);
		if (survey.share > 0.15)
			break;
	}
	return survey;
}

/* ---- One face ---- */

static void check_level(const struct gnp_solid_face *face, const struct gnp_solid_geometry *here)
{
	double gradient[3], other[3], x[3];
	CHECK_AT_MOST(fabs(gnp_solid_face_level(face, here->point, gradient)), 1e-12);
	double length = sqrt(gnp_dot(gradient, gradient)), step = 1e-6;
	for (int c = 0; c < 3; c++) {
		memcpy(x, here->point, sizeof x);
		x[c] += step;
		double above = gnp_solid_face_level(face, x, other);
		x[c] -= 2 * step;
		double below = gnp_solid_face_level(face, x, other);
		CHECK_NEAR((above - below) / (2 * step), gradient[c], 1e-6 * (1 + fabs(gradient[c])) / step * 1e-5);
		CHECK_NEAR(face->sign * here->normal[c], gradient[c] / length, 1e-9);
	}
}

/* II(a, b) = -dn(a) . b along both parameters. */
static void check_form(const struct gnp_solid_face *face, const double p[2], const struct gnp_solid_geometry *here,
                       double size)
{
	double dx[2][3], dn[2][3], step = 1e-4 * size, scale = 0;
	for (int c = 0; c < 2; c++) {
		struct gnp_solid_geometry low, high;
		double below[2] = {p[0], p[1]}, above[2] = {p[0], p[1]};
		below[c] -= step;
		above[c] += step;
		gnp_solid_face_evaluate(face, below, &low);
		gnp_solid_face_evaluate(face, above, &high);
		for (int i = 0; i < 3; i++) {
			dx[c][i] = (high.point[i] - low.point[i]) / (2 * step);
			dn[c][i] = (high.normal[i] - low.normal[i]) / (2 * step);
		}
		scale += gnp_dot(dx[c], dx[c]);
	}
	double form = norm(here->form);
	for (int a = 0; a < 2; a++)
		for (int b = 0; b < 2; b++)
			CHECK_NEAR(quadratic(here->form, dx[a], dx[b]), -gnp_dot(dn[a], dx[b]), 1e-5 * scale * (1 + form));
	for (int i = 0; i < 3; i++)
		CHECK_AT_MOST(fabs(gnp_dot(here->form + 3 * i, here->normal)), 1e-12 * (1 + form));
}

static void faces_have_the_geometry_of_their_levels(void)
{
	for (int kind = 0; kind < GNP_SOLID_KIND_COUNT; kind++)
		for (uint64_t seed = 0; seed < 3; seed++) {
			struct gnp_random random;
			body_make(kind, seed, 3000);
			gnp_random_seed(&random, seed, 99);
			for (int f = 0; f < body.faces; f++)
				for (int i = 0; i < 20; i++) {
					const struct gnp_solid_face *face = &body.face[f];
					struct gnp_solid_geometry here;
					double p[2], q[2], size = face->type == GNP_SOLID_GRAPH ? 0.02 : 1;
					if (!gnp_solid_face_draw(face, &random, p))
						continue;
					gnp_solid_face_evaluate(face, p, &here);
					/* a cone's tip and a sphere's pole have no second form in parameters */
					if ((face->type == GNP_SOLID_FRUSTUM && (p[0] < 0.02 || p[0] > 0.98)) ||
					    (face->type == GNP_SOLID_ARC && fabs(cos(p[0])) < 0.05))
						continue;
					check_level(face, &here);
					check_form(face, p, &here, size);
					CHECK(gnp_solid_face_locate(face, here.point, q));
					CHECK_NEAR(q[0], p[0], 1e-9);
				}
		}
}

/* Halves of a face's parameters have draws in proportion to their areas, by the length of parameter lines. */
static void check_draws(const struct gnp_solid_face *face, const double low[2], const double high[2])
{
	enum { CELLS = 8, GRID = 200, DRAWS = 40000 };
	double area[CELLS] = {0}, total = 0, drawn[CELLS] = {0}, kept = 0;
	struct gnp_random random;
	for (int i = 0; i < GRID; i++)
		for (int j = 0; j < GRID; j++) {
			double x[4][3], u[3], v[3], n[3];
			for (int c = 0; c < 4; c++) {
				const double at[2] = {low[0] + (high[0] - low[0]) * (i + 0.5 + 0.4 * (c == 1) - 0.4 * (c == 2)) / GRID,
				                      low[1] + (high[1] - low[1]) * (j + 0.5 + 0.4 * (c == 3)) / GRID};
				gnp_solid_face_point(face, at, x[c]);
			}
			for (int c = 0; c < 3; c++) {
				u[c] = (x[1][c] - x[2][c]) / 0.8;
				v[c] = (x[3][c] - x[0][c]) / 0.4;
			}
			gnp_cross(u, v, n);
			double cell = sqrt(gnp_dot(n, n));
			area[i * CELLS / GRID] += cell;
			total += cell;
		}
	gnp_random_seed(&random, 4, 4);
	for (int i = 0; i < DRAWS; i++) {
		double p[2];
		if (!gnp_solid_face_draw(face, &random, p))
			continue;
		drawn[(int)fmin(CELLS - 1, CELLS * (p[0] - low[0]) / (high[0] - low[0]))]++;
		kept++;
	}
	CHECK_NEAR(gnp_solid_face_area(face) * kept / DRAWS, total, 0.02 * total);
	for (int c = 0; c < CELLS; c++)
		CHECK_NEAR(drawn[c] / kept, area[c] / total, 5 * sqrt(area[c] / total / kept) + 1e-3);
}

static void draws_are_uniform_by_area(void)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(1, 2, 3);
	const struct gnp_solid_frustum cone = {{0.7, 0.1}, {0, 0.5}, {1, 4}};
	const struct gnp_solid_arc torus = {0.5, 0.3, {-1, 3}, {0, 2}}, sphere = {0, 0.5, {-0.3, 1.2}, {0, 2}};
	const struct gnp_solid_graph graph = {
		.half = {0.5, 0.3}, .bend = {3, -1}, .waves = 1, .wave = {{9, 4}}, .height = {0.05}};
	memset(&body, 0, sizeof body);
	gnp_solid_body_frustum(&body, 0, &frame, &cone);
	gnp_solid_body_arc(&body, 0, &frame, &torus);
	gnp_solid_body_arc(&body, 0, &frame, &sphere);
	gnp_solid_body_graph(&body, 0, &frame, &graph);
	check_draws(&body.face[0], (double[2]){0, 1}, (double[2]){1, 4});
	check_draws(&body.face[1], (double[2]){-1, 0}, (double[2]){3, 2});
	check_draws(&body.face[2], (double[2]){-0.3, 0}, (double[2]){1.2, 2});
	check_draws(&body.face[3], (double[2]){-0.5, -0.3}, (double[2]){0.5, 0.3});
}

/* ---- Boolean bodies ---- */

static bool holds(const double x[3])
{
	bool held = false;
	for (int p = 0; p < body.primitives; p++) {
		bool inside = true;
		double gradient[3];
		for (int h = 0; h < body.primitive[p].halves; h++)
			inside = inside && gnp_solid_face_level(&body.face[body.primitive[p].half[h]], x, gradient) <= 0;
		int operation = body.primitive[p].operation;
		if (operation == GNP_SOLID_UNION)
			held = held || inside;
		else
			held = held && inside == (operation == GNP_SOLID_INTERSECTION);
	}
	return held;
}

static void points_of_boolean_bodies_part_inside_from_outside(void)
{
	static const int kinds[] = {GNP_SOLID_BOX, GNP_SOLID_PRISM, GNP_SOLID_CSG};
	size_t wrong = 0, all = 0;
	for (int k = 0; k < 3; k++)
		for (uint64_t seed = 0; seed < 20; seed++) {
			struct gnp_solid_survey survey = body_make(kinds[k], seed, 500);
			const struct gnp_solid_options options = {seed, kinds[k], 500, GNP_SOLID_RANDOM};
			struct gnp_solid_draws draws;
			struct gnp_error error = {0};
			CHECK(gnp_solid_draws_create(&body, &options, &survey, pool, NULL, &draws, &error) == GNP_OK);
			for (size_t i = 0; i < draws.count; i++) {
				const struct gnp_solid_draw *draw = &draws.draw[i];
				struct gnp_solid_geometry g;
				double in[3], out[3], step = 1e-7 * draw->side;
				gnp_solid_face_evaluate(&body.face[draw->face], draw->p, &g);
				for (int c = 0; c < 3; c++) {
					in[c] = g.point[c] - step * g.normal[c];
					out[c] = g.point[c] + step * g.normal[c];
				}
				wrong += !holds(in) || holds(out);
				all++;
			}
			gnp_solid_draws_clear(&draws);
		}
	CHECK_AT_MOST((double)wrong, 1e-5 * (double)all); /* a point within 1e-7 of a crease may be among them */
}

/* ---- Pieces ---- */

/* Within a spacing of each other on one piece, points fit each other's paraboloids; elsewhere near each other, there
 * is an edge. Facets are the exception that solid.h names. */
static void neighbors_of_a_piece_fit_its_geometry(void)
{
	for (int kind = 0; kind < GNP_SOLID_FACETS; kind++)
		for (uint64_t seed = 0; seed < 6; seed++) {
			enum { COUNT = 2000 };
			struct gnp_solid_sample s = sample_of(kind, GNP_SOLID_RANDOM, seed, COUNT);
			size_t pairs = 0, misfits = 0;
			for (size_t i = 0; i < COUNT; i++)
				for (size_t j = 0; j < COUNT; j++) {
					const double *x = s.points + 3 * i, *y = s.points + 3 * j;
					const double *n = s.normals + 3 * i, *form = s.second_form + 9 * i;
					const double d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
					double square = gnp_dot(d, d), reach = fmin(s.spacing, 0.5 * s.edge[i]);
					double bend = norm(form);
					if (i == j || square > reach * reach || s.piece[i] != s.piece[j] || bend * s.spacing > 0.3)
						continue;
					double height = gnp_dot(n, d), fit = quadratic(form, d, d) / 2;
					pairs++;
					misfits += !(fabs(height - fit) < 0.12 * s.spacing) || gnp_dot(n, s.normals + 3 * j) < 0.8;
				}
			/* fillets may bend by more than the second forms at either end say */
			size_t limit = kind == GNP_SOLID_ROUNDED || kind == GNP_SOLID_FOLD ? pairs / 30 : pairs / 100;
			if (misfits > limit)
				fprintf(stderr, "%s, seed %d: %zu of %zu pairs do not fit\n", gnp_solid_kind_name(kind), (int)seed,
				        misfits, pairs);
			CHECK(misfits <= limit);
			gnp_solid_sample_clear(&s);
		}
}

static void pieces_differ_across_creases_and_not_across_fillets(void)
{
	int smooth = 0, sharp = 0;
	for (uint64_t seed = 0; seed < 30; seed++) {
		struct gnp_solid_sample s = sample_of(GNP_SOLID_ROUNDED, GNP_SOLID_EVEN, seed, 3000);
		bool without = isinf(s.edge[0]), one = true;
		double radius = INFINITY;
		for (size_t i = 0; i < s.count; i++) {
			const double *form = s.second_form + 9 * i;
			one = one && s.piece[i] == s.piece[0];
			double trace = form[0] + form[4] + form[8];
			radius = fmin(radius, trace ? 2 / fabs(trace) : INFINITY);
		}
		CHECK(without == one);
		if (without)
			CHECK(radius > 0.5 * s.spacing);
		smooth += without;
		sharp += !without;
		gnp_solid_sample_clear(&s);
	}
	CHECK(smooth >= 8 && sharp >= 4);
}

/* ---- Edges ---- */

/* On a box the nearest edge is where the nearest of the four planes across is met. */
static void edges_of_a_box_are_where_its_planes_meet(void)
{
	for (uint64_t seed = 0; seed < 10; seed++) {
		struct gnp_solid_sample s = sample_of(GNP_SOLID_BOX, GNP_SOLID_RANDOM, seed, 3000);
		double plane[6][4], worst = 0;
		for (size_t i = 0; i < s.count; i++) {
			CHECK(s.piece[i] < 6);
			memcpy(plane[s.piece[i]], s.normals + 3 * i, 3 * sizeof(double));
			plane[s.piece[i]][3] = gnp_dot(s.normals + 3 * i, s.points + 3 * i);
		}
		for (size_t i = 0; i < s.count; i++) {
			double nearest = INFINITY;
			for (int p = 0; p < 6; p++)
				if (fabs(gnp_dot(plane[p], s.normals + 3 * i)) < 0.5)
					nearest = fmin(nearest, plane[p][3] - gnp_dot(plane[p], s.points + 3 * i));
			worst = worse(worst, fabs(s.edge[i] - nearest) / s.spacing);
		}
		CHECK_AT_MOST(worst, 0.2);
		gnp_solid_sample_clear(&s);
	}
}

/* A sphere of radius 1/2 less the half space x > 0.3: the edge is a circle of radius 0.4. */
static void edge_of_a_cut_sphere_is_a_circle(void)
{
	const struct gnp_solid_frame middle = gnp_solid_frame_at(0, 0, 0), aside = gnp_solid_frame_at(1.3, 0.1, 0.2);
	const struct gnp_solid_arc sphere = {0, 0.5, {-M_PI / 2, M_PI / 2}, {0, 2 * M_PI}};
	struct gnp_solid_creases creases;
	struct gnp_error error = {0};
	struct gnp_random random;
	double spacing = 0.03, worst = 0;
	memset(&body, 0, sizeof body);
	gnp_solid_body_primitive(&body, GNP_SOLID_UNION);
	gnp_solid_body_half(&body, gnp_solid_body_arc(&body, 0, &middle, &sphere));
	gnp_solid_build_block(&body, GNP_SOLID_DIFFERENCE, &aside, (double[3]){1, 1, 1});
	gnp_solid_body_measure(&body);
	CHECK(gnp_solid_creases_create(&body, spacing, 1, pool, NULL, &creases, &error) == GNP_OK);
	CHECK(creases.count > 300);
	gnp_random_seed(&random, 3, 3);
	for (int i = 0; i < 2000; i++) {
		double x[3];
		for (int c = 0; c < 3; c++)
			x[c] = gnp_random_normal(&random) / 3;
		double exact = hypot(x[0] - 0.3, hypot(x[1], x[2]) - 0.4);
		worst = worse(worst, fabs(gnp_solid_creases_distance(&creases, x) - exact) / spacing);
	}
	CHECK_AT_MOST(worst, 0.1);
	gnp_solid_creases_clear(&creases);
}

static void the_nearest_stroke_is_found(void)
{
	body_make(GNP_SOLID_CSG, 3, 2000);
	struct gnp_solid_creases creases;
	struct gnp_error error = {0};
	struct gnp_random random;
	CHECK(gnp_solid_creases_create(&body, 0.03, 1, pool, NULL, &creases, &error) == GNP_OK);
	gnp_random_seed(&random, 1, 1);
	for (int i = 0; i < 300; i++) {
		double x[3], best = INFINITY;
		for (int c = 0; c < 3; c++)
			x[c] = gnp_random_normal(&random) / 3;
		for (size_t k = 0; k < creases.count; k++) {
			const struct gnp_solid_stroke *stroke = &creases.stroke[k];
			double d[3] = {x[0] - stroke->middle[0], x[1] - stroke->middle[1], x[2] - stroke->middle[2]};
			double t = fmin(1, fmax(-1, gnp_dot(d, stroke->half) / gnp_dot(stroke->half, stroke->half))), foot[3];
			for (int c = 0; c < 3; c++)
				foot[c] = stroke->middle[c] + t * stroke->half[c];
			best = fmin(best, distance(x, foot));
		}
		CHECK_NEAR(gnp_solid_creases_distance(&creases, x), best, 1e-12);
	}
	gnp_solid_creases_clear(&creases);
}

/* ---- Samplings ---- */

/* Distances to the nearest other point in spacings, ascending, and the directions there in the order of points. */
static void nearest_of(const struct gnp_solid_sample *s, double *near, double (*direction)[3])
{
	for (size_t i = 0; i < s->count; i++) {
		double best = INFINITY;
		size_t other = i;
		for (size_t j = 0; j < s->count; j++) {
			double d = i == j ? INFINITY : distance(s->points + 3 * i, s->points + 3 * j);
			other = d < best ? j : other;
			best = fmin(best, d);
		}
		for (int c = 0; c < 3; c++)
			direction[i][c] = (s->points[3 * other + (size_t)c] - s->points[3 * i + (size_t)c]) / best;
		near[i] = best / s->spacing;
	}
	qsort(near, s->count, sizeof *near, gnp_double_compare);
}

static void samplings_are_what_they_are_called(void)
{
	enum { COUNT = 2000 };
	static double near[COUNT], direction[COUNT][3];
	for (uint64_t seed = 0; seed < 6; seed++) {
		struct gnp_solid_sample even = sample_of(GNP_SOLID_CSG, GNP_SOLID_EVEN, seed, COUNT);
		nearest_of(&even, near, direction);
		CHECK_AT_MOST(0.5, near[COUNT / 100]);
		CHECK_NEAR(near[COUNT / 2], 0.83, 0.12);
		struct gnp_solid_sample random = sample_of(GNP_SOLID_CSG, GNP_SOLID_RANDOM, seed, COUNT);
		nearest_of(&random, near, direction);
		CHECK_NEAR(near[COUNT / 2], sqrt(log(2) / M_PI), 0.05); /* of a Poisson process */
		CHECK_NEAR(near[COUNT / 10], sqrt(log(1 / 0.9) / M_PI), 0.04);
		CHECK_NEAR(random.spacing, even.spacing, 0);
		gnp_solid_sample_clear(&even);
		gnp_solid_sample_clear(&random);
	}
}

/* Nearest points are in one row, nearer than a spacing, and rows are parallel. */
static void lines_are_rows(void)
{
	enum { COUNT = 2000 };
	static double near[COUNT], direction[COUNT][3];
	double least = INFINITY, most = 0;
	for (uint64_t seed = 0; seed < 12; seed++) {
		struct gnp_solid_sample s = sample_of(GNP_SOLID_PLATE, GNP_SOLID_LINES, seed, COUNT);
		nearest_of(&s, near, direction);
		size_t along = 0;
		for (size_t i = 0; i < COUNT; i++) {
			size_t same = 0, all = 0; /* near points of the same piece whose row runs the same way */
			for (size_t j = 0; j < COUNT; j++)
				if (s.piece[i] == s.piece[j] && distance(s.points + 3 * i, s.points + 3 * j) < 3 * s.spacing) {
					same += fabs(gnp_dot(direction[i], direction[j])) > 0.95;
					all++;
				}
			along += same >= all * 7 / 10;
		}
		CHECK(along > COUNT * 7 / 10);
		CHECK_AT_MOST(near[COUNT * 9 / 10], 1.4 * near[COUNT / 10]); /* even steps */
		least = fmin(least, near[COUNT / 2]);
		most = fmax(most, near[COUNT / 2]);
		gnp_solid_sample_clear(&s);
	}
	CHECK(least > 0.15 && least < 0.45 && most > 0.45 && most < 0.85);
}

static void densities_vary(void)
{
	enum { COUNT = 2000 };
	static double near[COUNT], direction[COUNT][3];
	for (int sampling = GNP_SOLID_GRADIENT; sampling <= GNP_SOLID_STRIPES; sampling++)
		for (uint64_t seed = 0; seed < 4; seed++) {
			struct gnp_solid_sample s = sample_of(GNP_SOLID_PATCH, sampling, seed, COUNT);
			nearest_of(&s, near, direction);
			/* of a Poisson process of one density the ratio is 3.21 */
			CHECK_AT_MOST(3.35, near[COUNT * 9 / 10] / near[COUNT / 5]);
			CHECK(near[COUNT / 2] < 0.46);
			gnp_solid_sample_clear(&s);
		}
}

/* ---- All ---- */

static void check_whole(const struct gnp_solid_sample *s, size_t count)
{
	double worst = 0, low = INFINITY;
	CHECK(s->count == count && s->spacing > 0);
	for (size_t i = 0; i < count; i++) {
		worst = worse(worst, fabs(gnp_dot(s->normals + 3 * i, s->normals + 3 * i) - 1));
		for (int c = 0; c < 9; c++)
			worst = worse(worst, isfinite(s->second_form[9 * i + (size_t)c]) ? 0 : 1);
		for (int c = 0; c < 3; c++)
			worst = worse(worst, fmax(0, fabs(s->points[3 * i + (size_t)c]) - 1));
		low = fmin(low, s->edge[i] >= 0 ? s->edge[i] : -1);
	}
	CHECK_AT_MOST(worst, 1e-9);
	CHECK(low >= 0);
}

/* GNP_SOLID_SEEDS=20 runs more of them. */
static void every_kind_has_every_sampling(void)
{
	const char *wanted = getenv("GNP_SOLID_SEEDS");
	int seeds = wanted ? atoi(wanted) : 2;
	for (int kind = 0; kind < GNP_SOLID_KIND_COUNT; kind++)
		for (int sampling = 0; sampling < GNP_SOLID_SAMPLING_COUNT; sampling++)
			for (int seed = 0; seed < seeds; seed++)
				for (size_t count = 500; count <= (wanted || seed < 1 ? 5000u : 500u); count *= 10) {
					struct gnp_solid_sample s = sample_of(kind, sampling, (uint64_t)seed, count);
					check_whole(&s, count);
					gnp_solid_sample_clear(&s);
				}
}

static void workers_change_nothing(void)
{
	static const int kinds[] = {GNP_SOLID_CSG, GNP_SOLID_ROUGH, GNP_SOLID_FACETS};
	struct gnp_pool *one = NULL;
	CHECK(gnp_pool_create(1, &one, NULL) == GNP_OK);
	for (int run = 0; run < 3 * GNP_SOLID_SAMPLING_COUNT; run++) {
		int kind = kinds[run % 3], sampling = run / 3;
		struct gnp_solid_sample a = sample_of(kind, sampling, 5, 3000);
		struct gnp_solid_sample b = sample_with(one, kind, sampling, 5, 3000);
		CHECK(memcmp(a.points, b.points, a.count * 3 * sizeof(double)) == 0);
		CHECK(memcmp(a.normals, b.normals, a.count * 3 * sizeof(double)) == 0);
		CHECK(memcmp(a.second_form, b.second_form, a.count * 9 * sizeof(double)) == 0);
		CHECK(memcmp(a.piece, b.piece, a.count * sizeof *a.piece) == 0);
		CHECK(memcmp(a.edge, b.edge, a.count * sizeof(double)) == 0);
		gnp_solid_sample_clear(&a);
		gnp_solid_sample_clear(&b);
	}
	gnp_pool_free(one);
}

static void bad_options_are_named(void)
{
	static const struct {
		struct gnp_solid_options options;
		const char *text;
	} cases[] = {
		{{1, GNP_SOLID_BOX, 15, GNP_SOLID_EVEN}, "count: got 15, need 16..1000000"},
		{{1, GNP_SOLID_BOX, 1000001, GNP_SOLID_EVEN}, "count: got 1000001"},
		{{1, -1, 500, GNP_SOLID_EVEN}, "kind: got -1"},
		{{1, GNP_SOLID_KIND_COUNT, 500, GNP_SOLID_EVEN}, "kind: got 13, need 0..12"},
		{{1, GNP_SOLID_BOX, 500, GNP_SOLID_SAMPLING_COUNT}, "sampling: got 5"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct gnp_error error = {0};
		struct gnp_solid_sample sample = {0};
		CHECK(gnp_solid_sample_create(&cases[i].options, pool, NULL, &sample, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, cases[i].text);
		CHECK(sample.points == NULL);
	}
	CHECK_STRING(gnp_solid_kind_name(GNP_SOLID_CSG), "csg");
	CHECK_STRING(gnp_solid_kind_name(GNP_SOLID_FACETS), "facets");
	CHECK_STRING(gnp_solid_sampling_name(GNP_SOLID_STRIPES), "stripes");
	CHECK(!gnp_solid_kind_name(GNP_SOLID_KIND_COUNT) && !gnp_solid_sampling_name(-1));
}

static void cancelled_work_stops(void)
{
	const struct gnp_solid_options options = {1, GNP_SOLID_CSG, 2000, GNP_SOLID_EVEN};
	struct gnp_solid_sample sample = {0};
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_solid_sample_create(&options, pool, &task, &sample, NULL) == GNP_CANCELLED);
	CHECK(sample.points == NULL);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(faces_have_the_geometry_of_their_levels),
		TEST(draws_are_uniform_by_area),
		TEST(points_of_boolean_bodies_part_inside_from_outside),
		TEST(neighbors_of_a_piece_fit_its_geometry),
		TEST(pieces_differ_across_creases_and_not_across_fillets),
		TEST(edges_of_a_box_are_where_its_planes_meet),
		TEST(edge_of_a_cut_sphere_is_a_circle),
		TEST(the_nearest_stroke_is_found),
		TEST(samplings_are_what_they_are_called),
		TEST(lines_are_rows),
		TEST(densities_vary),
		TEST(every_kind_has_every_sampling),
		TEST(workers_change_nothing),
		TEST(bad_options_are_named),
		TEST(cancelled_work_stops),
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
