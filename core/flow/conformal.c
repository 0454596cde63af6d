#include "core/flow/conformal.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/diffusion.h"

struct gnp_conformal {
	size_t count;
	struct gnp_stiffness stiffness;
	uint32_t *neighbor;   /* (count, GNP_FLOW_EDGES) of each cell at the start, counterclockwise */
	unsigned char *follower; /* (count, GNP_FLOW_EDGES) the next neighbour round the point, plus 1; 0: no triangle with it */
	double *share;        /* (count) area of the cell over the area of the fan, at the start */
};

/* ---- Fans ---- */

static void side(const double *points, size_t from, size_t to, double out[3])
{
	for (size_t c = 0; c < 3; c++)
		out[c] = points[3 * to + c] - points[3 * from + c];
}

/* Half the cross product of two sides at point i: area times normal. */
static void triangle(const double *points, size_t i, size_t a, size_t b, double out[3])
{
	double u[3], v[3];
	side(points, i, a, u);
	side(points, i, b, v);
	gnp_cross(u, v, out);
	for (int c = 0; c < 3; c++)
		out[c] /= 2;
}

static size_t edges_of(const struct gnp_flow_state *start, size_t i)
{
	size_t edges = 0;
	while (edges < GNP_FLOW_EDGES && start->weight[GNP_FLOW_EDGES * i + edges] > 0)
		edges++;
	return edges;
}

/* Area of the fan about point i and, in normal, the sum of its area vectors. */
static double fan(const struct gnp_conformal *conformal, const double *points, size_t i, double normal[3])
{
	const uint32_t *neighbor = conformal->neighbor + GNP_FLOW_EDGES * i;
	const unsigned char *follower = conformal->follower + GNP_FLOW_EDGES * i;
	double area = 0;
	normal[0] = normal[1] = normal[2] = 0;
	for (size_t e = 0; e < GNP_FLOW_EDGES; e++) {
		double vector[3];
		if (!follower[e])
			continue;
		triangle(points, i, neighbor[e], neighbor[follower[e] - 1], vector);
		area += sqrt(gnp_dot(vector, vector));
		for (int c = 0; c < 3; c++)
			normal[c] += vector[c];
	}
	return area;
}

/* Triangles that face as the surface does: at a boundary the fan is not closed. */
static void set_fan(struct gnp_conformal *conformal, const struct gnp_flow_state *start, size_t i)
{
	uint32_t *neighbor = conformal->neighbor + GNP_FLOW_EDGES * i;
	unsigned char *follower = conformal->follower + GNP_FLOW_EDGES * i;
	size_t edges = edges_of(start, i);
	memcpy(neighbor, start->neighbor + GNP_FLOW_EDGES * i, GNP_FLOW_EDGES * sizeof *neighbor);
	for (size_t e = 0; e < edges; e++) {
		size_t next = e + 1 < edges ? e + 1 : 0;
		double vector[3];
		triangle(start->points, i, neighbor[e], neighbor[next], vector);
		if (gnp_dot(vector, start->normals + 3 * i) > 0)
			follower[e] = (unsigned char)(next + 1);
	}
	double normal[3], area = fan(conformal, start->points, i, normal);
	conformal->share[i] = area > 0 ? start->area[i] / area : 0;
}

/* ---- Life ---- */

void gnp_conformal_free(struct gnp_conformal *conformal)
{
	if (!conformal)
		return;
	gnp_stiffness_clear(&conformal->stiffness);
	free(conformal->neighbor);
	free(conformal->follower);
	free(conformal->share);
	free(conformal);
}

gnp_status gnp_conformal_create(const struct gnp_flow_state *start, struct gnp_task *task, struct gnp_conformal **out,
                                struct gnp_error *error)
{
	size_t count = start->count;
	struct gnp_conformal *conformal = gnp_array_zero(1, sizeof *conformal);
	if (conformal) {
		conformal->count = count;
		conformal->neighbor = gnp_array_new(count, GNP_FLOW_EDGES * sizeof *conformal->neighbor);
		conformal->follower = gnp_array_zero(count, GNP_FLOW_EDGES);
		conformal->share = gnp_array_new(count, sizeof *conformal->share);
	}
	if (!conformal || !conformal->neighbor || !conformal->follower || !conformal->share) {
		gnp_conformal_free(conformal);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", count);
	}
	gnp_status status = gnp_stiffness_make(count, GNP_FLOW_EDGES, start->neighbor, start->weight, task, &conformal->stiffness,
	                                       error);
	if (status != GNP_OK) {
		gnp_conformal_free(conformal);
		return status;
	}
	for (size_t i = 0; i < count; i++)
		set_fan(conformal, start, i);
	*out = conformal;
	return GNP_OK;
}

/* ---- Measures ---- */

static bool reserve(struct gnp_flow_state *state)
{
	state->mean_curvature = gnp_array_new(state->count, sizeof(double));
	state->smooth = gnp_array_new(state->count, sizeof(double));
	state->principal = gnp_array_new(state->count, 2 * sizeof(double));
	state->area = gnp_array_new(state->count, sizeof(double));
	return state->mean_curvature && state->smooth && state->principal && state->area;
}

/* bend (3) = S x of the point: the integral of -2 H n over its cell. */
static void measure_point(const struct gnp_conformal *conformal, struct gnp_flow_state *state, size_t i,
                          const double bend[3], const double origin[3])
{
	double normal[3], *n = state->normals + 3 * i, d[3];
	double area = conformal->share[i] * fan(conformal, state->points, i, normal), length = sqrt(gnp_dot(normal, normal));
	for (size_t c = 0; c < 3; c++) {
		n[c] = length > 0 ? normal[c] / length : n[c];
		d[c] = state->points[3 * i + c] - origin[c];
	}
	state->area[i] = area;
	double curvature = area > 0 ? -gnp_dot(bend, n) / (2 * area) : 0;
	state->mean_curvature[i] = state->smooth[i] = state->principal[2 * i] = state->principal[2 * i + 1] = curvature;
	state->total_area += area;
	state->volume += area * gnp_dot(d, n) / 3;
	state->curvature = fmax(state->curvature, fabs(curvature));
	state->resolution = fmax(state->resolution, fabs(curvature) * sqrt(area));
	state->spread = fmax(state->spread, sqrt(area));
}

gnp_status gnp_conformal_measure(const struct gnp_conformal *conformal, struct gnp_flow_state *state,
                                 const double origin[3], struct gnp_pool *pool, struct gnp_task *task, bool *finite,
                                 struct gnp_error *error)
{
	double *bend = gnp_array_new(state->count, 3 * sizeof *bend);
	gnp_status status = bend && reserve(state) ? GNP_OK
	                                           : gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", state->count);
	if (status == GNP_OK)
		status = gnp_stiffness_apply(&conformal->stiffness, state->points, bend, pool, task, error);
	for (size_t i = 0; status == GNP_OK && i < state->count; i++)
		measure_point(conformal, state, i, bend + 3 * i, origin);
	*finite = status == GNP_OK && isfinite(state->total_area) && isfinite(state->volume) && isfinite(state->curvature);
	free(bend);
	return status;
}

/* ---- The step ---- */

/* Of the points as a surface with the state's masses: they change little within a step. Held points stay. */
static void scale_to(double volume, const struct gnp_flow_state *state, double *points, double now)
{
	double centre[3] = {0}, area = 0, ratio = volume / now;
	for (size_t i = 0; i < state->count; i++) {
		area += state->area[i];
		for (size_t c = 0; c < 3; c++)
			centre[c] += state->area[i] * points[3 * i + c];
	}
	if (!(ratio > 0 && isfinite(ratio) && area > 0))
		return;
	double scale = cbrt(ratio);
	for (size_t i = 0; i < 3 * state->count; i++)
		if (!state->fixed[i / 3])
			points[i] = centre[i % 3] / area + scale * (points[i] - centre[i % 3] / area);
}

static double enclosed(const struct gnp_conformal *conformal, const double *points)
{
	double volume = 0;
	for (size_t i = 0; i < conformal->count; i++) {
		double normal[3], area = conformal->share[i] * fan(conformal, points, i, normal), length = sqrt(gnp_dot(normal, normal));
		double d[3] = {points[3 * i] - points[0], points[3 * i + 1] - points[1], points[3 * i + 2] - points[2]};
		volume += length > 0 ? area * gnp_dot(d, normal) / (3 * length) : 0;
	}
	return volume;
}

static gnp_status solve(const struct gnp_conformal *conformal, const struct gnp_flow_state *state, double dt, double *d,
                        struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	size_t count = state->count, iterations;
	double *rhs = gnp_array_new(count, 3 * sizeof *rhs), *mass = gnp_array_new(count, sizeof *mass);
	gnp_status status = rhs && mass ? gnp_stiffness_apply(&conformal->stiffness, state->points, rhs, pool, task, error)
	                                : gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", count);
	const struct gnp_diffusion diffusion = {&conformal->stiffness, mass, dt / 2, state->fixed};
	for (size_t i = 0; status == GNP_OK && i < count; i++) {
		static const double least = 1e-9; /* of the mean mass: what has collapsed still has some */
		mass[i] = fmax(state->area[i], least * state->total_area / (double)count);
		for (size_t c = 0; c < 3; c++) {
			rhs[3 * i + c] *= -dt / 2;
			d[3 * i + c] = rhs[3 * i + c] / mass[i];
		}
	}
	if (status == GNP_OK)
		status = gnp_diffusion_solve(&diffusion, rhs, d, pool, task, &iterations, error);
	free(rhs);
	free(mass);
	return status;
}

gnp_status gnp_conformal_step(const struct gnp_conformal *conformal, const struct gnp_flow_state *state, double dt,
                              double volume, struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow_state *next,
                              struct gnp_error *error)
{
	gnp_status status = gnp_flow_state_reserve(next, state->count, error);
	if (status != GNP_OK)
		return status;
	status = solve(conformal, state, dt, next->points, pool, task, error);
	if (status != GNP_OK) {
		gnp_flow_state_clear(next);
		return status;
	}
	for (size_t i = 0; i < 3 * state->count; i++)
		next->points[i] += state->points[i];
	if (volume != 0)
		scale_to(volume, state, next->points, enclosed(conformal, next->points));
	memcpy(next->normals, state->normals, 3 * state->count * sizeof *next->normals);
	memcpy(next->index, state->index, state->count * sizeof *next->index);
	memcpy(next->fixed, state->fixed, state->count);
	return GNP_OK;
}
