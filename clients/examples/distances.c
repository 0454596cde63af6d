/* Distances along the surface of a cloud from one of its points, without a server: prints the distance to every point
 * of a torus, with its place.
 *
 *     cc -o distances distances.c $(pkg-config --cflags --libs gnp)
 *     OPENBLAS_NUM_THREADS=1 ./distances [COUNT [SOURCE]] > distances.xyz */
#include <gnp.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
	gnp_init();
	const uint32_t source = argc > 2 ? (uint32_t)strtoul(argv[2], NULL, 10) : 0;
	const struct gnp_sample_options sampling = {.count = argc > 1 ? strtoul(argv[1], NULL, 10) : 5000, .seed = 1};
	struct gnp_error error = {0};
	struct gnp_pool *pool = NULL;
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample = {0};
	struct gnp_geodesic *geodesic = NULL;
	double *distance = NULL;

	gnp_status status = gnp_pool_create(0, &pool, &error);
	if (status == GNP_OK)
		status = gnp_shape_create("torus", 1, 0, &shape, &error);
	if (status == GNP_OK)
		status = gnp_sample_create(shape, &sampling, pool, NULL, &sample, &error);
	const struct gnp_cloud cloud = {.count = sample.count, .points = sample.points, .normals = sample.normals};
	const struct gnp_domain_options options = gnp_laplacian_defaults().domain;
	/* The triangles are made once, for any number of sources. */
	if (status == GNP_OK)
		status = gnp_geodesic_create(&cloud, &options, pool, NULL, &geodesic, &error);
	if (status == GNP_OK && !(distance = malloc(cloud.count * sizeof *distance)))
		status = gnp_error_set(&error, GNP_OUT_OF_MEMORY, "no memory for %zu distances", cloud.count);
	if (status == GNP_OK)
		status = gnp_geodesic_distance(geodesic, &source, 1, pool, NULL, distance, &error);
	for (size_t i = 0; status == GNP_OK && i < cloud.count; i++)
		printf("%.9g %.9g %.9g %.9g\n", cloud.points[3 * i], cloud.points[3 * i + 1], cloud.points[3 * i + 2], distance[i]);
	if (status != GNP_OK)
		fprintf(stderr, "error: %s\n", error.text);

	free(distance);
	gnp_geodesic_free(geodesic);
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
	gnp_pool_free(pool);
	return status == GNP_OK ? 0 : 1;
}
