#include "weights/train/any/any_cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"

struct gnp_any_recipe gnp_any_recipe_defaults(void)
{
	return (struct gnp_any_recipe){
		.group = GNP_ANY_MIXED, .least = 3000, .most = 30000, .noise = -1, .normal_noise = 0.4, .outliers = -1,
		.given = 0.2};
}

static double between(struct gnp_random *random, double low, double high)
{
	return low + (high - low) * gnp_random_uniform(random);
}

static double between_logarithms(struct gnp_random *random, double low, double high)
{
	return exp(between(random, log(low), log(high)));
}

/* ---- What is done to a surface ---- */

struct harm {
	double noise, outliers, far; /* far: of outliers [spacing] */
	bool along;                  /* noise is along the normals */
	bool given;
	double tilt; /* of given normals */
};

static struct harm draw_harm(const struct gnp_any_recipe *recipe, struct gnp_random *random)
{
	struct harm harm = {.noise = recipe->noise, .outliers = recipe->outliers};
	double level = gnp_random_uniform(random);
	if (recipe->noise < 0)
		harm.noise = level < 0.3    ? 0
		             : level < 0.65 ? between_logarithms(random, 0.003, 0.5)
		                            : between_logarithms(random, 0.5, 5);
	harm.along = gnp_random_uniform(random) < recipe->normal_noise;
	if (recipe->outliers < 0)
		harm.outliers = gnp_random_uniform(random) < 0.35 ? between(random, 0, 0.3) : 0;
	if (recipe->noise < 0 && harm.outliers > 0 && gnp_random_uniform(random) < 0.5)
		harm.noise = 0;
	harm.far = between_logarithms(random, 0.03, 20);
	harm.given = gnp_random_uniform(random) < recipe->given;
	harm.tilt = gnp_random_uniform(random) < 0.3 ? 0 : between(random, 0, 0.2);
	return harm;
}

static enum gnp_any_outlier outlier_of(const struct harm *harm, double across)
{
	static const double DEVIATIONS = 3, LEAST = 0.02;
	return across > DEVIATIONS * harm->noise && across > LEAST ? GNP_ANY_OUTLIER : GNP_ANY_UNSURE;
}

static void displace(const struct harm *harm, const struct gnp_any_surface *surface, struct gnp_random *random,
                     double *points, unsigned char *outlier)
{
	for (size_t i = 0; i < surface->count; i++) {
		const double *exact = surface->points + 3 * i, *normal = surface->normals + 3 * i;
		bool far = gnp_random_uniform(random) < harm->outliers;
		double step[3], along = harm->along ? harm->noise * gnp_random_normal(random) : 0;
		for (int c = 0; c < 3; c++) {
			step[c] = harm->along ? along * normal[c] : harm->noise * gnp_random_normal(random);
			step[c] += far ? harm->far * gnp_random_normal(random) : 0;
			points[3 * i + (size_t)c] = exact[c] + step[c] * surface->spacing;
		}
		outlier[i] = far ? outlier_of(harm, fabs(gnp_dot(step, normal))) : GNP_ANY_GOOD;
	}
}

static void tilt_normals(double tilt, const struct gnp_any_surface *surface, struct gnp_random *random, double *normals)
{
	for (size_t i = 0; i < surface->count; i++) {
		double *n = normals + 3 * i;
		for (size_t c = 0; c < 3; c++)
			n[c] = surface->normals[3 * i + c] + tilt * gnp_random_normal(random);
		double length = sqrt(gnp_dot(n, n));
		for (size_t c = 0; c < 3; c++)
			n[c] /= length;
	}
}

/* Arrays of the surface into curve order: rows of `size` bytes. */
static void *reorder(const void *from, size_t size, const uint32_t *order, size_t count)
{
	char *to = gnp_array_new(count, size);
	for (size_t i = 0; to && i < count; i++)
		memcpy(to + i * size, (const char *)from + order[i] * size, size);
	return to;
}

static gnp_status take_truth(const struct gnp_any_surface *surface, const unsigned char *outlier,
                             struct gnp_any_cloud *out, struct gnp_error *error)
{
	const uint32_t *order = out->prepared.order;
	size_t n = surface->count;
	out->normals = reorder(surface->normals, 3 * sizeof *out->normals, order, n);
	out->second_form = reorder(surface->second_form, 9 * sizeof *out->second_form, order, n);
	out->piece = reorder(surface->piece, sizeof *out->piece, order, n);
	out->edge = reorder(surface->edge, sizeof *out->edge, order, n);
	out->outlier = reorder(outlier, sizeof *outlier, order, n);
	if (out->normals && out->second_form && out->piece && out->edge && out->outlier)
		return GNP_OK;
	return gnp_no_memory("training", n, "points", error);
}

static gnp_status enter(const struct harm *harm, const struct gnp_any_surface *surface, struct gnp_random *random,
                        struct gnp_pool *pool, struct gnp_any_cloud *out, struct gnp_error *error)
{
	size_t n = surface->count;
	double *points = gnp_array_new(n, 3 * sizeof *points);
	double *given = harm->given ? gnp_array_new(n, 3 * sizeof *given) : NULL;
	unsigned char *outlier = gnp_array_new(n, sizeof *outlier);
	gnp_status status = GNP_OK;
	if (!points || !outlier || (harm->given && !given))
		status = gnp_no_memory("training", n, "points", error);
	if (status == GNP_OK) {
		displace(harm, surface, random, points, outlier);
		if (given)
			tilt_normals(harm->tilt, surface, random, given);
		const struct gnp_cloud cloud = {n, points, given};
		status = gnp_prepare(&cloud, pool, NULL, &out->prepared, error);
	}
	if (status == GNP_OK)
		status = take_truth(surface, outlier, out, error);
	if (status == GNP_OK)
		status = gnp_roughness_measure(out->prepared.neighbors, pool, NULL, &out->roughness, error);
	free(points);
	free(given);
	free(outlier);
	return status;
}

gnp_status gnp_any_cloud_create(const struct gnp_any_recipe *recipe, uint64_t seed, uint64_t stream,
                                struct gnp_pool *pool, struct gnp_any_cloud *out, struct gnp_error *error)
{
	struct gnp_random random;
	struct gnp_any_surface surface;
	gnp_random_seed(&random, seed, stream);
	size_t count = (size_t)lround(between_logarithms(&random, (double)recipe->least, (double)recipe->most));
	gnp_status status = gnp_any_surface_draw(recipe->group, count, &random, pool, &surface, error);
	if (status != GNP_OK)
		return status;
	const struct harm harm = draw_harm(recipe, &random);
	struct gnp_any_cloud cloud = {
		.count = surface.count, .noise = harm.noise, .given = harm.given, .faceted = surface.faceted};
	memcpy(cloud.name, surface.name, sizeof cloud.name);
	status = enter(&harm, &surface, &random, pool, &cloud, error);
	gnp_any_surface_clear(&surface);
	if (status == GNP_OK)
		*out = cloud;
	else
		gnp_any_cloud_clear(&cloud);
	return status;
}

void gnp_any_cloud_clear(struct gnp_any_cloud *cloud)
{
	gnp_prepared_clear(&cloud->prepared);
	gnp_roughness_clear(&cloud->roughness);
	free(cloud->normals);
	free(cloud->second_form);
	free(cloud->piece);
	free(cloud->edge);
	free(cloud->outlier);
	*cloud = (struct gnp_any_cloud){.count = 0};
}

struct gnp_support_cloud gnp_any_cloud_source(const struct gnp_any_cloud *cloud)
{
	return (struct gnp_support_cloud){cloud->prepared.points, cloud->prepared.normals, cloud->given,
	                                  cloud->prepared.neighbors, &cloud->roughness};
}
