/* Families of bodies with fillets, bends, tubes and tips: their smallest radii are told in spacings. */
#include "core/solids/solid_kinds.h"

#include <string.h>

static const double FULL = 2 * M_PI, QUARTER = M_PI / 2;

/* A fillet as the consumer sees it: one of less than half a spacing is a crease. */
struct fillet {
	double radius;
	bool tiny;
};

/* sharp: share of those without. No radius is about half a spacing. */
static struct fillet fillet_draw(struct gnp_random *random, double sharp, double spacing, double limit)
{
	double style = gnp_random_uniform(random);
	double small = gnp_solid_scale(random, 0.05, 0.4), large = gnp_solid_scale(random, 0.6, 40);
	struct fillet fillet = {0, false};
	if (style >= sharp + 0.1)
		fillet.radius = large * spacing;
	else if (style >= sharp)
		fillet.radius = small * spacing;
	fillet.radius = fmin(fillet.radius, limit);
	fillet.tiny = fillet.radius > 0 && fillet.radius < 0.5 * spacing;
	return fillet;
}

/* ---- Rounded boxes: six sides, twelve quarter cylinders, eight eighths of a sphere ---- */

static uint32_t piece_of(const struct gnp_solid_body *body, bool tiny)
{
	return tiny ? body->pieces : 0;
}

static void round_sides(struct gnp_solid_body *body, const double half[3], struct fillet fillet)
{
	for (int c = 0; c < 3; c++)
		for (int sign = -1; sign <= 1; sign += 2) {
			int u = (c + (sign > 0 ? 1 : 2)) % 3, v = (c + (sign > 0 ? 2 : 1)) % 3;
			double origin[3] = {-half[0], -half[1], -half[2]}, a[3] = {0}, b[3] = {0};
			origin[c] = sign * (half[c] + fillet.radius);
			a[u] = 2 * half[u];
			b[v] = 2 * half[v];
			gnp_solid_body_flat(body, piece_of(body, fillet.tiny), origin, a, b, false);
		}
}

/* Quadrant q of the plane has the signs (+, +), (-, +), (-, -), (+, -). */
static double sign_0(int q)
{
	return q == 0 || q == 3 ? 1 : -1;
}

static double sign_1(int q)
{
	return q < 2 ? 1 : -1;
}

static void round_edges(struct gnp_solid_body *body, const double half[3], struct fillet fillet)
{
	for (int c = 0; c < 3; c++)
		for (int q = 0; q < 4; q++) {
			int u = (c + 1) % 3, v = (c + 2) % 3;
			struct gnp_solid_frame frame = {0};
			frame.axis[0][u] = frame.axis[1][v] = frame.axis[2][c] = 1;
			frame.origin[u] = sign_0(q) * half[u];
			frame.origin[v] = sign_1(q) * half[v];
			const struct gnp_solid_frustum wall = {
				{fillet.radius, fillet.radius}, {-half[c], half[c]}, {q * QUARTER, (q + 1) * QUARTER}};
			int face = gnp_solid_body_frustum(body, piece_of(body, fillet.tiny), &frame, &wall);
			if (fillet.tiny)
				gnp_solid_body_line(body, face, 0, (q + 0.5) * QUARTER, 1, (q + 0.5) * QUARTER);
		}
}

static void round_corners(struct gnp_solid_body *body, const double half[3], struct fillet fillet)
{
	for (int top = 0; top < 2; top++)
		for (int q = 0; q < 4; q++) {
			double z = top ? half[2] : -half[2];
			const struct gnp_solid_frame frame = gnp_solid_frame_at(sign_0(q) * half[0], sign_1(q) * half[1], z);
			const struct gnp_solid_arc arc = {
				0, fillet.radius, {top ? 0 : -QUARTER, top ? QUARTER : 0}, {q * QUARTER, (q + 1) * QUARTER}};
			int face = gnp_solid_body_arc(body, piece_of(body, fillet.tiny), &frame, &arc);
			double turn = (arc.turn[0] + arc.turn[1]) / 2, angle = (q + 0.5) * QUARTER;
			if (fillet.tiny)
				gnp_solid_body_line(body, face, turn, angle, turn, angle);
		}
}

static void rounded_box(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	double half[3] = {0.5, gnp_solid_scale(random, 0.1, 0.5), gnp_solid_scale(random, 0.06, 0.5)};
	double spacing = sqrt(8 * (half[0] * half[1] + half[1] * half[2] + half[2] * half[0]) / count);
	struct fillet fillet = fillet_draw(random, 0.1, spacing, 0.95 * fmin(half[1], half[2]));
	if (fillet.radius == 0) {
		const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
		gnp_solid_build_block(body, GNP_SOLID_UNION, &frame, half);
		return;
	}
	for (int c = 0; c < 3; c++)
		half[c] -= fillet.radius;
	round_sides(body, half, fillet);
	round_edges(body, half, fillet);
	round_corners(body, half, fillet);
}

/* ---- Rounded cylinders: each end has a fillet of its own ---- */

/* The disc and the fillet at one end; up: 1 or -1. */
static void rounded_end(struct gnp_solid_body *body, int wall, double radius, double height, int up,
                        struct fillet fillet)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, up * (height / 2 - fillet.radius));
	double inner = radius - fillet.radius, z = up * fillet.radius;
	struct gnp_solid_frustum disc = {{up > 0 ? inner : 0, up > 0 ? 0 : inner}, {z, z}, {0, FULL}};
	const struct gnp_solid_arc arc = {inner, fillet.radius, {up > 0 ? 0 : -QUARTER, up > 0 ? QUARTER : 0}, {0, FULL}};
	bool crease = fillet.tiny || fillet.radius == 0;
	if (fillet.radius > 0) {
		int face = gnp_solid_body_arc(body, piece_of(body, fillet.tiny), &frame, &arc);
		if (fillet.tiny)
			gnp_solid_body_line(body, face, up * QUARTER / 2, 0, up * QUARTER / 2, FULL);
	} else {
		gnp_solid_body_line(body, wall, up > 0 ? 1 : 0, 0, up > 0 ? 1 : 0, FULL);
	}
	gnp_solid_body_frustum(body, piece_of(body, crease), &frame, &disc);
}

static void rounded_cylinder(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, 0);
	double radius = gnp_solid_scale(random, 0.08, 0.5), height = gnp_solid_scale(random, 0.1, 1);
	double spacing = sqrt(FULL * radius * (radius + height) / count), limit = 0.48 * fmin(height, 2 * radius);
	struct fillet top = fillet_draw(random, 0.2, spacing, limit), bottom = fillet_draw(random, 0.2, spacing, limit);
	double low = -height / 2 + bottom.radius, high = height / 2 - top.radius;
	const struct gnp_solid_frustum wall = {{radius, radius}, {low, high}, {0, FULL}};
	int face = gnp_solid_body_frustum(body, 0, &frame, &wall);
	rounded_end(body, face, radius, height, 1, top);
	rounded_end(body, face, radius, height, -1, bottom);
}

void gnp_solid_build_rounded(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	if (gnp_solid_chance(random, 0.65))
		rounded_box(body, random, count);
	else
		rounded_cylinder(body, random, count);
}

/* ---- Folded sheets: strips along a line of bends that goes on forwards, so that it does not meet itself ---- */

enum { STRIPS = 7 };

struct fold {
	int strips;
	double width, length[STRIPS], heading[STRIPS];
	struct fillet bend[STRIPS]; /* after the strip; the last has none */
};

static void fold_draw(struct fold *fold, struct gnp_random *random, double count)
{
	static const double STEEPEST = 80 * M_PI / 180, LEAST = 12 * M_PI / 180, MOST = 150 * M_PI / 180;
	double sum = 0;
	fold->strips = 2 + (int)gnp_random_below(random, STRIPS - 1);
	fold->width = gnp_solid_between(random, 0.15, 1);
	for (int i = 0; i < fold->strips; i++) {
		fold->length[i] = gnp_solid_scale(random, 0.08, 0.6);
		sum += fold->length[i];
		double turn;
		do {
			fold->heading[i] = gnp_solid_between(random, -STEEPEST, STEEPEST);
			turn = i ? fabs(fold->heading[i] - fold->heading[i - 1]) : MOST;
		} while (turn < LEAST || turn > MOST);
	}
	double spacing = sqrt(sum * fold->width / count);
	for (int i = 0; i + 1 < fold->strips; i++) {
		double turn = fabs(fold->heading[i + 1] - fold->heading[i]);
		double limit = 0.45 * fmin(fold->length[i], fold->length[i + 1]) / tan(turn / 2);
		fold->bend[i] = fillet_draw(random, 0.4, spacing, limit);
	}
	fold->bend[fold->strips - 1] = (struct fillet){0, false};
}

/* What a fillet takes of the strips on both sides. */
static double fold_trim(const struct fold *fold, int i)
{
	if (i < 0 || i + 1 >= fold->strips)
		return 0;
	return fold->bend[i].radius * tan(fabs(fold->heading[i + 1] - fold->heading[i]) / 2);
}

static void strip_add(struct gnp_solid_body *body, const struct fold *fold, int i, const double start[2],
                      uint32_t piece)
{
	double length = fold->length[i] - fold_trim(fold, i - 1) - fold_trim(fold, i);
	const double origin[3] = {start[0], start[1], 0}, b[3] = {0, 0, fold->width};
	const double a[3] = {length * cos(fold->heading[i]), length * sin(fold->heading[i]), 0};
	int face = gnp_solid_body_flat(body, piece, origin, a, b, false);
	gnp_solid_body_line(body, face, 0, 0, 1, 0);
	gnp_solid_body_line(body, face, 0, 1, 1, 1);
	if (i == 0)
		gnp_solid_body_line(body, face, 0, 0, 0, 1);
	if (fold->bend[i].radius == 0) /* a crease, or the last rim */
		gnp_solid_body_line(body, face, 1, 0, 1, 1);
}

/* The round part after strip i, which ends at `at`. The sheet's outside is to the right of its line. */
static void bend_add(struct gnp_solid_body *body, const struct fold *fold, int i, const double at[2], uint32_t piece)
{
	double turn = fold->heading[i + 1] - fold->heading[i], radius = fold->bend[i].radius, left = turn > 0 ? 1 : -1;
	double first = fold->heading[i] - left * QUARTER, last = first + turn; /* directions from the centre */
	const struct gnp_solid_frame frame =
		gnp_solid_frame_at(at[0] - radius * cos(first), at[1] - radius * sin(first), 0);
	const struct gnp_solid_frustum wall = {{radius, radius}, {0, fold->width}, {fmin(first, last), fmax(first, last)}};
	int face = gnp_solid_body_frustum(body, piece, &frame, &wall);
	body->face[face].sign = left;
	gnp_solid_body_line(body, face, 0, first, 0, last);
	gnp_solid_body_line(body, face, 1, first, 1, last);
	if (fold->bend[i].tiny)
		gnp_solid_body_line(body, face, 0, (first + last) / 2, 1, (first + last) / 2);
}

void gnp_solid_build_fold(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	struct fold fold;
	double corner[2] = {0, 0};
	uint32_t piece = 0;
	fold_draw(&fold, random, count);
	for (int i = 0; i < fold.strips; i++) {
		const double along[2] = {cos(fold.heading[i]), sin(fold.heading[i])};
		double before = fold_trim(&fold, i - 1), after = fold.length[i] - fold_trim(&fold, i);
		strip_add(body, &fold, i, (double[2]){corner[0] + before * along[0], corner[1] + before * along[1]}, piece);
		piece += fold.bend[i].tiny;
		if (fold.bend[i].radius > 0)
			bend_add(body, &fold, i, (double[2]){corner[0] + after * along[0], corner[1] + after * along[1]}, piece);
		piece += fold.bend[i].tiny || fold.bend[i].radius == 0;
		corner[0] += fold.length[i] * along[0];
		corner[1] += fold.length[i] * along[1];
	}
}

/* ---- Tubes and rings ---- */

static int parts_draw(struct gnp_random *random, double count)
{
	return count < 1500 ? 1 : 1 + (int)gnp_random_below(random, count < 6000 ? 3 : 6);
}

enum { PARTS = 6 };

/* An end of a tube: open, round or flat. */
static void tube_end(struct gnp_solid_body *body, int wall, double x, double radius, double height, int up,
                     double style)
{
	const struct gnp_solid_frame frame = gnp_solid_frame_at(x, 0, up * height / 2);
	const struct gnp_solid_arc dome = {0, radius, {up > 0 ? 0 : -QUARTER, up > 0 ? QUARTER : 0}, {0, FULL}};
	const struct gnp_solid_frustum disc = {{up > 0 ? radius : 0, up > 0 ? 0 : radius}, {0, 0}, {0, FULL}};
	if (style < 0.4) {
		gnp_solid_body_arc(body, body->face[wall].piece, &frame, &dome);
		return;
	}
	gnp_solid_body_line(body, wall, up > 0 ? 1 : 0, 0, up > 0 ? 1 : 0, FULL);
	if (style < 0.7)
		gnp_solid_body_frustum(body, body->pieces, &frame, &disc);
}

static void tube_row(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	int parts = parts_draw(random, count);
	double radius[PARTS], height[PARTS], sum = 0, x = 0;
	for (int i = 0; i < parts; i++) {
		radius[i] = gnp_solid_scale(random, 1.5, 10);
		height[i] = gnp_solid_between(random, 0.3, 1);
		sum += FULL * radius[i] * height[i];
	}
	double spacing = sum / count;
	for (int i = 0; i < parts; i++) {
		double r = fmin(radius[i] * spacing, 0.3 * height[i]);
		x += i ? r + spacing * gnp_solid_scale(random, 1.5, 15) : 0;
		const struct gnp_solid_frame frame = gnp_solid_frame_at(x, 0, 0);
		const struct gnp_solid_frustum side = {{r, r}, {-height[i] / 2, height[i] / 2}, {0, FULL}};
		int wall = gnp_solid_body_frustum(body, body->pieces, &frame, &side);
		tube_end(body, wall, x, r, height[i], 1, gnp_random_uniform(random));
		tube_end(body, wall, x, r, height[i], -1, gnp_random_uniform(random));
		x += r;
	}
}

static void ring_stack(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	int parts = parts_draw(random, count);
	double major[PARTS], minor[PARTS], sum = 0, z = 0;
	for (int i = 0; i < parts; i++) {
		major[i] = gnp_solid_between(random, 0.15, 0.5);
		minor[i] = gnp_solid_scale(random, 1.5, 10);
		sum += FULL * FULL * major[i] * minor[i];
	}
	double spacing = sum / count;
	for (int i = 0; i < parts; i++) {
		double r = fmin(minor[i] * spacing, 0.4 * major[i]);
		z += i ? r + spacing * gnp_solid_scale(random, 1.5, 15) : 0;
		const struct gnp_solid_frame frame = gnp_solid_frame_at(0, 0, z);
		const struct gnp_solid_arc arc = {major[i], r, {-M_PI, M_PI}, {0, FULL}};
		gnp_solid_body_arc(body, body->pieces, &frame, &arc);
		z += r;
	}
}

void gnp_solid_build_tube(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	if (gnp_solid_chance(random, 0.7))
		tube_row(body, random, count);
	else
		ring_stack(body, random, count);
}

/* ---- Cones ---- */

/* The tip, sharp or a part of a sphere that the cone touches; slope: of the wall's normal upwards. */
static void cone_wall(struct gnp_solid_body *body, const struct gnp_solid_frame *frame, double radius, double slope,
                      double tip)
{
	double height = radius / tan(slope);
	const struct gnp_solid_frustum wall = {
		{radius, tip * cos(slope)}, {0, height - tip / sin(slope) + tip * sin(slope)}, {0, FULL}};
	int face = gnp_solid_body_frustum(body, body->pieces, frame, &wall);
	if (tip > 0) {
		struct gnp_solid_frame above = *frame;
		const struct gnp_solid_arc arc = {0, tip, {slope, QUARTER}, {0, FULL}};
		above.origin[2] += height - tip / sin(slope);
		gnp_solid_body_arc(body, body->face[face].piece, &above, &arc);
	} else {
		gnp_solid_body_line(body, face, 1, 0, 1, 0);
	}
	gnp_solid_body_line(body, face, 0, 0, 0, FULL);
}

/* Open, closed by a disc, or by another cone. */
static void cone_base(struct gnp_solid_body *body, const struct gnp_solid_frame *frame, double radius, double style,
                      double slope)
{
	if (style < 0.4) {
		const struct gnp_solid_frustum disc = {{0, radius}, {0, 0}, {0, FULL}};
		gnp_solid_body_frustum(body, body->pieces, frame, &disc);
	} else if (style < 0.7) {
		const struct gnp_solid_frustum wall = {{0, radius}, {-radius / tan(slope), 0}, {0, FULL}};
		int face = gnp_solid_body_frustum(body, body->pieces, frame, &wall);
		gnp_solid_body_line(body, face, 0, 0, 0, 0);
	}
}

void gnp_solid_build_cone(struct gnp_solid_body *body, struct gnp_random *random, double count)
{
	int parts = parts_draw(random, count);
	double radius[PARTS], slope[PARTS], area = 0, x = 0;
	for (int i = 0; i < parts; i++) {
		slope[i] = gnp_solid_between(random, 8, 70) * M_PI / 180;
		radius[i] = fmin(gnp_solid_between(random, 0.1, 0.4), tan(slope[i]));
		area += 1.3 * M_PI * radius[i] * radius[i] / sin(slope[i]);
	}
	double spacing = sqrt(area / count);
	for (int i = 0; i < parts; i++) {
		bool sharp = gnp_solid_chance(random, 0.5);
		double tip = sharp ? 0 : fmin(0.5 * radius[i], spacing * gnp_solid_scale(random, 0.6, 6));
		double gap = spacing * gnp_solid_scale(random, 1.5, 15), style = gnp_random_uniform(random);
		x += i ? radius[i] + gap : 0;
		const struct gnp_solid_frame frame = gnp_solid_frame_at(x, 0, 0);
		cone_wall(body, &frame, radius[i], slope[i], tip);
		cone_base(body, &frame, radius[i], style, gnp_solid_between(random, 8, 70) * M_PI / 180);
		x += radius[i];
	}
}
