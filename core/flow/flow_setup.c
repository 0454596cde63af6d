#include "core/flow/flow_setup.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/cells/area.h"
#include "core/flow/flow_result.h"

/* In units of the spacing h: the paper's 1e-4, 0.00667 and 0.005 at its spacing of 0.0112, and widest gaps. */
static const double step_default = 0.8, smoothing_default = 0.6, thinning_default = 0.45, insertion_default = 1.5;
static const double smoothing_most = 3, insertion_least = 0.9;
/* Even clouds have a mean spacing of no more than so many 5th percentiles. */
static const double UNEVEN = 1.5;
static const double LARGE = 16; /* times the median: an isolated point's cell */

static double settled(double value, double otherwise)
{
	return isnan(value) ? otherwise : value;
}

double gnp_flow_default_step(const struct gnp_flow_options *options, const struct gnp_flow *result, double dense)
{
	double h = fmin(result->spacing, options->scheme == GNP_FLOW_EXPLICIT ? dense : result->usual);
	return settled(options->dt, step_default * h * h);
}

/* A sphere of this area has gone by the time area / (8 pi). */
static gnp_status check_dt(double dt, double area, struct gnp_error *error)
{
	double most = area / (8 * acos(-1));
	if (dt < most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "dt: got %g, need less than %.3g: a sphere of the cloud's area vanishes within that", dt, most);
}

static gnp_status check_smoothing(double r0, double h, struct gnp_error *error)
{
	if (r0 == 0 || (3 * r0 >= h / 2 && r0 <= smoothing_most * h))
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "smoothing_radius: got %g, need %.3g..%.3g (a sixth to three times the points' spacing), or 0 for none", r0, h / 6,
	                     smoothing_most * h);
}

/* Disks of half this diameter, packed at random, cover about half the area. */
static gnp_status check_thinning(double r1, double area, size_t least, struct gnp_error *error)
{
	double most = sqrt(0.7 * area / (4 * (double)least));
	if (r1 <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "spacing: got %g, need at most %.3g, or fewer than %zu points would be left", r1, most,
	                     4 * least);
}

static gnp_status check_insertion(double distance, double h, double r1, struct gnp_error *error)
{
	double least = fmax(insertion_least * h, 1.2 * r1);
	if (distance == 0 || distance >= least)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "insertion: got %g, need at least %.3g (0.9 times the points' spacing, 1.2 times the "
	                                                  "distance they are thinned to), or 0 for none",
	                     distance, least);
}

static void settle_origin(const struct gnp_prepared *prepared, double origin[3])
{
	for (size_t c = 0; c < 3; c++) {
		origin[c] = 0;
		for (size_t i = 0; i < prepared->count; i++)
			origin[c] += (prepared->points[3 * i + c] - prepared->points[c]) / (double)prepared->count;
		origin[c] += prepared->points[c];
	}
}

/* Insertion's default grows with a given thinning distance, which would otherwise forbid it. */
static void settle_lengths(const struct gnp_flow_options *options, const struct gnp_flow *result,
                           struct gnp_flow_rule *rule, struct gnp_flow_move *move)
{
	double h = result->spacing, fine = options->scheme == GNP_FLOW_EXPLICIT ? h : fmin(h, UNEVEN * result->dense);
	bool conformal = options->scheme == GNP_FLOW_CONFORMAL;
	move->dt = gnp_flow_default_step(options, result, result->spacing);
	move->thinning = conformal ? 0 : settled(options->spacing, thinning_default * fine);
	move->insertion = conformal ? 0 : settled(options->insertion, fmax(insertion_default * h, 1.5 * move->thinning));
	rule->smoothing = settled(options->smoothing_radius, smoothing_default * h);
	rule->tangential = conformal ? 0 : options->tangential;
	rule->along = move->insertion > 0 || rule->tangential > 0;
	rule->edges = options->scheme != GNP_FLOW_EXPLICIT;
	rule->weak = options->scheme == GNP_FLOW_SEMI_IMPLICIT;
}

static gnp_status check_lengths(const struct gnp_flow_options *options, const struct gnp_flow_rule *rule,
                                const struct gnp_flow_move *move, double h, double area, struct gnp_error *error)
{
	gnp_status status = check_dt(move->dt, area, error);
	if (status == GNP_OK)
		status = check_smoothing(rule->smoothing, h, error);
	if (status == GNP_OK)
		status = check_thinning(move->thinning, area, gnp_flow_least_points(options), error);
	return status == GNP_OK ? check_insertion(move->insertion, h, move->thinning, error) : status;
}

static gnp_status check_closed(const struct gnp_flow_options *options, size_t open, size_t count,
                               struct gnp_error *error)
{
	if (options->volume != GNP_FLOW_VOLUME_PRESERVE || 100 * open <= count)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "volume: got preserve, need a closed surface: %zu of %zu points lie at a boundary", open,
	                     count);
}

/* The sum of cells that are not far larger than most: an isolated point's may be as large as all others. Of the others
 * the result has what spacing they stand for. */
static double usual_area(double *area, size_t count, struct gnp_flow *result)
{
	double most = LARGE * gnp_median(area, count), total = 0;
	size_t usual = 0;
	for (size_t i = 0; i < count; i++) {
		total += area[i] <= most ? area[i] : 0;
		usual += area[i] <= most;
	}
	result->spacing = sqrt(total / (double)usual);
	result->usual = sqrt(most / LARGE);
	result->dense = sqrt(gnp_select(area, count, count / 20));
	result->wide = sqrt(gnp_select(area, count, count - 1 - count / 1000));
	return total;
}

gnp_status gnp_flow_setup(const struct gnp_flow_options *options, const struct gnp_prepared *prepared,
                          struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow_rule *rule,
                          struct gnp_flow_move *move, struct gnp_flow *result, struct gnp_error *error)
{
	size_t open = 0, count = prepared->count;
	double total = 0, *area = gnp_array_new(count, sizeof *area);
	if (!area)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", count);
	gnp_status status = gnp_area_measure(prepared, pool, task, area, &open, error);
	if (status == GNP_OK)
		total = usual_area(area, count, result);
	free(area);
	if (status != GNP_OK)
		return status;
	*rule = (struct gnp_flow_rule){.estimate = options->estimate};
	*move = (struct gnp_flow_move){.scheme = (enum gnp_flow_scheme)options->scheme, .preserve = options->volume == GNP_FLOW_VOLUME_PRESERVE,
	                               .projection = options->projection, .points_most = 2 * count};
	settle_origin(prepared, rule->origin);
	settle_lengths(options, result, rule, move);
	status = check_closed(options, open, count, error);
	return status == GNP_OK ? check_lengths(options, rule, move, result->spacing, total, error) : status;
}

/* The most there is at a time: while the next state is estimated, which adds to what an estimate needs, or while it is
 * measured or a step is made, beside an index and what moves between the states. */
size_t gnp_flow_memory(size_t count, bool given, const struct gnp_flow_options *options)
{
	enum { BETWEEN = 96, CONFORMAL = 32, SNAPSHOT = 7 * sizeof(double), END = 7 * sizeof(double) + sizeof(int64_t) };
	bool conformal = options->scheme == GNP_FLOW_CONFORMAL, tangential = !conformal && options->tangential > 0;
	bool along = tangential || (!conformal && options->insertion != 0);
	struct gnp_estimate_options estimate = options->estimate;
	estimate.quantities = GNP_FLOW_QUANTITIES | (along ? GNP_QUANTITY_BIT(GNP_PRINCIPAL_DIRECTIONS) : 0);
	estimate.if_offered = 0;
	size_t state = gnp_flow_state_memory(count, along, tangential, options->scheme != GNP_FLOW_EXPLICIT);
	size_t start = gnp_estimate_memory(count, given, &estimate);
	size_t estimating = state + gnp_estimate_memory(count, true, &estimate);
	size_t stepping = 2 * state + count * (BETWEEN + (conformal ? CONFORMAL : 0));
	size_t most = estimating > stepping ? estimating : stepping;
	size_t shots = options->snapshot_every ? (size_t)(options->steps / options->snapshot_every) + 2 : 0;
	size_t records = ((size_t)options->steps + 1) * sizeof(struct gnp_flow_record);
	return (most > start ? most : start) + count * (shots * SNAPSHOT + END) + records;
}
