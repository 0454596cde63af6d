#include "core/solids/solid_graph.h"

#include <math.h>

double gnp_solid_graph_height(const struct gnp_solid_graph *graph, const double p[2], double slope[2],
                              double second[3])
{
	double f = (graph->bend[0] * p[0] * p[0] + graph->bend[1] * p[1] * p[1]) / 2;
	slope[0] = graph->bend[0] * p[0];
	slope[1] = graph->bend[1] * p[1];
	second[0] = graph->bend[0];
	second[1] = 0;
	second[2] = graph->bend[1];
	for (int w = 0; w < graph->waves; w++) {
		const double *k = graph->wave[w];
		double angle = k[0] * p[0] + k[1] * p[1] + graph->phase[w];
		double s = graph->height[w] * sin(angle), c = graph->height[w] * cos(angle);
		f += s;
		slope[0] += k[0] * c;
		slope[1] += k[1] * c;
		second[0] -= k[0] * k[0] * s;
		second[1] -= k[0] * k[1] * s;
		second[2] -= k[1] * k[1] * s;
	}
	return f;
}

bool gnp_solid_graph_contains(const struct gnp_solid_graph *graph, const double p[2])
{
	for (int h = 0; h < graph->holes; h++)
		if (hypot(p[0] - graph->hole[h][0], p[1] - graph->hole[h][1]) < graph->hole[h][2])
			return false;
	if (graph->disc)
		return hypot(p[0], p[1]) <= graph->half[0];
	return fabs(p[0]) <= graph->half[0] && fabs(p[1]) <= graph->half[1];
}

void gnp_solid_graph_bound(struct gnp_solid_graph *graph)
{
	double slope[2];
	for (int c = 0; c < 2; c++) {
		slope[c] = fabs(graph->bend[c]) * graph->half[graph->disc ? 0 : c];
		for (int w = 0; w < graph->waves; w++)
			slope[c] += fabs(graph->height[w] * graph->wave[w][c]);
	}
	graph->stretch = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
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
	gnp_solid_graph_height(graph, p, slope, second);
	double stretch = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
	return gnp_random_uniform(random) * graph->stretch < stretch && gnp_solid_graph_contains(graph, p);
}
