#include "weights/train/any/any_watch.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/network/weighted_head.h"
#include "core/support/moments.h"
#include "weights/protocol/protocol.h"
#include "weights/train/any/any_loss.h"
#include "weights/train/any/any_supports.h"

static const uint64_t STREAM_CLOUD = UINT64_C(0x21) << 56, STREAM_CENTRES = UINT64_C(0x25) << 56;
enum { PLANES = 5, SUPPORTS_AT_A_TIME = 20 };
static const size_t plane_points[PLANES] = {10, 18, 30, 50, 112};

/* Sums over the centres of a cloud. */
struct outcome {
	size_t count, curved, inside[2], creases[2][2]; /* creases: [true][flagged] */
	double square, frame, plane[PLANES];            /* of angles [rad] */
	double curvature;                               /* of logarithms */
};

struct gnp_any_watch {
	struct gnp_pool *pool;
	const struct gnp_network *network; /* during a run */
	size_t count, centres;             /* clouds; of each */
	struct gnp_any_cloud *clouds;      /* (count) */
	struct outcome *outcomes;          /* (count) */
};

const char *gnp_any_figure_name(enum gnp_any_figure figure)
{
	static const char *const names[GNP_ANY_FIGURES] = {"ratio",    "angle",    "frame_angle",      "curvature",
	                                                   "inside_1", "inside_2", "crease_precision", "crease_recall"};
	return (unsigned)figure < GNP_ANY_FIGURES ? names[figure] : NULL;
}

/* ---- The clouds ---- */

static gnp_status make_cloud(const struct gnp_any_recipe *recipe, size_t i, struct gnp_pool *pool,
                             struct gnp_any_cloud *out, struct gnp_error *error)
{
	enum { LEVELS = 6 };
	static const double noise[LEVELS] = {0, 0.05, 0.3, 1, 2.4, 4.5};
	struct gnp_any_recipe watched = *recipe;
	watched.group = (enum gnp_any_group)(i % GNP_ANY_GROUPS);
	watched.noise = noise[i / GNP_ANY_GROUPS % LEVELS];
	watched.normal_noise = watched.outliers = watched.given = 0;
	return gnp_any_cloud_create(&watched, GNP_SEED_WATCH + i, STREAM_CLOUD, pool, out, error);
}

gnp_status gnp_any_watch_open(const struct gnp_any_recipe *recipe, size_t clouds, size_t centres, struct gnp_pool *pool,
                              struct gnp_any_watch **out, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	struct gnp_any_watch *watch = gnp_array_zero(1, sizeof *watch);
	if (!watch)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory");
	*watch = (struct gnp_any_watch){.pool = pool,
	                                .count = clouds,
	                                .centres = centres,
	                                .clouds = gnp_array_zero(clouds, sizeof *watch->clouds),
	                                .outcomes = gnp_array_new(clouds, sizeof *watch->outcomes)};
	if (!watch->clouds || !watch->outcomes)
		status = gnp_no_memory("watched clouds", clouds, "of them", error);
	for (size_t i = 0; i < clouds && status == GNP_OK; i++)
		status = make_cloud(recipe, i, pool, &watch->clouds[i], error);
	if (status == GNP_OK)
		*out = watch;
	else
		gnp_any_watch_close(watch);
	return status;
}

void gnp_any_watch_close(struct gnp_any_watch *watch)
{
	if (!watch)
		return;
	for (size_t i = 0; watch->clouds && i < watch->count; i++)
		gnp_any_cloud_clear(&watch->clouds[i]);
	free(watch->clouds);
	free(watch->outcomes);
	free(watch);
}

/* ---- A look ---- */

static double angle_between(const double a[3], const double b[3])
{
	return acos(fmin(1, fabs(gnp_dot(a, b))));
}

/* Of planes fitted to the nearest points. */
static void judge_planes(const struct gnp_any_cloud *cloud, const uint32_t *index, size_t count, const double *normal,
                         struct outcome *outcome)
{
	struct gnp_moments moments = {0};
	const double *points = cloud->prepared.points, *origin = points + 3 * (size_t)index[0];
	double variance[3], axes[3][3];
	size_t i = 0;
	for (int p = 0; p < PLANES; p++) {
		for (; i < plane_points[p] && i < count; i++)
			gnp_moments_add(&moments, origin, points + 3 * (size_t)index[i]);
		gnp_moments_axes(&moments, variance, axes);
		outcome->plane[p] += pow(angle_between(axes[2], normal), 2);
	}
}

static void judge_support(const struct gnp_any_cloud *cloud, const struct gnp_support *support,
                          const struct gnp_weighted_fit *fit, const float *outputs, struct outcome *outcome)
{
	static const double TINY = 1e-6, QUIET = 0.2;
	struct gnp_any_truth truth;
	struct gnp_any_error made;
	double dcoefficients[GNP_TAYLOR_SIZE];
	gnp_any_truth_find(cloud, support, &truth);
	gnp_any_loss_surface(&truth, fit->coefficients, dcoefficients, &made);
	double variance = gnp_weighted_variance(outputs, gnp_weighted_error(support, fit)).slope;
	outcome->count++;
	outcome->square += made.angle * made.angle;
	outcome->frame += pow(acos(fmin(1, truth.normal[2])), 2);
	for (int i = 0; i < 2; i++)
		outcome->inside[i] += made.angle < (i + 1) * sqrt(2 * variance); /* two directions */
	if (truth.curved) {
		outcome->curvature += log(made.relative + TINY);
		outcome->curved++;
	}
	if (cloud->noise < QUIET && !cloud->faceted)
		outcome->creases[cloud->edge[support->centre] < 1][outputs[GNP_WEIGHTED_CREASE] > 0]++;
}

static gnp_status judge_some(const struct gnp_network *network, const struct gnp_any_cloud *cloud, size_t count,
                             struct gnp_random *random, struct gnp_scratch *scratch, struct outcome *outcome,
                             struct gnp_error *error)
{
	enum { WIDEST = 112 };
	const struct gnp_support *supports[SUPPORTS_AT_A_TIME];
	const struct gnp_any_cloud *clouds[SUPPORTS_AT_A_TIME];
	uint32_t centres[SUPPORTS_AT_A_TIME];
	struct gnp_neighborhoods found;
	struct gnp_weighted_pass pass;
	size_t made = 0, most = WIDEST < cloud->count ? WIDEST : cloud->count;
	gnp_any_supports_centres(cloud, false, count, random, centres);
	gnp_status status =
		gnp_any_supports_build(cloud, network, centres, count, random, scratch, supports, clouds, &made, error);
	if (status == GNP_OK && made)
		status = gnp_weighted_infer(network, supports, made, &pass, scratch, error);
	for (size_t p = 0; p < made && status == GNP_OK; p++)
		judge_support(cloud, supports[p], &pass.fits[p], pass.outputs + p * GNP_WEIGHTED_OUTPUTS, outcome);
	if (status == GNP_OK)
		status =
			gnp_neighborhoods_find(cloud->prepared.neighbors, centres, count, most, 1, most, scratch, &found, error);
	for (size_t p = 0; p < count && status == GNP_OK; p++)
		judge_planes(cloud, found.index + found.start[p], found.start[p + 1] - found.start[p],
		             cloud->normals + 3 * (size_t)centres[p], outcome);
	return status;
}

static gnp_status judge_clouds(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	struct gnp_any_watch *watch = context;
	gnp_status status = GNP_OK;
	for (size_t i = begin; i < end; i++) {
		struct gnp_random random;
		gnp_random_seed(&random, GNP_SEED_WATCH + i, STREAM_CENTRES);
		watch->outcomes[i] = (struct outcome){0};
		for (size_t done = 0; done < watch->centres && status == GNP_OK; done += SUPPORTS_AT_A_TIME) {
			size_t left = watch->centres - done;
			struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
			status =
				judge_some(watch->network, &watch->clouds[i], left < SUPPORTS_AT_A_TIME ? left : SUPPORTS_AT_A_TIME,
			               &random, scratch, &watch->outcomes[i], error);
			gnp_scratch_release(scratch, mark);
		}
	}
	return status;
}

/* ---- The figures ---- */

static double ratio_of(const struct outcome *outcome)
{
	double best = outcome->plane[0];
	for (int p = 1; p < PLANES; p++)
		best = fmin(best, outcome->plane[p]);
	return sqrt(outcome->square / best);
}

static void summarise(const struct gnp_any_watch *watch, double figures[GNP_ANY_FIGURES])
{
	struct outcome sum = {0};
	double ratios = 0, degree = 180 / M_PI;
	for (size_t i = 0; i < watch->count; i++) {
		const struct outcome *one = &watch->outcomes[i];
		ratios += log(ratio_of(one));
		sum.count += one->count;
		sum.square += one->square;
		sum.frame += one->frame;
		sum.curvature += one->curvature;
		sum.curved += one->curved;
		for (int k = 0; k < 2; k++) {
			sum.inside[k] += one->inside[k];
			sum.creases[0][k] += one->creases[0][k];
			sum.creases[1][k] += one->creases[1][k];
		}
	}
	double count = (double)sum.count, found = (double)sum.creases[1][1];
	figures[GNP_ANY_RATIO] = exp(ratios / (double)watch->count);
	figures[GNP_ANY_ANGLE] = degree * sqrt(sum.square / count);
	figures[GNP_ANY_FRAME] = degree * sqrt(sum.frame / count);
	figures[GNP_ANY_CURVATURE] = exp(sum.curvature / (double)sum.curved);
	figures[GNP_ANY_INSIDE_1] = (double)sum.inside[0] / count;
	figures[GNP_ANY_INSIDE_2] = (double)sum.inside[1] / count;
	figures[GNP_ANY_PRECISION] = found / (found + (double)sum.creases[0][1]);
	figures[GNP_ANY_RECALL] = found / (found + (double)sum.creases[1][0]);
}

gnp_status gnp_any_watch_run(struct gnp_any_watch *watch, const struct gnp_network *network,
                             double figures[GNP_ANY_FIGURES], struct gnp_error *error)
{
	watch->network = network;
	gnp_status status = gnp_pool_run(watch->pool, NULL, watch->count, 1, judge_clouds, watch, error);
	if (status == GNP_OK)
		summarise(watch, figures);
	return status;
}
