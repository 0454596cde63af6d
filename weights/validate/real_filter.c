#include "weights/validate/real_filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/estimate/filter.h"

enum { STREAM = 7 }; /* of random numbers; the cloud's own have others */
enum { GOOD, DISPLACED, OUTLIER };
static const double SHARE = 0.1;

/* Displaces points and says what each is then. */
static void plant(const struct gnp_real_cloud *cloud, const struct gnp_real_planting *planting, double *points,
                  unsigned char *what)
{
	struct gnp_random random;
	gnp_random_seed(&random, planting->seed, STREAM);
	for (size_t i = 0; i < cloud->count && planting->deviation > 0; i++) {
		double step[3];
		if (gnp_random_uniform(&random) >= SHARE)
			continue;
		for (int c = 0; c < 3; c++) {
			step[c] = planting->deviation * gnp_random_normal(&random);
			points[3 * i + c] += step[c];
		}
		what[i] = fabs(gnp_dot(step, cloud->normals + 3 * i)) > planting->beyond ? OUTLIER : DISPLACED;
	}
}

static struct gnp_real_filtered count(const unsigned char *what, const unsigned char *keep, size_t points)
{
	struct gnp_real_filtered filtered = {0};
	for (size_t i = 0; i < points; i++) {
		filtered.good += what[i] == GOOD;
		filtered.dropped += what[i] == GOOD && !keep[i];
		filtered.outliers += what[i] == OUTLIER;
		filtered.found += what[i] == OUTLIER && !keep[i];
	}
	return filtered;
}

gnp_status gnp_real_filter_judge(const struct gnp_real_cloud *cloud, const struct gnp_real_planting *planting,
                                 const struct gnp_models *models, struct gnp_pool *pool,
                                 struct gnp_real_filtered *out, struct gnp_error *error)
{
	struct gnp_filter_options options = gnp_filter_defaults();
	struct gnp_filter filter;
	double *points = gnp_array_new(cloud->count, 3 * sizeof *points);
	unsigned char *what = gnp_array_zero(cloud->count, 1);
	gnp_status status = points && what ? GNP_OK : gnp_no_memory("filter", cloud->count, "points", error);
	options.estimate.estimator = GNP_ESTIMATOR_GNP; /* as the operation's default is */
	options.estimate.models = models;
	if (status == GNP_OK) {
		memcpy(points, cloud->points, 3 * cloud->count * sizeof *points);
		plant(cloud, planting, points, what);
		const struct gnp_cloud planted = {cloud->count, points, NULL};
		status = gnp_filter_run(&planted, &options, pool, NULL, &filter, error);
	}
	if (status == GNP_OK) {
		*out = count(what, filter.keep, cloud->count);
		gnp_filter_clear(&filter);
	}
	free(points);
	free(what);
	return status;
}
