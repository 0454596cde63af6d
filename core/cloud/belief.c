#include "core/cloud/belief.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/fit/least_squares.h"
#include "core/fit/taylor.h"
#include "core/linear/pca.h"

/* Neighbours looked at: of a row of points, of a point's surface, of the patches that estimators make. */
enum { FEW = 9, NEAR = 16, WIDE = 96 };

/* Points looked at: one of EVERY, so that small clouds do not pay more for it than for their answer, and a share of FEWEST points is one. */
enum { EVERY = 50, SAMPLES_LEAST = 40, SAMPLES_MOST = 512, FEWEST = 3, CHUNK = 8 };

static const double PI = 3.14159265358979323846, DEGREES = 57.295779513082321;

/* Limits, the shares in per cent of the points looked at. Smooth shapes that their points resolve stay below each, and clouds that pass one have
 * answers that are far off; tests/unit/core/cloud/test_belief.c holds both. */
static const double STEP_MOST = 0.5;                          /* of the spacing */
static const double LINE = 0.01, IN_ROWS_MOST = 3;            /* second variance of the FEW nearest over the first */
static const double TURN = 45, TURNED_MOST = 20;              /* degrees, within the NEAR nearest */
static const double SHEET = 0.05, SHEETS_MOST = 5;            /* share of the WIDE nearest on another sheet that faces the same way */
static const double FLAT = 0.1, TILT = 30, TILTED_MOST = 5;   /* third variance over the second; degrees */
static const double OPPOSITE_GIVEN_MOST = 1, OPPOSITE_MOST = 2;
static const double BLUR = 1.7, BLUR_LEAST = 0.1;             /* residuals over those of small fits; in spacings */
static const double SCATTER = 1e-4;                           /* spacings: of spheres with so much noise 5 % of true H lie within one standard error */
static const double CREASE = 3, CREASE_LEAST = 0.05, CREASES_MOST = 2.5;

size_t gnp_belief_stride(size_t count)
{
	size_t wanted = count / EVERY;
	wanted = wanted < SAMPLES_LEAST ? SAMPLES_LEAST : wanted > SAMPLES_MOST ? SAMPLES_MOST : wanted;
	return (count + wanted - 1) / wanted;
}

/* What is seen at a point. Lengths in local spacings, angles in degrees. */
struct look {
	double spacing;      /* [length] the root of the area a point stands for */
	double flat;         /* third variance over the second, of a neighbourhood that spans two directions */
	size_t spanned;      /* how many points that took */
	double tilt;         /* of the normal of the cloud or, where one was probed, of the answer against that neighbourhood's plane */
	double rough;        /* root mean square distance from the plane of the NEAR nearest */
	double turn;         /* the third quartile of the angles to the normals of the NEAR nearest */
	double sheets;       /* share of the WIDE nearest */
	double small;        /* what quadratics leave of the heights of the NEAR nearest; NAN where it cannot be told */
	bool in_row, opposite;
};

struct work {
	const struct gnp_prepared *prepared;
	const struct gnp_belief_probe *probes; /* NULL: the cloud itself is looked at */
	size_t stride, samples;
	struct look *looks; /* (samples) */
};

/* The nearest of a point, in its order. */
struct row {
	size_t count;
	uint32_t index[WIDE];
	double distance[WIDE];
};

/* ---- Looking at a point ---- */

static size_t at_most(size_t wanted, const struct row *row)
{
	return wanted < row->count ? wanted : row->count;
}

static double angle(double cosine)
{
	return DEGREES * acos(fmax(fmin(cosine, 1), -1));
}

static void between(const double *from, const double *to, double d[3])
{
	for (int c = 0; c < 3; c++)
		d[c] = to[c] - from[c];
}

/* Of points in rows the nearest lie on a line, whose plane means nothing: looks farther until they span two directions. False when the row does
 * not. */
static bool see_plane(const struct gnp_prepared *prepared, const struct row *row, const double normal[3], struct look *look)
{
	static const double spans = 0.1; /* ratio of variances */
	struct gnp_pca pca;
	bool spanned;
	for (size_t k = at_most(NEAR, row);; k = at_most(2 * k, row)) {
		gnp_pca_fit(prepared->points, row->index, k, &pca);
		look->spanned = k;
		spanned = pca.values[1] >= spans * pca.values[0];
		if (k == row->count || spanned)
			break;
	}
	look->flat = pca.values[1] > 0 ? pca.values[2] / pca.values[1] : INFINITY;
	look->tilt = angle(fabs(gnp_dot(normal, pca.axes[2])));
	return spanned;
}

static void see_row(const struct gnp_prepared *prepared, const struct row *row, struct look *look)
{
	struct gnp_pca pca;
	gnp_pca_fit(prepared->points, row->index, at_most(FEW, row), &pca);
	look->in_row = pca.values[0] > 0 && pca.values[1] < LINE * pca.values[0];
}

/* How the normals about a point turn, and whether one in its plane is opposite. */
static void see_normals(const struct gnp_prepared *prepared, size_t i, const struct row *row, struct look *look)
{
	const double *o = prepared->points + 3 * i, *n = prepared->normals + 3 * i;
	double turns[NEAR], d[3];
	size_t near = at_most(NEAR, row);
	for (size_t j = 0; j < near; j++) {
		const double *m = prepared->normals + 3 * (size_t)row->index[j];
		between(o, prepared->points + 3 * (size_t)row->index[j], d);
		double cosine = gnp_dot(n, m), off = fmax(fabs(gnp_dot(d, n)), fabs(gnp_dot(d, m)));
		turns[j] = angle(cosine);
		look->opposite |= cosine < -0.5 && off < 0.3 * row->distance[j];
	}
	look->turn = gnp_select(turns, near, (near - 1) * 3 / 4);
}

/* Points that face as this one does, but lie over or under it rather than beside it. */
static void see_sheets(const struct gnp_prepared *prepared, size_t i, const struct row *row, struct look *look)
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

/* Root mean square heights of the nearest: over their mean, and per degree of freedom what a quadratic leaves of them. */
static void see_heights(const struct gnp_prepared *prepared, const struct row *row, struct look *look)
{
	enum { STRIDE = 8, SIZE = 6 };
	_Alignas(64) double rows[NEAR * STRIDE], gram[STRIDE * STRIDE], moment[STRIDE];
	double u[NEAR], v[NEAR], w[NEAR], ones[NEAR], d[3], mean = 0, square = 0, explained = 0;
	size_t near = at_most(NEAR, row);
	double radius = row->distance[near - 1];
	struct gnp_pca pca;
	look->small = NAN;
	look->rough = 0;
	if (!(radius > 0))
		return;
	gnp_pca_fit(prepared->points, row->index, near, &pca);
	for (size_t j = 0; j < near; j++) {
		between(prepared->points + 3 * (size_t)row->index[0], prepared->points + 3 * (size_t)row->index[j], d);
		u[j] = gnp_dot(d, pca.axes[0]) / radius;
		v[j] = gnp_dot(d, pca.axes[1]) / radius;
		w[j] = gnp_dot(d, pca.axes[2]) / radius;
		ones[j] = 1;
		mean += w[j] / (double)near;
	}
	for (size_t j = 0; j < near; j++) {
		w[j] -= mean;
		square += w[j] * w[j];
	}
	look->rough = sqrt(square / (double)near) * radius / look->spacing;
	if (near <= SIZE)
		return;
	gnp_taylor_rows(2, u, v, near, STRIDE, rows);
	gnp_normal_equations(rows, ones, w, near, STRIDE, gram, moment);
	if (!gnp_cholesky_factor(gram, SIZE, STRIDE, GNP_SMALLEST_PIVOT))
		return;
	gnp_cholesky_forward(gram, SIZE, STRIDE, moment, moment);
	for (size_t i = 0; i < SIZE; i++)
		explained += moment[i] * moment[i];
	look->small = sqrt(fmax(square - explained, 0) / (double)(near - SIZE)) * radius / look->spacing;
}

static gnp_status find_row(const struct gnp_prepared *prepared, size_t i, size_t count, struct gnp_scratch *scratch, struct row *row,
                           struct gnp_error *error)
{
	row->count = count < prepared->count ? count : prepared->count;
	return gnp_neighbors_knn(prepared->neighbors, prepared->points + 3 * i, 1, row->count, row->index, row->distance, scratch, error);
}

/* Of the answer: the wide row costs most and is looked for only where the near one spans one direction. */
static gnp_status look_at_answer(const struct work *work, size_t s, struct gnp_scratch *scratch, struct row *row, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	struct look *look = &work->looks[s];
	size_t i = gnp_belief_point(work->stride, prepared->count, s);
	gnp_status status = find_row(prepared, i, 2 * NEAR, scratch, row, error);
	if (status == GNP_OK && !see_plane(prepared, row, work->probes[s].normal, look)) {
		status = find_row(prepared, i, WIDE, scratch, row, error);
		if (status == GNP_OK)
			see_plane(prepared, row, work->probes[s].normal, look);
	}
	return status;
}

static gnp_status look_at_cloud(const struct work *work, size_t s, struct gnp_scratch *scratch, struct row *row, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	size_t i = gnp_belief_point(work->stride, prepared->count, s);
	struct look *look = &work->looks[s];
	gnp_status status = find_row(prepared, i, WIDE, scratch, row, error);
	if (status != GNP_OK)
		return status;
	see_plane(prepared, row, prepared->normals + 3 * i, look);
	see_row(prepared, row, look);
	see_normals(prepared, i, row, look);
	see_sheets(prepared, i, row, look);
	return GNP_OK;
}

static gnp_status look_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	struct row row;
	gnp_status status = GNP_OK;
	for (size_t s = begin; s < end && status == GNP_OK; s++) {
		struct look *look = &work->looks[s];
		status = (work->probes ? look_at_answer : look_at_cloud)(work, s, scratch, &row, error);
		if (status != GNP_OK)
			break;
		size_t near = at_most(2 * NEAR, &row);
		look->spacing = row.distance[near - 1] * sqrt(PI / (double)near);
		see_heights(work->prepared, &row, look);
	}
	return status;
}

static gnp_status look_at(struct work *work, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	work->stride = gnp_belief_stride(work->prepared->count);
	work->samples = (work->prepared->count + work->stride - 1) / work->stride;
	work->looks = gnp_array_zero(work->samples, sizeof *work->looks);
	if (!work->looks)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", work->samples);
	return gnp_pool_run(pool, task, work->samples, CHUNK, look_chunk, work, error);
}

/* ---- Steps of the numbers ---- */

/* The smallest step between different values (count, which are sorted); what rounding in double precision alone parts is one value. */
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

/* The distance to the next number of single precision at the largest of the values; 0 when they are not all of single precision. */
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

/* *single: of single precision at the coordinates' size; *grid: of all three axes' values, where they lie on one grid. A grid in two axes
 * is a way of sampling (terrain, images): the finest axis counts. */
static gnp_status find_steps(const struct work *work, double *single, double *grid, struct gnp_error *error)
{
	double *values = gnp_array_new(work->samples, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", work->samples);
	for (size_t c = 0; c < 3; c++) {
		for (size_t s = 0; s < work->samples; s++)
			values[s] = work->prepared->points[3 * gnp_belief_point(work->stride, work->prepared->count, s) + c];
		*single = fmax(*single, single_step(values, work->samples));
		double gap = smallest_gap(values, work->samples);
		*grid = gap > 0 ? fmin(*grid, gap) : *grid;
	}
	free(values);
	return GNP_OK;
}

/* ---- Verdicts ---- */

/* The share of the points looked at of which something holds, in per cent. */
static double share(const struct work *work, bool (*holds)(const struct work *work, size_t s))
{
	size_t count = 0;
	for (size_t s = 0; s < work->samples; s++)
		count += holds(work, s);
	return count < FEWEST ? 0 : 100 * (double)count / (double)work->samples;
}

static double spacing_at(const struct work *work, size_t s)
{
	return work->looks[s].spacing;
}

static double rough_at(const struct work *work, size_t s)
{
	return work->looks[s].rough * work->looks[s].spacing;
}

static double small_at(const struct work *work, size_t s)
{
	return work->looks[s].small;
}

static double residual_at(const struct work *work, size_t s)
{
	return work->probes[s].residual / work->looks[s].spacing;
}

static double spanned_at(const struct work *work, size_t s)
{
	return (double)work->looks[s].spanned;
}

/* Of what is finite; 0 of nothing. values (samples): room. */
static double median(const struct work *work, double (*of)(const struct work *work, size_t s), double *values)
{
	size_t known = 0;
	for (size_t s = 0; s < work->samples; s++) {
		double value = of(work, s);
		if (isfinite(value))
			values[known++] = value;
	}
	return gnp_median(values, known);
}

static gnp_status warn_of_steps(const struct work *work, struct gnp_warnings *warnings, struct gnp_error *error)
{
	double single = 0, grid = INFINITY;
	gnp_status status = find_steps(work, &single, &grid, error);
	if (status != GNP_OK)
		return status;
	double *values = gnp_array_new(work->samples, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", work->samples);
	double spacing = median(work, spacing_at, values), rough = median(work, rough_at, values);
	free(values);
	/* Points of a plane may lie on a grid without being off it. */
	bool off_grid = isfinite(grid) && rough > 0.15 * grid;
	if (single > STEP_MOST * spacing)
		gnp_warnings_add(warnings, GNP_WARNING_PRECISION, "coordinates are of single precision, whose steps are %.3g there, the points are %.3g "
		                 "apart, the limit is %g times that: subtract an offset before rounding to FP32, or send FP64",
		                 single, spacing, STEP_MOST);
	else if (off_grid && grid > STEP_MOST * spacing)
		gnp_warnings_add(warnings, GNP_WARNING_PRECISION, "coordinates are rounded to steps of %.3g, the points are %.3g apart, the limit is %g "
		                 "times that: keep more digits",
		                 grid, spacing, STEP_MOST);
	return GNP_OK;
}

static bool in_row(const struct work *work, size_t s)
{
	return work->looks[s].in_row;
}

static bool turned(const struct work *work, size_t s)
{
	return work->looks[s].turn > TURN;
}

static bool among_sheets(const struct work *work, size_t s)
{
	return work->looks[s].sheets > SHEET;
}

static bool opposed(const struct work *work, size_t s)
{
	return work->looks[s].opposite;
}

/* Nothing is said where the neighbourhood has no clear plane. */
static bool tilted(const struct work *work, size_t s)
{
	const struct look *look = &work->looks[s];
	return look->flat < FLAT && look->tilt > TILT && !(work->probes && work->probes[s].outlier);
}

static void warn_of_sampling(const struct work *work, struct gnp_warnings *warnings)
{
	double rows = share(work, in_row), turns = share(work, turned), sheets = share(work, among_sheets);
	if (rows > IN_ROWS_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_ROWS, "%.1f %% of %zu sampled points have their %d nearest on one line, the limit is %g %%: points lie "
		                 "in rows several times as far apart as the points in a row, thin them to the rows' distance, or take estimator=adaptive "
		                 "and compare",
		                 rows, work->samples, FEW - 1, IN_ROWS_MOST);
	if (turns > TURNED_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_RESOLUTION, "at %.1f %% of %zu sampled points the surface turns by more than %g degrees within the %d "
		                 "nearest, the limit is %g %%: there are too few points for its curvature, sample it more densely",
		                 turns, work->samples, TURN, NEAR, TURNED_MOST);
	if (sheets > SHEETS_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_SHEETS, "%.1f %% of %zu sampled points have among their %d nearest more than %g %% over or under them "
		                 "that face the same way, the limit is %g %%: sheets lie closer than patches are wide, which mix them, send normals and "
		                 "the sheets one by one",
		                 sheets, work->samples, WIDE, 100 * SHEET, SHEETS_MOST);
}

static void warn_of_given(const struct work *work, struct gnp_warnings *warnings)
{
	double tilts = share(work, tilted), opposite = share(work, opposed);
	if (tilts > TILTED_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_GIVEN_NORMALS, "%.1f %% of %zu sampled points came with a normal more than %g degrees off the plane of "
		                 "their nearest points, the limit is %g %%: leave the normals out, they are estimated then",
		                 tilts, work->samples, TILT, TILTED_MOST);
	else if (opposite > OPPOSITE_GIVEN_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_GIVEN_NORMALS, "%.1f %% of %zu sampled points came with a normal opposite to one beside it, the limit "
		                 "is %g %%: orient the normals, or leave them out",
		                 opposite, work->samples, OPPOSITE_GIVEN_MOST);
}

static void warn_of_sides(const struct work *work, struct gnp_warnings *warnings)
{
	double opposite = share(work, opposed);
	if (opposite > OPPOSITE_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_NORMALS, "%.1f %% of %zu sampled points have a normal opposite to one beside it, the limit is %g %%: parts "
		                 "came out inside out, send normals",
		                 opposite, work->samples, OPPOSITE_MOST);
}

gnp_status gnp_belief_check_cloud(const struct gnp_prepared *prepared, bool given, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_error *error)
{
	struct gnp_warnings *warnings = gnp_task_warnings(task);
	struct work work = {.prepared = prepared};
	if (!warnings)
		return GNP_OK;
	gnp_status status = look_at(&work, pool, task, error);
	if (status == GNP_OK)
		status = warn_of_steps(&work, warnings, error);
	if (status == GNP_OK) {
		warn_of_sampling(&work, warnings);
		(given ? warn_of_given : warn_of_sides)(&work, warnings);
	}
	free(work.looks);
	return status;
}

static bool creased(const struct work *work, size_t s)
{
	double residual = residual_at(work, s), small = work->looks[s].small;
	return residual > CREASE_LEAST && residual > CREASE * small && !work->probes[s].outlier;
}

static gnp_status warn_of_detail(const struct work *work, bool standard_errors, struct gnp_warnings *warnings, struct gnp_error *error)
{
	double *values = gnp_array_new(work->samples, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", work->samples);
	double residual = median(work, residual_at, values), small = median(work, small_at, values), creases = share(work, creased);
	free(values);
	if (standard_errors && residual > SCATTER)
		gnp_warnings_add(warnings, GNP_WARNING_STDERR, "heights scatter by %.2g spacings, from %g on curvatures are flattened by more than their "
		                 "standard errors, which hold the scatter alone: take them for weights, not for bounds",
		                 residual, SCATTER);
	if (residual > BLUR_LEAST && residual > BLUR * small)
		gnp_warnings_add(warnings, GNP_WARNING_DETAIL, "fits leave %.2g spacings of the points unexplained, quadratics of the %d nearest %.2g, the limit "
		                 "is %g times that: detail is taken for noise, take a clean model (weights=clean_30k) or estimator=adaptive",
		                 residual, NEAR, small, BLUR);
	else if (creases > CREASES_MOST)
		gnp_warnings_add(warnings, GNP_WARNING_DETAIL, "at %.1f %% of %zu sampled points fits leave more than %g times of what quadratics of the %d "
		                 "nearest do, the limit is %g %%: they smooth over edges, creases or fine detail there",
		                 creases, work->samples, CREASE, NEAR, CREASES_MOST);
	return GNP_OK;
}

static gnp_status warn_of_normals(const struct work *work, struct gnp_warnings *warnings, struct gnp_error *error)
{
	double tilts = share(work, tilted);
	if (tilts <= TILTED_MOST)
		return GNP_OK;
	double *values = gnp_array_new(work->samples, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", work->samples);
	gnp_warnings_add(warnings, GNP_WARNING_NORMALS, "%.1f %% of %zu sampled points have normals more than %g degrees off the plane of their nearest points "
	                 "that span two directions (%.0f at the median), the limit is %g %%: take estimator=adaptive or weights=noise_70k",
	                 tilts, work->samples, TILT, median(work, spanned_at, values), TILTED_MOST);
	free(values);
	return GNP_OK;
}

gnp_status gnp_belief_check_answer(const struct gnp_prepared *prepared, const struct gnp_belief_probe *probes, bool standard_errors,
                                   struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_warnings *warnings = gnp_task_warnings(task);
	struct work work = {.prepared = prepared, .probes = probes};
	if (!warnings)
		return GNP_OK;
	gnp_status status = look_at(&work, pool, task, error);
	if (status == GNP_OK)
		status = warn_of_normals(&work, warnings, error);
	if (status == GNP_OK)
		status = warn_of_detail(&work, standard_errors, warnings, error);
	free(work.looks);
	return status;
}
