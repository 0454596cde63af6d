#include "core/support/support.h"

#include <math.h>
#include <string.h>

#include "core/base/select.h"
#include "core/base/simd.h"
#include "core/base/vector.h"
#include "core/fit/least_squares.h"
#include "core/support/first_fits.h"

enum {
	SINGLES = GNP_SUPPORT_SINGLES, RINGS = 4, NEAR = 12, GROUP = 27,
	STRIDE = GNP_TAYLOR_STRIDE, FEATURES = GNP_SUPPORT_FEATURES,
	LANES = GNP_SIMD_WIDTH
};

/* Where rings of neighbours end, and how many points a node of each has. */
static const size_t ring_end[RINGS] = {SINGLES, 144, 432, GNP_SUPPORT_POINTS}, ring_group[RINGS] = {1, 3, 9, GROUP};

size_t gnp_support_reach(unsigned step)
{
	return gnp_ladder_points[step] <= 12 ? ring_end[1] : gnp_ladder_points[step] <= 40 ? ring_end[2] : ring_end[3];
}

static void put_first(uint32_t *index, size_t count, uint32_t centre)
{
	size_t at = 0;
	while (at < count && index[at] != centre)
		at++;
	if (at > 0 && at < count) {
		index[at] = index[0];
		index[0] = centre;
	}
}

void gnp_support_look(const struct gnp_support_cloud *cloud, uint32_t centre, uint32_t *index, size_t count,
                      struct gnp_ladder *ladder)
{
	put_first(index, count, centre);
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

/* psi3 to the side of the centre's normal and psi1 to that of the points, the frame right-handed and turned: an axis
 * has no direction of its own that would turn with the cloud. */
static void orient(const double normal[3], const double side[3], double turn, double frame[3][3])
{
	double first[3], up = gnp_dot(frame[2], normal) < 0 ? -1 : 1, along = gnp_dot(frame[0], side) < 0 ? -1 : 1;
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

/* Ascending, in place: by digits of the numbers that differ, the last first. count is at most that of the last ring. */
static void sort_along_curve(uint32_t *index, size_t count)
{
	enum { DIGIT = 9, VALUES = 1 << DIGIT };
	uint32_t spare[GNP_SUPPORT_POINTS], least = UINT32_MAX, most = 0, *from = index, *to = spare;
	for (size_t i = 0; i < count; i++) {
		least = index[i] < least ? index[i] : least;
		most = index[i] > most ? index[i] : most;
	}
	for (unsigned shift = 0; shift < 32 && (most - least) >> shift; shift += DIGIT) {
		uint16_t start[VALUES + 1] = {0};
		for (size_t i = 0; i < count; i++)
			start[((from[i] - least) >> shift) % VALUES + 1]++;
		for (size_t v = 1; v < VALUES; v++)
			start[v] = (uint16_t)(start[v] + start[v - 1]);
		for (size_t i = 0; i < count; i++)
			to[start[((from[i] - least) >> shift) % VALUES]++] = from[i];
		uint32_t *swap = from;
		from = to;
		to = swap;
	}
	if (from != index)
		memcpy(index, from, count * sizeof *index);
}

/* Up to eight nodes of one ring, which are worked on together: a lane is a node, and `many` points deep. */
struct block {
	size_t node, nodes, many;
	double share[LANES]; /* 1 / points of the node */
	double *difference;  /* (many, 3, LANES) from the centre; of points that a node lacks, 0 */
};

struct blocks {
	size_t count;
	struct block block[GNP_SUPPORT_NODES / LANES];
	double side[3]; /* sum of differences */
	_Alignas(64) double difference[3 * GNP_SUPPORT_POINTS], normal[3][GNP_SUPPORT_NODES];
};

/* Appends a node of the members `from` on to a block. */
static void fill_node(const struct gnp_support_cloud *cloud, size_t from, size_t count, struct block *block,
                      struct blocks *all, struct gnp_support *out)
{
	const double *origin = cloud->points + 3 * (size_t)out->centre;
	size_t lane = block->nodes++, n = out->nodes++;
	double normal[3] = {0};
	for (size_t i = 0; i < count; i++) {
		size_t at = 3 * (size_t)out->member[from + i];
		const double *p = cloud->points + at, *m = cloud->normals + at;
		double *d = block->difference + i * 3 * LANES + lane;
		for (size_t c = 0; c < 3; c++) {
			d[c * LANES] = p[c] - origin[c];
			all->side[c] += d[c * LANES];
			normal[c] += m[c];
		}
	}
	block->share[lane] = 1 / (double)count;
	for (size_t c = 0; c < 3; c++)
		all->normal[c][n] = normal[c] * block->share[lane];
	out->start[n + 1] = (uint16_t)(from + count);
	out->weight[n] = (double)count;
}

/* Members by rings, in nodes. */
static void gather(const struct gnp_support_cloud *cloud, struct blocks *all, struct gnp_support *out)
{
	double *free_difference = all->difference;
	all->count = 0;
	memset(all->side, 0, sizeof all->side);
	memset(all->difference, 0, sizeof all->difference);
	out->nodes = out->start[0] = 0;
	size_t from = 0;
	for (int ring = 0; ring < RINGS && from < out->points; ring++) {
		size_t end = ring_end[ring] < out->points ? ring_end[ring] : out->points, many = ring_group[ring];
		if (ring)
			sort_along_curve(out->member + from, end - from);
		while (from < end) {
			struct block *block = &all->block[all->count++];
			*block = (struct block){.node = out->nodes, .many = many, .difference = free_difference};
			free_difference += 3 * LANES * many;
			for (; from < end && block->nodes < LANES; from = out->start[out->nodes])
				fill_node(cloud, from, many < end - from ? many : end - from, block, all, out);
		}
	}
}

/* Of a block in the frame: u, v (many, LANES), and means of heights and distances. */
GNP_INLINE void project_body(const struct block *block, const double (*frame)[3], double inverse, double *u, double *v,
                             double *y, double *distance)
{
	gnp_v8 height = {0}, far = {0}, share = *(const gnp_v8u *)block->share * inverse;
	for (size_t i = 0; i < block->many; i++) {
		const gnp_v8u *d = (const gnp_v8u *)(block->difference + i * 3 * LANES);
		gnp_v8 square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], root;
		for (int l = 0; l < LANES; l++)
			root[l] = sqrt(square[l]);
		*(gnp_v8u *)(u + i * LANES) = (d[0] * frame[0][0] + d[1] * frame[0][1] + d[2] * frame[0][2]) * inverse;
		*(gnp_v8u *)(v + i * LANES) = (d[0] * frame[1][0] + d[1] * frame[1][1] + d[2] * frame[1][2]) * inverse;
		height += d[0] * frame[2][0] + d[1] * frame[2][1] + d[2] * frame[2][2];
		far += root;
	}
	*(gnp_v8u *)y = height * share;
	*(gnp_v8u *)distance = far * share;
}

GNP_SIMD_DISPATCH(static, project, project_body,
                  (const struct block *block, const double (*frame)[3], double inverse, double *u, double *v, double *y,
                   double *distance),
                  (block, frame, inverse, u, v, y, distance))

static void fill_nodes(const struct blocks *all, struct gnp_support *out)
{
	double u[GROUP * LANES], v[GROUP * LANES], y[LANES], distance[LANES];
	for (const struct block *block = all->block; block < all->block + all->count; block++) {
		project(block, (const double(*)[3])out->frame, 1 / out->radius, u, v, y, distance);
		gnp_taylor_means(u, v, block->many, block->share, block->nodes, out->rows + block->node * STRIDE);
		memcpy(out->y + block->node, y, block->nodes * sizeof *y);
		memcpy(out->distance + block->node, distance, block->nodes * sizeof *distance);
	}
	for (size_t n = 0; n < out->nodes; n++) {
		const double normal[3] = {all->normal[0][n], all->normal[1][n], all->normal[2][n]};
		out->u[n] = out->rows[n * STRIDE + 1];
		out->v[n] = out->rows[n * STRIDE + 2];
		for (size_t c = 0; c < 3; c++)
			out->features[n * FEATURES + 5 + c] = (float)gnp_dot(normal, out->frame[c]);
	}
}

/* ---- What a network sees ---- */

static void fill_features(const struct gnp_first_fit *narrow, const struct gnp_first_fit *middle,
                          struct gnp_support *out)
{
	double left[2][GNP_SUPPORT_NODES], height = 1e-15;
	gnp_residuals(out->rows, out->y, out->nodes, STRIDE, narrow->mean, left[0]);
	gnp_residuals(out->rows, out->y, out->nodes, STRIDE, middle->mean, left[1]);
	for (size_t n = 0; n < out->nodes && n < 16; n++)
		height += out->y[n] * out->y[n];
	height = sqrt(height / 16);
	double fine = 0.5 / (sqrt(narrow->misfit) + 1e-9), rough = 0.5 / (sqrt(middle->misfit) + 1e-12);
	for (size_t n = 0; n < out->nodes; n++) {
		float *x = out->features + n * FEATURES;
		x[0] = (float)out->u[n];
		x[1] = (float)out->v[n];
		x[2] = (float)(2 * out->y[n]);
		x[3] = (float)fmax(-4, fmin(4, left[1][n] * rough));
		x[4] = (float)(asinh(out->y[n] / height) / 2);
		x[8] = (float)(asinh(left[0][n] * fine) / 2);
		x[9] = (float)(log(out->distance[n] + 0.01) / 2);
	}
}

/* Of a first fit, over the deviation of the residuals of `nodes` single points, the centre's among them. */
static float centre_off(const struct gnp_support *support, const struct gnp_first_fit *fit, size_t nodes)
{
	static const double LEAST = 1e-6;
	double left[GNP_SUPPORT_SINGLES];
	gnp_residuals(support->rows, support->y, nodes, STRIDE, fit->mean, left);
	double own = fabs(left[0]);
	for (size_t i = 0; i < nodes; i++)
		left[i] = fabs(left[i]);
	return (float)asinh(own / (gnp_median_deviation(left, nodes) + LEAST));
}

static void describe(const struct gnp_support_cloud *cloud, const struct gnp_ladder *ladder, struct gnp_support *out)
{
	static const size_t nodes[GNP_SUPPORT_FITS] = {16, SINGLES, 80, GNP_SUPPORT_NODES};
	struct gnp_first_fit fits[GNP_SUPPORT_FITS];
	struct gnp_first_sums sums = {.count = 0};
	float *summary = out->summary, off[GNP_SUPPORT_FITS];
	for (int f = 0; f < GNP_SUPPORT_FITS; f++) {
		size_t from = f ? nodes[f - 1] : 0, to = nodes[f] < out->nodes ? nodes[f] : out->nodes;
		if (to > from)
			gnp_first_sums_add(&sums, out->rows + from * STRIDE, out->weight + from, out->y + from, to - from);
		gnp_first_fit_solve(&sums, sqrt(sums.count / (double)out->points), &fits[f]);
		gnp_first_fit_summarise(&fits[f], summary);
		summary += 1 + GNP_TAYLOR_DEGREE;
		size_t singles = gnp_support_singles(out);
		off[f] = centre_off(out, &fits[f], nodes[f] < singles ? nodes[f] : singles);
	}
	memcpy(summary, ladder->looks, sizeof ladder->looks);
	summary[GNP_LADDER_LOOKS] = (float)log(gnp_ladder_points[out->step]);
	summary[GNP_LADDER_LOOKS + 1] = (float)log((double)out->points);
	summary[GNP_LADDER_LOOKS + 2] = cloud->given;
	memcpy(summary + GNP_LADDER_LOOKS + 3, off, sizeof off);
	fill_features(&fits[0], &fits[1], out);
}

bool gnp_support_build(const struct gnp_support_cloud *cloud, uint32_t centre, const struct gnp_ladder *ladder,
                       unsigned step, const uint32_t *index, const double *distance, size_t count, double turn,
                       struct gnp_support *out)
{
	const double *normal = cloud->normals + 3 * (size_t)centre;
	size_t reach = gnp_support_reach(step);
	struct blocks blocks;
	out->centre = centre;
	out->step = step;
	out->points = reach < count ? reach : count;
	out->radius = distance[out->points - 1];
	if (!(out->radius > 0))
		return false;
	memcpy(out->frame, ladder->frames[step], sizeof out->frame);
	memcpy(out->member, index, out->points * sizeof *index);
	put_first(out->member, out->points, centre);
	if (cloud->given && fabs(gnp_dot(out->frame[2], normal)) < 0.5)
		frame_by_normals(cloud, out->member, out->points, out->frame);
	gather(cloud, &blocks, out);
	orient(normal, blocks.side, turn, out->frame);
	fill_nodes(&blocks, out);
	describe(cloud, ladder, out);
	return true;
}
