#include "core/cells/front.h"
#include "core/linear/linalg.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

/* A cloud with its triangles, and what a front from some of its points found, in the caller's order. */
struct ground {
	size_t count;
	struct gnp_prepared prepared;
	struct gnp_fans shared;
	double *distance, *vector, *start; /* (count), (count, 3), (count, 3) */
};

static void lay(struct ground *ground, size_t count, const double *points, const double *normals)
{
	struct gnp_fans fans;
	const struct gnp_cloud cloud = {count, points, normals};
	*ground = (struct ground){.count = count, .distance = calloc(count, sizeof(double)),
	                          .vector = calloc(count, 3 * sizeof(double)), .start = calloc(count, 3 * sizeof(double))};
	CHECK(gnp_prepare(&cloud, pool, NULL, &ground->prepared, NULL) == GNP_OK);
	CHECK(gnp_fans_make(&ground->prepared, pool, NULL, &fans, NULL) == GNP_OK);
	CHECK(gnp_fans_share(&fans, &ground->prepared, &ground->shared, NULL) == GNP_OK);
	gnp_fans_clear(&fans);
}

static void clear(struct ground *ground)
{
	gnp_prepared_clear(&ground->prepared);
	gnp_fans_clear(&ground->shared);
	free(ground->distance);
	free(ground->vector);
	free(ground->start);
}

static void reorder(const struct ground *ground, size_t width, double *values)
{
	double *copy = malloc(ground->count * width * sizeof *copy);
	memcpy(copy, values, ground->count * width * sizeof *copy);
	for (size_t i = 0; i < ground->count; i++)
		memcpy(values + ground->prepared.order[i] * width, copy + i * width, width * sizeof *copy);
	free(copy);
}

/* From the points that are marked (count, in the caller's order), each with a vector that points along the axis. */
static void spread(struct ground *ground, const unsigned char *source, const double along[3])
{
	const double *normals = ground->prepared.normals;
	uint32_t *sources = malloc(ground->count * sizeof *sources);
	const struct gnp_carried carried = {ground->vector, ground->start};
	size_t found = 0;
	for (uint32_t i = 0; i < ground->count; i++) {
		if (!source[ground->prepared.order[i]])
			continue;
		sources[found++] = i;
		for (size_t c = 0; c < 3; c++)
			ground->vector[3 * i + c] = along[c] - gnp_dot(along, normals + 3 * i) * normals[3 * i + c];
	}
	CHECK(gnp_front_find(&ground->prepared, &ground->shared, sources, found, &carried, NULL, NULL, ground->distance,
	                     NULL) == GNP_OK);
	reorder(ground, 1, ground->distance);
	reorder(ground, 3, ground->vector);
	reorder(ground, 3, ground->start);
	free(sources);
}

/* A front from one point. */
static void spread_from(struct ground *ground, size_t point, const double along[3])
{
	unsigned char *source = calloc(ground->count, 1);
	source[point] = 1;
	spread(ground, source, along);
	free(source);
}

static double angle_between(const double *a, const double *b)
{
	double cross[3];
	gnp_cross(a, b, cross);
	return atan2(sqrt(gnp_dot(cross, cross)), gnp_dot(a, b));
}

enum { SIDE = 300, MANY = SIDE * SIDE };

static uint64_t state = 1;

static double draw(void)
{
	state = state * UINT64_C(6364136223846793005) + 1442695040888963407;
	return (double)(state >> 11) / 9007199254740992.0;
}

/* The unit square, inner points moved by so many spacings at most; z = 0. Freed by the caller. */
static double *make_square(double jitter)
{
	double *points = calloc(6 * MANY, sizeof *points);
	for (size_t i = 0; i < MANY; i++) {
		size_t at[2] = {i / SIDE, i % SIDE};
		bool inner = at[0] % (SIDE - 1) && at[1] % (SIDE - 1);
		for (size_t c = 0; c < 2; c++)
			points[3 * i + c] = ((double)at[c] + (inner ? jitter * (2 * draw() - 1) : 0)) / (SIDE - 1);
		points[3 * MANY + 3 * i + 2] = 1;
	}
	return points;
}

/* Mean error over mean distance. */
static double mean_error(const double *got, const double *want, size_t count)
{
	double error = 0, mean = 0;
	for (size_t i = 0; i < count; i++) {
		error += fabs(got[i] - want[i]);
		mean += want[i];
	}
	return error / mean;
}

static const double east[3] = {1, 0, 0};

static void many_sources_are_as_exact_as_one(void)
{
	unsigned char *source = calloc(MANY, 1);
	double *want = malloc(MANY * sizeof *want);
	for (int jitter = 0; jitter < 2; jitter++) {
		double *points = make_square(0.3 * jitter);
		struct ground ground;
		lay(&ground, MANY, points, points + 3 * MANY);
		for (size_t i = 0; i < MANY; i++) {
			const double *p = points + 3 * i;
			want[i] = fmin(fmin(p[0], 1 - p[0]), fmin(p[1], 1 - p[1]));
			source[i] = want[i] < 1e-9;
		}
		spread(&ground, source, east);
		CHECK_AT_MOST(mean_error(ground.distance, want, MANY), jitter ? 1e-3 : 1e-9);
		for (size_t i = 0; i < MANY; i++)
			source[i] = draw() < 0.1;
		struct gnp_neighbors *index = NULL;
		struct gnp_scratch *scratch = gnp_scratch_create();
		double *places = malloc(3 * MANY * sizeof *places);
		uint32_t *nearest = malloc(MANY * sizeof *nearest);
		size_t sources = 0;
		for (size_t i = 0; i < MANY; i++)
			if (source[i])
				memcpy(places + 3 * sources++, points + 3 * i, 3 * sizeof *places);
		CHECK(gnp_neighbors_build(places, sources, &index, NULL) == GNP_OK);
		CHECK(gnp_neighbors_knn(index, points, MANY, 1, nearest, want, scratch, NULL) == GNP_OK);
		spread(&ground, source, east);
		CHECK_AT_MOST(mean_error(ground.distance, want, MANY), 1e-3);
		gnp_neighbors_free(index);
		gnp_scratch_free(scratch);
		free(nearest);
		free(places);
		clear(&ground);
		free(points);
	}
	free(want);
	free(source);
}

/* Rows sixteen times as far apart as points in a row; the straight line is exact. */
static void scan_lines_are_crossed(void)
{
	enum { ROW = 160, ROWS = 10, COUNT = ROW * ROWS };
	double *points = calloc(6 * COUNT, sizeof *points), *want = malloc(COUNT * sizeof *want);
	struct ground ground;
	for (size_t i = 0; i < COUNT; i++) {
		points[3 * i] = (double)(i % ROW) + 0.6 * draw();
		points[3 * i + 1] = 16.0 * (double)(i / ROW);
		points[3 * COUNT + 3 * i + 2] = 1;
	}
	for (size_t i = 0; i < COUNT; i++)
		want[i] = hypot(points[3 * i] - points[3 * 880], points[3 * i + 1] - points[3 * 880 + 1]);
	lay(&ground, COUNT, points, points + 3 * COUNT);
	spread_from(&ground, 880, east);
	CHECK_AT_MOST(mean_error(ground.distance, want, COUNT), 1e-3);
	clear(&ground);
	free(want);
	free(points);
}

/* A wall with a way around its end: the way turns there. */
static void ways_lead_around_walls(void)
{
	double *points = make_square(0), *want = malloc(MANY * sizeof *want);
	size_t count = 0, source = 0;
	for (size_t i = 0; i < MANY; i++) {
		const double *p = points + 3 * i;
		if (fabs(p[0] - 0.5) < 0.02 && p[1] < 0.7)
			continue;
		memmove(points + 3 * count++, p, 3 * sizeof *points);
	}
	for (size_t i = 0; i < count; i++) {
		const double *p = points + 3 * i;
		if (hypot(p[0] - 0.25, p[1] - 0.25) < hypot(points[3 * source] - 0.25, points[3 * source + 1] - 0.25))
			source = i;
	}
	const double *o = points + 3 * source;
	static const double ends[2][2] = {{143.0 / 299, 210.0 / 299}, {156.0 / 299, 210.0 / 299}};
	for (size_t i = 0; i < count; i++) {
		const double *p = points + 3 * i;
		double first = hypot(ends[0][0] - o[0], ends[0][1] - o[1]);
		bool seen = p[0] < 0.5 || (p[1] - o[1]) / (p[0] - o[0]) > (ends[0][1] - o[1]) / (ends[0][0] - o[0]);
		bool beside = p[1] > ends[0][1] - 1e-9;
		want[i] = seen ? hypot(p[0] - o[0], p[1] - o[1])
		          : beside ? first + hypot(p[0] - ends[0][0], p[1] - ends[0][1])
		                   : first + 13.0 / 299 + hypot(p[0] - ends[1][0], p[1] - ends[1][1]);
	}
	struct ground ground;
	lay(&ground, count, points, points + 3 * MANY);
	spread_from(&ground, source, east);
	/* triangles round the wall's corners by a few spacings */
	CHECK_AT_MOST(mean_error(ground.distance, want, count), 0.015);
	clear(&ground);
	free(want);
	free(points);
}

/* Random points of a cylinder of radius 1, by angle and height: it unrolls, and what is carried keeps its parts. */
static void a_cylinder_unrolls(void)
{
	enum { COUNT = 8000 };
	double *points = malloc(6 * COUNT * sizeof *points), (*flat)[2] = malloc(COUNT * sizeof *flat);
	for (size_t i = 0; i < COUNT; i++) {
		flat[i][0] = i ? 6.283185307179586 * draw() - 3.141592653589793 : 0;
		flat[i][1] = i ? 2 * draw() - 1 : 0;
		for (size_t k = 0; k < 2; k++)
			memcpy(points + 3 * (k * COUNT + i), (double[]){cos(flat[i][0]), sin(flat[i][0]), k ? 0 : flat[i][1]},
			       3 * sizeof *points);
	}
	struct ground ground;
	lay(&ground, COUNT, points, points + 3 * COUNT);
	spread_from(&ground, 0, (double[]){0, 3, 4});
	double off[3] = {0}, mean = 0;
	for (size_t i = 1; i < COUNT; i++) {
		double far = hypot(flat[i][0], flat[i][1]), *v = ground.vector + 3 * i, *start = ground.start + 3 * i;
		const double want[3] = {-3 * sin(flat[i][0]), 3 * cos(flat[i][0]), 4};
		mean += far / COUNT;
		off[0] += fabs(ground.distance[i] - far) / COUNT;
		off[1] += angle_between(start, (double[]){0, flat[i][0], flat[i][1]}) / COUNT;
		off[2] += angle_between(v, want) / COUNT;
		CHECK_NEAR(gnp_dot(v, v), 25, 1e-6);
		CHECK_NEAR(gnp_dot(start, start), 1, 1e-9);
		CHECK_NEAR(gnp_dot(v, points + 3 * (COUNT + i)), 0, 1e-9);
	}
	CHECK_AT_MOST(off[0], 0.001 * mean);
	CHECK_AT_MOST(off[1], 0.001);
	CHECK_AT_MOST(off[2], 0.001);
	clear(&ground);
	free(flat);
	free(points);
}

/* Along great circles a vector turns with the plane. Near the point opposite there is no shortest way. */
static void vectors_go_along_great_circles(void)
{
	enum { COUNT = 10000 };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = COUNT, .seed = 7}, pool);
	struct ground ground;
	const double along[3] = {1, 0.3, 0.2}, *o = sample.points;
	lay(&ground, COUNT, sample.points, sample.normals);
	spread_from(&ground, 0, along);
	double off[3] = {0}, worst = 0, far = 0;
	for (size_t i = 1; i < COUNT; i++) {
		const double *p = sample.points + 3 * i;
		double v[3], start[3], cosine = gnp_dot(o, p);
		double part = (gnp_dot(p, along) - gnp_dot(o, along) * cosine) / (1 + cosine);
		if (angle_between(o, p) > 2.8)
			continue;
		for (int c = 0; c < 3; c++) {
			v[c] = along[c] - gnp_dot(along, o) * o[c] - part * (o[c] + p[c]);
			start[c] = p[c] - cosine * o[c];
		}
		far += angle_between(o, p) / COUNT;
		off[0] += fabs(ground.distance[i] - angle_between(o, p)) / COUNT;
		off[1] += angle_between(ground.start + 3 * i, start) / COUNT;
		off[2] += angle_between(ground.vector + 3 * i, v) / COUNT;
		worst = fmax(worst, angle_between(ground.vector + 3 * i, v));
	}
	CHECK_AT_MOST(off[0], 0.003 * far);
	CHECK_AT_MOST(off[1], 0.002);
	CHECK_AT_MOST(off[2], 0.002);
	CHECK_AT_MOST(worst, 0.05);
	clear(&ground);
	gnp_sample_clear(&sample);
}

/* To the same distance as one that goes everywhere, and not much farther. */
static void a_front_ends_at_its_goals(void)
{
	double *points = make_square(0.3), *all = malloc(MANY * sizeof *all);
	struct ground ground;
	lay(&ground, MANY, points, points + 3 * MANY);
	const uint32_t source = 17, goals[] = {18, 400, 900, 17};
	const struct gnp_front_goals given = {goals, 4, 2 * gnp_fans_longest_edge(&ground.shared, &ground.prepared)};
	CHECK(gnp_front_find(&ground.prepared, &ground.shared, &source, 1, NULL, NULL, NULL, all, NULL) == GNP_OK);
	CHECK(gnp_front_find(&ground.prepared, &ground.shared, &source, 1, NULL, &given, NULL, ground.distance,
	                     NULL) == GNP_OK);
	for (size_t g = 0; g < 4; g++)
		CHECK(ground.distance[goals[g]] == all[goals[g]]);
	size_t reached = 0;
	for (size_t i = 0; i < MANY; i++)
		reached += isfinite(ground.distance[i]) != 0;
	CHECK(reached > 900 && reached < MANY / 4);
	clear(&ground);
	free(all);
	free(points);
}

/* The square's triangles are each in three stars, and one put over it like a bridge is in none. */
static void steep_triangles_are_left_out(void)
{
	double *points = make_square(0);
	const struct gnp_cloud cloud = {MANY, points, points + 3 * MANY};
	struct gnp_prepared prepared;
	struct gnp_fans fans, shared, bridged;
	CHECK(gnp_prepare(&cloud, pool, NULL, &prepared, NULL) == GNP_OK);
	CHECK(gnp_fans_make(&prepared, pool, NULL, &fans, NULL) == GNP_OK);
	CHECK(gnp_fans_share(&fans, &prepared, &shared, NULL) == GNP_OK);
	CHECK(shared.start[MANY] == fans.start[MANY] && fans.start[MANY] == (size_t)6 * (SIDE - 1) * (SIDE - 1));
	for (size_t c = 0; c < 3; c++) /* a point far above another: its triangles stand upright */
		prepared.points[3 * 1000 + c] = prepared.points[3 * 40000 + c] + (c == 2);
	fans.corner[fans.start[40000]][0] = 1000;
	CHECK(gnp_fans_share(&fans, &prepared, &bridged, NULL) == GNP_OK);
	size_t bridges = 0;
	for (size_t t = bridged.start[40000]; t < bridged.start[40001]; t++)
		bridges += bridged.corner[t][0] == 1000 || bridged.corner[t][1] == 1000;
	CHECK(bridges == 0);
	gnp_fans_clear(&bridged);
	gnp_fans_clear(&shared);
	gnp_fans_clear(&fans);
	gnp_prepared_clear(&prepared);
	free(points);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(many_sources_are_as_exact_as_one), TEST(scan_lines_are_crossed),
	                                    TEST(ways_lead_around_walls), TEST(a_cylinder_unrolls),
	                                    TEST(vectors_go_along_great_circles), TEST(a_front_ends_at_its_goals),
	                                    TEST(steep_triangles_are_left_out)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
