#include "core/flow/flow_step.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/cells/diffusion.h"
#include "core/cloud/thin.h"

/* ---- How far each point moves ---- */

/* What keeping the volume adds to H: minus its mean, and what the cells say was lost since the start. */
static double pressure(const struct gnp_flow_state *state, const struct gnp_flow_move *move)
{
	double sum = 0, area = 0;
	if (!move->preserve)
		return 0;
	for (size_t i = 0; i < state->count; i++) {
		if (state->fixed[i])
			continue;
		sum += state->area[i] * state->smooth[i];
		area += state->area[i];
	}
	return area > 0 ? (-sum + (move->volume - state->volume) / move->dt) / area : 0;
}

/* d (count, 3) = dt H n, 0 at fixed points. */
static void pull(const struct gnp_flow_state *state, const struct gnp_flow_move *move, double *d)
{
	double more = pressure(state, move);
	for (size_t i = 0; i < state->count; i++) {
		double normal[3], length = state->fixed[i] ? 0 : move->dt * (state->smooth[i] + more);
		memcpy(normal, state->normals + 3 * i, sizeof normal);
		if (state->shift)
			gnp_flow_normal_along(state, i, state->shift + 3 * i, normal);
		for (size_t c = 0; c < 3; c++)
			d[3 * i + c] = length * normal[c];
	}
}

/* d in: dt H n; out: the solution of (M + dt/2 S) d = M dt H n. */
static gnp_status diffuse(const struct gnp_flow_state *state, double dt, double *d, struct gnp_pool *pool,
                          struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_stiffness stiffness = {0};
	size_t iterations;
	double *rhs = gnp_array_new(state->count, 3 * sizeof *rhs);
	gnp_status status = rhs ? gnp_stiffness_make(state->count, GNP_FLOW_EDGES, state->neighbor, state->weight, task, &stiffness, error)
	                        : gnp_no_memory("flow", state->count, "points", error);
	for (size_t i = 0; status == GNP_OK && i < 3 * state->count; i++)
		rhs[i] = state->area[i / 3] * d[i];
	const struct gnp_diffusion diffusion = {&stiffness, state->area, dt / 2, state->fixed};
	if (status == GNP_OK)
		status = gnp_diffusion_solve(&diffusion, rhs, d, pool, task, &iterations, error);
	gnp_stiffness_clear(&stiffness);
	free(rhs);
	return status;
}

/* Where the points do not resolve the surface, none goes farther than half its spacing in a step. */
static void hold_back(const struct gnp_flow_state *state, double *d)
{
	for (size_t i = 0; i < state->count; i++) {
		double *own = d + 3 * i, far = sqrt(gnp_dot(own, own)), most = gnp_flow_spacing(state, i) / 2;
		for (int c = 0; state->rough[i] && far > most && c < 3; c++)
			own[c] *= most / far;
	}
}

/* The 99.9th percentile of how far points go over how far they may; infinite where one goes nowhere finite. */
static gnp_status judge(const struct gnp_flow_state *state, const struct gnp_flow_move *move, const double *d,
                        double *too_far, struct gnp_error *error)
{
	double *ratio = gnp_array_new(state->count, sizeof *ratio);
	if (!ratio)
		return gnp_no_memory("flow", state->count, "points", error);
	bool finite = true;
	for (size_t i = 0; i < state->count; i++) {
		double far = sqrt(gnp_dot(d + 3 * i, d + 3 * i)), bend = fmax(fabs(state->principal[2 * i]), fabs(state->principal[2 * i + 1]));
		double h = gnp_flow_spacing(state, i);
		ratio[i] = 2 * far * (move->scheme == GNP_FLOW_EXPLICIT ? 1 / h : fmin(bend, GNP_FLOW_RESOLVED / h));
		finite &= isfinite(ratio[i]) && isfinite(far);
	}
	*too_far = finite ? gnp_select(ratio, state->count, state->count - 1 - state->count / 1000) : INFINITY;
	free(ratio);
	return GNP_OK;
}

/* ---- Which points there are then ---- */

/* keep (count): which of the moved points stay. */
static gnp_status thin(const struct gnp_flow_state *state, double distance, const double *points, struct gnp_task *task,
                       unsigned char *keep, size_t *kept, struct gnp_error *error)
{
	uint32_t *order = NULL;
	size_t fixed = 0;
	gnp_status status = gnp_flow_state_rank(state, true, &order, &fixed, error);
	if (status == GNP_OK)
		status = gnp_thin(points, state->count, distance, order, fixed, task, keep, kept, error);
	free(order);
	return status;
}

/* Whether two points can have come closer than `distance`. */
static bool may_crowd(const struct gnp_flow_state *state, const double *points, double distance)
{
	double most = 0;
	for (size_t i = 0; i < state->count; i++) {
		const double *p = state->points + 3 * i, *q = points + 3 * i, d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
		most = fmax(most, gnp_dot(d, d));
	}
	return state->nearest - 2 * sqrt(most) < distance;
}

/* A point in the gap beside point i: its cell's farthest corner, lifted onto the surface, moved as i is. */
static void fill_gap(const struct gnp_flow_state *state, size_t i, const double *d, double point[3], double normal[3])
{
	const double *corner = state->corner + 3 * i;
	double height = gnp_flow_second_form(state, i, corner) / 2;
	for (size_t c = 0; c < 3; c++)
		point[c] = state->points[3 * i + c] + corner[c] + height * state->normals[3 * i + c] + d[3 * i + c];
	gnp_flow_normal_along(state, i, corner, normal);
}

/* Where points are to be inserted; freed by the caller. */
struct gaps {
	size_t count;
	double *points, *normals; /* (count, 3) */
};

static gnp_status find_gaps(const struct gnp_flow_state *state, const struct gnp_flow_move *move, const double *d,
                            struct gaps *gaps, struct gnp_error *error)
{
	size_t wide = 0, made = 0;
	for (size_t i = 0; i < state->count; i++)
		wide += state->gap[i] > move->insertion;
	*gaps = (struct gaps){.count = wide};
	if (wide == 0)
		return GNP_OK;
	gaps->points = gnp_array_new(wide, 3 * sizeof(double));
	gaps->normals = gnp_array_new(wide, 3 * sizeof(double));
	if (!gaps->points || !gaps->normals)
		return gnp_no_memory("flow", wide, "points", error);
	for (size_t i = 0; i < state->count; i++)
		if (state->gap[i] > move->insertion) {
			fill_gap(state, i, d, gaps->points + 3 * made, gaps->normals + 3 * made);
			made++;
		}
	return GNP_OK;
}

/* The points of the next state, as they are being chosen. */
struct choice {
	double *points;       /* (state's count, 3) moved */
	unsigned char *keep;  /* (state's count) */
	size_t kept;
	struct gaps gaps;
	unsigned char *fill;  /* (gaps) */
	size_t filled;
};

/* Several points see one gap: of their proposals those stay that are apart from each other and from what is there. */
static gnp_status choose_gaps(const struct gnp_flow_state *state, const struct gnp_flow_move *move,
                              struct choice *choice, struct gnp_task *task, struct gnp_error *error)
{
	size_t there = choice->kept, total = there + choice->gaps.count, kept, at = 0;
	double *points = gnp_array_new(total, 3 * sizeof *points);
	unsigned char *keep = gnp_array_new(total, 1);
	gnp_status status = points && keep ? GNP_OK : gnp_no_memory("flow", total, "points", error);
	for (size_t i = 0; status == GNP_OK && i < state->count; i++)
		if (choice->keep[i])
			memcpy(points + 3 * at++, choice->points + 3 * i, 3 * sizeof *points);
	if (status == GNP_OK) {
		memcpy(points + 3 * there, choice->gaps.points, 3 * choice->gaps.count * sizeof *points);
		status = gnp_thin(points, total, 0.95 * move->insertion, NULL, there, task, keep, &kept, error);
	}
	for (size_t g = 0; status == GNP_OK && g < choice->gaps.count; g++) {
		choice->fill[g] = keep[there + g] && there + choice->filled < move->points_most;
		choice->filled += choice->fill[g];
	}
	free(points);
	free(keep);
	return status;
}

static gnp_status choose(const struct gnp_flow_state *state, const struct gnp_flow_move *move, const double *d,
                         struct choice *choice, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	choice->kept = state->count;
	memset(choice->keep, 1, state->count);
	if (move->thinning > 0 && may_crowd(state, choice->points, move->thinning))
		status = thin(state, move->thinning, choice->points, task, choice->keep, &choice->kept, error);
	if (status == GNP_OK && move->insertion > 0)
		status = find_gaps(state, move, d, &choice->gaps, error);
	if (status != GNP_OK || choice->gaps.count == 0)
		return status;
	choice->fill = gnp_array_new(choice->gaps.count, 1);
	return choice->fill ? choose_gaps(state, move, choice, task, error) : gnp_no_memory("flow", choice->gaps.count, "points", error);
}

static gnp_status gather(const struct gnp_flow_state *state, const struct choice *choice, struct gnp_flow_state *next,
                         struct gnp_error *error)
{
	size_t at = 0;
	gnp_status status = gnp_flow_state_reserve(next, choice->kept + choice->filled, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < state->count; i++) {
		if (!choice->keep[i])
			continue;
		memcpy(next->points + 3 * at, choice->points + 3 * i, 3 * sizeof(double));
		memcpy(next->normals + 3 * at, state->normals + 3 * i, 3 * sizeof(double));
		next->index[at] = state->index[i];
		next->before[at] = state->rough && state->rough[i] ? NAN : state->smooth[i];
		next->fixed[at++] = state->fixed[i];
	}
	for (size_t g = 0; g < choice->gaps.count; g++) {
		if (!choice->fill[g])
			continue;
		memcpy(next->points + 3 * at, choice->gaps.points + 3 * g, 3 * sizeof(double));
		memcpy(next->normals + 3 * at, choice->gaps.normals + 3 * g, 3 * sizeof(double));
		next->index[at++] = -1;
	}
	return GNP_OK;
}

static void set_off(const struct gnp_flow_state *state, const struct gnp_flow_move *move, const double *d, size_t i,
                    double point[3])
{
	double lift = state->fixed[i] || state->rough[i] ? 0 : move->projection * state->lift[i];
	for (size_t c = 0; c < 3; c++)
		point[c] = state->points[3 * i + c] + (state->shift ? state->shift[3 * i + c] : 0) +
		           lift * state->normals[3 * i + c] + d[3 * i + c];
}

static gnp_status arrive(const struct gnp_flow_state *state, const struct gnp_flow_move *move, const double *d,
                         struct gnp_task *task, struct gnp_flow_state *next, struct gnp_flow_moved *moved,
                         struct gnp_error *error)
{
	struct choice choice = {.points = gnp_array_new(state->count, 3 * sizeof(double)), .keep = gnp_array_new(state->count, 1)};
	gnp_status status = choice.points && choice.keep ? GNP_OK : gnp_no_memory("flow", state->count, "points", error);
	for (size_t i = 0; status == GNP_OK && i < state->count; i++)
		set_off(state, move, d, i, choice.points + 3 * i);
	if (status == GNP_OK)
		status = choose(state, move, d, &choice, task, error);
	if (status == GNP_OK)
		status = gather(state, &choice, next, error);
	moved->thinned = state->count - choice.kept;
	moved->inserted = choice.filled;
	free(choice.points);
	free(choice.keep);
	free(choice.fill);
	free(choice.gaps.points);
	free(choice.gaps.normals);
	return status;
}

gnp_status gnp_flow_step(const struct gnp_flow_state *state, const struct gnp_flow_move *move, struct gnp_pool *pool,
                         struct gnp_task *task, struct gnp_flow_state *next, struct gnp_flow_moved *moved, struct gnp_error *error)
{
	double *d = gnp_array_new(state->count, 3 * sizeof *d);
	gnp_status status = d ? GNP_OK : gnp_no_memory("flow", state->count, "points", error);
	*moved = (struct gnp_flow_moved){0};
	if (status == GNP_OK)
		pull(state, move, d);
	if (status == GNP_OK && move->scheme == GNP_FLOW_SEMI_IMPLICIT)
		status = diffuse(state, move->dt, d, pool, task, error);
	if (status == GNP_OK)
		hold_back(state, d);
	if (status == GNP_OK)
		status = judge(state, move, d, &moved->too_far, error);
	if (status == GNP_OK && moved->too_far <= 1)
		status = arrive(state, move, d, task, next, moved, error);
	free(d);
	return status;
}
