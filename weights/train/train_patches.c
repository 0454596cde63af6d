#include "weights/train/train_patches.h"

#include <math.h>

#include "core/base/vector.h"

/* Least cosine between a normal and psi3 at which the surface counts as a graph over the patch's plane. */
static const double UPRIGHT = 0.2;

/* II of the tangents a and b, both in space. */
static double form_at(const float s[6], const double a[3], const double b[3])
{
	return a[0] * (s[0] * b[0] + s[1] * b[1] + s[2] * b[2]) + a[1] * (s[1] * b[0] + s[3] * b[1] + s[4] * b[2]) +
	       a[2] * (s[2] * b[0] + s[4] * b[1] + s[5] * b[2]);
}

/* False where the surface is too steep over the patch's plane. Monge form: n ~ (-h_u, -h_v, 1), Hess(h) = sqrt(det g) II. */
static bool truth_at(const struct gnp_train_shape *shape, size_t point, const struct gnp_patch *patch, struct gnp_truth *truth)
{
	const double(*psi)[3] = (const double(*)[3])patch->frame;
	double normal[3], away[3], tangents[2][3], slopes[2];
	for (int c = 0; c < 3; c++) {
		normal[c] = shape->normals[3 * point + c];
		away[c] = shape->exact[3 * point + c] - patch->origin[c];
	}
	double upright = gnp_dot(psi[2], normal);
	if (upright <= UPRIGHT)
		return false;
	for (int i = 0; i < 2; i++) {
		slopes[i] = -gnp_dot(psi[i], normal) / upright;
		for (int c = 0; c < 3; c++)
			tangents[i][c] = psi[i][c] + slopes[i] * psi[2][c];
	}
	const float *form = shape->second_form + 6 * point;
	double root = sqrt(1 + slopes[0] * slopes[0] + slopes[1] * slopes[1]);
	truth->u = gnp_dot(psi[0], away) / patch->scale_xy;
	truth->v = gnp_dot(psi[1], away) / patch->scale_xy;
	truth->jet = (struct gnp_jet){gnp_dot(psi[2], away), slopes[0], slopes[1],
	                              root * form_at(form, tangents[0], tangents[0]), root * form_at(form, tangents[0], tangents[1]),
	                              root * form_at(form, tangents[1], tangents[1])};
	return true;
}

/* Row 0 is the centre. */
static size_t fill_truth(const struct gnp_train_cloud *cloud, const struct gnp_patch *patch, struct gnp_truth *truth)
{
	size_t count = 0;
	for (size_t i = 0; i < patch->count; i++) {
		size_t point = patch->index[i];
		if (!cloud->outlier[point])
			count += truth_at(&cloud->shape, cloud->prepared.order[point], patch, &truth[count]);
		if (count == 0)
			break;
	}
	return count;
}

static void fill_nodes(const struct gnp_patch *patch, size_t count, float *nodes)
{
	for (size_t i = 0; i < count; i++) {
		nodes[3 * i] = (float)patch->u[i];
		nodes[3 * i + 1] = (float)patch->v[i];
		nodes[3 * i + 2] = (float)patch->w[i];
	}
}

/* Room for patches of `points` points in all. */
static gnp_status reserve(size_t count, size_t points, struct gnp_scratch *scratch, struct gnp_train_patches *out,
                          struct gnp_error *error)
{
	out->patches = gnp_scratch_take(scratch, count, sizeof *out->patches);
	out->start = gnp_scratch_take(scratch, count + 1, sizeof *out->start);
	out->inner = gnp_scratch_take(scratch, count, sizeof *out->inner);
	out->nodes = gnp_scratch_take(scratch, points, 3 * sizeof *out->nodes);
	out->truth_start = gnp_scratch_take(scratch, count + 1, sizeof *out->truth_start);
	out->truth = gnp_scratch_take(scratch, points, sizeof *out->truth);
	if (!out->patches || !out->start || !out->inner || !out->nodes || !out->truth_start || !out->truth)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu patches", count);
	out->start[0] = out->truth_start[0] = 0;
	return GNP_OK;
}

static gnp_status find(const struct gnp_train_cloud *cloud, const struct gnp_train_recipe *recipe, const uint32_t *centres,
                       size_t count, struct gnp_scratch *scratch, struct gnp_neighborhoods *found, struct gnp_error *error)
{
	double ratio = recipe->buffer * GNP_PATCH_TAU;
	size_t most = (size_t)(4 * recipe->buffer * recipe->buffer * (double)recipe->k) + 64;
	if (recipe->reach)
		return gnp_neighborhoods_find(cloud->prepared.neighbors, centres, count, recipe->reach, 1, recipe->reach, scratch, found,
		                              error);
	return gnp_neighborhoods_find(cloud->prepared.neighbors, centres, count, recipe->k, ratio, most, scratch, found, error);
}

/* Patch p, from its row of found points; uvw: (row, 3) room for its coordinates. */
static gnp_status build_one(const struct gnp_train_cloud *cloud, const struct gnp_train_recipe *recipe,
                            const struct gnp_neighborhoods *found, size_t p, uint32_t centre, double *uvw,
                            struct gnp_train_patches *out, struct gnp_error *error)
{
	const struct gnp_patch_source source = {.points = cloud->prepared.points, .normals = cloud->prepared.normals,
	                                        .k = recipe->k, .delta0_ratio = recipe->delta0_ratio};
	const double *distance = found->distance + found->start[p];
	size_t length = found->start[p + 1] - found->start[p], nodes = 0;
	struct gnp_patch *patch = &out->patches[p];
	gnp_status status = gnp_patch_build(&source, found, p, centre, uvw, uvw + length, uvw + 2 * length, patch, error);
	if (status != GNP_OK)
		return status;
	while (nodes < length && distance[nodes] <= recipe->buffer * patch->epsilon)
		nodes++;
	fill_nodes(patch, nodes, out->nodes + 3 * out->start[p]);
	out->start[p + 1] = out->start[p] + nodes;
	out->inner[p] = patch->count;
	out->truth_start[p + 1] = out->truth_start[p] + fill_truth(cloud, patch, out->truth + out->truth_start[p]);
	return GNP_OK;
}

gnp_status gnp_train_patches_build(const struct gnp_train_cloud *cloud, const struct gnp_train_recipe *recipe,
                                   const uint32_t *centres, size_t count, struct gnp_scratch *scratch,
                                   struct gnp_train_patches *out, struct gnp_error *error)
{
	struct gnp_neighborhoods found;
	gnp_status status = find(cloud, recipe, centres, count, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	*out = (struct gnp_train_patches){.cloud = cloud, .count = count};
	double *uvw = gnp_scratch_take(scratch, found.start[count], 3 * sizeof *uvw);
	if (!uvw)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for patches of %zu points", found.start[count]);
	status = reserve(count, found.start[count], scratch, out, error);
	for (size_t p = 0; p < count && status == GNP_OK; p++)
		status = build_one(cloud, recipe, &found, p, centres[p], uvw + 3 * found.start[p], out, error);
	return status;
}

static uint32_t draw_centre(const struct gnp_train_cloud *cloud, struct gnp_random *random)
{
	uint32_t centre;
	do
		centre = (uint32_t)gnp_random_below(random, cloud->prepared.count);
	while (cloud->outlier[centre]);
	return centre;
}

gnp_status gnp_train_patches_draw(const struct gnp_train_cloud *cloud, const struct gnp_train_recipe *recipe, size_t count,
                                  struct gnp_random *random, struct gnp_scratch *scratch, struct gnp_train_patches *out,
                                  struct gnp_error *error)
{
	uint32_t *centres = gnp_scratch_take(scratch, count, sizeof *centres);
	if (!centres)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu patches", count);
	for (size_t p = 0; p < count; p++)
		centres[p] = draw_centre(cloud, random);
	return gnp_train_patches_build(cloud, recipe, centres, count, scratch, out, error);
}
