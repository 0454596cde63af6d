/* A small drawn model for any cloud, loaded from a folder that is gone afterwards, for tests of the judge. */
#ifndef GNP_TESTS_DRAWN_MODEL_H
#define GNP_TESTS_DRAWN_MODEL_H

#include <unistd.h>

#include "core/base/random.h"
#include "core/model/models.h"
#include "core/support/weighted_projection.h"
#include "tests/unit/test.h"

enum { DRAWN_WIDTH = 8 };

static inline bool drawn_model_save(void (*adjust)(const struct gnp_layout *layout, float *parameters),
                                    const char *path)
{
	static const struct gnp_architecture architecture = {
		.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_WEIGHTED, .features = GNP_SUPPORT_FEATURES, .width = DRAWN_WIDTH,
		.channels = 2, .neurons = 6, .layers = 1, .quadrature = GNP_QUADRATURE_MAX, .head_width = 8,
		.outputs = GNP_WEIGHTED_OUTPUTS, .node_width = 8, .frame_width = 8};
	struct gnp_layout layout;
	struct gnp_random random;
	struct gnp_error error = {0};
	gnp_random_seed(&random, 11, 0);
	if (gnp_architecture_layout(&architecture, &layout, &error) != GNP_OK)
		return false;
	float *parameters = malloc(layout.total * sizeof *parameters);
	for (size_t p = 0; p < layout.total; p++)
		parameters[p] = (float)(0.2 * gnp_random_normal(&random));
	adjust(&layout, parameters);
	const struct gnp_model_source source = {.architecture = architecture, .regime = "any", .parameters = parameters};
	bool good = gnp_model_save(path, &source, &error) == GNP_OK;
	fputs(error.text, stderr);
	free(parameters);
	return good;
}

/* Called any; adjust: changes drawn parameters. Released by the caller. */
static inline bool drawn_model_load(void (*adjust)(const struct gnp_layout *layout, float *parameters),
                                    struct gnp_models **out)
{
	char folder[] = "/tmp/gnp-drawn-XXXXXX", path[128];
	bool good = mkdtemp(folder) != NULL;
	snprintf(path, sizeof path, "%s/any.safetensors", folder);
	good = good && drawn_model_save(adjust, path) && gnp_models_load(folder, out, NULL) == GNP_OK;
	unlink(path);
	rmdir(folder);
	return good;
}

#endif
