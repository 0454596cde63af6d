#include "core/flow/flow_measure.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/cells/cell.h"
#include "core/cloud/patch.h"

enum { POINTS_A_CHUNK = 128, RING_MAX = 512 };

/* ---- The estimate ---- */

static double *take(struct gnp_estimate *estimate, enum gnp_quantity quantity)
{
	double *values = estimate->values[quantity];
	estimate->values[quantity] = NULL;
	return values;
}

/* Normals stay on the side of those carried along: turning n, H, k1 and k2 over leaves the surface what it is. */
static void keep_sides(struct gnp_flow_state *state, const double *carried)
{
	for (size_t i = 0; i < state->count; i++) {
		double *n = state->normals + 3 * i, *k = state->principal + 2 * i, swap = k[0];
		if (gnp_dot(n, carried + 3 * i) >= 0)
			continue;
		for (int c = 0; c < 3; c++)
			n[c] = -n[c];
		state->lift[i] = -state->lift[i];
		state->mean_curvature[i] = -state->mean_curvature[i];
		k[0] = -k[1];
		k[1] = -swap;
		for (int c = 0; state->directions && c < 3; c++) {
			double *d = state->directions + 6 * i, other = d[c];
			d[c] = d[3 + c];
			d[3 + c] = other;
		}
	}
}

static bool all_finite(const struct gnp_flow_state *state)
{
	bool finite = true;
	for (size_t i = 0; i < state->count; i++)
		finite &= isfinite(state->lift[i]) && isfinite(state->mean_curvature[i]) && isfinite(state->principal[2 * i]) &&
		          isfinite(state->principal[2 * i + 1]);
	for (size_t i = 0; i < 3 * state->count; i++)
		finite &= isfinite(state->normals[i]);
	return finite;
}

/* projected (count, 3): the points on their surfaces. */
static gnp_status set_lift(struct gnp_flow_state *state, const double *projected, struct gnp_error *error)
{
	state->lift = gnp_array_new(state->count, sizeof *state->lift);
	if (!state->lift)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", state->count);
	for (size_t i = 0; i < state->count; i++) {
		const double *p = state->points + 3 * i, *q = projected + 3 * i, d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
		state->lift[i] = gnp_dot(d, state->normals + 3 * i);
	}
	return GNP_OK;
}

static gnp_status estimate(struct gnp_flow_state *state, const struct gnp_flow_rule *rule,
                           const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                           const struct gnp_model **model, struct gnp_error *error)
{
	struct gnp_estimate_options options = rule->estimate;
	struct gnp_estimate found;
	options.quantities = GNP_FLOW_QUANTITIES;
	if (rule->along)
		options.quantities |= GNP_QUANTITY_BIT(GNP_PRINCIPAL_DIRECTIONS);
	options.if_offered = 0;
	gnp_status status = gnp_estimate_prepared(prepared, &options, pool, task, &found, error);
	if (status != GNP_OK)
		return status;
	double *carried = state->normals;
	state->normals = take(&found, GNP_NORMALS);
	state->mean_curvature = take(&found, GNP_MEAN_CURVATURE);
	state->principal = take(&found, GNP_PRINCIPAL_CURVATURES);
	state->directions = take(&found, GNP_PRINCIPAL_DIRECTIONS);
	if (model)
		*model = found.model;
	status = set_lift(state, found.values[GNP_POINTS], error);
	gnp_estimate_clear(&found);
	if (status == GNP_OK)
		keep_sides(state, carried);
	free(carried);
	return status;
}

/* ---- What a point sees about it: its cell, and the smoothed curvature ---- */

struct ring {
	struct gnp_flow_state *state;
	const struct gnp_flow_rule *rule;
	const struct gnp_prepared *prepared;
	size_t size;
};

/* The Gaussian mean of H about a place near point i, over the points of its sheet that move: where others are held, the
 * surface has an edge, and what is estimated there is the edge's. */
static double smooth_about(const struct ring *ring, size_t i, const double place[3], const uint32_t *index,
                           size_t count)
{
	const struct gnp_flow_state *state = ring->state;
	double r0 = ring->rule->smoothing, cut = 9 * r0 * r0, sum = 0, total = 0;
	for (size_t j = 0; j < count; j++) {
		const double *p = state->points + 3 * (size_t)index[j];
		double x = p[0] - place[0], y = p[1] - place[1], z = p[2] - place[2], square = x * x + y * y + z * z;
		if (square > cut || state->fixed[index[j]] || !gnp_same_sheet(state->normals + 3 * i, state->normals + 3 * (size_t)index[j]))
			continue;
		double weight = exp(-square / (2 * r0 * r0));
		sum += weight * state->mean_curvature[index[j]];
		total += weight;
	}
	return total > 0 ? sum / total : state->mean_curvature[i];
}

static void set_shift(const struct ring *ring, size_t i, const struct gnp_cell *cell, double tangents[2][3])
{
	struct gnp_flow_state *state = ring->state;
	double *shift = state->shift + 3 * i, share = state->fixed[i] || cell->open ? 0 : ring->rule->tangential;
	for (int c = 0; c < 3; c++)
		shift[c] = share * (cell->centroid[0] * tangents[0][c] + cell->centroid[1] * tangents[1][c]);
	double height = gnp_flow_second_form(state, i, shift) / 2;
	for (int c = 0; c < 3; c++)
		shift[c] += height * state->normals[3 * i + (size_t)c];
}

static void set_edges(struct gnp_flow_state *state, size_t i, const struct gnp_cell *cell, const uint32_t *index)
{
	for (size_t e = 0; e < GNP_FLOW_EDGES; e++) {
		bool there = e < cell->edges;
		state->neighbor[GNP_FLOW_EDGES * i + e] = there ? index[cell->neighbor[e]] : 0;
		state->weight[GNP_FLOW_EDGES * i + e] = there ? (float)cell->weight[e] : 0;
	}
}

/* Half the Laplacian of the place along the normal, by the finite volumes of the cell. */
static double weak_curvature(const struct gnp_flow_state *state, size_t i, const struct gnp_cell *cell,
                             const uint32_t *index)
{
	double sum = 0;
	for (size_t e = 0; e < cell->edges; e++) {
		const double *p = state->points + 3 * i, *q = state->points + 3 * (size_t)index[cell->neighbor[e]];
		const double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
		sum += cell->weight[e] * gnp_dot(d, state->normals + 3 * i);
	}
	return sum / (2 * state->area[i]);
}

/* The estimate where the points resolve it and finite volumes say much the same; else what these say: an implicit step
 * of it is a mean of neighbours, whatever the points are. */
static void judge_curvature(struct gnp_flow_state *state, size_t i, const struct gnp_cell *cell, const uint32_t *index)
{
	static const double OFF = 0.05, FAR = 0.7; /* over the spacing; spacings from the fitted surface */
	double h = gnp_flow_spacing(state, i), weak = weak_curvature(state, i, cell, index);
	double bend = fmax(fabs(state->principal[2 * i]), fabs(state->principal[2 * i + 1]));
	state->rough[i] = cell->open || h * bend > GNP_FLOW_RESOLVED || h * fabs(state->smooth[i] - weak) > OFF ||
	                  fabs(state->lift[i]) > FAR * h;
	state->smooth[i] = state->rough[i] ? weak : state->smooth[i];
}

static void look_about(const struct ring *ring, size_t i, const uint32_t *index, const double *distance, size_t count)
{
	struct gnp_flow_state *state = ring->state;
	const double *here = state->points + 3 * i;
	double tangents[2][3], place[3] = {here[0], here[1], here[2]};
	struct gnp_cell cell;
	gnp_cell_make(state->points, state->normals, i, index, count, tangents, &cell);
	state->apart[i] = count > 1 ? distance[1] : INFINITY;
	state->area[i] = gnp_cell_share(&cell, distance[count - 1]);
	state->gap[i] = cell.hole ? cell.gap : 0;
	for (size_t c = 0; c < 3; c++)
		state->corner[3 * i + c] = cell.corner[0] * tangents[0][c] + cell.corner[1] * tangents[1][c];
	if (state->shift)
		set_shift(ring, i, &cell, tangents);
	for (size_t c = 0; state->shift && c < 3; c++)
		place[c] += state->shift[3 * i + c];
	if (state->weight)
		set_edges(state, i, &cell, index);
	double smooth = ring->rule->smoothing > 0 ? smooth_about(ring, i, place, index, count) : state->mean_curvature[i];
	state->smooth[i] = smooth;
	state->rough[i] = 0;
	if (ring->rule->weak)
		judge_curvature(state, i, &cell, index);
}

static gnp_status ring_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	const struct ring *ring = context;
	const uint32_t *centres = ring->prepared->order + begin; /* the identity */
	struct gnp_neighborhoods found;
	gnp_status status = gnp_neighborhoods_find(ring->prepared->neighbors, centres, end - begin, ring->size, 1, ring->size, scratch,
	                                           &found, error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		size_t row = i - begin, start = found.start[row];
		look_about(ring, i, found.index + start, found.distance + start, found.start[row + 1] - start);
	}
	return status;
}

static bool reserve_measures(struct gnp_flow_state *state, const struct gnp_flow_rule *rule)
{
	size_t count = state->count;
	state->smooth = gnp_array_new(count, sizeof(double));
	state->area = gnp_array_new(count, sizeof(double));
	state->rough = gnp_array_new(count, 1);
	state->apart = gnp_array_new(count, sizeof(double));
	state->gap = gnp_array_new(count, sizeof(double));
	state->corner = gnp_array_new(count, 3 * sizeof(double));
	if (rule->tangential > 0)
		state->shift = gnp_array_new(count, 3 * sizeof(double));
	if (rule->edges) {
		state->neighbor = gnp_array_new(count, GNP_FLOW_EDGES * sizeof *state->neighbor);
		state->weight = gnp_array_new(count, GNP_FLOW_EDGES * sizeof *state->weight);
	}
	return state->smooth && state->rough && state->area && state->apart && state->gap && state->corner &&
	       (state->shift || rule->tangential <= 0) &&
	       (!rule->edges || (state->neighbor && state->weight));
}

/* So many neighbours fill the ball of the smoothing, with room: about pi (3 r0 / h)^2 lie in it. The spacing is that of
 * a sample. */
static gnp_status ring_size(const struct gnp_flow_state *state, const struct gnp_flow_rule *rule,
                            const struct gnp_neighbors *neighbors, size_t *size, struct gnp_error *error)
{
	enum { SAMPLES = 256, NEAR = 13 };
	struct gnp_scratch *scratch = gnp_scratch_create();
	double square[SAMPLES], distance[NEAR];
	uint32_t index[NEAR];
	gnp_status status = scratch ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory");
	for (size_t s = 0; s < SAMPLES && status == GNP_OK; s++) {
		const double *p = state->points + 3 * (s * state->count / SAMPLES);
		status = gnp_neighbors_knn(neighbors, p, 1, NEAR, index, distance, scratch, error);
		square[s] = distance[NEAR - 1] * distance[NEAR - 1];
	}
	gnp_scratch_free(scratch);
	if (status != GNP_OK)
		return status;
	double wanted = 1.5 * NEAR * 9 * rule->smoothing * rule->smoothing / fmax(gnp_median(square, SAMPLES), 1e-300);
	*size = GNP_CELL_NEIGHBORS + 1;
	if (wanted > (double)*size)
		*size = wanted < RING_MAX ? (size_t)wanted : RING_MAX;
	*size = *size < state->count ? *size : state->count;
	return GNP_OK;
}

static gnp_status look_all(struct gnp_flow_state *state, const struct gnp_flow_rule *rule,
                           const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                           struct gnp_error *error)
{
	struct ring ring = {.state = state, .rule = rule, .prepared = prepared};
	if (!reserve_measures(state, rule))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", state->count);
	gnp_status status = ring_size(state, rule, prepared->neighbors, &ring.size, error);
	return status == GNP_OK ? gnp_pool_run(pool, task, state->count, POINTS_A_CHUNK, ring_chunk, &ring, error) : status;
}

/* ---- Sums over the points ---- */

/* All but a thousandth lie below. */
static double nearly_largest(double *values, size_t count)
{
	return gnp_select(values, count, count - 1 - count / 1000);
}

static double overshoot(const struct gnp_flow_state *state)
{
	double sum = 0;
	for (size_t i = 0; i < state->count; i++) {
		double change = state->smooth[i] - state->before[i];
		if (!state->rough[i] && state->smooth[i] * state->before[i] < 0)
			sum += change * change;
	}
	return sqrt(sum / (double)state->count);
}

static gnp_status sum_up(struct gnp_flow_state *state, const struct gnp_flow_rule *rule, struct gnp_error *error)
{
	double *values = gnp_array_new(state->count, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", state->count);
	state->nearest = INFINITY;
	for (size_t i = 0; i < state->count; i++) {
		const double *p = state->points + 3 * i, d[3] = {p[0] - rule->origin[0], p[1] - rule->origin[1], p[2] - rule->origin[2]};
		state->total_area += state->area[i];
		state->volume += state->area[i] * gnp_dot(d, state->normals + 3 * i) / 3;
		state->curvature = fmax(state->curvature, state->fixed[i] ? 0 : fabs(state->smooth[i]));
		state->nearest = fmin(state->nearest, state->apart[i]);
		values[i] = gnp_flow_spacing(state, i);
	}
	state->spread = nearly_largest(values, state->count);
	state->dense = gnp_select(values, state->count, state->count / 20);
	state->overshoot = overshoot(state);
	for (size_t i = 0; i < state->count; i++)
		values[i] = state->fixed[i] ? 0
		                            : gnp_flow_spacing(state, i) *
		                                  fmax(fabs(state->principal[2 * i]), fabs(state->principal[2 * i + 1]));
	state->resolution = nearly_largest(values, state->count);
	size_t unresolved = 0;
	for (size_t i = 0; i < state->count; i++)
		unresolved += values[i] > GNP_FLOW_RESOLVED;
	state->unresolved = (double)unresolved / (double)state->count;
	free(values);
	return GNP_OK;
}

static gnp_status measure(struct gnp_flow_state *state, const struct gnp_flow_rule *rule, struct gnp_prepared *prepared,
                          struct gnp_pool *pool, struct gnp_task *task, const struct gnp_model **model, bool *finite,
                          struct gnp_error *error)
{
	gnp_task_stage(task, GNP_STAGE_NEIGHBORS, 0);
	gnp_status status = gnp_task_check(task, error);
	if (status == GNP_OK)
		status = gnp_neighbors_build(state->points, state->count, &prepared->neighbors, error);
	if (status == GNP_OK)
		status = gnp_task_check(task, error);
	if (status == GNP_OK)
		status = estimate(state, rule, prepared, pool, task, model, error);
	*finite = status == GNP_OK && all_finite(state);
	if (status != GNP_OK || !*finite)
		return status;
	gnp_task_stage(task, GNP_STAGE_FLOW, state->count);
	status = look_all(state, rule, prepared, pool, task, error);
	if (status == GNP_OK)
		status = sum_up(state, rule, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	return status;
}

gnp_status gnp_flow_measure(struct gnp_flow_state *state, const struct gnp_flow_rule *rule, struct gnp_pool *pool,
                            struct gnp_task *task, const struct gnp_model **model, bool *finite, struct gnp_error *error)
{
	/* What estimation needs of a cloud, which borrows the state's points; rows stay in the state's order. */
	struct gnp_prepared prepared = {.count = state->count, .points = state->points, .normals = state->normals,
	                                .order = gnp_array_new(state->count, sizeof *prepared.order)};
	if (!prepared.order)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", state->count);
	for (size_t i = 0; i < state->count; i++)
		prepared.order[i] = (uint32_t)i;
	gnp_status status = measure(state, rule, &prepared, pool, task, model, finite, error);
	gnp_neighbors_free(prepared.neighbors);
	free(prepared.order);
	return status;
}
