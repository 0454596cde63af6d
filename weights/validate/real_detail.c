#include "weights/validate/real_detail.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "weights/validate/judged.h"

/* Sums over far points. */
struct sums {
	double angle, mean[2], gaussian[2]; /* squares: of angles; of errors and truths */
};

/* The angle between lines [radian]; a quarter turn where there is no direction. */
static double angle_to(const double *truth, const double *normal)
{
	double cross[3], along = fabs(gnp_dot(truth, normal));
	gnp_cross(truth, normal, cross);
	double angle = atan2(sqrt(gnp_dot(cross, cross)), along);
	return isfinite(angle) && along + sqrt(gnp_dot(cross, cross)) > 0 ? angle : M_PI / 2;
}

static void count_within(double error, double bar, size_t within[GNP_REAL_BARS])
{
	for (int b = 0; b < GNP_REAL_BARS; b++)
		within[b] += fabs(error) <= (b + 1) * bar;
}

/* The point `at`, row i of the estimate. */
static void add_far(const struct gnp_real_cloud *cloud, size_t at, const struct gnp_estimate *estimate, size_t i,
                    struct sums *sums, struct gnp_real_detail *detail)
{
	const double *truth = cloud->normals + 3 * at, *normal = estimate->values[GNP_NORMALS] + 3 * i;
	double angle = angle_to(truth, normal), side = gnp_dot(truth, normal) < 0 ? -1 : 1;
	double mean = side * estimate->values[GNP_MEAN_CURVATURE][i] - cloud->mean_curvature[at];
	double gaussian = estimate->values[GNP_GAUSSIAN_CURVATURE][i] - cloud->gaussian_curvature[at];
	detail->far++;
	sums->angle += angle * angle;
	sums->mean[0] += mean * mean;
	sums->mean[1] += cloud->mean_curvature[at] * cloud->mean_curvature[at];
	sums->gaussian[0] += gaussian * gaussian;
	sums->gaussian[1] += cloud->gaussian_curvature[at] * cloud->gaussian_curvature[at];
	count_within(angle, estimate->values[GNP_NORMALS_STDERR][i], detail->normals_within);
	count_within(mean, estimate->values[GNP_MEAN_CURVATURE_STDERR][i], detail->curvature_within);
}

/* Bodies are of a size of about 1, so that what is curved at all has a larger truth. */
static double relative(const double squares[2], size_t count)
{
	static const double flat = 1e-3;
	return squares[1] > flat * flat * (double)count ? sqrt(squares[0] / squares[1]) : NAN;
}

static struct gnp_real_detail score(const struct gnp_real_cloud *cloud, const uint32_t *centres, size_t count,
                                    const struct gnp_estimate *estimate)
{
	struct gnp_real_detail detail = {.centres = count};
	const double *crease = estimate->values[GNP_CREASE];
	struct sums sums = {0};
	for (size_t i = 0; i < count; i++) {
		bool near = cloud->edge && cloud->edge[centres[i]] <= 1, flagged = crease && !cloud->open && crease[i] > 0.5;
		detail.near += near;
		detail.flagged += flagged;
		detail.found += near && flagged;
		if (!near)
			add_far(cloud, centres[i], estimate, i, &sums, &detail);
	}
	detail.angle = sqrt(sums.angle / (double)detail.far) * 180 / M_PI;
	detail.mean_curvature = relative(sums.mean, detail.far);
	detail.gaussian_curvature = relative(sums.gaussian, detail.far);
	return detail;
}

gnp_status gnp_real_detail_judge(const struct gnp_real_method *method, const struct gnp_real_cloud *cloud,
                                 size_t most, struct gnp_pool *pool, struct gnp_real_detail *out,
                                 struct gnp_error *error)
{
	const struct gnp_cloud points = {cloud->count, cloud->points, NULL};
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_estimate estimate;
	size_t count = most == 0 || most > cloud->count ? cloud->count : most;
	uint32_t *centres = gnp_array_new(count, sizeof *centres);
	if (!centres)
		return gnp_no_memory("detail", count, "centres", error);
	for (size_t i = 0; i < count; i++)
		centres[i] = (uint32_t)(i * cloud->count / count);
	options.estimator = method->estimator;
	options.model = method->model;
	options.models = method->models;
	options.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE) |
	                     GNP_QUANTITY_BIT(GNP_GAUSSIAN_CURVATURE) | GNP_QUANTITY_BIT(GNP_NORMALS_STDERR) |
	                     GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE_STDERR);
	options.if_offered = GNP_QUANTITY_BIT(GNP_CREASE);
	gnp_status status = gnp_judged_at(&points, &options, centres, count, pool, &estimate, error);
	if (status == GNP_OK) {
		*out = score(cloud, centres, count, &estimate);
		gnp_estimate_clear(&estimate);
	}
	free(centres);
	return status;
}
