#include "core/cells/polygon.h"

void gnp_polygon_square(double half, struct gnp_polygon *out)
{
	*out = (struct gnp_polygon){.count = 4, .x = {half, -half, -half, half}, .y = {half, half, -half, -half},
	                            .cutter = {GNP_POLYGON_OUTER, GNP_POLYGON_OUTER, GNP_POLYGON_OUTER, GNP_POLYGON_OUTER}};
}

void gnp_polygon_cut(struct gnp_polygon *polygon, double a, double b, double c, uint32_t cutter)
{
	struct gnp_polygon kept = {.count = 0};
	for (size_t i = 0; i < polygon->count && kept.count + 2 <= GNP_POLYGON_MAX; i++) {
		size_t next = i + 1 < polygon->count ? i + 1 : 0;
		double here = a * polygon->x[i] + b * polygon->y[i] - c;
		double there = a * polygon->x[next] + b * polygon->y[next] - c;
		if (here <= 0) {
			kept.x[kept.count] = polygon->x[i];
			kept.y[kept.count] = polygon->y[i];
			kept.cutter[kept.count++] = polygon->cutter[i];
		}
		if ((here <= 0) != (there <= 0)) {
			double t = here / (here - there);
			kept.x[kept.count] = polygon->x[i] + t * (polygon->x[next] - polygon->x[i]);
			kept.y[kept.count] = polygon->y[i] + t * (polygon->y[next] - polygon->y[i]);
			kept.cutter[kept.count++] = here <= 0 ? cutter : polygon->cutter[i];
		}
	}
	*polygon = kept;
}

double gnp_polygon_reach(const struct gnp_polygon *polygon, size_t *farthest)
{
	double most = 0;
	for (size_t i = 0; i < polygon->count; i++) {
		double r = polygon->x[i] * polygon->x[i] + polygon->y[i] * polygon->y[i];
		if (r > most) {
			most = r;
			*farthest = i;
		}
	}
	return most;
}
