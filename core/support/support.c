#include "core/support/support.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"
#include "core/support/first_fits.h"

enum { SINGLES = GNP_SUPPORT_SINGLES, RINGS = 4, NEAR = 12, GROUP = 27, STRIDE = GNP_TAYLOR_STRIDE };

/* Where rings of neighbours end, and how many points a node of each has. */
static const size_t ring_end[RINGS] = {SINGLES, 144, 432, GNP_SUPPORT_POINTS}, ring_group[RINGS] = {1, 3, 9, GROUP};

size_t gnp_support_reach(unsigned step)
{
	return gnp_ladder_points[step] <= 12 ? ring_end[1] : gnp_ladder_points[step] <= 40 ? ring_end[2] : ring_end[3];
}

void gnp_support_look(const struct gnp_support_cloud *cloud, uint32_t centre, uint32_t *index, size_t count,
                      struct gnp_ladder *ladder)
{
	size_t at = 0;
	while (at < count && index[at] != centre)
		at++;
	if (at > 0 && at < count) {
		index[at] = index[0];
		index[0] = centre;
	}
	gnp_ladder_look(cloud->points, cloud->given ? cloud->normals : NULL, cloud->roughness, index, count, ladder);
}

/* ---- The frame ---- */

static void scale_to_unit(double vector[3])
{
	double length = sqrt(gnp_dot(vector, vector));
	for (int c = 0; c < 3; c++)
		vector[c] /= length;
}

/* psi3 by the mean of the given normals about the centre that face as its own does, psi1 the axis it leans to least. */
static void frame_by_normals(const struct gnp_support_cloud *cloud, const uint32_t *index, size_t count,
                             double frame[3][3])
{
	const double *own = cloud->normals + 3 * (size_t)index[0];
	double mean[3] = {0}, along[3];
	int axis = 0;
	for (size_t i = 0; i < count && i < NEAR; i++) {
		const double *normal = cloud->normals + 3 * (size_t)index[i];
		for (int c = 0; gnp_dot(normal, own) > 0.5 && c < 3; c++)
			mean[c] += normal[c];
	}
	scale_to_unit(mean);
	for (int a = 0; a < 3; a++) {
		along[a] = gnp_dot(frame[a], mean);
		axis = fabs(along[a]) < fabs(along[axis]) ? a : axis;
	}
	for (int c = 0; c < 3; c++)
		frame[0][c] = frame[axis][c] - along[axis] * mean[c];
	scale_to_unit(frame[0]);
	memcpy(frame[2], mean, sizeof mean);
}

/* psi3 to the side of the centre's normal and psi1 to that of the points, the frame right-handed and turned: an axis has no
 * direction of its own that would turn with the cloud. */
static void orient(const struct gnp_support_cloud *cloud, const uint32_t *index, double turn, struct gnp_support *out)
{
	const double *origin = cloud->points + 3 * (size_t)out->centre, *normal = cloud->normals + 3 * (size_t)out->centre;
	double(*frame)[3] = out->frame, first[3], side[3] = {0};
	for (size_t i = 0; i < out->points; i++)
		for (int c = 0; c < 3; c++)
			side[c] += cloud->points[3 * (size_t)index[i] + (size_t)c] - origin[c];
	double up = gnp_dot(frame[2], normal) < 0 ? -1 : 1, along = gnp_dot(frame[0], side) < 0 ? -1 : 1;
	for (int c = 0; c < 3; c++) {
		frame[2][c] *= up;
		frame[0][c] *= along;
	}
	gnp_cross(frame[2], frame[0], frame[1]);
	for (int c = 0; c < 3; c++)
		first[c] = cos(turn) * frame[0][c] + sin(turn) * frame[1][c];
	memcpy(frame[0], first, sizeof first);
	gnp_cross(frame[2], frame[0], frame[1]);
}

/* ---- Nodes ---- */

static void sift(uint32_t *heap, size_t root, size_t count)
{
	for (size_t child; (child = 2 * root + 1) < count; root = child) {
		child += child + 1 < count && heap[child] < heap[child + 1];
		if (heap[root] >= heap[child])
			return;
		uint32_t swap = heap[root];
		heap[root] = heap[child];
		heap[child] = swap;
	}
}

/* Ascending, in place. */
static void sort_along_curve(uint32_t *index, size_t count)
{
	for (size_t i = count / 2; i-- > 0;)
		sift(index, i, count);
	for (size_t end = count; end-- > 1;) {
		uint32_t swap = index[0];
		index[0] = index[end];
		index[end] = swap;
		sift(index, 0, end);
	}
}

/* Appends a node of `many` points. */
static void add_node(const struct gnp_support_cloud *cloud, struct gnp_support *out, size_t many)
{
	size_t n = out->nodes++, from = out->start[n];
	const double *origin = cloud->points + 3 * (size_t)out->centre;
	double u[GROUP], v[GROUP], y = 0, distance = 0, normal[3] = {0}, inverse = 1 / out->radius, share = 1 / (double)many;
	double rows[GROUP * STRIDE], *row = out->rows + n * STRIDE;
	for (size_t i = 0; i < many; i++) {
		const double *p = cloud->points + 3 * (size_t)out->member[from + i], *m = cloud->normals + 3 * (size_t)out->member[from + i];
		double d[3] = {p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]};
		u[i] = gnp_dot(d, out->frame[0]) * inverse;
		v[i] = gnp_dot(d, out->frame[1]) * inverse;
		y += gnp_dot(d, out->frame[2]) * inverse;
		distance += sqrt(gnp_dot(d, d)) * inverse;
		for (int c = 0; c < 3; c++)
			normal[c] += m[c];
	}
	gnp_taylor_rows(GNP_TAYLOR_DEGREE, u, v, many, STRIDE, rows);
	for (size_t c = 0; c < STRIDE; c++) {
		double sum = 0;
		for (size_t i = 0; i < many; i++)
			sum += rows[i * STRIDE + c];
		row[c] = sum * share;
	}
	out->start[n + 1] = (uint16_t)(from + many);
	out->weight[n] = (double)many;
	out->u[n] = row[1];
	out->v[n] = row[2];
	out->y[n] = y * share;
	out->distance[n] = distance * share;
	for (int c = 0; c < 3; c++)
		out->features[n * GNP_SUPPORT_FEATURES + 5 + (size_t)c] = (float)(gnp_dot(normal, out->frame[c]) * share);
}

static void gather(const struct gnp_support_cloud *cloud, struct gnp_support *out)
{
	out->nodes = out->start[0] = 0;
	size_t from = 0;
	for (int ring = 0; ring < RINGS && from < out->points; ring++) {
		size_t to = ring_end[ring] < out->points ? ring_end[ring] : out->points;
		if (ring)
			sort_along_curve(out->member + from, to - from);
		for (size_t i = from; i < to; i += ring_group[ring])
			add_node(cloud, out, i + ring_group[ring] < to ? ring_group[ring] : to - i);
		from = to;
	}
}

/* ---- What a network sees ---- */

static void fill_features(const struct gnp_first_fit *narrow, const struct gnp_first_fit *middle, struct gnp_support *out)
{
	double height = 1e-15;
	for (size_t n = 0; n < out->nodes && n < 16; n++)
		height += out->y[n] * out->y[n];
	height = sqrt(height / 16);
	for (size_t n = 0; n < out->nodes; n++) {
		float *x = out->features + n * GNP_SUPPORT_FEATURES;
		const double *row = out->rows + n * STRIDE;
		double y = out->y[n], r = gnp_first_fit_residual(middle, row, y) / (sqrt(middle->misfit) + 1e-12);
		x[0] = (float)out->u[n];
		x[1] = (float)out->v[n];
		x[2] = (float)(2 * y);
		x[3] = (float)fmax(-4, fmin(4, r / 2));
		x[4] = (float)(asinh(y / height) / 2);
		x[8] = (float)(asinh(gnp_first_fit_residual(narrow, row, y) / (sqrt(narrow->misfit) + 1e-9) / 2) / 2);
		x[9] = (float)(log(out->distance[n] + 0.01) / 2);
	}
}

static void describe(const struct gnp_support_cloud *cloud, const struct gnp_ladder *ladder, struct gnp_support *out)
{
	static const size_t nodes[GNP_SUPPORT_FITS] = {16, SINGLES, 80, GNP_SUPPORT_NODES};
	struct gnp_first_fit fits[GNP_SUPPORT_FITS];
	struct gnp_first_sums sums = {.count = 0};
	float *summary = out->summary;
	for (int f = 0; f < GNP_SUPPORT_FITS; f++) {
		size_t from = f ? nodes[f - 1] : 0, to = nodes[f] < out->nodes ? nodes[f] : out->nodes;
		if (to > from)
			gnp_first_sums_add(&sums, out->rows + from * STRIDE, out->weight + from, out->y + from, to - from);
		gnp_first_fit_solve(&sums, sqrt(sums.count / (double)out->points), &fits[f]);
		gnp_first_fit_summarise(&fits[f], summary);
		summary += 1 + GNP_TAYLOR_DEGREE;
	}
	memcpy(summary, ladder->looks, sizeof ladder->looks);
	summary[GNP_LADDER_LOOKS] = (float)log(gnp_ladder_points[out->step]);
	summary[GNP_LADDER_LOOKS + 1] = (float)log((double)out->points);
	summary[GNP_LADDER_LOOKS + 2] = cloud->given;
	fill_features(&fits[0], &fits[1], out);
}

bool gnp_support_build(const struct gnp_support_cloud *cloud, uint32_t centre, const struct gnp_ladder *ladder,
                       unsigned step, const uint32_t *index, const double *distance, size_t count, double turn,
                       struct gnp_support *out)
{
	const double *normal = cloud->normals + 3 * (size_t)centre;
	size_t reach = gnp_support_reach(step);
	out->centre = centre;
	out->step = step;
	out->points = reach < count ? reach : count;
	out->radius = distance[out->points - 1];
	if (!(out->radius > 0))
		return false;
	memcpy(out->frame, ladder->frames[step], sizeof out->frame);
	if (cloud->given && fabs(gnp_dot(out->frame[2], normal)) < 0.5)
		frame_by_normals(cloud, index, count, out->frame);
	orient(cloud, index, turn, out);
	memcpy(out->member, index, out->points * sizeof *index);
	gather(cloud, out);
	describe(cloud, ladder, out);
	return true;
}
