/* Where an equation on a surface lives: the points of a cloud that take part, on the estimator's surface and with its
 * normals, and the area each stands for. */
#ifndef GNP_CORE_DOMAIN_H
#define GNP_CORE_DOMAIN_H

#include <stdbool.h>

#include "core/cloud/prepare.h"
#include "core/estimate/filter.h"
#include "core/operators/copies.h"

struct gnp_domain_options {
	struct gnp_estimate_options estimate; /* whose normals; its quantities are ignored */
	bool project;                         /* move the points onto the fitted surface first: for noisy clouds */
	const struct gnp_filter_options *filter; /* drop what it drops first, and take the points as it leaves them; NULL: none */
};

/* Owned; freed by gnp_domain_clear. */
struct gnp_domain {
	size_t cloud_count;           /* n, points of the cloud */
	size_t dropped;               /* points the filter dropped */
	uint32_t *dropped_index;      /* (dropped) ascending; NULL without a filter */
	double *dropped_points;       /* (dropped, 3) */
	struct gnp_copies copies;     /* points at the places of others, which alone take part */
	struct gnp_prepared prepared; /* the points that take part; order: their index in the cloud, of cloud_count: with
	                                 a filter or copies no permutation of the rows here; normals are the estimator's */
	double *area;                 /* (prepared.count) of each point's cell [length^2] */
	size_t open;                  /* cells at open boundaries */
	int normals_estimated;        /* as in struct gnp_estimate, as are these: */
	size_t components, patches, degenerate, outliers;
	const struct gnp_model *model;
};

/* What is known of the surface, for results that outlive their domain. */
struct gnp_domain_facts {
	int normals_estimated; /* as in struct gnp_domain */
	size_t components, patches, degenerate, outliers;
	const struct gnp_model *model;
};
struct gnp_domain_facts gnp_domain_facts(const struct gnp_domain *domain);

/* Checks cloud and options as gnp_estimate_run does. Points that coincide are merged, and the task is warned of it.
 * Deterministic for any worker count. On failure *out is unchanged. task may be NULL. */
gnp_status gnp_domain_make(const struct gnp_cloud *cloud, const struct gnp_domain_options *options,
                           struct gnp_pool *pool, struct gnp_task *task, struct gnp_domain *out,
                           struct gnp_error *error);
/* But for single open cells, which noisy and coarse clouds have: a boundary has more. */
bool gnp_domain_is_closed(const struct gnp_domain *domain);
void gnp_domain_clear(struct gnp_domain *domain);
size_t gnp_domain_bytes(const struct gnp_domain *domain);

#endif
