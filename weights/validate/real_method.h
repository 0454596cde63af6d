/* Who is judged in the real table: our estimators, plain PCA of several sizes of neighbourhood, and programs of others.
 */
#ifndef GNP_WEIGHTS_REAL_METHOD_H
#define GNP_WEIGHTS_REAL_METHOD_H

#include "core/base/pool.h"
#include "core/model/models.h"
#include "weights/validate/ablation.h"
#include "weights/validate/real_cloud.h"
#include "weights/validate/real_peer.h"
#include "weights/validate/real_score.h"

enum gnp_real_kind {
	GNP_REAL_ESTIMATOR, /* of core/estimate, with its defaults and the model given, if any */
	GNP_REAL_PCA,       /* the plane of least squares of the k nearest points */
	GNP_REAL_PEER
};
enum { GNP_REAL_VARIANTS = 5, GNP_REAL_METHODS_MAX = 64 };

struct gnp_real_method {
	char name[GNP_MODEL_NAME_MAX + 1];
	enum gnp_real_kind kind;
	int estimator;                   /* enum gnp_estimator_kind */
	const struct gnp_model *model;   /* NULL: none is used */
	const struct gnp_models *models; /* that it is one of, borrowed; NULL: it uses none */
	enum gnp_ablation_part part;     /* what is missing of its models */
	const struct gnp_real_peer *peer;
	size_t variants;   /* the best of them counts, cloud by cloud */
	const unsigned *k; /* (variants) neighbours, the point itself included; NULL: its own choice */
};

/* All of them in the table's order: gnp with its defaults, where there is the model for any cloud, each model of the
 * projection head by name, adaptive, gmls, PCA, and the peers that are there. Their number is returned. */
size_t gnp_real_method_list(const struct gnp_models *models, const struct gnp_real_peers *peers,
                               struct gnp_real_method out[GNP_REAL_METHODS_MAX]);
/* The first rows again, of altered models (ablation.h), behind the `count` that are there; the new count is returned.
 */
size_t gnp_real_method_ablated(const struct gnp_models *altered, enum gnp_ablation_part part, size_t count,
                                  struct gnp_real_method out[GNP_REAL_METHODS_MAX]);

/* Judges one on a cloud that was given to the peers: scores (variants); *seconds grows by what the work took, the
 * search of neighbours included. */
gnp_status gnp_real_method_judge(const struct gnp_real_method *method, const struct gnp_real_peers *peers,
                                    const struct gnp_real_cloud *cloud, struct gnp_pool *pool,
                                    struct gnp_real_score *scores, double *seconds, struct gnp_error *error);

#endif
