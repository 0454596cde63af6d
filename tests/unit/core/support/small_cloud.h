/* Clouds of some hundred points with all that supports are made from, for the tests of supports and of their head. */
#ifndef GNP_TESTS_SMALL_CLOUD_H
#define GNP_TESTS_SMALL_CLOUD_H

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/search/order.h"
#include "core/support/support.h"
#include "tests/unit/test.h"

struct small_cloud {
	size_t count;
	double *points, *normals; /* (count, 3) in curve order */
	struct gnp_neighbors *neighbors;
	struct gnp_roughness roughness;
	struct gnp_support_cloud cloud;
};

/* Indexes and measures what the arrays hold, which are the cloud's from now on. */
static inline void small_cloud_take(size_t count, double *points, double *normals, bool given, struct small_cloud *out)
{
	struct gnp_pool *pool = NULL;
	*out = (struct small_cloud){.count = count, .points = points, .normals = normals};
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	CHECK(gnp_neighbors_build(points, count, &out->neighbors, NULL) == GNP_OK);
	CHECK(gnp_roughness_measure(out->neighbors, pool, NULL, &out->roughness, NULL) == GNP_OK);
	gnp_pool_free(pool);
	out->cloud = (struct gnp_support_cloud){points, normals, given, out->neighbors, &out->roughness};
}

static inline void small_cloud_clear(struct small_cloud *cloud)
{
	gnp_roughness_clear(&cloud->roughness);
	gnp_neighbors_free(cloud->neighbors);
	free(cloud->points);
	free(cloud->normals);
}

/* A point of a bent sheet over [-1, 1]^2 with its normal; every eighth one of a second sheet above, facing down. */
static inline void small_cloud_draw(struct gnp_random *random, size_t i, double noise, double *point, double *normal)
{
	double x = 2 * gnp_random_uniform(random) - 1, y = 2 * gnp_random_uniform(random) - 1, side = i % 8 == 7 ? -1 : 1;
	double dx = 0.6 * x - 0.2 * y + 0.3 * cos(3 * x), dy = -0.2 * x + 0.4 * y;
	double length = side * sqrt(1 + dx * dx + dy * dy);
	double lift = 0.3 * x * x - 0.2 * x * y + 0.2 * y * y + 0.1 * sin(3 * x) + (side < 0 ? 0.4 : 0);
	const double p[3] = {x, y, lift + noise * gnp_random_normal(random)};
	const double n[3] = {-dx / length, -dy / length, 1 / length};
	memcpy(point, p, sizeof p);
	memcpy(normal, n, sizeof n);
}

static inline void small_cloud_make(size_t count, double noise, bool given, struct small_cloud *out)
{
	struct gnp_random random;
	double *drawn = malloc(6 * count * sizeof *drawn), *points = malloc(3 * count * sizeof *points);
	double *normals = malloc(3 * count * sizeof *normals);
	uint32_t *order = malloc(count * sizeof *order);
	gnp_random_seed(&random, 11, count);
	for (size_t i = 0; i < count; i++)
		small_cloud_draw(&random, i, noise, drawn + 3 * i, drawn + 3 * (count + i));
	CHECK(gnp_order_compute(drawn, count, order, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++) {
		memcpy(points + 3 * i, drawn + 3 * (size_t)order[i], 3 * sizeof *points);
		memcpy(normals + 3 * i, drawn + 3 * (count + (size_t)order[i]), 3 * sizeof *normals);
	}
	small_cloud_take(count, points, normals, given, out);
	free(order);
	free(drawn);
}

/* A search about a point, for gnp_support_look and gnp_support_build. */
struct small_row {
	size_t count;
	uint32_t index[GNP_SUPPORT_POINTS];
	double distance[GNP_SUPPORT_POINTS];
};

static inline void small_cloud_search(const struct small_cloud *cloud, uint32_t centre, struct small_row *row)
{
	struct gnp_scratch *scratch = gnp_scratch_create();
	row->count = cloud->count < GNP_SUPPORT_POINTS ? cloud->count : (size_t)GNP_SUPPORT_POINTS;
	CHECK(gnp_neighbors_knn(cloud->neighbors, cloud->points + 3 * (size_t)centre, 1, row->count, row->index,
	                        row->distance, scratch, NULL) == GNP_OK);
	gnp_scratch_free(scratch);
}

/* The support of a point by a step of the ladder. */
static inline bool small_cloud_support(const struct small_cloud *cloud, uint32_t centre, unsigned step, double turn,
                                       struct gnp_ladder *ladder, struct small_row *row, struct gnp_support *out)
{
	small_cloud_search(cloud, centre, row);
	gnp_support_look(&cloud->cloud, centre, row->index, row->count, ladder);
	return gnp_support_build(&cloud->cloud, centre, ladder, step, row->index, row->distance, row->count, turn, out);
}

#endif
