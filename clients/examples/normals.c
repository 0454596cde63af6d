/* Normals and mean curvature of a cloud, without a server: lines "x y z" in, lines "x y z nx ny nz H" out.
 *
 *     cc -o normals normals.c $(pkg-config --cflags --libs gnp)
 *     OPENBLAS_NUM_THREADS=1 ./normals [FOLDER-OF-WEIGHTS] < cloud.xyz > normals.xyz
 *
 * With weights the estimator is the neural operator of the model for any cloud, else moving least squares. */
#include <gnp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double *read_points(size_t *count)
{
	double *points = NULL, p[3];
	for (*count = 0; scanf("%lf %lf %lf", &p[0], &p[1], &p[2]) == 3; (*count)++) {
		if (*count % 1024 == 0 && !(points = realloc(points, (*count + 1024) * sizeof p)))
			exit(2);
		memcpy(points + 3 * *count, p, sizeof p);
	}
	return points;
}

int main(int argc, char **argv)
{
	gnp_init();
	struct gnp_error error = {0};
	struct gnp_pool *pool = NULL;
	struct gnp_models *models = NULL;
	struct gnp_estimate estimate = {0};
	struct gnp_task task;
	gnp_task_init(&task);
	struct gnp_estimate_options options = gnp_estimate_defaults();
	options.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE);

	struct gnp_cloud cloud = {0};
	double *points = read_points(&cloud.count);
	cloud.points = points;
	gnp_status status = gnp_pool_create(0, &pool, &error);
	if (status == GNP_OK && argc > 1) {
		status = gnp_models_load(argv[1], &models, &error);
		options.estimator = GNP_ESTIMATOR_GNP;
		options.models = models;
	}
	if (status == GNP_OK)
		status = gnp_estimate_run(&cloud, &options, pool, &task, &estimate, &error);
	for (size_t i = 0; status == GNP_OK && i < estimate.count; i++) {
		const double *x = points + 3 * i, *n = estimate.values[GNP_NORMALS] + 3 * i;
		printf("%.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", x[0], x[1], x[2], n[0], n[1], n[2], estimate.values[GNP_MEAN_CURVATURE][i]);
	}
	for (int kind = 0; kind < GNP_WARNING_KINDS; kind++)
		if (task.warnings.text[kind][0])
			fprintf(stderr, "warning: %s\n", task.warnings.text[kind]);
	if (status != GNP_OK)
		fprintf(stderr, "error: %s\n", error.text);
	gnp_estimate_clear(&estimate);
	gnp_models_release(models);
	gnp_pool_free(pool);
	free(points);
	return status == GNP_OK ? 0 : 1;
}
