/* What equations say of themselves: nothing on clouds that resolve their surface, the reason on those that do not. */
#include "core/geodesic/geodesic_check.h"
#include "core/base/random.h"
#include "core/geodesic/geodesic.h"
#include "core/equations/heat.h"
#include "core/equations/spectrum.h"
#include "core/linear/linalg.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

enum { SIDE = 40, MOST = 4000 };

/* A cloud with a column of numbers beside it. */
struct given {
	size_t count;
	double points[3 * MOST], column[MOST];
};
static struct given given;

static void add(double x, double y, double z)
{
	double *p = given.points + 3 * given.count;
	p[0] = x, p[1] = y, p[2] = z;
	given.column[given.count++] = 1;
}

/* Points of a unit sphere drawn without any distance between them. */
static void make_random_sphere(uint64_t seed)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 0);
	given.count = 0;
	while (given.count < 2000) {
		double x = gnp_random_normal(&random), y = gnp_random_normal(&random), z = gnp_random_normal(&random), r = sqrt(x * x + y * y + z * z);
		add(x / r, y / r, z / r);
	}
}

static void make_sphere(size_t count, double below)
{
	given.count = 0;
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z), turn = 2.39996323 * (double)i;
		if (z < below)
			add(r * cos(turn), r * sin(turn), z);
	}
}

/* As a grid's lines cross a sphere: of each of three directions. */
static void make_grid_crossings(void)
{
	given.count = 0;
	for (int i = 0; i < 27; i++)
		for (int j = 0; j < 27; j++) {
			double u = -1.187 + 2.4 / 26 * i, v = -1.187 + 2.4 / 26 * j, w = sqrt(fmax(0, 1 - u * u - v * v));
			if (u * u + v * v >= 1)
				continue;
			add(u, v, w), add(u, v, -w), add(w, u, v), add(-w, u, v), add(v, w, u), add(v, -w, u);
		}
}

static void make_latitudes(void)
{
	given.count = 0;
	for (int t = 0; t < SIDE; t++)
		for (int p = 0; p < 2 * SIDE; p++) {
			double theta = M_PI * (t + 0.5) / SIDE, phi = M_PI * p / SIDE;
			add(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
		}
}

static void make_square(double jitter)
{
	struct gnp_random random;
	gnp_random_seed(&random, 2, 0);
	given.count = 0;
	for (int a = 0; a < SIDE; a++)
		for (int b = 0; b < SIDE; b++) {
			double x = a + jitter * (2 * gnp_random_uniform(&random) - 1), y = b + jitter * (2 * gnp_random_uniform(&random) - 1);
			add(x / (SIDE - 1), y / (SIDE - 1), 0);
		}
}

/* A spiral sheet whose turns lie `gap` spacings apart. */
static void make_roll(double gap)
{
	const double spacing = 0.06, rise = gap * spacing / (2 * M_PI);
	given.count = 0;
	for (double t = 0; t < 6 * M_PI && given.count + 17 < MOST; t += spacing / (1 + rise * t))
		for (int k = 0; k < 16; k++)
			add((1 + rise * t) * cos(t), (1 + rise * t) * sin(t), spacing * k);
}

static struct gnp_poisson_options options_of(void)
{
	struct gnp_poisson_options options = gnp_poisson_defaults();
	options.laplacian.domain.estimate.k = 50;
	return options;
}

static const char *text_of(const struct gnp_task *task, enum gnp_warning_kind kind)
{
	return task->warnings.text[kind];
}

static struct gnp_cloud cloud_of(void)
{
	return (struct gnp_cloud){given.count, given.points, NULL};
}

static void check_status(gnp_status status, const struct gnp_error *error)
{
	if (status != GNP_OK)
		fprintf(stderr, "%s\n", error->text);
	CHECK(status == GNP_OK);
}

/* The matrix; a solution, given at `fixed` (NULL: nowhere); heat of the column; the lowest eigenvalues. */
static void laplacian_warns(struct gnp_task *task)
{
	struct gnp_error error = {0};
	struct gnp_cloud cloud = cloud_of();
	struct gnp_poisson_options options = options_of();
	struct gnp_collocation made = {0};
	gnp_task_init(task);
	check_status(gnp_laplacian_run(&cloud, &options.laplacian, pool, task, &made, NULL, &error), &error);
	gnp_collocation_clear(&made);
}

static double poisson_warns(const unsigned char *fixed, struct gnp_task *task)
{
	struct gnp_error error = {0};
	struct gnp_cloud cloud = cloud_of();
	struct gnp_poisson_options options = options_of();
	struct gnp_poisson *poisson = NULL;
	struct gnp_poisson_report report = {.energy = NAN};
	static double source[MOST], zeros[MOST], solution[MOST];
	gnp_task_init(task);
	options.fixed = fixed;
	for (size_t i = 0; i < cloud.count; i++)
		source[i] = given.points[3 * i] - 0.3 * given.points[3 * i + 1];
	gnp_status status = gnp_poisson_prepare(&cloud, &options, pool, task, &poisson, &error);
	if (status == GNP_OK)
		status = gnp_poisson_solve(poisson, source, zeros, 1, pool, task, solution, &report, &error);
	check_status(status, &error);
	gnp_poisson_release(poisson);
	return report.energy;
}

static gnp_status heat_warns(double dt, size_t steps, struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_cloud cloud = cloud_of();
	struct gnp_poisson_options options = options_of();
	struct gnp_poisson *poisson = NULL;
	gnp_task_init(task);
	gnp_status status = gnp_heat_prepare(&cloud, &options, &(struct gnp_heat_options){.dt = dt}, pool, task, &poisson, error);
	if (status == GNP_OK)
		status = gnp_heat_run(poisson, &(struct gnp_heat_options){.dt = dt, .steps = steps},
		                      &(struct gnp_heat_field){.count = 1, .u = given.column}, pool, task, error);
	gnp_poisson_release(poisson);
	return status;
}

static void spectrum_warns(size_t count, struct gnp_task *task)
{
	struct gnp_error error = {0};
	struct gnp_cloud cloud = cloud_of();
	struct gnp_poisson_options options = options_of();
	struct gnp_spectrum spectrum = {.count = 0};
	gnp_task_init(task);
	const struct gnp_spectrum_wanted wanted = {count, 0, 1e-6};
	check_status(gnp_spectrum_run(&cloud, &options, &wanted, pool, task, &spectrum, &error), &error);
	gnp_spectrum_clear(&spectrum);
}

static void geodesic_warns(const uint32_t *sources, size_t count, struct gnp_task *task)
{
	struct gnp_error error = {0};
	struct gnp_cloud cloud = cloud_of();
	struct gnp_poisson_options options = options_of();
	struct gnp_geodesic *geodesic = NULL;
	static double distance[MOST];
	gnp_task_init(task);
	gnp_status status = gnp_geodesic_create(&cloud, &options.laplacian.domain, pool, task, &geodesic, &error);
	if (status == GNP_OK)
		status = gnp_geodesic_distance(geodesic, sources, count, pool, task, distance, &error);
	check_status(status, &error);
	gnp_geodesic_free(geodesic);
}

static void check_silent(const struct gnp_task *task, const char *what)
{
	for (int kind = 0; kind < GNP_WARNING_KINDS; kind++)
		if (task->warnings.text[kind][0])
			fprintf(stderr, "%s: %s\n", what, task->warnings.text[kind]);
	CHECK(gnp_warnings_count(&task->warnings) == 0);
}

static void take_sample(const char *name, size_t count)
{
	struct gnp_sample sample = sample_of(name, &(struct gnp_sample_options){.count = count, .seed = 5}, pool);
	given.count = 0;
	for (size_t i = 0; i < count; i++)
		add(sample.points[3 * i], sample.points[3 * i + 1], sample.points[3 * i + 2]);
	gnp_sample_clear(&sample);
}

static void clouds_that_resolve_their_surface_are_not_warned_of(void)
{
	static const char *const shapes[] = {"sphere", "torus", "genus2", "radial"};
	struct gnp_task task;
	struct gnp_error error = {0};
	for (size_t s = 0; s < 4; s++) {
		const uint32_t sources[] = {7, 1500};
		take_sample(shapes[s], 3000);
		laplacian_warns(&task);
		check_silent(&task, shapes[s]);
		CHECK_NEAR(poisson_warns(NULL, &task), 1, 0.1);
		CHECK(!text_of(&task, GNP_WARNING_OPERATOR)[0] && !text_of(&task, GNP_WARNING_CROSSINGS)[0]);
		for (size_t i = 0; i < given.count; i++)
			given.column[i] = i % 7 == 0;
		CHECK(heat_warns(1e-3, 3, &task, &error) == GNP_OK);
		check_silent(&task, shapes[s]);
		spectrum_warns(40, &task);
		check_silent(&task, shapes[s]);
		geodesic_warns(sources, 2, &task);
		check_silent(&task, shapes[s]);
	}
}

/* Every way of asking on clouds too uneven for it. */
static void uneven_clouds_are_told(void)
{
	struct gnp_task task;
	struct gnp_error error = {0};
	for (uint64_t cloud = 1; cloud <= 5; cloud++) {
		cloud <= 3 ? make_random_sphere(cloud) : cloud == 4 ? make_grid_crossings() : make_latitudes();
		laplacian_warns(&task);
		CHECK_CONTAINS(text_of(&task, GNP_WARNING_STENCILS), "% of the rows, more than 0.25 %, have a weight of their own that is positive or less than");
		poisson_warns(NULL, &task);
		CHECK_CONTAINS(text_of(&task, GNP_WARNING_OPERATOR), "solutions of random right-hand sides have ");
		CHECK_CONTAINS(text_of(&task, GNP_WARNING_OPERATOR), "need 0.5 to 1.5");
		CHECK(heat_warns(1e-2, 1, &task, &error) == GNP_OK);
		CHECK_CONTAINS(text_of(&task, GNP_WARNING_OPERATOR), "not to be believed");
		spectrum_warns(10, &task);
		CHECK_CONTAINS(text_of(&task, GNP_WARNING_OPERATOR), "not to be believed");
	}
}

static void eigenvalues_that_are_none_are_told(void)
{
	struct gnp_task task;
	make_grid_crossings();
	spectrum_warns(10, &task);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_EIGENVALUES), "to a second discretisation its vector is one of ");
	make_square(0.3);
	spectrum_warns(6, &task);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_EIGENVALUES), "-Delta has none below 0");
}

/* The natural condition is what the second discretisation has; where the edge is given, there is nothing to say. */
static void open_surfaces_need_values_at_their_edge(void)
{
	static unsigned char edge[MOST];
	struct gnp_task task;
	make_square(0);
	poisson_warns(NULL, &task);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_OPERATOR), "the surface has a boundary (");
	for (int i = 0; i < SIDE * SIDE; i++)
		edge[i] = i / SIDE < 2 || i / SIDE >= SIDE - 2 || i % SIDE < 2 || i % SIDE >= SIDE - 2;
	CHECK_NEAR(poisson_warns(edge, &task), 1, 0.2);
	CHECK(!text_of(&task, GNP_WARNING_OPERATOR)[0]);
}

static void heat_beyond_its_range_is_told(void)
{
	struct gnp_task task;
	struct gnp_error error = {0};
	make_square(0);
	CHECK(heat_warns(1e-2, 100, &task, &error) == GNP_OK);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_HEAT), "heat that began as this did stays within 1 and 1 (");
	make_sphere(MOST, 0.95);
	CHECK(heat_warns(1e-2, 100, &task, &error) == GNP_OK);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_HEAT), "column 0 is not to be believed: it has values from ");
	make_square(0.3);
	CHECK(heat_warns(1e-2, 3000, &task, &error) == GNP_NO_CONVERGENCE);
	CHECK_CONTAINS(error.text, "too large to go on");
}

static void distances_of_many_sources_are_not_warned_of(void)
{
	static uint32_t edge[4 * SIDE];
	struct gnp_task task;
	size_t count = 0;
	make_square(0);
	for (uint32_t i = 0; i < SIDE * SIDE; i++)
		if (i / SIDE == 0 || i / SIDE == SIDE - 1 || i % SIDE == 0 || i % SIDE == SIDE - 1)
			edge[count++] = i;
	geodesic_warns(edge, count, &task);
	CHECK_STRING(text_of(&task, GNP_WARNING_DISTANCE), "");
	geodesic_warns(edge, 1, &task);
	CHECK_STRING(text_of(&task, GNP_WARNING_DISTANCE), "");
}

/* A tenth less than the straight line: told, and lengthened to it. What is longer or infinite stays. */
static void distances_too_short_are_told(void)
{
	static double distance[SIDE * SIDE];
	struct gnp_prepared prepared;
	struct gnp_task task;
	make_square(0);
	const struct gnp_cloud cloud = cloud_of();
	CHECK(gnp_prepare(&cloud, pool, NULL, &prepared, NULL) == GNP_OK);
	const double *p = prepared.points;
	for (size_t i = 0; i < prepared.count; i++)
		distance[i] = i == 7 ? INFINITY : i == 8 ? 3 : 0.9 * hypot(p[3 * i] - p[0], p[3 * i + 1] - p[1]);
	gnp_task_init(&task);
	CHECK(gnp_geodesic_check(&prepared, &(uint32_t){0}, 1, pool, &task, distance, NULL) == GNP_OK);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_DISTANCE), "they were shorter than the straight line to the nearest ");
	for (size_t i = 0; i < prepared.count; i++)
		CHECK(i == 7 ? isinf(distance[i]) : distance[i] >= (1 - 1e-12) * hypot(p[3 * i] - p[0], p[3 * i + 1] - p[1]));
	CHECK(distance[8] == 3);
	gnp_prepared_clear(&prepared);
}

static void sheets_taken_for_one_are_told(void)
{
	struct gnp_task task;
	make_roll(3);
	geodesic_warns(&(uint32_t){0}, 1, &task);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_CROSSINGS), "leave the surface steeply for a point that faces the same way");
}

/* Every hundredth point again: the answers are those without, at both. */
static void points_at_one_place_are_merged(void)
{
	enum { ONCE = 1000, TWICE = ONCE + 10 };
	struct gnp_poisson_options options = options_of();
	struct gnp_task task;
	struct gnp_collocation made, alone;
	struct gnp_geodesic *geodesic;
	double distance[TWICE];
	make_sphere(ONCE, 2);
	for (size_t k = 0; k < 10; k++)
		memcpy(given.points + 3 * (ONCE + k), given.points + 300 * k, 3 * sizeof(double));
	struct gnp_cloud once = cloud_of(), twice = once;
	twice.count = TWICE;
	gnp_task_init(&task);
	CHECK(gnp_laplacian_run(&once, &options.laplacian, pool, NULL, &alone, NULL, NULL) == GNP_OK);
	CHECK(gnp_laplacian_run(&twice, &options.laplacian, pool, &task, &made, NULL, NULL) == GNP_OK);
	CHECK_CONTAINS(text_of(&task, GNP_WARNING_COPIES), "copies: 10 points lie where another one does, point 1000 where point 0 is");
	CHECK(made.rows == TWICE && made.columns == ONCE && alone.rows == ONCE);
	for (size_t i = 0; i < TWICE; i++) {
		size_t like = i < ONCE ? i : 100 * (i - ONCE), count = made.row_offsets[i + 1] - made.row_offsets[i];
		CHECK(count == alone.row_offsets[like + 1] - alone.row_offsets[like]);
		CHECK(memcmp(made.column + made.row_offsets[i], alone.column + alone.row_offsets[like], count * sizeof *made.column) == 0);
	}
	gnp_collocation_clear(&made);
	gnp_collocation_clear(&alone);
	CHECK(gnp_geodesic_create(&twice, &options.laplacian.domain, pool, NULL, &geodesic, NULL) == GNP_OK);
	CHECK(gnp_geodesic_distance(geodesic, (const uint32_t[]){ONCE, 0}, 2, pool, NULL, distance, NULL) == GNP_OK);
	for (size_t k = 0; k < 10; k++)
		CHECK(distance[ONCE + k] == distance[100 * k]);
	CHECK(distance[0] == 0 && distance[100] > 0);
	gnp_geodesic_free(geodesic);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(clouds_that_resolve_their_surface_are_not_warned_of), TEST(uneven_clouds_are_told),
	                                    TEST(eigenvalues_that_are_none_are_told), TEST(open_surfaces_need_values_at_their_edge),
	                                    TEST(heat_beyond_its_range_is_told),
	                                    TEST(distances_of_many_sources_are_not_warned_of),
	                                    TEST(distances_too_short_are_told),
	                                    TEST(sheets_taken_for_one_are_told), TEST(points_at_one_place_are_merged)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
