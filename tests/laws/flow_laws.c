/* flow_laws [CASE]: mean-curvature flow against its laws, and filtering, at full size; minutes. `make build/tests/laws/flow_laws`. */
#include <stdio.h>

#include "core/estimate/filter.h"
#include "core/flow/flow.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"
#include "tests/laws/flow_laws.h"

static struct gnp_pool *pool;
static struct gnp_models *models;

static void fail(const char *what, const struct gnp_error *error)
{
	fprintf(stderr, "flow_laws: %s: %s\n", what, error->text);
	exit(1);
}

/* ---- Clouds and flows ---- */

static struct gnp_sample sampled(const char *name, const struct gnp_sample_options *options)
{
	struct gnp_shape *shape;
	struct gnp_sample sample;
	struct gnp_error error = {0};
	if (gnp_shape_create(name, 1, 6, &shape, &error) != GNP_OK || gnp_sample_create(shape, options, pool, NULL, &sample, &error) != GNP_OK)
		fail(name, &error);
	gnp_shape_free(shape);
	return sample;
}

static struct gnp_estimate_options with(const char *weights)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_error error = {0};
	options.estimator = GNP_ESTIMATOR_GNP;
	options.models = models;
	if (gnp_models_find(models, weights, &options.model, &error) != GNP_OK)
		fail(weights, &error);
	return options;
}

/* False, with the error in *error, when no step can be taken. */
static bool flow_on(const struct gnp_cloud *cloud, const unsigned char *fixed, const struct gnp_flow_options *options,
                    struct gnp_flow *flow, struct gnp_error *error)
{
	*error = (struct gnp_error){0};
	return gnp_flow_run(cloud, fixed, options, pool, NULL, flow, error) == GNP_OK;
}

static struct gnp_flow flowed(const struct gnp_cloud *cloud, const unsigned char *fixed, const struct gnp_flow_options *options)
{
	struct gnp_flow flow;
	struct gnp_error error;
	if (!flow_on(cloud, fixed, options, &flow, &error))
		fail("flow", &error);
	return flow;
}

static struct gnp_flow flowed_sample(const char *name, size_t count, const struct gnp_flow_options *options)
{
	struct gnp_sample sample = sampled(name, &(struct gnp_sample_options){.count = count, .seed = 7});
	struct gnp_flow flow = flowed(&(struct gnp_cloud){count, sample.points, sample.normals}, NULL, options);
	gnp_sample_clear(&sample);
	return flow;
}

static void report(const char *name, const struct gnp_flow *flow)
{
	const struct gnp_flow_record *last = &flow->records[flow->steps];
	double seconds = 0;
	for (size_t step = 1; step <= flow->steps; step++)
		seconds += flow->records[step].seconds / (double)flow->steps;
	printf("%s: %zu points, %zu steps to time %.5f at %.3f s, %.0f points left, stop %s\n", name, (size_t)flow->records[0].points, flow->steps,
	       last->time, seconds, last->points, gnp_flow_stop_name(flow->stop));
	fflush(stdout);
}

/* ---- Cases ---- */

static void sphere(void)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = GNP_FLOW_EXPLICIT;
	options.estimate = with("fit_clean_50k");
	options.steps = 500;
	options.dt = 1e-4;
	struct gnp_flow flow = flowed_sample("sphere", 100000, &options);
	struct spread spread = radii(flow.points, flow.normals, flow.count);
	report("sphere", &flow);
	printf("    R^2 over R0^2 - 2t less 1: %.2e (limit 1e-3); farthest off round: %.2e of R (limit 2e-3)\n",
	       spread.mean * spread.mean / (1 - 2 * flow.records[flow.steps].time) - 1, spread.worst);
	gnp_flow_clear(&flow);
}

static void held_cylinder(void)
{
	struct cloud cloud = cylinder(0.5, 1, 0.016);
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = GNP_FLOW_EXPLICIT;
	double sum = 0, count = 0;
	options.estimate = with("fit_clean_50k");
	options.steps = 250;
	options.dt = 2e-4;
	struct gnp_flow flow = flowed(&(struct gnp_cloud){cloud.count, cloud.points, cloud.normals}, cloud.fixed, &options);
	for (size_t i = 0; i < flow.count; i++)
		if (fabs(flow.points[3 * i + 2]) < 0.1) {
			sum += pow(flow.points[3 * i], 2) + pow(flow.points[3 * i + 1], 2);
			count++;
		}
	report("cylinder, ends held", &flow);
	printf("    R^2 half way between the ends over R0^2 - t less 1: %.2e\n", sum / count / (0.25 - flow.records[flow.steps].time) - 1);
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void torus(void)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.estimate = with("fit_clean_50k");
	options.scheme = GNP_FLOW_SEMI_IMPLICIT;
	options.steps = 2000;
	struct gnp_flow flow = flowed_sample("torus", 20000, &options);
	const struct gnp_flow_record *start = flow.records, *end = &flow.records[flow.steps];
	report("torus of 2/3 and 1/3", &flow);
	/* of a torus: area 4 pi^2 R r, volume 2 pi^2 R r^2 */
	printf("    tube's radius by volume and area: %.4f at the start, %.4f at the end; %s\n", 2 * start->volume / start->area,
	       2 * end->volume / end->area, flow.reason);
	gnp_flow_clear(&flow);
}

static void bumpy_torus(void)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = GNP_FLOW_EXPLICIT;
	options.estimate = with("fit_clean_50k");
	options.steps = 60;
	options.snapshot_every = 10;
	struct gnp_flow flow = flowed_sample("bumpy_torus", 20000, &options);
	report("bumpy torus", &flow);
	printf("    bumps of 0.035 every %d steps:", options.snapshot_every);
	for (size_t s = 0; s < flow.snapshots.count; s++)
		printf(" %.5f", bumps(flow.snapshots.points + 3 * flow.snapshots.start[s], flow.snapshots.start[s + 1] - flow.snapshots.start[s]));
	printf("\n");
	gnp_flow_clear(&flow);
}

static void kept_ellipsoid(void)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.estimate = with("fit_clean_50k");
	options.scheme = GNP_FLOW_SEMI_IMPLICIT;
	options.volume = GNP_FLOW_VOLUME_PRESERVE;
	options.steps = 250;
	options.dt = 0.01;
	struct gnp_flow flow = flowed_sample("ellipsoid", 10000, &options);
	struct spread spread = radii(flow.points, flow.normals, flow.count);
	report("ellipsoid of 1, 0.8, 0.6, volume kept", &flow);
	printf("    R^3 over 0.48 less 1: %.2e (limit 5e-3); farthest off round: %.2e of R\n", pow(spread.mean, 3) / 0.48 - 1, spread.worst);
	gnp_flow_clear(&flow);
}

static void catenoid(void)
{
	struct cloud cloud = cylinder(1, 0.5, 0.03);
	struct gnp_flow_options options = gnp_flow_defaults();
	options.estimate = with("fit_clean_50k");
	options.scheme = GNP_FLOW_SEMI_IMPLICIT;
	options.steps = 200;
	options.dt = 0.01;
	struct gnp_flow flow = flowed(&(struct gnp_cloud){cloud.count, cloud.points, cloud.normals}, cloud.fixed, &options);
	report("cylinder between rings", &flow);
	printf("    farthest off the catenoid: %.2e of its radius (limit 1e-2)\n", off_catenoid(flow.points, flow.count));
	gnp_flow_clear(&flow);
	cloud_free(&cloud);
}

static void conformal(void)
{
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = GNP_FLOW_CONFORMAL;
	options.volume = GNP_FLOW_VOLUME_PRESERVE;
	options.steps = 200;
	options.dt = 0.05;
	struct gnp_flow flow = flowed_sample("radial", 20000, &options);
	struct spread spread = radii(flow.points, flow.normals, flow.count);
	report("radial manifold, conformal", &flow);
	printf("    farthest off round: %.2e of R\n", spread.worst);
	gnp_flow_clear(&flow);
}

/* dt 1.6 h^2 and no smoothing: what fits make of noise is all there is. */
static void disturbed(const char *name, const struct gnp_sample_options *disturbance, const char *weights)
{
	struct gnp_sample sample = sampled("bumpy_torus", disturbance);
	const struct gnp_cloud cloud = {sample.count, sample.points, sample.normals};
	struct gnp_flow_options options = gnp_flow_defaults();
	options.scheme = GNP_FLOW_EXPLICIT;
	struct gnp_flow flow;
	struct gnp_error error;
	options.dt = 1.6 * 9.03 / (double)sample.count;
	options.smoothing_radius = 0;
	options.steps = 40;
	options.estimate = with(weights);
	flow = flowed(&cloud, NULL, &options);
	report(name, &flow);
	printf("    gnp: largest |H| %.3g at the start, %.3g at the end\n", flow.records[0].curvature, flow.records[flow.steps].curvature);
	gnp_flow_clear(&flow);
	for (int k = 30; k <= 70; k += 20) {
		options.estimate = gnp_estimate_defaults();
		options.estimate.k = k;
		options.singularity = 1e6;
		bool went = flow_on(&cloud, NULL, &options, &flow, &error);
		printf("    gmls, k %d: %zu steps; %s\n", k, went ? flow.steps : 0, went ? flow.reason : error.text);
		if (went)
			gnp_flow_clear(&flow);
	}
	gnp_sample_clear(&sample);
}

static void noisy(void)
{
	disturbed("bumpy torus, noise 1e-3", &(struct gnp_sample_options){.count = 100000, .seed = 7, .noise = 1e-3},
	          "fit_noise_70k");
}

static void contaminated(void)
{
	disturbed("bumpy torus, 10 % outliers of 5e-3",
	          &(struct gnp_sample_options){.count = 100000, .seed = 7, .outlier_fraction = 0.1, .outlier_noise = 5e-3},
	          "fit_outlier_50k");
}

/* ---- Filtering ---- */

static double least_squares_error(const struct gnp_sample *sample, const struct gnp_cloud *cloud, const uint32_t *index, int quantity,
                                  const double *truth)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_estimate found;
	struct gnp_error error = {0};
	double sum = 0, norm = 0;
	if (gnp_estimate_run(cloud, &options, pool, NULL, &found, &error) != GNP_OK)
		fail("estimate", &error);
	for (size_t i = 0; i < cloud->count; i++) {
		size_t at = index ? index[i] : i;
		if (sample->outlier[at])
			continue;
		sum += pow(found.values[quantity][i] - truth[at], 2);
		norm += truth[at] * truth[at];
	}
	gnp_estimate_clear(&found);
	return sqrt(sum / norm);
}

static void filter(const char *name)
{
	struct gnp_sample sample = sampled(name, &(struct gnp_sample_options){.count = 100000, .seed = 7, .outlier_fraction = 0.1, .outlier_noise = 5e-3});
	const struct gnp_cloud cloud = {sample.count, sample.points, sample.normals};
	struct gnp_filter_options options = gnp_filter_defaults();
	struct gnp_filter found;
	struct gnp_error error = {0};
	static const double bounds[] = {1e-5, 1e-4, 5e-4};
	options.estimate = with("fit_outlier_50k");
	options.alpha = 0.1; /* the paper's rule */
	double begun = gnp_clock();
	if (gnp_filter_run(&cloud, &options, pool, NULL, &found, &error) != GNP_OK)
		fail("filter", &error);
	printf("filter, %s, 100000 points, 10 %% outliers of 5e-3: %.2f s\n", name, gnp_clock() - begun);
	size_t good = 0, alarms = 0;
	for (size_t b = 0; b < sizeof bounds / sizeof *bounds; b++) {
		size_t outliers = 0, dropped = 0;
		good = alarms = 0;
		for (size_t i = 0; i < sample.count; i++) {
			const double *p = sample.points + 3 * i, *q = sample.exact + 3 * i, d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
			bool off = sample.outlier[i] && fabs(gnp_dot(d, sample.normals + 3 * i)) > bounds[b];
			outliers += off;
			dropped += off && !found.keep[i];
			good += !sample.outlier[i];
			alarms += !sample.outlier[i] && !found.keep[i];
		}
		printf("    displaced along the normal by more than %.0e: %zu of %zu found (%.2f %%)\n", bounds[b], dropped, outliers,
		       100 * (double)dropped / (double)outliers);
	}
	const struct gnp_cloud kept = {found.kept, found.points, found.normals};
	printf("    false alarms %zu of %zu; gmls before and after: H %.3g %.3g, K %.3g %.3g\n", alarms, good,
	       least_squares_error(&sample, &cloud, NULL, GNP_MEAN_CURVATURE, sample.mean_curvature),
	       least_squares_error(&sample, &kept, found.index, GNP_MEAN_CURVATURE, sample.mean_curvature),
	       least_squares_error(&sample, &cloud, NULL, GNP_GAUSSIAN_CURVATURE, sample.gaussian_curvature),
	       least_squares_error(&sample, &kept, found.index, GNP_GAUSSIAN_CURVATURE, sample.gaussian_curvature));
	gnp_filter_clear(&found);
	gnp_sample_clear(&sample);
}

static void filter_radial(void)
{
	filter("radial");
}

static void filter_toroidal(void)
{
	filter("toroidal");
}

int main(int argc, char **argv)
{
	static const struct {
		const char *name;
		void (*run)(void);
	} cases[] = {{"filter_radial", filter_radial}, {"filter_toroidal", filter_toroidal}, {"catenoid", catenoid}, {"ellipsoid", kept_ellipsoid},
	             {"bumpy_torus", bumpy_torus},     {"torus", torus},                     {"cylinder", held_cylinder}, {"conformal", conformal},
	             {"noise", noisy},                 {"outliers", contaminated},           {"sphere", sphere}};
	struct gnp_error error = {0};
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, &error) != GNP_OK || gnp_models_load("weights", &models, &error) != GNP_OK)
		fail("start", &error);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		if (argc < 2 || strcmp(argv[1], cases[i].name) == 0)
			cases[i].run();
	gnp_models_release(models);
	gnp_pool_free(pool);
	return 0;
}
