#include "core/flow/conformal.h"
#include "core/flow/flow_measure.h"

#include "tests/laws/flow_laws.h"
#include "tests/unit/test.h"

enum { COUNT = 1500 };
static const double pi = 3.14159265358979324;
static struct gnp_pool *pool;

/* ---- Clouds ---- */

static double ball(const double d[3])
{
	(void)d;
	return 1;
}

/* Two bulbs and a neck half as wide. */
static double dumbbell(const double d[3])
{
	return 0.4 + 0.6 * d[2] * d[2];
}

/* Points of a surface about the origin in the directions of a spiral, those of a sphere evenly; normals from differences. */
static struct gnp_flow_state star(double (*radius)(const double[3]), double scale, double place, double side)
{
	struct gnp_flow_state state;
	CHECK(gnp_flow_state_reserve(&state, COUNT, NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++) {
		double z = 1 - (2 * (double)i + 1) / COUNT, r = sqrt(1 - z * z), turn = 2.399963229728653 * (double)i;
		double d[3] = {r * cos(turn), r * sin(turn), z}, n[3], rho = radius(d);
		for (size_t c = 0; c < 3; c++) { /* the gradient of |x| - radius(x / |x|) */
			double p[3] = {rho * d[0], rho * d[1], rho * d[2]}, value[2];
			for (int s = 0; s < 2; s++) {
				p[c] += s ? -2e-6 : 1e-6;
				double length = sqrt(gnp_dot(p, p)), e[3] = {p[0] / length, p[1] / length, p[2] / length};
				value[s] = length - radius(e);
			}
			n[c] = value[0] - value[1];
		}
		for (size_t c = 0; c < 3; c++) {
			state.points[3 * i + c] = scale * rho * d[c] + place;
			state.normals[3 * i + c] = side * n[c] / sqrt(gnp_dot(n, n));
		}
		state.index[i] = (int64_t)i;
	}
	CHECK(gnp_flow_state_sort(&state, NULL) == GNP_OK);
	return state;
}

/* ---- Flows ---- */

struct flow {
	struct gnp_flow_state now;
	struct gnp_conformal *conformal;
	double origin[3];
};

static struct flow begun(struct gnp_flow_state state)
{
	struct flow flow = {.now = state};
	struct gnp_flow_rule rule = {.estimate = gnp_estimate_defaults(), .edges = true};
	bool finite = false;
	memcpy(flow.origin, state.points, sizeof flow.origin);
	memcpy(rule.origin, state.points, sizeof rule.origin);
	CHECK(gnp_flow_measure(&flow.now, &rule, pool, NULL, NULL, &finite, NULL) == GNP_OK && finite);
	CHECK(gnp_conformal_create(&flow.now, NULL, &flow.conformal, NULL) == GNP_OK);
	return flow;
}

static void advance(struct flow *flow, size_t steps, double dt, double volume, struct gnp_pool *workers)
{
	for (size_t s = 0; s < steps; s++) {
		struct gnp_flow_state next;
		bool finite = false;
		CHECK(gnp_conformal_step(flow->conformal, &flow->now, dt, volume, workers, NULL, &next, NULL) == GNP_OK);
		CHECK(gnp_conformal_measure(flow->conformal, &next, flow->origin, workers, NULL, &finite, NULL) == GNP_OK && finite);
		gnp_flow_state_clear(&flow->now);
		flow->now = next;
	}
}

static void end(struct flow *flow)
{
	gnp_flow_state_clear(&flow->now);
	gnp_conformal_free(flow->conformal);
}

static struct spread spread_of(const struct flow *flow)
{
	return radii(flow->now.points, flow->now.normals, flow->now.count);
}

/* ---- Tests ---- */

static void measures_of_a_sphere_are_its(void)
{
	struct flow flow = begun(star(ball, 1, 0, 1));
	bool finite = false;
	struct gnp_flow_state same = star(ball, 1, 0, 1);
	CHECK(gnp_conformal_measure(flow.conformal, &same, flow.origin, pool, NULL, &finite, NULL) == GNP_OK && finite);
	CHECK_NEAR(same.total_area, flow.now.total_area, 1e-12 * flow.now.total_area);
	CHECK_NEAR(same.total_area, 4 * pi, 0.02 * 4 * pi);
	CHECK_NEAR(same.volume, 4 * pi / 3, 0.02 * 4 * pi / 3);
	double sum = 0;
	for (size_t i = 0; i < COUNT; i++) {
		CHECK_NEAR(gnp_dot(same.normals + 3 * i, same.points + 3 * i), 1, 2e-3);
		sum += same.mean_curvature[i] / COUNT;
	}
	CHECK_NEAR(sum, -1, 0.01);
	gnp_flow_state_clear(&same);
	end(&flow);
}

/* (M + dt/2 S) x' = M x with M = R^2 M_0 and S x = 2 M_0 x: R' = R^3 / (R^2 + dt), which is R^2 = 1 - 2 t to first order. */
static void a_sphere_stays_one_and_shrinks_by_its_law(void)
{
	static const size_t steps[] = {10, 20, 40};
	double off[3];
	for (size_t k = 0; k < 3; k++) {
		struct flow flow = begun(star(ball, 1, 0, 1));
		double dt = 0.2 / (double)steps[k], law = 1;
		advance(&flow, steps[k], dt, 0, pool);
		for (size_t s = 0; s < steps[k]; s++)
			law = law * law * law / (law * law + dt);
		struct spread spread = spread_of(&flow);
		CHECK_AT_MOST(spread.worst, 0.01);
		CHECK_NEAR(spread.mean, law, 2e-3);
		off[k] = law * law - (1 - 2 * 0.2);
		end(&flow);
	}
	CHECK_NEAR(off[1] / off[0], 0.5, 0.05);
	CHECK_NEAR(off[2] / off[1], 0.5, 0.05);
}

static void a_dumbbell_becomes_round_and_its_neck_does_not_pinch(void)
{
	struct flow flow = begun(star(dumbbell, 1, 0, 1));
	double volume = flow.now.volume;
	CHECK(spread_of(&flow).worst > 0.3);
	advance(&flow, 60, 0.05, volume, pool);
	struct spread spread = spread_of(&flow);
	CHECK_AT_MOST(spread.worst, 0.03);
	CHECK_NEAR(flow.now.volume / volume, 1, 1e-3);
	CHECK_NEAR(spread.mean, cbrt(3 * volume / (4 * pi)), 0.02 * spread.mean);
	end(&flow);
}

/* Of surfaces whose normals point inwards, whose volume is negative, none was kept. */
static void volume_is_kept_whichever_side_normals_are_on(void)
{
	struct flow flow[2] = {begun(star(dumbbell, 1, 0, 1)), begun(star(dumbbell, 1, 0, -1))};
	for (int i = 0; i < 2; i++) {
		double volume = flow[i].now.volume;
		CHECK((volume < 0) == (i == 1));
		advance(&flow[i], 5, 0.05, volume, pool);
		CHECK_NEAR(flow[i].now.volume / volume, 1, 1e-3);
	}
	for (size_t i = 0; i < 3 * COUNT; i++)
		CHECK_NEAR(flow[1].now.points[i], flow[0].now.points[i], 1e-6);
	end(&flow[0]);
	end(&flow[1]);
}

/* Keeping the volume moved them. */
static void held_points_stay(void)
{
	for (int preserve = 0; preserve < 2; preserve++) {
		struct gnp_flow_state start = star(dumbbell, 1, 0, 1);
		double before[3 * COUNT];
		for (size_t i = 0; i < COUNT; i++)
			start.fixed[i] = i % 10 == 0;
		memcpy(before, start.points, sizeof before);
		struct flow flow = begun(start);
		advance(&flow, 5, 0.02, preserve ? flow.now.volume : 0, pool);
		for (size_t i = 0; i < COUNT; i++)
			CHECK((memcmp(before + 3 * i, flow.now.points + 3 * i, 3 * sizeof *before) == 0) == (i % 10 == 0));
		end(&flow);
	}
	struct gnp_flow_state all = star(dumbbell, 1, 0, 1);
	memset(all.fixed, 1, COUNT);
	struct flow flow = begun(all);
	double volume = flow.now.volume;
	advance(&flow, 2, 0.02, volume, pool);
	CHECK_NEAR(flow.now.volume, volume, 0.03 * volume);
	end(&flow);
}

static void units_and_places_do_not_matter(void)
{
	static const double scales[] = {1, 1e-3, 1e3, 1e60, 1e-60, 1}, places[] = {0, 0, 0, 0, 0, 1e5};
	double first[3 * COUNT];
	for (size_t s = 0; s < 6; s++) {
		struct flow flow = begun(star(dumbbell, scales[s], places[s], 1));
		double unit = scales[s], worst = 0;
		advance(&flow, 3, 0.05 * unit * unit, flow.now.volume, pool);
		for (size_t i = 0; i < COUNT; i++) /* in the order of the spiral: curve orders may differ */
			for (size_t c = 0; c < 3; c++) {
				double x = (flow.now.points[3 * i + c] - places[s]) / unit, *was = first + 3 * (size_t)flow.now.index[i] + c;
				*was = s == 0 ? x : *was;
				worst = fmax(worst, fabs(x - *was));
			}
		CHECK_AT_MOST(worst, places[s] > 0 ? 1e-5 : 1e-6);
		end(&flow);
	}
}

static void a_point_without_neighbours_stays_and_weighs_nothing(void)
{
	struct flow flow = begun(star(ball, 1, 0, 1));
	gnp_conformal_free(flow.conformal);
	double before[3];
	for (size_t e = 0; e < GNP_FLOW_EDGES; e++)
		flow.now.weight[GNP_FLOW_EDGES * 700 + e] = 0;
	for (size_t i = 0; i < GNP_FLOW_EDGES * COUNT; i++)
		if (flow.now.neighbor[i] == 700)
			flow.now.weight[i] = 0;
	for (size_t i = 0; i < COUNT; i++) { /* edges past the first without weight do not count: close the gaps */
		size_t made = 0;
		for (size_t at = GNP_FLOW_EDGES * i; at < GNP_FLOW_EDGES * (i + 1); at++)
			if (flow.now.weight[at] > 0) {
				flow.now.neighbor[GNP_FLOW_EDGES * i + made] = flow.now.neighbor[at];
				flow.now.weight[GNP_FLOW_EDGES * i + made++] = flow.now.weight[at];
			}
		for (; made < GNP_FLOW_EDGES; made++)
			flow.now.weight[GNP_FLOW_EDGES * i + made] = 0;
	}
	CHECK(gnp_conformal_create(&flow.now, NULL, &flow.conformal, NULL) == GNP_OK);
	memcpy(before, flow.now.points + 3 * 700, sizeof before);
	advance(&flow, 3, 0.02, 0, pool);
	CHECK(memcmp(before, flow.now.points + 3 * 700, sizeof before) == 0);
	CHECK(flow.now.area[700] == 0 && flow.now.mean_curvature[700] == 0);
	CHECK_NEAR(gnp_dot(flow.now.normals + 2100, flow.now.normals + 2100), 1, 1e-12);
	end(&flow);
}

static void bytes_do_not_depend_on_workers(void)
{
	struct flow flow[2] = {begun(star(dumbbell, 1, 0, 1)), begun(star(dumbbell, 1, 0, 1))};
	struct gnp_pool *one;
	CHECK(gnp_pool_create(1, &one, NULL) == GNP_OK);
	for (size_t i = 0; i < 2; i++)
		advance(&flow[i], 3, 0.05, 0, i ? one : pool);
	CHECK(memcmp(flow[0].now.points, flow[1].now.points, 3 * COUNT * sizeof(double)) == 0);
	CHECK(flow[0].now.volume == flow[1].now.volume);
	end(&flow[0]);
	end(&flow[1]);
	gnp_pool_free(one);
}

static void all_of_it_is_cancelled(void)
{
	struct flow flow = begun(star(ball, 1, 0, 1));
	struct gnp_flow_state next = {0};
	struct gnp_conformal *other = NULL;
	struct gnp_task task;
	bool finite;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_conformal_create(&flow.now, &task, &other, NULL) == GNP_CANCELLED && !other);
	CHECK(gnp_conformal_step(flow.conformal, &flow.now, 0.1, 0, pool, &task, &next, NULL) == GNP_CANCELLED && !next.points);
	next = star(ball, 1, 0, 1);
	CHECK(gnp_conformal_measure(flow.conformal, &next, flow.origin, pool, &task, &finite, NULL) == GNP_CANCELLED && !finite);
	gnp_flow_state_clear(&next);
	gnp_conformal_free(NULL);
	end(&flow);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(measures_of_a_sphere_are_its),
	                                    TEST(a_sphere_stays_one_and_shrinks_by_its_law),
	                                    TEST(a_dumbbell_becomes_round_and_its_neck_does_not_pinch),
	                                    TEST(volume_is_kept_whichever_side_normals_are_on),
	                                    TEST(held_points_stay),
	                                    TEST(units_and_places_do_not_matter),
	                                    TEST(a_point_without_neighbours_stays_and_weighs_nothing),
	                                    TEST(bytes_do_not_depend_on_workers),
	                                    TEST(all_of_it_is_cancelled)};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
