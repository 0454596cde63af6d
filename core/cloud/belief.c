#include "core/cloud/belief.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/base/warning.h"
#include "core/cloud/belief_sample.h"
#include "core/linear/pca.h"

enum { FEW = 9 }; /* neighbours looked at of a row of points */

/* Limits, the shares in per cent of the points looked at. Smooth shapes that their points resolve stay below each, and
 * clouds that pass one have answers that are far off; tests/unit/core/estimate/test_belief.c holds both. */
static const double STEP_MOST = 0.5;                          /* of the spacing */
static const double LINE = 0.01, IN_ROWS_MOST = 3;            /* second variance of the FEW nearest over the first */
static const double TURN = 45, TURNED_MOST = 20;              /* degrees, within the nearest */
static const double SHEET = 0.05, SHEETS_MOST = 5;            /* share of the wide row on another sheet that faces the same way */
static const double OPPOSITE_GIVEN_MOST = 1, OPPOSITE_MOST = 2;

/* ---- Looking at a point ---- */

static void between(const double *from, const double *to, double d[3])
{
	for (int c = 0; c < 3; c++)
		d[c] = to[c] - from[c];
}

static void see_row(const struct gnp_prepared *prepared, const struct gnp_belief_row *row, struct gnp_belief_look *look)
{
	struct gnp_pca pca;
	gnp_pca_fit(prepared->points, row->index, gnp_belief_at_most(FEW, row), &pca);
	look->in_row = pca.values[0] > 0 && pca.values[1] < LINE * pca.values[0];
}

/* How the normals about a point turn, and whether one in its plane is opposite. */
static void see_normals(const struct gnp_prepared *prepared, size_t i, const struct gnp_belief_row *row,
                        struct gnp_belief_look *look)
{
	const double *o = prepared->points + 3 * i, *n = prepared->normals + 3 * i;
	double turns[GNP_BELIEF_NEAR], d[3];
	size_t near = gnp_belief_at_most(GNP_BELIEF_NEAR, row);
	for (size_t j = 0; j < near; j++) {
		const double *m = prepared->normals + 3 * (size_t)row->index[j];
		between(o, prepared->points + 3 * (size_t)row->index[j], d);
		double cosine = gnp_dot(n, m), off = fmax(fabs(gnp_dot(d, n)), fabs(gnp_dot(d, m)));
		turns[j] = gnp_belief_angle(cosine);
		look->opposite |= cosine < -0.5 && off < 0.3 * row->distance[j];
	}
	look->turn = gnp_select(turns, near, (near - 1) * 3 / 4);
}

/* Points that face as this one does, but lie over or under it rather than beside it. */
static void see_sheets(const struct gnp_prepared *prepared, size_t i, const struct gnp_belief_row *row,
                       struct gnp_belief_look *look)
{
	static const double same_way = 0.9, steep = 0.6, far = 0.3;
	const double *o = prepared->points + 3 * i, *n = prepared->normals + 3 * i;
	double d[3], radius = row->distance[row->count - 1];
	size_t sheets = 0;
	for (size_t j = 0; j < row->count; j++) {
		between(o, prepared->points + 3 * (size_t)row->index[j], d);
		double height = fabs(gnp_dot(d, n));
		sheets += height > steep * row->distance[j] && height > far * radius &&
		          gnp_dot(n, prepared->normals + 3 * (size_t)row->index[j]) > same_way;
	}
	look->sheets = (double)sheets / (double)row->count;
}

static gnp_status look_at_cloud(const struct gnp_belief_sample *sample, const void *context, size_t s,
                                struct gnp_scratch *scratch, struct gnp_belief_row *row, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = sample->prepared;
	size_t i = gnp_belief_sample_point(sample->stride, prepared->count, s);
	struct gnp_belief_look *look = &sample->looks[s];
	(void)context;
	gnp_status status = gnp_belief_find_row(prepared, i, GNP_BELIEF_WIDE, scratch, row, error);
	if (status != GNP_OK)
		return status;
	gnp_belief_see_plane(prepared, row, prepared->normals + 3 * i, look);
	see_row(prepared, row, look);
	see_normals(prepared, i, row, look);
	see_sheets(prepared, i, row, look);
	return GNP_OK;
}

/* ---- Steps of the numbers ---- */

/* The smallest step between different values (count, which are sorted); what rounding in double precision alone parts
 * is one value. */
static double smallest_gap(double *values, size_t count)
{
	qsort(values, count, sizeof *values, gnp_double_compare);
	double least = INFINITY, largest = fmax(fabs(values[0]), fabs(values[count - 1]));
	double nothing = 1e-9 * (values[count - 1] - values[0]) + 1e-15 * largest;
	for (size_t i = 1; i < count; i++)
		if (values[i] - values[i - 1] > nothing)
			least = fmin(least, values[i] - values[i - 1]);
	return isfinite(least) ? least : 0;
}

/* The distance to the next number of single precision at the largest of the values; 0 when they are not all of single
 * precision. */
static double single_step(const double *values, size_t count)
{
	double largest = 0;
	for (size_t i = 0; i < count; i++) {
		if (fabs(values[i]) > 1e38 || (double)(float)values[i] != values[i])
			return 0;
		largest = fmax(largest, fabs(values[i]));
	}
	return largest > 1e-30 ? ldexp(1, ilogb(largest) - 23) : 0;
}

/* *single: of single precision at the coordinates' size; *grid: of all three axes' values, where they lie on one grid.
 * A grid in two axes is a way of sampling (terrain, images): the finest axis counts. */
static gnp_status find_steps(const struct gnp_belief_sample *sample, double *single, double *grid,
                             struct gnp_error *error)
{
	double *values = gnp_array_new(sample->count, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", sample->count);
	for (size_t c = 0; c < 3; c++) {
		for (size_t s = 0; s < sample->count; s++)
			values[s] = sample->prepared->points[3 * gnp_belief_sample_point(sample->stride, sample->prepared->count, s) + c];
		*single = fmax(*single, single_step(values, sample->count));
		double gap = smallest_gap(values, sample->count);
		*grid = gap > 0 ? fmin(*grid, gap) : *grid;
	}
	free(values);
	return GNP_OK;
}

/* ---- Verdicts ---- */

static const struct gnp_belief_look *look_at(const void *sample, size_t s)
{
	return &((const struct gnp_belief_sample *)sample)->looks[s];
}

static double spacing_at(const void *sample, size_t s)
{
	return look_at(sample, s)->spacing;
}

static double rough_at(const void *sample, size_t s)
{
	return look_at(sample, s)->rough * look_at(sample, s)->spacing;
}

static gnp_status warn_of_steps(const struct gnp_belief_sample *sample, struct gnp_warnings *warnings,
                                struct gnp_error *error)
{
	double single = 0, grid = INFINITY;
	gnp_status status = find_steps(sample, &single, &grid, error);
	if (status != GNP_OK)
		return status;
	double *values = gnp_array_new(sample->count, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", sample->count);
	double spacing = gnp_belief_sample_median(sample, spacing_at, sample, values);
	double rough = gnp_belief_sample_median(sample, rough_at, sample, values);
	free(values);
	/* Points of a plane may lie on a grid without being off it. */
	bool off_grid = isfinite(grid) && rough > 0.15 * grid;
	if (single > STEP_MOST * spacing)
		gnp_warnings_add(warnings, GNP_WARNING_PRECISION,
		                 "coordinates are of single precision, whose steps are %.3g there, the points are %.3g "
		                 "apart, the limit is %g times that: subtract an offset before rounding to FP32, or send FP64",
		                 single, spacing, STEP_MOST);
	else if (off_grid && grid > STEP_MOST * spacing)
		gnp_warnings_add(warnings, GNP_WARNING_PRECISION,
		                 "coordinates are rounded to steps of %.3g, the points are %.3g apart, the limit is %g "
		                 "times that: keep more digits",
		                 grid, spacing, STEP_MOST);
	return GNP_OK;
}

static bool in_row(const void *sample, size_t s)
{
	return look_at(sample, s)->in_row;
}

static bool turned(const void *sample, size_t s)
{
	return look_at(sample, s)->turn > TURN;
}

static bool among_sheets(const void *sample, size_t s)
{
	return look_at(sample, s)->sheets > SHEET;
}

static bool opposed(const void *sample, size_t s)
{
	return look_at(sample, s)->opposite;
}

static bool tilted(const void *sample, size_t s)
{
	return gnp_belief_tilted(look_at(sample, s));
}

static void warn_of_sampling(const struct gnp_belief_sample *sample, struct gnp_warnings *warnings)
{
	double rows = gnp_belief_sample_share(sample, in_row, sample), turns = gnp_belief_sample_share(sample, turned, sample);
	double sheets = gnp_belief_sample_share(sample, among_sheets, sample);
	if (rows > IN_ROWS_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_ROWS,
		                 "%.1f %% of %zu sampled points have their %d nearest on one line, the limit is %g %%: points lie "
		                 "in rows several times as far apart as the points in a row, thin them to the rows' distance, or take estimator=adaptive "
		                 "and compare",
		                 rows, sample->count, FEW - 1, IN_ROWS_MOST);
	if (turns > TURNED_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_RESOLUTION,
		                 "at %.1f %% of %zu sampled points the surface turns by more than %g degrees within the %d "
		                 "nearest, the limit is %g %%: there are too few points for its curvature, sample it more densely",
		                 turns, sample->count, TURN, GNP_BELIEF_NEAR, TURNED_MOST);
	if (sheets > SHEETS_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_SHEETS,
		                 "%.1f %% of %zu sampled points have among their %d nearest more than %g %% over or under them "
		                 "that face the same way, the limit is %g %%: sheets lie closer than patches are wide, which mix them, send normals and "
		                 "the sheets one by one",
		                 sheets, sample->count, GNP_BELIEF_WIDE, 100 * SHEET, SHEETS_MOST);
}

static void warn_of_given(const struct gnp_belief_sample *sample, struct gnp_warnings *warnings)
{
	double tilts = gnp_belief_sample_share(sample, tilted, sample);
	double opposite = gnp_belief_sample_share(sample, opposed, sample);
	if (tilts > GNP_BELIEF_TILTED_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_GIVEN_NORMALS,
		                 "%.1f %% of %zu sampled points came with a normal more than %d degrees off the plane of "
		                 "their nearest points, the limit is %d %%: leave the normals out, they are estimated then",
		                 tilts, sample->count, GNP_BELIEF_TILT, GNP_BELIEF_TILTED_MOST);
	else if (opposite > OPPOSITE_GIVEN_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_GIVEN_NORMALS,
		                 "%.1f %% of %zu sampled points came with a normal opposite to one beside it, the limit "
		                 "is %g %%: orient the normals, or leave them out",
		                 opposite, sample->count, OPPOSITE_GIVEN_MOST);
}

static void warn_of_sides(const struct gnp_belief_sample *sample, struct gnp_warnings *warnings)
{
	double opposite = gnp_belief_sample_share(sample, opposed, sample);
	if (opposite > OPPOSITE_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_NORMALS,
		                 "%.1f %% of %zu sampled points have a normal opposite to one beside it, the limit is %g %%: parts "
		                 "came out inside out, send normals",
		                 opposite, sample->count, OPPOSITE_MOST);
}

gnp_status gnp_belief_check_cloud(const struct gnp_prepared *prepared, bool given, struct gnp_pool *pool,
                                  struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_warnings *warnings = gnp_task_warnings(task);
	struct gnp_belief_sample sample;
	if (!warnings)
		return GNP_OK;
	gnp_status status = gnp_belief_sample_make(prepared, look_at_cloud, NULL, pool, task, &sample, error);
	if (status != GNP_OK)
		return status;
	status = warn_of_steps(&sample, warnings, error);
	if (status == GNP_OK) {
		warn_of_sampling(&sample, warnings);
		(given ? warn_of_given : warn_of_sides)(&sample, warnings);
	}
	free(sample.looks);
	return status;
}
