/* A small cloud and a small network of the model for every cloud, for the tests of its training. */
#ifndef GNP_TESTS_ANY_SCENE_H
#define GNP_TESTS_ANY_SCENE_H

#include "core/network/network.h"
#include "tests/unit/test.h"
#include "tests/unit/test.h"
#include "weights/train/any/any_cloud.h"
#include "weights/train/any/any_start.h"
#include "weights/train/any/any_train.h"

enum { POINTS = 2000 };

/* Of the program, which makes and frees it. */
static struct gnp_pool *pool;

static inline struct gnp_any_recipe recipe_of(enum gnp_any_group group, double noise)
{
	return (struct gnp_any_recipe){.group = group, .least = POINTS, .most = POINTS, .noise = noise};
}

static inline struct gnp_any_cloud make_cloud(const struct gnp_any_recipe *recipe, uint64_t seed)
{
	struct gnp_any_cloud cloud;
	struct gnp_error error = {0};
	if (gnp_any_cloud_create(recipe, seed, 0, pool, &cloud, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return cloud;
}

static inline struct gnp_network *make_network(void)
{
	struct gnp_architecture architecture = gnp_any_train_defaults().architecture;
	static struct gnp_layout layout;
	struct gnp_network *network;
	architecture.width = architecture.neurons = architecture.head_width = architecture.node_width = 8;
	architecture.frame_width = 8;
	architecture.layers = 1;
	CHECK(gnp_architecture_layout(&architecture, &layout, NULL) == GNP_OK);
	float *parameters = malloc(layout.total * sizeof *parameters);
	gnp_any_start_parameters(&architecture, &layout, 3, parameters);
	CHECK(gnp_network_create(&architecture, parameters, &network, NULL) == GNP_OK);
	free(parameters);
	return network;
}

#endif
