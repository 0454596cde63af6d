#include "core/cells/front.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/queue.h"

enum { POLL = 8192 };

/* How a front came to a point. */
struct arrival {
	double way[3];   /* unit direction in which it went on */
	double before;   /* length of the way to its centre */
	uint32_t source; /* from which it came */
	uint32_t centre; /* of its circles: a source, or a point where the way turns about an obstacle */
	uint8_t there;   /* how often the point was the nearest of those on the way */
};

struct front {
	const double *points, *normals;
	const struct gnp_fans *fans;
	const struct gnp_carried *carried;
	struct arrival *arrival; /* (points) */
	struct gnp_queue queue;  /* by distance */
};

/* A triangle's plane: a at its origin, b on the first axis, i above it. */
struct plane {
	uint32_t a, b, i;
	double axis[2][3], base, x, y; /* base: |ab|; (x, y): i */
};

static bool lay_down(const double *points, uint32_t a, uint32_t b, uint32_t i, struct plane *out)
{
	static const double SLIVER = 1e-3; /* height, of a side */
	const double *o = points + 3 * (size_t)a, *p = points + 3 * (size_t)b, *q = points + 3 * (size_t)i;
	double to_b[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]}, to_i[3] = {q[0] - o[0], q[1] - o[1], q[2] - o[2]};
	out->a = a;
	out->b = b;
	out->i = i;
	out->base = sqrt(gnp_dot(to_b, to_b));
	if (!(out->base > 0))
		return false;
	for (int c = 0; c < 3; c++)
		out->axis[0][c] = to_b[c] / out->base;
	out->x = gnp_dot(to_i, out->axis[0]);
	for (int c = 0; c < 3; c++)
		out->axis[1][c] = to_i[c] - out->x * out->axis[0][c];
	out->y = sqrt(gnp_dot(out->axis[1], out->axis[1]));
	if (!(out->y > SLIVER * out->base))
		return false;
	for (int c = 0; c < 3; c++)
		out->axis[1][c] /= out->y;
	return true;
}

/* The centre of the front that came to both a and b, unfolded; false: they were reached by different ones. */
static bool centre_of_both(const struct front *front, const struct plane *plane, double centre[2])
{
	static const double TURN = 0.5; /* cosine */
	const struct arrival *at_a = front->arrival + plane->a, *at_b = front->arrival + plane->b;
	if (at_b->centre != at_a->centre || at_b->before != at_a->before)
		return false;
	double a = front->queue.key[plane->a] - at_a->before, b = front->queue.key[plane->b] - at_b->before;
	if (fmin(a, b) > 3 * plane->base && gnp_dot(at_a->way, at_b->way) < TURN)
		return false;
	centre[0] = (a * a - b * b + plane->base * plane->base) / (2 * plane->base);
	double square = a * a - centre[0] * centre[0];
	centre[1] = -sqrt(fmax(square, 0));
	return square > 0;
}

/* The centre of the front that came to a, by the way it went on there. */
static bool centre_of_one(const struct front *front, const struct plane *plane, double centre[2])
{
	const struct arrival *at_a = front->arrival + plane->a;
	double radius = front->queue.key[plane->a] - at_a->before;
	double u = gnp_dot(at_a->way, plane->axis[0]), v = gnp_dot(at_a->way, plane->axis[1]), length = hypot(u, v);
	if (!(radius > 0) || !(length > 0.1))
		return false;
	centre[0] = -radius * u / length;
	centre[1] = -radius * v / length;
	return true;
}

static void arrive(struct front *front, uint32_t i, const struct arrival *from, const double way[3])
{
	struct arrival *at = front->arrival + i;
	at->before = from->before;
	at->source = from->source;
	at->centre = from->centre;
	memcpy(at->way, way, sizeof at->way);
}

/* In triangles with an obtuse angle a nearer way may be found late. */
static bool offer(struct front *front, uint32_t i, double distance)
{
	enum { MOST = 8 };
	static const double NEARER = 1e-12;
	bool again = front->arrival[i].there > 0;
	if (again && (front->arrival[i].there >= MOST || !(distance < (1 - NEARER) * front->queue.key[i])))
		return false;
	return gnp_queue_offer(&front->queue, i, distance);
}

/* Angles are those that the ways make where they set out, as long as nothing turned them. */
static void carry(struct front *front, const struct plane *plane, const double centre[2], bool both)
{
	uint32_t source = front->arrival[plane->a].source;
	double to_a = atan2(-centre[1], -centre[0]), to_b = atan2(-centre[1], plane->base - centre[0]);
	double to_i = atan2(plane->y - centre[1], plane->x - centre[0]), axis[3];
	if (both) {
		gnp_carry_between(front->carried, front->normals, (uint32_t[]){plane->a, plane->b},
		                  (to_a - to_i) / (to_a - to_b), source, plane->i);
		return;
	}
	gnp_cross(plane->axis[0], plane->axis[1], axis);
	double sign = gnp_dot(axis, front->normals + 3 * (size_t)plane->i) < 0 ? -1 : 1;
	gnp_carry_turned(front->carried, front->normals, plane->a, sign * (to_i - to_a), source, plane->i);
}

/* Through the side from a to b, where the straight way from the centre of the front that came to a passes it; both: it
 * came to b as well. */
static void pass_side(struct front *front, const struct plane *plane, const double centre[2], bool both)
{
	static const double BESIDE = 1e-6;
	double rise = plane->y - centre[1], run = plane->x - centre[0], length = hypot(run, rise), way[3];
	if (!(centre[1] < -BESIDE * plane->base))
		return;
	double across = centre[0] + run * -centre[1] / rise;
	if (across < -BESIDE * plane->base || across > (1 + BESIDE) * plane->base)
		return;
	if (!offer(front, plane->i, front->arrival[plane->a].before + length))
		return;
	for (int c = 0; c < 3; c++)
		way[c] = (run * plane->axis[0][c] + rise * plane->axis[1][c]) / length;
	arrive(front, plane->i, front->arrival + plane->a, way);
	if (front->carried)
		carry(front, plane, centre, both);
}

static void pass_triangle(struct front *front, uint32_t a, uint32_t b, uint32_t i)
{
	struct plane plane;
	double centre[2];
	if (!front->arrival[b].there || !lay_down(front->points, a, b, i, &plane))
		return;
	if (centre_of_both(front, &plane, centre)) {
		pass_side(front, &plane, centre, true);
		return;
	}
	if (centre_of_one(front, &plane, centre))
		pass_side(front, &plane, centre, false);
	if (lay_down(front->points, b, a, i, &plane) && centre_of_one(front, &plane, centre))
		pass_side(front, &plane, centre, false);
}

/* Along the edge from a to i: where the way turns, a is a centre. */
static void pass_edge(struct front *front, uint32_t a, uint32_t i)
{
	static const double STRAIGHT = 0.9; /* cosine */
	const double *p = front->points + 3 * (size_t)a, *q = front->points + 3 * (size_t)i;
	double way[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, length = sqrt(gnp_dot(way, way));
	if (!(length > 0) || !offer(front, i, front->queue.key[a] + length))
		return;
	struct arrival from = front->arrival[a];
	double radius = front->queue.key[a] - from.before, along = radius > 0 ? gnp_dot(from.way, way) : length;
	if (along < STRAIGHT * length) {
		from.before = front->queue.key[a];
		from.centre = a;
		radius = 0;
	}
	for (int c = 0; c < 3; c++)
		way[c] += radius * from.way[c];
	double far = sqrt(gnp_dot(way, way));
	for (int c = 0; c < 3; c++)
		way[c] /= far;
	arrive(front, i, &from, way);
	if (front->carried)
		gnp_carry_along(front->carried, front->points, front->normals, a, i);
}

static void pass_on(struct front *front, uint32_t a)
{
	const struct gnp_fans *fans = front->fans;
	front->arrival[a].there++;
	for (size_t t = fans->start[a]; t < fans->start[a + 1]; t++) {
		uint32_t b = fans->corner[t][0], c = fans->corner[t][1];
		pass_edge(front, a, b);
		pass_edge(front, a, c);
		pass_triangle(front, a, b, c);
		pass_triangle(front, a, c, b);
	}
}

/* How far the front has to go, as far as that is known: INFINITY while a goal was not reached. */
struct goals {
	const struct gnp_front_goals *given;
	size_t reached;
	double last;
};

static double end_of(const struct front *front, struct goals *goals)
{
	if (!goals->given)
		return INFINITY;
	for (; goals->reached < goals->given->count; goals->reached++) {
		uint32_t goal = goals->given->points[goals->reached];
		if (!front->arrival[goal].there)
			return INFINITY;
		goals->last = fmax(goals->last, front->queue.key[goal]);
	}
	return goals->last + goals->given->beyond;
}

static gnp_status spread(struct front *front, const struct gnp_front_goals *given, struct gnp_task *task,
                         struct gnp_error *error)
{
	struct goals goals = {.given = given};
	gnp_status status = GNP_OK;
	for (size_t taken = 1; front->queue.used > 0 && status == GNP_OK; taken++) {
		uint32_t nearest = gnp_queue_take(&front->queue);
		if (front->queue.key[nearest] > end_of(front, &goals))
			return GNP_OK;
		pass_on(front, nearest);
		if (taken % POLL == 0)
			status = gnp_task_check(task, error);
	}
	return status;
}

/* Where only tentative ways lead a front that ended early does not count as having come. */
static void forget(const struct front *front, size_t count)
{
	for (size_t i = 0; i < count; i++)
		if (!front->arrival[i].there)
			front->queue.key[i] = INFINITY;
}

gnp_status gnp_front_find(const struct gnp_prepared *prepared, const struct gnp_fans *shared, const uint32_t *sources,
                          size_t count, const struct gnp_carried *carried, const struct gnp_front_goals *goals,
                          struct gnp_task *task, double *distance, struct gnp_error *error)
{
	size_t points = prepared->count;
	struct arrival *arrival = gnp_array_zero(points, sizeof *arrival);
	struct front front = {prepared->points, prepared->normals, shared, carried, arrival, {.used = 0}};
	if (!arrival)
		return gnp_no_memory("distances", points, "points", error);
	gnp_status status = gnp_queue_init(&front.queue, distance, points, "distances", error);
	for (size_t s = 0; s < count && status == GNP_OK; s++) {
		arrival[sources[s]].centre = arrival[sources[s]].source = sources[s];
		gnp_queue_offer(&front.queue, sources[s], 0);
	}
	if (status == GNP_OK)
		status = spread(&front, goals, task, error);
	if (status == GNP_OK)
		forget(&front, points);
	gnp_queue_clear(&front.queue);
	free(arrival);
	return status;
}
