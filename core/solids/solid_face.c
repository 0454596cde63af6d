#include "core/solids/solid_face.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"
#include "core/shapes/shape_family.h"

/* ---- Frames ---- */

static void to_local(const struct gnp_solid_frame *frame, const double x[3], double y[3])
{
	double d[3] = {x[0] - frame->origin[0], x[1] - frame->origin[1], x[2] - frame->origin[2]};
	for (int c = 0; c < 3; c++)
		y[c] = gnp_dot(frame->axis[c], d);
}

static void turn_back(const struct gnp_solid_frame *frame, const double y[3], double x[3])
{
	for (int i = 0; i < 3; i++)
		x[i] = frame->axis[0][i] * y[0] + frame->axis[1][i] * y[1] + frame->axis[2][i] * y[2];
}

static void to_body(const struct gnp_solid_frame *frame, const double y[3], double x[3])
{
	turn_back(frame, y, x);
	for (int i = 0; i < 3; i++)
		x[i] += frame->origin[i];
}

static double between(const double ends[2], double t)
{
	return ends[0] + (ends[1] - ends[0]) * t;
}

/* The angle's representative in [first, first + 2 pi). */
static double wrapped(double angle, double first)
{
	double turns = (angle - first) / (2 * M_PI);
	return angle - 2 * M_PI * floor(turns);
}

/* form += factor * a a^T */
static void form_add(double form[9], double factor, const double a[3])
{
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			form[3 * i + j] += factor * a[i] * a[j];
}

/* ---- Planes ---- */

static double flat_area(const struct gnp_solid_face *face)
{
	const struct gnp_solid_flat *f = &face->flat;
	return (f->a[0] * f->b[1] - f->a[1] * f->b[0]) * (f->triangle ? 0.5 : 1);
}

static bool flat_draw(const struct gnp_solid_face *face, struct gnp_random *random, double p[2])
{
	p[0] = gnp_random_uniform(random);
	p[1] = gnp_random_uniform(random);
	if (face->flat.triangle && p[0] + p[1] > 1) {
		p[0] = 1 - p[0];
		p[1] = 1 - p[1];
	}
	return true;
}

static void flat_point(const struct gnp_solid_face *face, const double p[2], double x[3])
{
	const struct gnp_solid_flat *f = &face->flat;
	double y[3] = {p[0] * f->a[0] + p[1] * f->b[0], p[0] * f->a[1] + p[1] * f->b[1], 0};
	to_body(&face->frame, y, x);
}

static void flat_evaluate(const struct gnp_solid_face *face, const double p[2], struct gnp_solid_geometry *out)
{
	flat_point(face, p, out->point);
	memcpy(out->normal, face->frame.axis[2], sizeof out->normal);
}

static double flat_level(const struct gnp_solid_face *face, const double x[3], double gradient[3])
{
	double y[3];
	to_local(&face->frame, x, y);
	memcpy(gradient, face->frame.axis[2], 3 * sizeof *gradient);
	return y[2];
}

static bool flat_locate(const struct gnp_solid_face *face, const double x[3], double p[2])
{
	const struct gnp_solid_flat *f = &face->flat;
	double y[3], determinant = f->a[0] * f->b[1] - f->a[1] * f->b[0];
	to_local(&face->frame, x, y);
	p[0] = (y[0] * f->b[1] - y[1] * f->b[0]) / determinant;
	p[1] = (f->a[0] * y[1] - f->a[1] * y[0]) / determinant;
	return p[0] >= 0 && p[1] >= 0 && p[0] <= 1 && p[1] <= 1 && (!f->triangle || p[0] + p[1] <= 1);
}

/* ---- Turned lines: cylinders, cones, discs ---- */

/* The unit vectors away from the axis and around it. */
static void directions_at(const struct gnp_solid_frame *frame, double angle, double away[3], double around[3])
{
	double c = cos(angle), s = sin(angle);
	turn_back(frame, (double[3]){c, s, 0}, away);
	turn_back(frame, (double[3]){-s, c, 0}, around);
}

/* The line's normal: along the radius, along the axis. */
static void line_normal(const struct gnp_solid_frustum *f, double normal[2])
{
	double along = f->radius[1] - f->radius[0], up = f->height[1] - f->height[0], length = hypot(along, up);
	normal[0] = up / length;
	normal[1] = -along / length;
}

static double frustum_area(const struct gnp_solid_face *face)
{
	const struct gnp_solid_frustum *f = &face->frustum;
	double length = hypot(f->radius[1] - f->radius[0], f->height[1] - f->height[0]);
	return (f->angle[1] - f->angle[0]) * (f->radius[0] + f->radius[1]) / 2 * length;
}

static bool frustum_draw(const struct gnp_solid_face *face, struct gnp_random *random, double p[2])
{
	const struct gnp_solid_frustum *f = &face->frustum;
	double first = f->radius[0], last = f->radius[1], u = gnp_random_uniform(random);
	double radius = sqrt(first * first + u * (last * last - first * first));
	p[0] = radius + first > 0 ? u * (first + last) / (radius + first) : 0;
	p[1] = between(f->angle, gnp_random_uniform(random));
	return true;
}

static void frustum_point(const struct gnp_solid_face *face, const double p[2], double x[3])
{
	double radius = between(face->frustum.radius, p[0]);
	double y[3] = {radius * cos(p[1]), radius * sin(p[1]), between(face->frustum.height, p[0])};
	to_body(&face->frame, y, x);
}

static void frustum_evaluate(const struct gnp_solid_face *face, const double p[2], struct gnp_solid_geometry *out)
{
	double normal[2], away[3], around[3];
	frustum_point(face, p, out->point);
	line_normal(&face->frustum, normal);
	directions_at(&face->frame, p[1], away, around);
	for (int i = 0; i < 3; i++)
		out->normal[i] = normal[0] * away[i] + normal[1] * face->frame.axis[2][i];
	if (normal[0] != 0)
		form_add(out->form, -normal[0] / between(face->frustum.radius, p[0]), around);
}

static double frustum_level(const struct gnp_solid_face *face, const double x[3], double gradient[3])
{
	const struct gnp_solid_frustum *f = &face->frustum;
	double y[3], normal[2];
	to_local(&face->frame, x, y);
	line_normal(f, normal);
	double radius = hypot(y[0], y[1]), scale = radius > 0 ? normal[0] / radius : 0;
	turn_back(&face->frame, (double[3]){scale * y[0], scale * y[1], normal[1]}, gradient);
	return normal[0] * (radius - f->radius[0]) + normal[1] * (y[2] - f->height[0]);
}

static bool frustum_locate(const struct gnp_solid_face *face, const double x[3], double p[2])
{
	const struct gnp_solid_frustum *f = &face->frustum;
	double y[3], along = f->radius[1] - f->radius[0], up = f->height[1] - f->height[0];
	to_local(&face->frame, x, y);
	double radius = hypot(y[0], y[1]);
	p[0] = ((radius - f->radius[0]) * along + (y[2] - f->height[0]) * up) / (along * along + up * up);
	p[1] = wrapped(atan2(y[1], y[0]), f->angle[0]);
	return p[0] >= 0 && p[0] <= 1 && p[1] <= f->angle[1];
}

/* ---- Turned arcs: spheres, tori ---- */

static double arc_area(const struct gnp_solid_face *face)
{
	const struct gnp_solid_arc *f = &face->arc;
	double line = f->major * (f->turn[1] - f->turn[0]) + f->minor * (sin(f->turn[1]) - sin(f->turn[0]));
	return (f->angle[1] - f->angle[0]) * f->minor * line;
}

static bool arc_draw(const struct gnp_solid_face *face, struct gnp_random *random, double p[2])
{
	const struct gnp_solid_arc *f = &face->arc;
	if (f->major == 0) {
		double low = sin(f->turn[0]), high = sin(f->turn[1]);
		p[0] = asin(fmin(1, low + (high - low) * gnp_random_uniform(random)));
	} else {
		do
			p[0] = between(f->turn, gnp_random_uniform(random));
		while (gnp_random_uniform(random) * (f->major + f->minor) > f->major + f->minor * cos(p[0]));
	}
	p[1] = between(f->angle, gnp_random_uniform(random));
	return true;
}

static void arc_point(const struct gnp_solid_face *face, const double p[2], double x[3])
{
	const struct gnp_solid_arc *f = &face->arc;
	double radius = f->major + f->minor * cos(p[0]);
	double y[3] = {radius * cos(p[1]), radius * sin(p[1]), f->minor * sin(p[0])};
	to_body(&face->frame, y, x);
}

static void arc_evaluate(const struct gnp_solid_face *face, const double p[2], struct gnp_solid_geometry *out)
{
	const struct gnp_solid_arc *f = &face->arc;
	double away[3], around[3], along[3], c = cos(p[0]), s = sin(p[0]);
	arc_point(face, p, out->point);
	directions_at(&face->frame, p[1], away, around);
	for (int i = 0; i < 3; i++) {
		out->normal[i] = c * away[i] + s * face->frame.axis[2][i];
		along[i] = -s * away[i] + c * face->frame.axis[2][i];
	}
	form_add(out->form, -1 / f->minor, along);
	form_add(out->form, f->major == 0 ? -1 / f->minor : -c / (f->major + f->minor * c), around);
}

static double arc_level(const struct gnp_solid_face *face, const double x[3], double gradient[3])
{
	const struct gnp_solid_arc *f = &face->arc;
	double y[3];
	to_local(&face->frame, x, y);
	double radius = hypot(y[0], y[1]), distance = hypot(radius - f->major, y[2]);
	double safe = distance > 0 ? distance : 1, scale = radius > 0 ? (radius - f->major) / (safe * radius) : 0;
	turn_back(&face->frame, (double[3]){scale * y[0], scale * y[1], y[2] / safe}, gradient);
	return distance - f->minor;
}

static bool arc_locate(const struct gnp_solid_face *face, const double x[3], double p[2])
{
	const struct gnp_solid_arc *f = &face->arc;
	double y[3];
	to_local(&face->frame, x, y);
	p[0] = wrapped(atan2(y[2], hypot(y[0], y[1]) - f->major), f->turn[0]);
	p[1] = wrapped(atan2(y[1], y[0]), f->angle[0]);
	return p[0] <= f->turn[1] && p[1] <= f->angle[1];
}

/* ---- Height fields ---- */

static double graph_area(const struct gnp_solid_face *face)
{
	return gnp_solid_graph_area(&face->graph);
}

static bool graph_draw(const struct gnp_solid_face *face, struct gnp_random *random, double p[2])
{
	return gnp_solid_graph_draw(&face->graph, random, p);
}

static void graph_point(const struct gnp_solid_face *face, const double p[2], double x[3])
{
	double slope[2], second[3], height = gnp_solid_graph_height(&face->graph, p, slope, second);
	to_body(&face->frame, (double[3]){p[0], p[1], height}, x);
}

static void graph_evaluate(const struct gnp_solid_face *face, const double p[2], struct gnp_solid_geometry *out)
{
	double slope[2], second[3], derivative[5][3], height = gnp_solid_graph_height(&face->graph, p, slope, second);
	double local[5][3] = {{1, 0, slope[0]}, {0, 1, slope[1]}, {0, 0, second[0]}, {0, 0, second[1]}, {0, 0, second[2]}};
	for (int d = 0; d < 5; d++)
		turn_back(&face->frame, local[d], derivative[d]);
	struct gnp_geometry geometry;
	to_body(&face->frame, (double[3]){p[0], p[1], height}, out->point);
	gnp_geometry_from_chart(out->point, derivative, &geometry);
	memcpy(out->normal, geometry.normal, sizeof out->normal);
	memcpy(out->form, geometry.second_form, sizeof out->form);
}

static double graph_level(const struct gnp_solid_face *face, const double x[3], double gradient[3])
{
	double y[3], slope[2], second[3];
	to_local(&face->frame, x, y);
	double height = gnp_solid_graph_height(&face->graph, y, slope, second);
	turn_back(&face->frame, (double[3]){-slope[0], -slope[1], 1}, gradient);
	return y[2] - height;
}

static bool graph_locate(const struct gnp_solid_face *face, const double x[3], double p[2])
{
	double y[3];
	to_local(&face->frame, x, y);
	p[0] = y[0];
	p[1] = y[1];
	return gnp_solid_graph_contains(&face->graph, p);
}

/* ---- All of them ---- */

static const struct face_type {
	double (*area)(const struct gnp_solid_face *face);
	bool (*draw)(const struct gnp_solid_face *face, struct gnp_random *random, double p[2]);
	void (*point)(const struct gnp_solid_face *face, const double p[2], double x[3]);
	void (*evaluate)(const struct gnp_solid_face *face, const double p[2], struct gnp_solid_geometry *out);
	double (*level)(const struct gnp_solid_face *face, const double x[3], double gradient[3]);
	bool (*locate)(const struct gnp_solid_face *face, const double x[3], double p[2]);
} types[] = {
	[GNP_SOLID_FLAT] = {flat_area, flat_draw, flat_point, flat_evaluate, flat_level, flat_locate},
	[GNP_SOLID_FRUSTUM] = {frustum_area, frustum_draw, frustum_point, frustum_evaluate, frustum_level, frustum_locate},
	[GNP_SOLID_ARC] = {arc_area, arc_draw, arc_point, arc_evaluate, arc_level, arc_locate},
	[GNP_SOLID_GRAPH] = {graph_area, graph_draw, graph_point, graph_evaluate, graph_level, graph_locate},
};

double gnp_solid_face_area(const struct gnp_solid_face *face)
{
	return types[face->type].area(face);
}

bool gnp_solid_face_draw(const struct gnp_solid_face *face, struct gnp_random *random, double p[2])
{
	return types[face->type].draw(face, random, p);
}

void gnp_solid_face_point(const struct gnp_solid_face *face, const double p[2], double x[3])
{
	types[face->type].point(face, p, x);
}

void gnp_solid_face_evaluate(const struct gnp_solid_face *face, const double p[2], struct gnp_solid_geometry *out)
{
	memset(out, 0, sizeof *out);
	types[face->type].evaluate(face, p, out);
	for (int i = 0; i < 3; i++)
		out->normal[i] *= face->sign;
	for (int i = 0; i < 9; i++)
		out->form[i] *= face->sign;
}

double gnp_solid_face_level(const struct gnp_solid_face *face, const double x[3], double gradient[3])
{
	return types[face->type].level(face, x, gradient);
}

bool gnp_solid_face_locate(const struct gnp_solid_face *face, const double x[3], double p[2])
{
	return types[face->type].locate(face, x, p);
}
