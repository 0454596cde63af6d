#include "core/cloud/settle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/base/warning.h"
#include "core/cloud/cluster_signs.h"
#include "core/cloud/winding.h"

enum {
	LEAST = 200, /* points of a surface that is looked at */
	BLOCK = 64,  /* of a first look: so many neighbours in curve order count as a cluster */
	LOOKS = 256, /* points where it looks */
	ROWS = 1024, /* points where the winding number is to be 1/2 */
	CHUNK = 16   /* of them a worker takes at a time */
};

/* Mean squares of the winding number less 1/2. Up to the first a surface is in order. What is changed must come below
 * the second, and to this share of what it was: noise of half a spacing leaves 0.05, a hemisphere has 0.04, a plane
 * 0.25. */
static const double in_order = 0.01, settled = 0.06, better = 0.8;
/* Above it a closed surface is warned of; closed: at this share of points or fewer a gap of this angle between
 * neighbours. */
static const double inside_out = 0.1, rims_most = 0.01, gap_least = 2.6;
/* What a unit of the edges' trust weighs against it. */
static const double trust_weight = 3;

/* One surface at work. */
struct work {
	struct gnp_orient_graph *graph;
	const uint32_t *members;
	size_t count, rows;
	struct gnp_winding winding;
	float *shares; /* (rows) in a first look; else (clusters, rows) */
};

static gnp_status no_memory(size_t points, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory to settle %zu points", points);
}

/* The point of a row: evenly among the members, fragments passed over. */
static uint32_t row_point(const struct work *work, size_t row)
{
	size_t m = row * work->count / work->rows, next = (row + 1) * work->count / work->rows;
	while (m + 1 < next && work->graph->radius[work->members[m]] == 0)
		m++;
	return work->members[m];
}

static gnp_status begin_winding(struct work *work, const uint32_t *members, const size_t *start, size_t clusters,
                                struct gnp_error *error)
{
	const struct gnp_orient_graph *graph = work->graph;
	work->winding = (struct gnp_winding){.points = graph->points, .normals = graph->normals, .radius = graph->radius,
	                                     .neighbors = (double)graph->k, .members = members, .start = start,
	                                     .clusters = clusters};
	return gnp_winding_init(&work->winding, error);
}

static gnp_status run_rows(struct work *work, gnp_chunk_fn fn, struct gnp_error *error)
{
	struct gnp_task part;
	gnp_task_init_part(&part, work->graph->task);
	return gnp_pool_run(work->graph->pool, &part, work->rows, CHUNK, fn, work, error);
}

/* --- is there anything to mend --- */

static gnp_status look(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	float *shares = gnp_scratch_take(scratch, work->winding.clusters, sizeof *shares);
	if (!shares)
		return no_memory(work->count, error);
	for (size_t r = begin; r < end; r++) {
		gnp_winding_at(&work->winding, row_point(work, r), shares, 1);
		work->shares[r] = 0;
		for (size_t c = 0; c < work->winding.clusters; c++)
			work->shares[r] += shares[c];
	}
	return GNP_OK;
}

/* The energy of a surface as it is, or turned over where that is less. */
static double energy_of_look(const struct work *work)
{
	double as_is = 0, over = 0;
	for (size_t r = 0; r < work->rows; r++) {
		as_is += (work->shares[r] - 0.5) * (work->shares[r] - 0.5);
		over += (work->shares[r] + 0.5) * (work->shares[r] + 0.5);
	}
	return fmin(as_is, over) / (double)work->rows;
}

static gnp_status first_look(struct work *work, double *energy, struct gnp_error *error)
{
	size_t blocks = (work->count + BLOCK - 1) / BLOCK, *start = gnp_array_new(blocks + 1, sizeof *start);
	work->rows = LOOKS < work->count ? LOOKS : work->count;
	work->shares = gnp_array_new(work->rows, sizeof *work->shares);
	gnp_status status = start && work->shares ? GNP_OK : no_memory(work->count, error);
	for (size_t b = 0; b <= blocks && status == GNP_OK; b++)
		start[b] = b < blocks ? b * BLOCK : work->count;
	if (status == GNP_OK)
		status = begin_winding(work, work->members, start, blocks, error);
	if (status == GNP_OK)
		status = run_rows(work, look, error);
	if (status == GNP_OK)
		*energy = energy_of_look(work);
	gnp_winding_clear(&work->winding);
	free(work->shares);
	work->shares = NULL;
	free(start);
	return status;
}

/* --- mending --- */

static gnp_status fill_shares(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct work *work = context;
	(void)scratch;
	(void)error;
	for (size_t r = begin; r < end; r++)
		gnp_winding_at(&work->winding, row_point(work, r), work->shares + r, work->rows);
	return GNP_OK;
}

static void negate(struct gnp_orient_graph *graph, size_t point)
{
	for (int c = 0; c < 3; c++)
		graph->normals[3 * point + c] *= -1;
}

static void negate_clusters(struct gnp_orient_graph *graph, const struct gnp_clusters *clusters,
                            const signed char *sign)
{
	for (size_t c = 0; c < clusters->count; c++)
		for (size_t m = clusters->start[c]; m < clusters->start[c + 1] && sign[c] < 0; m++)
			negate(graph, clusters->members[m]);
}

/* Single points that their edges contradict, at the borders of what was turned: they take the sign that edges want. */
static void smooth_borders(struct work *work)
{
	enum { SWEEPS = 10 };
	struct gnp_orient_graph *graph = work->graph;
	bool any = true;
	for (int sweep = 0; sweep < SWEEPS && any; sweep++) {
		any = false;
		for (size_t m = 0; m < work->count; m++) {
			size_t i = work->members[m];
			double agreement = 0;
			for (size_t s = 0; s < graph->k; s++)
				agreement += gnp_orient_graph_trust(graph, i, graph->index[i * graph->k + s]);
			if (agreement >= 0)
				continue;
			negate(graph, i);
			any = true;
		}
	}
}

/* Finds the signs and takes them where they are worth it. *energy: as it is then. */
static gnp_status choose_signs(struct work *work, const struct gnp_clusters *clusters, signed char *sign,
                               double *energy, struct gnp_error *error)
{
	struct gnp_cluster_signs problem = {clusters->count, work->rows, work->shares, clusters->link_start,
	                                    clusters->link_to, clusters->link_trust, trust_weight};
	memset(sign, -1, clusters->count);
	double over = gnp_cluster_signs_energy(&problem, sign);
	memset(sign, 1, clusters->count);
	double before = gnp_cluster_signs_energy(&problem, sign);
	if (over < before)
		memset(sign, -1, clusters->count);
	before = fmin(before, over);
	gnp_status status = gnp_cluster_signs_find(&problem, work->graph->task, sign, error);
	if (status != GNP_OK)
		return status;
	double after = gnp_cluster_signs_energy(&problem, sign);
	bool worth = after < settled && after < better * before;
	if (worth) {
		negate_clusters(work->graph, clusters, sign);
		smooth_borders(work);
	}
	*energy = worth ? after : before;
	return GNP_OK;
}

static gnp_status mend(struct work *work, const struct gnp_clusters *clusters, double *energy, struct gnp_error *error)
{
	signed char *sign = gnp_array_new(clusters->count, 1);
	work->rows = work->count < ROWS ? work->count : ROWS;
	work->shares = gnp_array_new(clusters->count, work->rows * sizeof *work->shares);
	gnp_status status = sign && work->shares ? GNP_OK : no_memory(work->count, error);
	if (status == GNP_OK)
		status = begin_winding(work, clusters->members, clusters->start, clusters->count, error);
	if (status == GNP_OK)
		status = run_rows(work, fill_shares, error);
	if (status == GNP_OK)
		status = choose_signs(work, clusters, sign, energy, error);
	gnp_winding_clear(&work->winding);
	free(work->shares);
	free(sign);
	return status;
}

/* --- what stays inside out --- */

/* Whether the neighbours of a point lie to one side of it in its plane: it is on a rim. */
static bool on_rim(const struct gnp_orient_graph *graph, size_t i, double *angle)
{
	const double *n = graph->normals + 3 * i, *p = graph->points + 3 * i;
	double u[3], v[3], least[3] = {0, 0, 0};
	int c = fabs(n[0]) < fabs(n[1]) ? 0 : 1;
	least[fabs(n[2]) < fabs(n[c]) ? 2 : c] = 1;
	gnp_cross(n, least, u);
	gnp_cross(n, u, v);
	for (size_t s = 0; s < graph->k; s++) {
		const double *q = graph->points + 3 * (size_t)graph->index[i * graph->k + s];
		double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
		angle[s] = atan2(gnp_dot(v, d), gnp_dot(u, d));
	}
	qsort(angle, graph->k, sizeof *angle, gnp_double_compare);
	double gap = angle[0] + 2 * acos(-1) - angle[graph->k - 1];
	for (size_t s = 1; s < graph->k; s++)
		gap = fmax(gap, angle[s] - angle[s - 1]);
	return gap > gap_least;
}

static gnp_status warn(struct work *work, double energy, struct gnp_error *error)
{
	struct gnp_warnings *warnings = gnp_task_warnings(work->graph->task);
	if (!warnings || !(energy > inside_out))
		return GNP_OK;
	double *angle = gnp_array_new(work->graph->k, sizeof *angle);
	if (!angle)
		return no_memory(work->count, error);
	size_t rims = 0;
	for (size_t r = 0; r < work->rows; r++)
		rims += on_rim(work->graph, row_point(work, r), angle);
	free(angle);
	if ((double)rims <= rims_most * (double)work->rows)
		gnp_warnings_add(warnings, GNP_WARNING_NORMALS,
		                 "the winding number at the points of a closed surface of %zu points is off 1/2 by %.2f, the "
		                 "limit is %.2f: parts came out inside out, send normals",
		                 work->count, sqrt(energy), sqrt(inside_out));
	return GNP_OK;
}

gnp_status gnp_settle(struct gnp_orient_graph *graph, const struct gnp_surfaces *surfaces, struct gnp_error *error)
{
	struct gnp_clusters clusters = {0};
	gnp_status status = GNP_OK;
	for (size_t s = 0, begin = 0; s < surfaces->count && status == GNP_OK; begin = surfaces->ends[s++]) {
		struct work work = {.graph = graph, .members = surfaces->members + begin, .count = surfaces->ends[s] - begin};
		double energy = 0;
		if (work.count < LEAST)
			continue;
		status = first_look(&work, &energy, error);
		if (status != GNP_OK || energy <= in_order)
			continue;
		if (!clusters.graph)
			status = gnp_clusters_init(&clusters, graph, surfaces, error);
		if (status == GNP_OK)
			status = gnp_clusters_make(&clusters, s, error);
		if (status == GNP_OK)
			status = mend(&work, &clusters, &energy, error);
		if (status == GNP_OK)
			status = warn(&work, energy, error);
	}
	gnp_clusters_clear(&clusters);
	return status;
}

size_t gnp_settle_memory(size_t count)
{
	size_t rows = count < ROWS ? count : ROWS, clusters = gnp_clusters_most(count);
	return clusters * (rows > clusters ? rows : clusters) * sizeof(float);
}
