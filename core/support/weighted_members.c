#include "core/support/weighted_members.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"

enum { FEW = 3 }; /* points of a node that is looked at */

/* The nodes that are looked at, which are the first. */
static size_t nodes_of(const struct gnp_support *support)
{
	size_t count = gnp_support_singles(support);
	while (count < support->nodes && support->weight[count] <= FEW)
		count++;
	return count;
}

static bool is_on_surface(const struct gnp_weighted_near *near, size_t node)
{
	static const double STEEP = 0.35, DEVIATIONS = 4;
	double off = fabs(near->residual[node]);
	return off <= STEEP * near->support->distance[node] ||
	       off * sqrt(near->support->weight[node]) <= DEVIATIONS * near->noise;
}

/* ---- The patch ---- */

struct arrays {
	uint32_t *index;
	double *u, *v, *w;
	size_t count;
};

static void enter(const struct gnp_weighted_near *near, const double *points, uint32_t point, struct arrays *to)
{
	const struct gnp_support *support = near->support;
	const double *p = points + 3 * (size_t)point, *o = points + 3 * (size_t)support->centre;
	double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
	to->index[to->count] = point;
	to->u[to->count] = gnp_dot(d, support->frame[0]) / near->scale;
	to->v[to->count] = gnp_dot(d, support->frame[1]) / near->scale;
	to->w[to->count++] = gnp_dot(d, support->frame[2]);
}

/* Twice the deviation of heights, but a tenth of the scale at least. */
static double height_of(const struct arrays *a, double scale)
{
	double mean = 0, square = 0;
	for (size_t i = 0; i < a->count; i++)
		mean += a->w[i] / (double)a->count;
	for (size_t i = 0; i < a->count; i++)
		square += (a->w[i] - mean) * (a->w[i] - mean) / (double)a->count;
	return fmax(2 * sqrt(square), 0.1 * scale);
}

gnp_status gnp_weighted_near_patch(const struct gnp_weighted_near *near, const double *points, struct gnp_patch *patch,
                                   struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_support *support = near->support;
	size_t nodes = nodes_of(support), most = support->start[nodes];
	double *u = gnp_scratch_take(scratch, 3 * most, sizeof *u);
	struct arrays a = {gnp_scratch_take(scratch, most, sizeof *a.index), u, u + most, u + 2 * most, 0};
	if (!u || !a.index)
		return gnp_no_memory("gnp", most, "points of a patch", error);
	for (size_t n = 0; n < nodes; n++)
		for (size_t m = support->start[n]; m < support->start[n + 1] && (n == 0 || is_on_surface(near, n)); m++)
			enter(near, points, support->member[m], &a);
	double height = height_of(&a, near->scale);
	for (size_t i = 0; i < a.count; i++)
		a.w[i] /= height;
	*patch = (struct gnp_patch){.centre = support->centre, .k = a.count, .count = a.count, .buffer_count = a.count,
	                            .index = a.index, .u = a.u, .v = a.v, .w = a.w, .epsilon = near->scale,
	                            .scale_xy = near->scale, .scale_w = height};
	memcpy(patch->origin, points + 3 * (size_t)support->centre, sizeof patch->origin);
	memcpy(patch->frame, support->frame, sizeof support->frame);
	return GNP_OK;
}

/* ---- Where it ends ---- */

bool gnp_weighted_near_ends(const struct gnp_weighted_near *near, const struct gnp_patch *patch)
{
	static const double SLIGHT = 0.03, DEVIATIONS = 3;
	for (size_t i = 1; i < gnp_support_singles(near->support); i++) {
		double off = fabs(near->residual[i]);
		if (off > SLIGHT * near->support->distance[i] && off > DEVIATIONS * near->noise)
			return true;
	}
	return gnp_patch_one_sided(patch, 0, 0);
}

/* ---- Whom it serves ---- */

/* In units of R. */
static double reach_of(const struct gnp_weighted_near *near, size_t nodes)
{
	static const double FAR = 0.5, NEAR = 0.125, INNER = 0.5, SURE = 0.005; /* of the scale; of points; radian */
	const struct gnp_support *support = near->support;
	if (near->outputs[GNP_WEIGHTED_CREASE] > -1 || near->outputs[GNP_WEIGHTED_OUTLIER] > -1 || !near->fit->solved)
		return 0;
	double reach = (near->error.slope < SURE * SURE ? FAR : NEAR) * near->scale / support->radius, farthest = 0;
	for (size_t n = 1; n < nodes; n++) {
		farthest = fmax(farthest, support->distance[n]);
		if (!is_on_surface(near, n))
			reach = fmin(reach, 0.5 * support->distance[n]);
	}
	return fmin(reach, INNER * farthest);
}

gnp_status gnp_weighted_near_members(const struct gnp_weighted_near *near, const double *points,
                                     const uint32_t **member, size_t *count, struct gnp_scratch *scratch,
                                     struct gnp_error *error)
{
	const struct gnp_support *support = near->support;
	const double *o = points + 3 * (size_t)support->centre;
	size_t nodes = nodes_of(support), made = 0;
	uint32_t *served = gnp_scratch_take(scratch, support->start[nodes], sizeof *served);
	if (!served)
		return gnp_no_memory("gnp", support->start[nodes], "points", error);
	double reach = reach_of(near, nodes) * support->radius;
	served[made++] = support->centre;
	for (size_t m = 1; m < support->start[nodes] && reach > 0; m++) {
		const double *p = points + 3 * (size_t)support->member[m];
		double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		if (gnp_dot(d, d) <= reach * reach)
			served[made++] = support->member[m];
	}
	*member = served;
	*count = made;
	return GNP_OK;
}
