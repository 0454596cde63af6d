#include "weights/validate/real_cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "weights/protocol/protocol.h"

enum { STREAM_PLACES, STREAM_NOISE, STREAM_CENTRES };
enum { STRIPES = 20 };
static const double SPARSE = 0.1; /* the least density over the largest */

void gnp_real_cloud_clear(struct gnp_real_cloud *cloud)
{
	free(cloud->points);
	free(cloud->normals);
	free(cloud->mean_curvature);
	free(cloud->gaussian_curvature);
	free(cloud->edge);
	free(cloud->unjudged);
	free(cloud->centres);
	*cloud = (struct gnp_real_cloud){0};
}

gnp_status gnp_real_cloud_create(size_t count, struct gnp_real_cloud *out, struct gnp_error *error)
{
	struct gnp_real_cloud cloud = {.count = count};
	cloud.points = gnp_array_new(count, 3 * sizeof *cloud.points);
	cloud.normals = gnp_array_new(count, 3 * sizeof *cloud.normals);
	if (!cloud.points || !cloud.normals) {
		gnp_real_cloud_clear(&cloud);
		return gnp_no_memory("cloud", count, "points", error);
	}
	*out = cloud;
	return GNP_OK;
}

/* FNV-1a. */
uint64_t gnp_real_cloud_seed(const char *name)
{
	uint64_t hash = UINT64_C(14695981039346656037);
	for (; *name; name++)
		hash = (hash ^ (unsigned char)*name) * UINT64_C(1099511628211);
	return GNP_SEED_REAL + hash % (UINT64_C(1) << 40);
}

/* The first steps of a shuffle. */
gnp_status gnp_real_cloud_choose(struct gnp_real_cloud *cloud, size_t most, uint64_t seed, struct gnp_error *error)
{
	struct gnp_random random;
	size_t count = 0;
	cloud->centres = gnp_array_new(cloud->count, sizeof *cloud->centres);
	if (!cloud->centres)
		return gnp_no_memory("cloud", cloud->count, "centres", error);
	for (size_t i = 0; i < cloud->count; i++)
		if (!cloud->unjudged || !cloud->unjudged[i])
			cloud->centres[count++] = (uint32_t)i;
	cloud->centre_count = most == 0 || most > count ? count : most;
	gnp_random_seed(&random, seed, STREAM_CENTRES);
	for (size_t i = 0; i < cloud->centre_count && cloud->centre_count < count; i++) {
		size_t j = i + (size_t)gnp_random_below(&random, count - i);
		uint32_t other = cloud->centres[j];
		cloud->centres[j] = cloud->centres[i];
		cloud->centres[i] = other;
	}
	return count > 0 ? GNP_OK
	                 : gnp_error_set(error, GNP_INVALID_ARGUMENT, "cloud: none of its %zu points may be judged",
	                                 cloud->count);
}

/* ---- Samples ---- */

/* What places are drawn by. */
struct urn {
	const struct gnp_real_mesh *mesh;
	double *upto; /* (triangles) area of the triangles up to this one, itself included */
	enum gnp_real_density density;
	int axis; /* of the bounding box's longest side */
	double low, length;
};

static void find_axis(struct urn *urn)
{
	const struct gnp_real_mesh *mesh = urn->mesh;
	for (int axis = 0; axis < 3; axis++) {
		double low = INFINITY, high = -INFINITY;
		for (size_t i = 0; i < mesh->vertex_count; i++) {
			low = fmin(low, mesh->vertices[3 * i + axis]);
			high = fmax(high, mesh->vertices[3 * i + axis]);
		}
		if (axis == 0 || high - low > urn->length) {
			urn->axis = axis;
			urn->low = low;
			urn->length = high - low;
		}
	}
}

static size_t draw_triangle(const struct urn *urn, struct gnp_random *random)
{
	size_t low = 0, high = urn->mesh->triangle_count - 1;
	double wanted = gnp_random_uniform(random) * urn->upto[high];
	while (low < high) {
		size_t middle = (low + high) / 2;
		if (urn->upto[middle] > wanted)
			high = middle;
		else
			low = middle + 1;
	}
	return low;
}

/* Uniform on the triangle: a parallelogram's half is folded onto the other one. */
static void draw_place(const struct urn *urn, size_t triangle, struct gnp_random *random, double place[3])
{
	const uint32_t *corner = urn->mesh->triangles + 3 * triangle;
	const double *vertices = urn->mesh->vertices;
	double s = gnp_random_uniform(random), t = gnp_random_uniform(random);
	if (s + t > 1) {
		s = 1 - s;
		t = 1 - t;
	}
	for (int c = 0; c < 3; c++)
		place[c] = (1 - s - t) * vertices[3 * (size_t)corner[0] + c] + s * vertices[3 * (size_t)corner[1] + c] +
		           t * vertices[3 * (size_t)corner[2] + c];
}

/* Relative density in (0, 1]. */
static double density_at(const struct urn *urn, const double place[3])
{
	double along = (place[urn->axis] - urn->low) / urn->length;
	switch (urn->density) {
	case GNP_REAL_STRIPES: return (int)floor(along * STRIPES) % 2 == 0 ? 1 : SPARSE;
	case GNP_REAL_GRADIENT: return 1 - (1 - SPARSE) * along;
	default: return 1;
	}
}

static void draw_points(const struct urn *urn, const struct gnp_real_sampling *sampling, struct gnp_real_cloud *cloud)
{
	struct gnp_random places, noise;
	double deviation = sampling->noise * urn->mesh->diagonal;
	gnp_random_seed(&places, sampling->seed, STREAM_PLACES);
	gnp_random_seed(&noise, sampling->seed, STREAM_NOISE);
	for (size_t i = 0; i < cloud->count;) {
		double *point = cloud->points + 3 * i;
		size_t triangle = draw_triangle(urn, &places);
		draw_place(urn, triangle, &places, point);
		if (urn->density != GNP_REAL_EVEN && gnp_random_uniform(&places) >= density_at(urn, point))
			continue;
		gnp_real_mesh_normal(urn->mesh, triangle, cloud->normals + 3 * i);
		for (int c = 0; c < 3 && deviation > 0; c++)
			point[c] += deviation * gnp_random_normal(&noise);
		i++;
	}
}

gnp_status gnp_real_cloud_sample(const struct gnp_real_mesh *mesh, const struct gnp_real_sampling *sampling,
                                 struct gnp_real_cloud *out, struct gnp_error *error)
{
	struct urn urn = {.mesh = mesh, .density = sampling->density};
	double area = 0, normal[3];
	urn.upto = gnp_array_new(mesh->triangle_count, sizeof *urn.upto);
	if (!urn.upto)
		return gnp_no_memory("cloud", mesh->triangle_count, "triangles", error);
	gnp_status status = gnp_real_cloud_create(sampling->count, out, error);
	if (status == GNP_OK) {
		for (size_t t = 0; t < mesh->triangle_count; t++)
			urn.upto[t] = area += gnp_real_mesh_normal(mesh, t, normal);
		find_axis(&urn);
		draw_points(&urn, sampling, out);
	}
	free(urn.upto);
	return status;
}

gnp_status gnp_real_cloud_vertices(const struct gnp_real_mesh *mesh, struct gnp_real_cloud *out,
                                   struct gnp_error *error)
{
	struct gnp_real_cloud cloud;
	gnp_status status = gnp_real_cloud_create(mesh->vertex_count, &cloud, error);
	if (status != GNP_OK)
		return status;
	gnp_real_mesh_vertex_normals(mesh, cloud.normals);
	cloud.count = 0;
	for (size_t i = 0; i < mesh->vertex_count; i++) {
		const double *normal = cloud.normals + 3 * i;
		if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)
			continue;
		memcpy(cloud.points + 3 * cloud.count, mesh->vertices + 3 * i, 3 * sizeof(double));
		memmove(cloud.normals + 3 * cloud.count, normal, 3 * sizeof(double));
		cloud.count++;
	}
	*out = cloud;
	return GNP_OK;
}
