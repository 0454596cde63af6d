/* Families of bodies that are sheets: thin plates, concentric shells, open patches, wavy height fields. */
#include "core/solids/solid_kinds.h"

static const double FULL = 2 * M_PI;

/* The four edges of a face whose parameters fill [p0, q0] x [p1, q1]. */
static void rims_add(struct gnp_solid_body *body, int face, double p0, double p1, double q0, double q1)
{
	gnp_solid_body_line(body, face, p0, p1, q0, p1);
	gnp_solid_body_line(body, face, p0, q1, q0, q1);
	gnp_solid_body_line(body, face, p0, p1, p0, q1);
	gnp_solid_body_line(body, face, q0, p1, q0, q1);
}

/* ---- Plates: the two sheets look away from each other, or one way ---- */

static void plate_flat(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	double width = gnp_solid_between(random, 0.3, 1), gap = gnp_solid_between(random, 1, 10) * sqrt(2 * width / count);
	gap = fmin(gap, 0.3);
	if (gnp_solid_chance(random, 0.5)) {
		const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
		gnp_solid_build_block(body, GNP_SOLID_UNION, &frame, (double[3]){0.5, width / 2, gap / 2});
		return;
	}
	for (int sheet = 0; sheet < 2; sheet++) {
		const double origin[3] = {0, 0, sheet * gap}, a[3] = {1, 0, 0}, b[3] = {0, width, 0};
		int face = gnp_solid_body_flat(body, body->pieces, origin, a, b, false);
		rims_add(body, face, 0, 0, 1, 1);
	}
	if (gnp_solid_chance(random, 0.7))
		body->face[0].sign = -1;
}

/* The narrow sides of a bent plate of radii r to r + gap. */
static void plate_sides(struct gnp_solid_body *body, const struct gnp_solid_frame *frame, double r, double gap,
                        double span, double height)
{
	double outer = r + gap, low = -height / 2;
	const struct gnp_solid_frustum top = {{outer, r}, {-low, -low}, {0, span}};
	const struct gnp_solid_frustum bottom = {{r, outer}, {low, low}, {0, span}};
	const double c = cos(span), s = sin(span);
	int upper = gnp_solid_body_frustum(body, body->pieces, frame, &top);
	int lower = gnp_solid_body_frustum(body, body->pieces, frame, &bottom);
	gnp_solid_body_flat(body, body->pieces, (double[3]){r, 0, low}, (double[3]){gap, 0, 0}, (double[3]){0, 0, height},
	                    false);
	gnp_solid_body_flat(body, body->pieces, (double[3]){r * c, r * s, low}, (double[3]){0, 0, height},
	                    (double[3]){gap * c, gap * s, 0}, false);
	gnp_solid_body_line(body, upper, 0, 0, 1, 0);
	gnp_solid_body_line(body, upper, 0, span, 1, span);
	gnp_solid_body_line(body, lower, 0, 0, 1, 0);
	gnp_solid_body_line(body, lower, 0, span, 1, span);
}

static void plate_bent(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	double r = gnp_solid_between(random, 0.2, 0.6), span = gnp_solid_between(random, 40, 200) * M_PI / 180;
	double height = gnp_solid_between(random, 0.3, 1), spacing = sqrt(2 * r * span * height / count);
	double gap = fmin(0.3 * r, gnp_solid_between(random, 1, 10) * spacing);
	bool sides = gnp_solid_chance(random, 0.5), away = sides || gnp_solid_chance(random, 0.7);
	for (int sheet = 0; sheet < 2; sheet++) {
		double radius = r + sheet * gap;
		const struct gnp_solid_frustum wall = {{radius, radius}, {-height / 2, height / 2}, {0, span}};
		int face = gnp_solid_body_frustum(body, body->pieces, &frame, &wall);
		rims_add(body, face, 0, 0, 1, span);
	}
	if (away)
		body->face[0].sign = -1;
	if (sides)
		plate_sides(body, &frame, r, gap, span, height);
}

static void plate_dome(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	double r = 0.5, low = gnp_solid_between(random, -0.3, 1), area = 2 * FULL * r * r * (1 - sin(low));
	double gap = fmin(0.3 * r, gnp_solid_between(random, 1, 10) * sqrt(area / count));
	for (int sheet = 0; sheet < 2; sheet++) {
		const struct gnp_solid_arc arc = {0, r + sheet * gap, {low, M_PI / 2}, {0, FULL}};
		int face = gnp_solid_body_arc(body, body->pieces, &frame, &arc);
		gnp_solid_body_line(body, face, low, 0, low, FULL);
	}
	if (gnp_solid_chance(random, 0.7))
		body->face[0].sign = -1;
}

void gnp_solid_build_plate(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	double style = gnp_random_uniform(random);
	if (style < 0.4)
		plate_flat(body, random, count);
	else if (style < 0.8)
		plate_bent(body, random, count);
	else
		plate_dome(body, random, count);
}

/* ---- Shells ---- */

/* Spheres, or cylinders open at both ends; from the outside in. */
void gnp_solid_build_nested(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	int shells = 2 + (int)gnp_random_below(random, 3);
	bool spheres = gnp_solid_chance(random, 0.5), alternate = gnp_solid_chance(random, 0.5);
	double height = gnp_solid_between(random, 0.4, 1.2), radius = spheres ? 0.5 : gnp_solid_between(random, 0.2, 0.5);
	double spacing = sqrt(shells * FULL * radius * (spheres ? 2 * radius : height) / count);
	for (int shell = 0; shell < shells; shell++) {
		int face;
		if (spheres) {
			const struct gnp_solid_arc arc = {0, radius, {-M_PI / 2, M_PI / 2}, {0, FULL}};
			face = gnp_solid_body_arc(body, body->pieces, &frame, &arc);
		} else {
			const struct gnp_solid_frustum wall = {{radius, radius}, {-height / 2, height / 2}, {0, FULL}};
			face = gnp_solid_body_frustum(body, body->pieces, &frame, &wall);
			gnp_solid_body_line(body, face, 0, 0, 0, FULL);
			gnp_solid_body_line(body, face, 1, 0, 1, FULL);
		}
		if (alternate && shell % 2)
			body->face[face].sign = -1;
		radius -= fmin(radius / 2, gnp_solid_scale(random, 1, 10) * spacing);
	}
}

/* ---- Patches ---- */

static bool hole_fits(const struct gnp_solid_graph *g, const double hole[3])
{
	for (int h = 0; h < g->holes; h++)
		if (hypot(hole[0] - g->hole[h][0], hole[1] - g->hole[h][1]) < 1.2 * (hole[2] + g->hole[h][2]))
			return false;
	if (g->disc)
		return hypot(hole[0], hole[1]) + 1.2 * hole[2] < g->half[0];
	return fabs(hole[0]) + 1.2 * hole[2] < g->half[0] && fabs(hole[1]) + 1.2 * hole[2] < g->half[1];
}

static void holes_draw(struct gnp_solid_graph *g, struct gnp_random *random, int wanted, double spacing)
{
	for (int attempt = 0; attempt < 16 && g->holes < wanted; attempt++) {
		double *hole = g->hole[g->holes];
		hole[0] = gnp_solid_between(random, -g->half[0], g->half[0]);
		hole[1] = gnp_solid_between(random, -g->half[g->disc ? 0 : 1], g->half[g->disc ? 0 : 1]);
		hole[2] = fmin(0.2, spacing * gnp_solid_scale(random, 1.5, 12));
		if (hole_fits(g, hole))
			g->holes++;
	}
}

void gnp_solid_build_graph(struct gnp_solid_body *body, const struct gnp_solid_graph *g)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	int face = gnp_solid_body_graph(body, body->pieces, &frame, g);
	if (g->disc)
		gnp_solid_body_circle(body, face, 0, 0, g->half[0]);
	else
		rims_add(body, face, -g->half[0], -g->half[1], g->half[0], g->half[1]);
	for (int h = 0; h < g->holes; h++)
		gnp_solid_body_circle(body, face, g->hole[h][0], g->hole[h][1], g->hole[h][2]);
}

static void patch_cylinder(struct gnp_solid_body *body, struct gnp_random *random)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	double radius = gnp_solid_scale(random, 0.12, 1), span = gnp_solid_between(random, 30, 320) * M_PI / 180;
	double height = gnp_solid_scale(random, 0.15, 1);
	span = fmin(span, 2 / radius);
	const struct gnp_solid_frustum wall = {{radius, radius}, {-height / 2, height / 2}, {0, span}};
	rims_add(body, gnp_solid_body_frustum(body, body->pieces, &frame, &wall), 0, 0, 1, span);
}

void gnp_solid_build_patch(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	double style = gnp_random_uniform(random), width = gnp_solid_scale(random, 0.08, 0.5);
	double first = gnp_solid_scale(random, 0.2, 3), second = gnp_solid_scale(random, 0.2, 3);
	struct gnp_solid_graph g = {.disc = gnp_solid_chance(random, 0.25), .half = {0.5, width}};
	double ribbon = gnp_solid_scale(random, 3, 15);
	if (style < 0.25) {
		patch_cylinder(body, random);
		return;
	}
	if (style >= 0.45) {
		g.bend[0] = first;
		g.bend[1] = style < 0.7 ? second : -second;
	}
	if (gnp_solid_chance(random, 0.25)) /* a ribbon: its width g spacings, its length 1 */
		g.half[1] = fmin(g.half[1], ribbon * ribbon / count / 2);
	double spacing = sqrt((g.disc ? M_PI / 4 : 2 * g.half[1]) / count);
	holes_draw(&g, random, (int)gnp_random_below(random, GNP_SOLID_HOLES + 1), spacing);
	gnp_solid_build_graph(body, &g);
}

/* A crest of slope at most m and wave number k has the curvature m k. */
void gnp_solid_build_wave(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	enum { MOST = 4 };
	struct gnp_solid_graph g = {.half = {0.5, gnp_solid_between(random, 0.2, 0.5)}};
	double spacing = sqrt(2 * g.half[1] / count);
	g.waves = 1 + (int)gnp_random_below(random, MOST);
	for (int w = 0; w < g.waves; w++) {
		double slope = gnp_solid_between(random, 0.15, 0.8) / sqrt(g.waves), angle = gnp_solid_between(random, 0, FULL);
		double radius = spacing * gnp_solid_scale(random, 2 * sqrt(g.waves), 40);
		double number = fmax(FULL, 1 / (slope * radius));
		g.wave[w][0] = number * cos(angle);
		g.wave[w][1] = number * sin(angle);
		g.height[w] = fmin(slope, 1 / (number * radius)) / number;
		g.phase[w] = gnp_solid_between(random, 0, FULL);
	}
	gnp_solid_build_graph(body, &g);
}
