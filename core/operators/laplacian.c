#include "core/operators/laplacian.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/cloud/farthest.h"
#include "core/fit/taylor.h"
#include "core/operators/operator_check.h"
#include "core/operators/weak.h"

enum { NEIGHBORS_MAX = 500 };
static const double drop_max = 0.5;

struct gnp_laplacian_options gnp_laplacian_defaults(void)
{
	return (struct gnp_laplacian_options){.domain = {.estimate = gnp_estimate_defaults()}, .system = GNP_SYSTEM_SQUARE, .drop = 0.1,
	                                      .which = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN)};
}

/* Odd degrees gain little order over the even one below, but hold where surfaces are rough for the spacing. Normal
 * equations, whose stencils are twice as wide, are spared the price. */
unsigned gnp_laplacian_degree(const struct gnp_laplacian_options *options)
{
	return options->degree ? (unsigned)options->degree : options->system == GNP_SYSTEM_LEAST_SQUARES ? 4 : 5;
}

size_t gnp_laplacian_neighbors(const struct gnp_laplacian_options *options)
{
	return options->neighbors ? (size_t)options->neighbors : 2 * gnp_taylor_size(gnp_laplacian_degree(options));
}

static gnp_status check_options(const struct gnp_laplacian_options *options, struct gnp_error *error)
{
	if (options->system < GNP_SYSTEM_AUTO || options->system > GNP_SYSTEM_LEAST_SQUARES)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "system: got %d, need 0..%d", options->system, GNP_SYSTEM_LEAST_SQUARES);
	if (!(options->drop >= 0 && options->drop <= drop_max))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "drop: got %g, need 0..%g", options->drop, drop_max);
	if (options->degree < 0 || options->degree > 7)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "degree: got %d, need 1..7, or 0 for the system's", options->degree);
	if (options->neighbors < 0 || options->neighbors > NEIGHBORS_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "neighbors: got %d, need 0..%d", options->neighbors, NEIGHBORS_MAX);
	return GNP_OK;
}

/* keep (points) out: 0 for those that carry no unknown. */
static gnp_status choose_kept(const struct gnp_domain *domain, double drop, const unsigned char *unknown,
                              struct gnp_task *task, unsigned char *keep, struct gnp_error *error)
{
	size_t count = domain->prepared.count;
	gnp_status status = gnp_farthest_choose(domain->prepared.points, count, unknown, (size_t)(drop * (double)count), task, keep, error);
	for (size_t i = 0; i < count; i++)
		keep[i] = !keep[i];
	return status;
}

gnp_status gnp_laplacian_check_which(int system, unsigned which, struct gnp_error *error)
{
	const unsigned weak = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN) | GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_STIFFNESS);
	for (int d = 0; d < GNP_DERIVATIVE_COUNT; d++) {
		unsigned bit = which & GNP_DERIVATIVE_BIT(d);
		if (system == GNP_SYSTEM_SYMMETRIC && bit & ~weak)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "outputs: got %s, which system=symmetric does not have (square and least_squares do)",
			                     gnp_derivative_name((enum gnp_derivative)d));
		if (system != GNP_SYSTEM_SYMMETRIC && bit && d == GNP_DERIVATIVE_STIFFNESS)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "outputs: got %s, which system=symmetric alone has",
			                     gnp_derivative_name((enum gnp_derivative)d));
	}
	return GNP_OK;
}

gnp_status gnp_laplacian_assemble(const struct gnp_domain *domain, const struct gnp_laplacian_options *options,
                                  const unsigned char *unknown, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_collocation *out, struct gnp_error *error)
{
	gnp_status status = check_options(options, error);
	if (status == GNP_OK)
		status = gnp_laplacian_check_which(options->system, options->which, error);
	if (status != GNP_OK)
		return status;
	struct gnp_collocation_rule rule = {.degree = gnp_laplacian_degree(options), .neighbors = (size_t)options->neighbors,
	                                    .which = options->which};
	gnp_task_stage(task, GNP_STAGE_ASSEMBLE, domain->prepared.count);
	if (options->system == GNP_SYSTEM_SYMMETRIC)
		return gnp_weak_make(domain, options->which, options->stiffness, pool, task, out, error);
	unsigned char *keep = NULL;
	if (options->system == GNP_SYSTEM_LEAST_SQUARES) {
		keep = gnp_array_new(domain->prepared.count, 1);
		status = keep ? choose_kept(domain, options->drop, unknown, task, keep, error)
		              : gnp_error_set(error, GNP_OUT_OF_MEMORY, "laplacian: no memory for %zu points", domain->prepared.count);
		rule.keep = keep;
	}
	if (status == GNP_OK)
		status = gnp_collocation_make(&domain->prepared, &rule, pool, task, out, error);
	if (status == GNP_OK)
		gnp_operator_check_stencils(out, rule.degree, gnp_task_warnings(task));
	free(keep);
	return status;
}

gnp_status gnp_laplacian_run(const struct gnp_cloud *cloud, const struct gnp_laplacian_options *options,
                             struct gnp_pool *pool, struct gnp_task *task, struct gnp_collocation *out,
                             struct gnp_domain_facts *facts, struct gnp_error *error)
{
	struct gnp_domain domain;
	struct gnp_collocation made = {.rows = 0};
	gnp_status status = check_options(options, error);
	if (status == GNP_OK)
		status = gnp_domain_make(cloud, &options->domain, pool, task, &domain, error);
	if (status != GNP_OK)
		return status;
	status = gnp_laplacian_assemble(&domain, options, NULL, pool, task, &made, error);
	if (status == GNP_OK)
		gnp_operator_check_rows(&made, domain.open, gnp_task_warnings(task));
	if (status == GNP_OK)
		status = gnp_collocation_reorder(&made, domain.prepared.order, &domain.copies, cloud->count, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK && facts)
		*facts = gnp_domain_facts(&domain);
	gnp_domain_clear(&domain);
	if (status == GNP_OK)
		*out = made;
	else
		gnp_collocation_clear(&made);
	return status;
}
