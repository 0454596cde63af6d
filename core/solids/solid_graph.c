#include "core/solids/solid_graph.h"

#include <math.h>

/* ---- Heights ---- */

/* w and its derivatives by t. */
static void wave_at(double t, double soft, double w[3])
{
	double s = sin(t), c = cos(t);
	if (soft > 0) {
		w[0] = sqrt(s * s + soft * soft);
		w[1] = s * c / w[0];
		w[2] = (c * c - s * s - w[1] * w[1]) / w[0];
	} else {
		w[0] = s;
		w[1] = c;
		w[2] = -s;
	}
}

static double smooth_height(const struct gnp_solid_graph *graph, const double p[2], double slope[2], double second[3])
{
	double f = (graph->bend[0] * p[0] * p[0] + graph->bend[1] * p[1] * p[1]) / 2;
	slope[0] = graph->bend[0] * p[0];
	slope[1] = graph->bend[1] * p[1];
	second[0] = graph->bend[0];
	second[1] = 0;
	second[2] = graph->bend[1];
	for (int i = 0; i < graph->waves; i++) {
		const double *k = graph->wave[i];
		double w[3];
		wave_at(k[0] * p[0] + k[1] * p[1] + graph->phase[i], graph->soft[i], w);
		for (int d = 0; d < 3; d++)
			w[d] *= graph->height[i];
		f += w[0];
		slope[0] += k[0] * w[1];
		slope[1] += k[1] * w[1];
		second[0] += k[0] * k[0] * w[2];
		second[1] += k[0] * k[1] * w[2];
		second[2] += k[1] * k[1] * w[2];
	}
	return f;
}

static double facet_height(const struct gnp_solid_graph *graph, const double p[2], double slope[2], double second[3])
{
	double corner[3][2], z[3];
	gnp_solid_grid_find(&graph->grid, p, corner);
	for (int c = 0; c < 3; c++)
		z[c] = smooth_height(graph, corner[c], slope, second);
	const double a[2] = {corner[1][0] - corner[0][0], corner[1][1] - corner[0][1]}, rise = z[1] - z[0];
	const double b[2] = {corner[2][0] - corner[0][0], corner[2][1] - corner[0][1]}, other = z[2] - z[0];
	double determinant = a[0] * b[1] - a[1] * b[0];
	slope[0] = (rise * b[1] - other * a[1]) / determinant;
	slope[1] = (other * a[0] - rise * b[0]) / determinant;
	second[0] = second[1] = second[2] = 0;
	return z[0] + slope[0] * (p[0] - corner[0][0]) + slope[1] * (p[1] - corner[0][1]);
}

double gnp_solid_graph_height(const struct gnp_solid_graph *graph, const double p[2], double slope[2],
                              double second[3])
{
	if (graph->grid.cell > 0)
		return facet_height(graph, p, slope, second);
	return smooth_height(graph, p, slope, second);
}

/* ---- Places ---- */

bool gnp_solid_graph_contains(const struct gnp_solid_graph *graph, const double p[2])
{
	for (int h = 0; h < graph->holes; h++)
		if (hypot(p[0] - graph->hole[h][0], p[1] - graph->hole[h][1]) < graph->hole[h][2])
			return false;
	if (graph->disc)
		return hypot(p[0], p[1]) <= graph->half[0];
	return fabs(p[0]) <= graph->half[0] && fabs(p[1]) <= graph->half[1];
}

/* The sum of all waves' slopes is far above what many waves reach together; of up to eight it is the lesser bound. */
void gnp_solid_graph_bound(struct gnp_solid_graph *graph)
{
	static const double STEEPEST = 4; /* root mean squares */
	double bend[2], sum[2] = {0}, square = 0;
	for (int c = 0; c < 2; c++) {
		bend[c] = sum[c] = fabs(graph->bend[c]) * graph->half[graph->disc ? 0 : c];
		for (int w = 0; w < graph->waves; w++) {
			double slope = graph->height[w] * graph->wave[w][c];
			sum[c] += fabs(slope);
			square += slope * slope / 2;
		}
	}
	double all = sum[0] * sum[0] + sum[1] * sum[1], likely = hypot(bend[0], bend[1]) + STEEPEST * sqrt(square);
	graph->stretch = sqrt(1 + fmin(all, likely * likely));
}

double gnp_solid_graph_area(const struct gnp_solid_graph *graph)
{
	const double *half = graph->half;
	return graph->stretch * (graph->disc ? M_PI * half[0] * half[0] : 4 * half[0] * half[1]);
}

bool gnp_solid_graph_draw(const struct gnp_solid_graph *graph, struct gnp_random *random, double p[2])
{
	double u = gnp_random_uniform(random), v = gnp_random_uniform(random), slope[2], second[3];
	if (graph->disc) {
		p[0] = graph->half[0] * sqrt(u) * cos(2 * M_PI * v);
		p[1] = graph->half[0] * sqrt(u) * sin(2 * M_PI * v);
	} else {
		p[0] = graph->half[0] * (2 * u - 1);
		p[1] = graph->half[1] * (2 * v - 1);
	}
	double least = gnp_random_uniform(random) * graph->stretch; /* what the place must stretch by; 1 it always does */
	if (!gnp_solid_graph_contains(graph, p))
		return false;
	if (least < 1)
		return true;
	gnp_solid_graph_height(graph, p, slope, second);
	return least < sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
}
