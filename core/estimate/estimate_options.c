#include "core/estimate/estimate_options.h"

#include "core/base/check.h"
#include "core/estimators/estimators.h"
#include "core/model/model.h"

enum { K_MIN = 12, K_MAX = 500 };

struct gnp_estimate_options gnp_estimate_defaults(void)
{
	return (struct gnp_estimate_options){
		.estimator = GNP_ESTIMATOR_GMLS, .cover = GNP_COVER_COVER, .k = 30, .degree = 3, .basis = GNP_BASIS_TENSOR,
		.weight = GNP_WEIGHT_QUARTIC,
		.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE) |
		              GNP_QUANTITY_BIT(GNP_GAUSSIAN_CURVATURE)};
}

const struct gnp_estimator *gnp_estimate_estimator(const struct gnp_estimate_options *options)
{
	return gnp_estimator_at((enum gnp_estimator_kind)options->estimator);
}

struct gnp_basis gnp_estimate_basis(const struct gnp_estimate_options *options)
{
	const struct gnp_basis wanted = {(enum gnp_basis_kind)options->basis, (unsigned)options->degree};
	return gnp_estimate_estimator(options)->basis(wanted);
}

/* Whether fits are of a model that weighs nodes: the default is one. */
static bool is_weighted(const struct gnp_estimate_options *options)
{
	return gnp_estimate_estimator(options)->weighted &&
	       (!options->model || options->model->architecture.head == GNP_HEAD_WEIGHTED);
}

static uint64_t offered_quantities(const struct gnp_estimate_options *options)
{
	const struct gnp_estimator *estimator = gnp_estimate_estimator(options);
	uint64_t offered = GNP_QUANTITY_ALL;
	if (!estimator->errors && !is_weighted(options))
		offered &= ~GNP_QUANTITY_STDERR;
	if (!is_weighted(options))
		offered &= ~GNP_QUANTITY_BIT(GNP_CREASE);
	if (!estimator->outliers)
		offered &= ~GNP_QUANTITY_BIT(GNP_OUTLIER);
	return offered;
}

uint64_t gnp_estimate_quantities(const struct gnp_estimate_options *options)
{
	return (options->quantities | options->if_offered) & offered_quantities(options);
}

/* "All" means all the estimator has; asking for another one by name is a mistake worth a message. */
static gnp_status check_quantities(const struct gnp_estimate_options *options, struct gnp_error *error)
{
	const struct gnp_estimator *estimator = gnp_estimate_estimator(options);
	uint64_t lacking = options->quantities & ~offered_quantities(options);
	if (!options->quantities || options->quantities & ~GNP_QUANTITY_ALL)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "quantities: got mask %#llx, need some of %#llx",
		                     (unsigned long long)options->quantities, (unsigned long long)GNP_QUANTITY_ALL);
	if (!lacking || options->quantities == GNP_QUANTITY_ALL)
		return GNP_OK;
	const char *name = gnp_quantity_info((enum gnp_quantity)__builtin_ctzll(lacking))->name;
	if (options->model && estimator->weighted)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "quantities: the estimator %s has no %s with weights %s",
		                     estimator->name, name, options->model->name);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "quantities: the estimator %s has no %s", estimator->name, name);
}

size_t gnp_estimate_width(enum gnp_quantity quantity, size_t basis_size)
{
	size_t width = gnp_quantity_info(quantity)->width;
	return width ? width : basis_size;
}

gnp_status gnp_estimate_check(const struct gnp_estimate_options *options, struct gnp_error *error)
{
	const struct {
		const char *name;
		int value, low, high;
	} rows[] = {{"estimator", options->estimator, 0, GNP_ESTIMATOR_KINDS - 1},
	            {"cover", options->cover, GNP_COVER_COVER, GNP_COVER_ALL},
	            {"k", options->k, K_MIN, K_MAX},
	            {"degree", options->degree, 1, GNP_DEGREE_MAX},
	            {"basis", options->basis, GNP_BASIS_TENSOR, GNP_BASIS_TOTAL},
	            {"weight", options->weight, GNP_WEIGHT_QUARTIC, GNP_WEIGHT_LINEAR},
	            {"outliers", options->outliers, GNP_OUTLIERS_AUTO, GNP_OUTLIERS_LEFT_OUT}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		gnp_status status = gnp_check_integer(rows[i].name, rows[i].value, rows[i].low, rows[i].high, error);
		if (status != GNP_OK)
			return status;
	}
	struct gnp_basis basis = gnp_estimate_basis(options);
	if (basis.kind != GNP_BASIS_TAYLOR && gnp_basis_size(basis) > (size_t)options->k)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %d, need at least %zu for degree %d", options->k,
		                     gnp_basis_size(basis), options->degree);
	return check_quantities(options, error);
}
