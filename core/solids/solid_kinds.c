#include "core/solids/solid_kinds.h"

#include <string.h>

#include "core/solids/solid.h"

static const double FULL = 2 * M_PI;

/* ---- Primitives ---- */

static void place(const struct gnp_solid_frame *frame, double x, double y, double z, double out[3])
{
	for (int i = 0; i < 3; i++)
		out[i] = frame->origin[i] + x * frame->axis[0][i] + y * frame->axis[1][i] + z * frame->axis[2][i];
}

static void side_add(struct gnp_solid_body *body, const struct gnp_solid_frame *frame, const double half[3], int c,
                     int sign)
{
	int u = (c + (sign > 0 ? 1 : 2)) % 3, v = (c + (sign > 0 ? 2 : 1)) % 3;
	double corner[3] = {-half[0], -half[1], -half[2]}, origin[3], a[3], b[3];
	corner[c] *= -sign;
	place(frame, corner[0], corner[1], corner[2], origin);
	for (int i = 0; i < 3; i++) {
		a[i] = 2 * half[u] * frame->axis[u][i];
		b[i] = 2 * half[v] * frame->axis[v][i];
	}
	gnp_solid_body_half(body, gnp_solid_body_flat(body, body->pieces, origin, a, b, false));
}

void gnp_solid_build_block(struct gnp_solid_body *body, int operation, const struct gnp_solid_frame *frame,
                           const double half[3])
{
	gnp_solid_body_primitive(body, operation);
	for (int c = 0; c < 3; c++)
		for (int sign = -1; sign <= 1; sign += 2)
			side_add(body, frame, half, c, sign);
}

static int turned_add(struct gnp_solid_body *body, const struct gnp_solid_frame *frame, double r0, double z0,
                      double r1, double z1)
{
	const struct gnp_solid_frustum line = {{r0, r1}, {z0, z1}, {0, FULL}};
	int face = gnp_solid_body_frustum(body, body->pieces, frame, &line);
	gnp_solid_body_half(body, face);
	return face;
}

/* A cone cut at radius top; 0: to its tip. Equal radii: a cylinder. */
static void cone_add(struct gnp_solid_body *body, int operation, const struct gnp_solid_frame *frame, double base,
                     double top, double height)
{
	gnp_solid_body_primitive(body, operation);
	int wall = turned_add(body, frame, base, -height / 2, top, height / 2);
	turned_add(body, frame, 0, -height / 2, base, -height / 2);
	if (top > 0)
		turned_add(body, frame, top, height / 2, 0, height / 2);
	else
		gnp_solid_body_line(body, wall, 1, 0, 1, 0);
}

static void ring_add(struct gnp_solid_body *body, int operation, const struct gnp_solid_frame *frame, double major,
                     double minor)
{
	const double limit = major > 0 ? M_PI : M_PI / 2;
	const struct gnp_solid_arc arc = {major, minor, {-limit, limit}, {0, FULL}};
	gnp_solid_body_primitive(body, operation);
	gnp_solid_body_half(body, gnp_solid_body_arc(body, body->pieces, frame, &arc));
}

/* polygon: convex, counterclockwise, at most 10 corners; the prism stands on it along z. */
static void prism_add(struct gnp_solid_body *body, int corners, const double polygon[][2], double height)
{
	uint32_t top = body->pieces + (uint32_t)corners, bottom = top + 1;
	int first_top = -1, first_bottom = -1;
	gnp_solid_body_primitive(body, GNP_SOLID_UNION);
	for (int i = 0; i < corners; i++) {
		const double *p = polygon[i], *q = polygon[(i + 1) % corners];
		const double origin[3] = {p[0], p[1], 0}, a[3] = {q[0] - p[0], q[1] - p[1], 0}, b[3] = {0, 0, height};
		gnp_solid_body_half(body, gnp_solid_body_flat(body, body->pieces, origin, a, b, false));
	}
	for (int i = 1; i + 1 < corners; i++) {
		const double *o = polygon[0], *p = polygon[i], *q = polygon[i + 1];
		const double low[3] = {o[0], o[1], 0}, high[3] = {o[0], o[1], height};
		const double a[3] = {p[0] - o[0], p[1] - o[1], 0}, b[3] = {q[0] - o[0], q[1] - o[1], 0};
		int upper = gnp_solid_body_flat(body, top, high, a, b, true);
		int lower = gnp_solid_body_flat(body, bottom, low, b, a, true);
		if (i == 1) {
			gnp_solid_body_half(body, first_top = upper);
			gnp_solid_body_half(body, first_bottom = lower);
		} else {
			gnp_solid_body_same_half(body, upper, first_top);
			gnp_solid_body_same_half(body, lower, first_bottom);
		}
	}
}

/* ---- Families of one primitive ---- */

static void build_box(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	double half[3] = {0.5, gnp_solid_scale(random, 0.1, 0.5), gnp_solid_scale(random, 0.1, 0.5)};
	double style = gnp_random_uniform(random), g = gnp_solid_scale(random, 1, 12), h = gnp_solid_scale(random, 1, 12);
	if (style < 0.35) { /* a plate: area 2 a b */
		half[2] = fmin(half[2], g * sqrt(8 * half[0] * half[1] / count) / 2);
	} else if (style < 0.55) { /* a bar: area 2 (g + h) times the spacing */
		half[1] = fmin(half[1], g * (g + h) / count);
		half[2] = fmin(half[2], h * (g + h) / count);
	}
	gnp_solid_build_block(body, GNP_SOLID_UNION, &frame, half);
}

/* An isosceles roof of the given angle: a triangle, or on walls. */
static int polygon_roof(double angle, double width, bool walls, double polygon[][2])
{
	double rise = width / 2 / tan(angle / 2), wall = walls ? width / 2 : 0;
	double side = width / 2;
	const double corners[5][2] = {{0, wall + rise}, {-side, wall}, {-side, 0}, {side, 0}, {side, wall}};
	int made = 0;
	for (int i = 0; i < 5; i++)
		if (walls || (i != 1 && i != 4))
			memcpy(polygon[made++], corners[i], sizeof corners[i]);
	return made;
}

/* Corners on an ellipse, a sixth of a step off an even spread at most. */
static int polygon_oval(struct gnp_random *random, double polygon[][2])
{
	int corners = 3 + (int)gnp_random_below(random, 6);
	double flat = gnp_solid_between(random, 0.5, 1);
	for (int i = 0; i < corners; i++) {
		double angle = FULL * (i + gnp_solid_between(random, -0.16, 0.16)) / corners;
		polygon[i][0] = 0.4 * cos(angle);
		polygon[i][1] = 0.4 * flat * sin(angle);
	}
	return corners;
}

static void build_prism(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	double polygon[10][2], angle = gnp_solid_between(random, 30, 170) * M_PI / 180;
	double width = gnp_solid_scale(random, 0.15, 0.8);
	bool roof = gnp_solid_chance(random, 0.7), walls = angle > M_PI / 3 && gnp_solid_chance(random, 0.7);
	double height = gnp_solid_scale(random, 0.1, 1);
	(void)count;
	walls = walls || angle > 2 * M_PI / 3; /* else the eaves are sharper than 30 degrees */
	int corners = roof ? polygon_roof(angle, width, walls, polygon) : polygon_oval(random, polygon);
	prism_add(body, corners, (const double (*)[2])polygon, height);
}

/* ---- Boolean operations ---- */

/* size: about half the width. */
static void primitive_draw(struct gnp_solid_body *body, struct gnp_random *random, int operation,
                           const struct gnp_solid_frame *frame, double size)
{
	double kind = gnp_random_uniform(random), a = gnp_random_uniform(random), b = gnp_random_uniform(random);
	if (kind < 0.35) {
		const double half[3] = {size * (0.5 + a), size * (0.5 + b), size * gnp_solid_between(random, 0.5, 1.5)};
		gnp_solid_build_block(body, operation, frame, half);
	} else if (kind < 0.6) {
		double radius = size * (0.4 + 0.6 * a);
		cone_add(body, operation, frame, radius, radius, size * (0.8 + 2.2 * b));
	} else if (kind < 0.75) {
		ring_add(body, operation, frame, 0, size);
	} else if (kind < 0.9) {
		double top = gnp_solid_chance(random, 0.5) ? 0 : 0.8 * size * a;
		cone_add(body, operation, frame, size, top, size * (0.8 + 1.7 * b));
	} else {
		ring_add(body, operation, frame, size, size * (0.15 + 0.3 * a));
	}
}

/* About a point of a face there is, off it by a few tenths of the size. */
static void frame_draw(const struct gnp_solid_body *body, struct gnp_random *random, double size,
                       struct gnp_solid_frame *frame)
{
	const struct gnp_solid_face *face = &body->face[gnp_random_below(random, (uint64_t)body->faces)];
	double p[2], x[3];
	gnp_solid_face_draw(face, random, p);
	gnp_solid_face_point(face, p, x);
	*frame = gnp_solid_chance(random, 0.5) ? gnp_solid_frame_at(0, 0, 0) : gnp_solid_frame_random(random);
	for (int i = 0; i < 3; i++)
		frame->origin[i] = x[i] + 0.3 * size * gnp_random_normal(random);
}

static void build_csg(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	int primitives = 2 + (int)gnp_random_below(random, GNP_SOLID_PRIMITIVES - 1);
	double spacing = sqrt(1.5 / count);
	struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	primitive_draw(body, random, GNP_SOLID_UNION, &frame, gnp_solid_between(random, 0.25, 0.4));
	for (int i = 1; i < primitives; i++) {
		bool small = gnp_solid_chance(random, 0.35);
		double size = small ? fmin(0.3, spacing * gnp_solid_scale(random, 2, 15)) : gnp_solid_scale(random, 0.08, 0.4);
		double kind = gnp_random_uniform(random);
		int rest = kind < 0.85 || small ? GNP_SOLID_DIFFERENCE : GNP_SOLID_INTERSECTION;
		int operation = kind < 0.45 ? GNP_SOLID_UNION : rest;
		frame_draw(body, random, size, &frame);
		if (operation == GNP_SOLID_INTERSECTION) {
			size = gnp_solid_between(random, 0.25, 0.5);
			for (int c = 0; c < 3; c++)
				frame.origin[c] *= 0.4;
		}
		primitive_draw(body, random, operation, &frame, size);
	}
}

/* ---- All ---- */

void gnp_solid_kinds_build(int kind, struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	static gnp_solid_build *const builders[GNP_SOLID_KIND_COUNT] = {
		[GNP_SOLID_BOX] = build_box,
		[GNP_SOLID_PRISM] = build_prism,
		[GNP_SOLID_CSG] = build_csg,
		[GNP_SOLID_ROUNDED] = gnp_solid_build_rounded,
		[GNP_SOLID_FOLD] = gnp_solid_build_fold,
		[GNP_SOLID_PLATE] = gnp_solid_build_plate,
		[GNP_SOLID_NESTED] = gnp_solid_build_nested,
		[GNP_SOLID_PATCH] = gnp_solid_build_patch,
		[GNP_SOLID_TUBE] = gnp_solid_build_tube,
		[GNP_SOLID_CONE] = gnp_solid_build_cone,
		[GNP_SOLID_WAVE] = gnp_solid_build_wave,
		[GNP_SOLID_ROUGH] = gnp_solid_build_rough,
		[GNP_SOLID_FACETS] = gnp_solid_build_facets,
	};
	memset(body, 0, sizeof *body);
	builders[kind](body, random, count);
	gnp_solid_body_measure(body);
}
