#include "core/flow/flow_options.h"

#include <math.h>

#include "core/base/check.h"
#include "core/cells/cell.h"
#include "core/model/model.h"

struct gnp_flow_options gnp_flow_defaults(void)
{
	return (struct gnp_flow_options){.estimate = gnp_estimate_defaults(), .scheme = GNP_FLOW_SEMI_IMPLICIT,
	                                 .volume = GNP_FLOW_VOLUME_NONE,
	                                 .steps = 1, .dt = NAN, .smoothing_radius = NAN, .spacing = NAN, .insertion = NAN,
	                                 .projection = 0.1, .singularity = NAN, .spacing_limit = 4};
}

size_t gnp_flow_least_points(const struct gnp_flow_options *options)
{
	const struct gnp_model *model = options->estimate.model;
	size_t k = model && model->recipe.k ? model->recipe.k : (size_t)options->estimate.k;
	return k > GNP_CELL_NEIGHBORS + 1 ? k : GNP_CELL_NEIGHBORS + 1;
}

static gnp_status check_length(const char *name, double value, struct gnp_error *error)
{
	if (isnan(value) || (value >= 0 && value <= 1e100))
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "%s: got %g, need a length of at least 0 and at most 1e100", name, value);
}

static gnp_status check_snapshots(const struct gnp_flow_options *options, size_t count, struct gnp_error *error)
{
	if (options->snapshot_every == 0)
		return GNP_OK;
	double each = (double)count * 7 * sizeof(double), most = (double)GNP_FLOW_SNAPSHOT_BYTES_MAX;
	double taken = options->steps / options->snapshot_every + 2, bytes = each * taken;
	if (bytes <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_TOO_LARGE,
	                     "snapshot_every: got %d, %.0f snapshots of %zu points need up to %.3g bytes, need at most %.3g: "
	                                           "take one every %.0f steps or more",
	                     options->snapshot_every, taken, count, bytes, most, ceil(options->steps / fmax(floor(most / each) - 2, 1)));
}

gnp_status gnp_flow_check(const struct gnp_flow_options *options, const struct gnp_cloud *cloud,
                          struct gnp_error *error)
{
	enum { STEPS_MAX = 1000000 };
	gnp_status status = gnp_check_integer("scheme", options->scheme, GNP_FLOW_EXPLICIT, GNP_FLOW_CONFORMAL, error);
	if (status == GNP_OK)
		status = gnp_check_integer("volume", options->volume, GNP_FLOW_VOLUME_NONE, GNP_FLOW_VOLUME_PRESERVE, error);
	if (status == GNP_OK)
		status = gnp_check_integer("steps", options->steps, 1, STEPS_MAX, error);
	if (status == GNP_OK)
		status = gnp_check_integer("snapshot_every", options->snapshot_every, 0, STEPS_MAX, error);
	if (status == GNP_OK && !isnan(options->dt))
		status = gnp_check_above("dt", options->dt, 0, 1e200, error);
	if (status == GNP_OK)
		status = check_length("smoothing_radius", options->smoothing_radius, error);
	if (status == GNP_OK)
		status = check_length("spacing", options->spacing, error);
	if (status == GNP_OK)
		status = check_length("insertion", options->insertion, error);
	if (status == GNP_OK)
		status = gnp_check_number("tangential", options->tangential, 0, 1, error);
	if (status == GNP_OK)
		status = gnp_check_number("projection", options->projection, 0, 1, error);
	if (status == GNP_OK && !isnan(options->singularity))
		status = gnp_check_above("singularity", options->singularity, 0, 1e6, error);
	if (status == GNP_OK)
		status = gnp_check_above("spacing_limit", options->spacing_limit, 1, 1e6, error);
	return status == GNP_OK ? check_snapshots(options, cloud->count, error) : status;
}
