#include "weights/validate/real_method.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/pca.h"
#include "core/search/neighbors.h"
#include "weights/validate/judged.h"
#include "weights/validate/method.h"

static const unsigned neighbors_of_pca[GNP_REAL_VARIANTS] = {10, 18, 30, 50, 112};

/* ---- Who ---- */

static struct gnp_real_method *add(struct gnp_real_method *out, size_t *count, const char *name)
{
	struct gnp_real_method *method = &out[*count < GNP_REAL_METHODS_MAX - 1 ? (*count)++ : *count];
	*method = (struct gnp_real_method){.variants = 1};
	snprintf(method->name, sizeof method->name, "%s", name);
	return method;
}

static void add_models(const struct gnp_models *models, enum gnp_ablation_part part, struct gnp_real_method *out,
                       size_t *count)
{
	size_t first = *count;
	if (gnp_method_any(models))
		add(out, count, "gnp")->model = gnp_method_any(models);
	for (size_t i = 0; i < gnp_models_count(models); i++) {
		const struct gnp_model *model = gnp_models_at(models, i);
		if (model->architecture.head != GNP_HEAD_PROJECTION)
			continue;
		add(out, count, model->name)->model = model;
	}
	for (size_t c = first; c < *count; c++) {
		out[c].estimator = GNP_ESTIMATOR_GNP;
		out[c].models = models;
		out[c].part = part;
	}
}

size_t gnp_real_method_ablated(const struct gnp_models *altered, enum gnp_ablation_part part, size_t count,
                                  struct gnp_real_method out[GNP_REAL_METHODS_MAX])
{
	add_models(altered, part, out, &count);
	return count;
}

size_t gnp_real_method_list(const struct gnp_models *models, const struct gnp_real_peers *peers,
                               struct gnp_real_method out[GNP_REAL_METHODS_MAX])
{
	size_t count = 0;
	add_models(models, GNP_ABLATION_NONE, out, &count);
	add(out, &count, "adaptive")->estimator = GNP_ESTIMATOR_ADAPTIVE;
	add(out, &count, "gmls")->estimator = GNP_ESTIMATOR_GMLS;
	struct gnp_real_method *pca = add(out, &count, "pca");
	pca->kind = GNP_REAL_PCA;
	pca->variants = GNP_REAL_VARIANTS;
	pca->k = neighbors_of_pca;
	for (size_t i = 0; gnp_real_peer_at(i); i++) {
		const struct gnp_real_peer *peer = gnp_real_peer_at(i);
		if (!gnp_real_peers_have(peers, peer))
			continue;
		struct gnp_real_method *method = add(out, &count, peer->name);
		method->kind = GNP_REAL_PEER;
		method->peer = peer;
		method->variants = GNP_REAL_VARIANTS;
		method->k = neighbors_of_pca;
	}
	return count;
}

/* ---- Estimators ---- */

static gnp_status judge_estimator(const struct gnp_real_method *method, const struct gnp_real_cloud *cloud,
                                  struct gnp_pool *pool, struct gnp_real_score *score, double *seconds,
                                  struct gnp_error *error)
{
	const struct gnp_cloud points = {cloud->count, cloud->points, NULL};
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_estimate estimate;
	options.estimator = method->estimator;
	options.model = method->model;
	options.models = method->models;
	options.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE);
	double begun = gnp_clock();
	gnp_status status =
		gnp_judged_at(&points, &options, cloud->centres, cloud->centre_count, pool, &estimate, error);
	if (status != GNP_OK)
		return status;
	*seconds += gnp_clock() - begun;
	const double *normals = estimate.values[GNP_NORMALS];
	status = gnp_real_score_normals(cloud->normals, cloud->centres, cloud->centre_count, normals, score, error);
	if (status == GNP_OK && cloud->mean_curvature)
		score->curvature = gnp_real_score_curvature(cloud->normals, cloud->mean_curvature, cloud->centres,
		                                            cloud->centre_count, normals, estimate.values[GNP_MEAN_CURVATURE]);
	gnp_estimate_clear(&estimate);
	return status;
}

/* ---- PCA ---- */

/* Neighbourhoods of the largest size, of whose beginnings the planes are. */
struct planes {
	const struct gnp_real_cloud *cloud;
	const struct gnp_neighbors *neighbors;
	size_t most;
	double *normals; /* (GNP_REAL_VARIANTS, centres, 3) */
};

static gnp_status fit_planes(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	const struct planes *planes = context;
	const struct gnp_real_cloud *cloud = planes->cloud;
	uint32_t *index = gnp_scratch_take(scratch, planes->most, sizeof *index);
	double *distance = gnp_scratch_take(scratch, planes->most, sizeof *distance);
	gnp_status status = index && distance ? GNP_OK : gnp_no_memory("pca", planes->most, "neighbours", error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		status = gnp_neighbors_knn(planes->neighbors, cloud->points + 3 * (size_t)cloud->centres[i], 1, planes->most,
		                           index, distance, scratch, error);
		for (size_t v = 0; v < GNP_REAL_VARIANTS && status == GNP_OK; v++) {
			struct gnp_pca pca;
			gnp_pca_fit(cloud->points, index, neighbors_of_pca[v] < planes->most ? neighbors_of_pca[v] : planes->most,
			            &pca);
			memcpy(planes->normals + 3 * (v * cloud->centre_count + i), pca.axes[2], sizeof pca.axes[2]);
		}
	}
	return status;
}

static gnp_status judge_pca(const struct gnp_real_cloud *cloud, struct gnp_pool *pool, double *normals, double *seconds,
                            struct gnp_error *error)
{
	struct gnp_neighbors *neighbors = NULL;
	size_t most = neighbors_of_pca[GNP_REAL_VARIANTS - 1];
	double begun = gnp_clock();
	gnp_status status = gnp_neighbors_build(cloud->points, cloud->count, &neighbors, error);
	struct planes planes = {cloud, neighbors, most < cloud->count ? most : cloud->count, normals};
	if (status == GNP_OK)
		status = gnp_pool_run(pool, NULL, cloud->centre_count, 256, fit_planes, &planes, error);
	gnp_neighbors_free(neighbors);
	*seconds += gnp_clock() - begun;
	return status;
}

/* ---- Any ---- */

gnp_status gnp_real_method_judge(const struct gnp_real_method *method, const struct gnp_real_peers *peers,
                                    const struct gnp_real_cloud *cloud, struct gnp_pool *pool,
                                    struct gnp_real_score *scores, double *seconds, struct gnp_error *error)
{
	size_t stride = 3 * cloud->centre_count;
	if (method->kind == GNP_REAL_ESTIMATOR)
		return judge_estimator(method, cloud, pool, scores, seconds, error);
	double *normals = gnp_array_new(method->variants * stride, sizeof *normals);
	if (!normals)
		return gnp_no_memory(method->name, cloud->centre_count, "normals", error);
	gnp_status status =
		method->kind == GNP_REAL_PCA
			? judge_pca(cloud, pool, normals, seconds, error)
			: gnp_real_peers_run(peers, method->peer, method->k, method->variants, normals, seconds, error);
	for (size_t v = 0; v < method->variants && status == GNP_OK; v++) {
		status = gnp_real_score_normals(cloud->normals, cloud->centres, cloud->centre_count, normals + v * stride,
		                                &scores[v], error);
		scores[v].sided = NAN; /* they say nothing of sides */
	}
	free(normals);
	return status;
}
