/* What an estimator is: a function from patches to fitted surfaces. Each is one file, and one row of the table
 * (estimators.h). */
#ifndef GNP_CORE_ESTIMATOR_H
#define GNP_CORE_ESTIMATOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/scratch.h"
#include "core/base/status.h"
#include "core/cloud/patch.h"
#include "core/fit/legendre.h"
#include "core/fit/surface.h"
#include "core/search/neighbors.h"

enum gnp_estimator_kind { GNP_ESTIMATOR_GNP, GNP_ESTIMATOR_GMLS, GNP_ESTIMATOR_ADAPTIVE, GNP_ESTIMATOR_KINDS };
enum gnp_weight_kind { GNP_WEIGHT_QUARTIC, GNP_WEIGHT_FLAT, GNP_WEIGHT_LINEAR };

struct gnp_model;
struct gnp_models;
struct gnp_weighted_cloud;

/* Outliers in what a network sees. left_out: they are looked for, and are in no patch; auto: left_out where the model is one
 * with a projection head of the regime `outlier`, else kept. Weighted models weigh every point, and it makes no difference
 * to them. */
enum gnp_outliers_kind { GNP_OUTLIERS_AUTO, GNP_OUTLIERS_KEPT, GNP_OUTLIERS_LEFT_OUT };

/* How to fit; the fields an estimator has no use for are ignored by it. */
struct gnp_fit_options {
	struct gnp_basis basis;
	const struct gnp_model *model;   /* the network; NULL: the one of models for any cloud */
	const struct gnp_models *models; /* may be NULL: none */
	enum gnp_outliers_kind outliers; /* of those that use a model */
	enum gnp_weight_kind weight; /* of a point at r = |(u, v)| in [0, 1]: (1 - r)^4, 1, or 1.2 - r */
};

/* How the patches of an estimator are made. */
struct gnp_patch_rule {
	size_t k;                                  /* neighbours that set epsilon = 1.1 r_k */
	size_t served;                             /* points a patch serves at most where it serves several */
	double buffer;                             /* points out to buffer * epsilon, >= 1 */
	double delta0_ratio, delta0, height_scale; /* as in struct gnp_patch_source */
	struct gnp_basis basis;                    /* of the fitted surfaces */
};

/* A whole cloud in curve order, borrowed. */
struct gnp_fit_cloud {
	size_t count;
	const double *points;  /* (count, 3) */
	const double *normals; /* (count, 3) unit */
	bool given;            /* normals are the caller's */
	const struct gnp_neighbors *neighbors;
};

/* A fitted patch. */
struct gnp_fit {
	struct gnp_surface surface; /* its coefficients and factor live in the scratch or state the fit was given */
	bool reduced;    /* the neighbourhood was too poor for the basis: a lower degree was used */
	double residual; /* root mean square of the heights' misfit, as the fit weighs its points [length] */
};

enum { GNP_SERVED_MAX = 64 };

/* Fits each patch: fits (count) out. state: what prepare made, or NULL. */
typedef gnp_status (*gnp_fit_fn)(const struct gnp_fit_options *options, const void *state,
                                 const struct gnp_patch *patches, size_t count, struct gnp_fit *fits,
                                 struct gnp_scratch *scratch, struct gnp_error *error);

struct gnp_estimator {
	const char *name;
	bool errors;         /* gives standard errors */
	/* The basis of its surfaces, or the largest it may take, given the options'. */
	struct gnp_basis (*basis)(struct gnp_basis wanted);
	/* Looks at the whole cloud once; *state is freed by release. Both may be NULL. */
	gnp_status (*prepare)(const struct gnp_fit_cloud *cloud, const struct gnp_fit_options *options, struct gnp_pool *pool,
	                      struct gnp_task *task, void **state, struct gnp_error *error);
	void (*release)(void *state);
	/* The model it uses; NULL: it uses none. */
	const struct gnp_model *(*model)(const void *state);
	/* What its patches differ in from those of the rule given, which is the options'; NULL: in nothing. */
	void (*rule)(const void *state, struct gnp_patch_rule *rule);
	/* How many nearest points the fit at a point wants to see; NULL, or 0: the patch with its buffer. */
	size_t (*reach)(const void *state, uint32_t point);
	/* How many points about this one a patch may serve as well as one of their own would, at most
	 * GNP_SERVED_MAX; NULL: 1. */
	size_t (*served)(const void *state, uint32_t point);
	/* Which points it takes for outliers, (count) 0 or 1; NULL, also from the function: it does not judge. */
	const unsigned char *(*outliers)(const void *state);
	/* Normals (count, 3) that tell sheets apart: patches are framed by and serve points of one sheet (patch.h), so that
	 * no point is told what holds across a gap; NULL: the cloud's, and sheets are not told apart. */
	const double *(*normals)(const void *state);
	gnp_fit_fn fit;
	/* What fits go by where they find supports of their own (weighted_fit.h): then there are no patches of a rule, and what is
	 * told of them above is not asked; NULL, also from the function: they go by patches. */
	const struct gnp_weighted_cloud *(*weighted)(const void *state);
};

#endif
