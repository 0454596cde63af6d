/* Families of rough sheets, as scanned detail is: height fields of many waves of all lengths, smooth or as
 * triangles. */
#include "core/solids/solid_kinds.h"

static const double FULL = 2 * M_PI;

/* Lengths between the shortest and most of the patch; what a length has of the slope goes with a power of it. */
static void waves_draw(struct gnp_solid_graph *g, struct gnp_random *random, double shortest, double slope)
{
	enum { FEWEST = 20 };
	double longest = fmax(2.0 / 3, 2 * shortest), power = gnp_solid_between(random, -0.3, 1), square = 0;
	double ridged = gnp_solid_chance(random, 0.35) ? gnp_solid_between(random, 0.1, 0.8) : 0;
	double soft = gnp_solid_scale(random, 0.02, 0.5);
	g->waves = FEWEST + (int)gnp_random_below(random, GNP_SOLID_WAVES - FEWEST + 1);
	for (int w = 0; w < g->waves; w++) {
		double length = gnp_solid_scale(random, shortest, longest), angle = gnp_solid_between(random, 0, FULL);
		double share = pow(length, power) * gnp_solid_between(random, 0.3, 1.3);
		g->wave[w][0] = FULL / length * cos(angle);
		g->wave[w][1] = FULL / length * sin(angle);
		g->phase[w] = gnp_solid_between(random, 0, FULL);
		g->height[w] = share * length / FULL;
		g->soft[w] = gnp_solid_chance(random, ridged) ? soft : 0;
		square += share * share / 2;
	}
	for (int w = 0; w < g->waves; w++)
		g->height[w] *= slope / sqrt(square);
}

/* Returns the spacing: of the slope's mean square the area follows. */
static double field_draw(struct gnp_solid_graph *g, struct gnp_random *random, double count)
{
	double slope = gnp_solid_scale(random, 0.05, 0.9);
	*g = (struct gnp_solid_graph){.half = {0.5, 0.5 / gnp_solid_between(random, 1, 2.5)}};
	double spacing = sqrt(2 * g->half[1] * hypot(1, slope) / count);
	waves_draw(g, random, gnp_solid_scale(random, 2.5, 30) * spacing, slope);
	return spacing;
}

void gnp_solid_build_rough(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	struct gnp_solid_graph g;
	field_draw(&g, random, count);
	gnp_solid_build_graph(body, &g);
}

void gnp_solid_build_facets(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	struct gnp_solid_graph g;
	double spacing = field_draw(&g, random, count);
	g.grid.cell = gnp_solid_scale(random, 0.7, 6) * spacing;
	g.grid.jitter = gnp_solid_between(random, 0, 0.2);
	g.grid.seed = gnp_random_next(random);
	gnp_solid_build_graph(body, &g);
}
