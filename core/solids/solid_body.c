#include "core/solids/solid_body.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "core/base/vector.h"

/* ---- Frames ---- */

struct gnp_solid_frame gnp_solid_frame_at(double x, double y, double z)
{
	return (struct gnp_solid_frame){{x, y, z}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

/* From a random unit quaternion. */
struct gnp_solid_frame gnp_solid_frame_random(struct gnp_random *random)
{
	double q[4], sum = 0;
	for (int i = 0; i < 4; i++) {
		q[i] = gnp_random_normal(random);
		sum += q[i] * q[i];
	}
	for (int i = 0; i < 4; i++)
		q[i] /= sqrt(sum);
	double w = q[0], x = q[1], y = q[2], z = q[3];
	return (struct gnp_solid_frame){{0, 0, 0},
	                                {{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
	                                 {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
	                                 {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}}};
}

/* ---- Building ---- */

static struct gnp_solid_face *face_add(struct gnp_solid_body *body, int type, uint32_t piece)
{
	assert(body->faces < GNP_SOLID_FACES);
	struct gnp_solid_face *face = &body->face[body->faces++];
	*face = (struct gnp_solid_face){.type = type, .sign = 1, .piece = piece, .primitive = -1, .half = -1};
	if (piece >= body->pieces)
		body->pieces = piece + 1;
	return face;
}

int gnp_solid_body_flat(struct gnp_solid_body *body, uint32_t piece, const double origin[3], const double a[3],
                        const double b[3], bool triangle)
{
	struct gnp_solid_face *face = face_add(body, GNP_SOLID_FLAT, piece);
	double (*axis)[3] = face->frame.axis, length = sqrt(gnp_dot(a, a));
	memcpy(face->frame.origin, origin, sizeof face->frame.origin);
	gnp_cross(a, b, axis[2]);
	double normal = sqrt(gnp_dot(axis[2], axis[2]));
	for (int i = 0; i < 3; i++) {
		axis[0][i] = a[i] / length;
		axis[2][i] /= normal;
	}
	gnp_cross(axis[2], axis[0], axis[1]);
	face->flat = (struct gnp_solid_flat){{length, 0}, {gnp_dot(axis[0], b), gnp_dot(axis[1], b)}, triangle};
	return body->faces - 1;
}

int gnp_solid_body_frustum(struct gnp_solid_body *body, uint32_t piece, const struct gnp_solid_frame *frame,
                           const struct gnp_solid_frustum *frustum)
{
	struct gnp_solid_face *face = face_add(body, GNP_SOLID_FRUSTUM, piece);
	face->frame = *frame;
	face->frustum = *frustum;
	return body->faces - 1;
}

int gnp_solid_body_arc(struct gnp_solid_body *body, uint32_t piece, const struct gnp_solid_frame *frame,
                       const struct gnp_solid_arc *arc)
{
	struct gnp_solid_face *face = face_add(body, GNP_SOLID_ARC, piece);
	face->frame = *frame;
	face->arc = *arc;
	return body->faces - 1;
}

int gnp_solid_body_graph(struct gnp_solid_body *body, uint32_t piece, const struct gnp_solid_frame *frame,
                         const struct gnp_solid_graph *graph)
{
	struct gnp_solid_face *face = face_add(body, GNP_SOLID_GRAPH, piece);
	face->frame = *frame;
	face->graph = *graph;
	gnp_solid_graph_bound(&face->graph);
	return body->faces - 1;
}

void gnp_solid_body_primitive(struct gnp_solid_body *body, int operation)
{
	assert(body->primitives < GNP_SOLID_PRIMITIVES);
	body->primitive[body->primitives++] = (struct gnp_solid_primitive){.operation = operation};
}

void gnp_solid_body_half(struct gnp_solid_body *body, int face)
{
	struct gnp_solid_primitive *primitive = &body->primitive[body->primitives - 1];
	assert(primitive->halves < GNP_SOLID_HALVES);
	body->face[face].primitive = body->primitives - 1;
	body->face[face].half = primitive->halves;
	primitive->half[primitive->halves++] = face;
}

void gnp_solid_body_same_half(struct gnp_solid_body *body, int face, int earlier)
{
	body->face[face].primitive = body->face[earlier].primitive;
	body->face[face].half = body->face[earlier].half;
}

static void curve_add(struct gnp_solid_body *body, const struct gnp_solid_curve *curve)
{
	assert(body->curves < GNP_SOLID_CURVES);
	body->curve[body->curves++] = *curve;
}

void gnp_solid_body_line(struct gnp_solid_body *body, int face, double p0, double p1, double q0, double q1)
{
	curve_add(body, &(struct gnp_solid_curve){face, false, {p0, p1}, {q0, q1}});
}

void gnp_solid_body_circle(struct gnp_solid_body *body, int face, double p0, double p1, double radius)
{
	curve_add(body, &(struct gnp_solid_curve){face, true, {p0, p1}, {radius, 0}});
}

/* ---- Drawing ---- */

void gnp_solid_body_measure(struct gnp_solid_body *body)
{
	body->area[0] = 0;
	for (int f = 0; f < body->faces; f++)
		body->area[f + 1] = body->area[f] + gnp_solid_face_area(&body->face[f]);
}

int gnp_solid_body_pick(const struct gnp_solid_body *body, double t)
{
	double area = t * body->area[body->faces];
	int f = 0;
	while (f + 1 < body->faces && body->area[f + 1] <= area)
		f++;
	return f;
}

/* ---- Boolean operations ---- */

static bool primitive_holds(const struct gnp_solid_body *body, int p, const double x[3])
{
	const struct gnp_solid_primitive *primitive = &body->primitive[p];
	double gradient[3];
	for (int h = 0; h < primitive->halves; h++)
		if (gnp_solid_face_level(&body->face[primitive->half[h]], x, gradient) > 0)
			return false;
	return true;
}

/* Bit p: whether primitive p holds x; those named by `known` are left out. */
static unsigned holders(const struct gnp_solid_body *body, const double x[3], unsigned known)
{
	unsigned bits = 0;
	for (int p = 0; p < body->primitives; p++)
		if (!(known >> p & 1) && primitive_holds(body, p, x))
			bits |= 1u << p;
	return bits;
}

static bool body_holds(const struct gnp_solid_body *body, unsigned bits)
{
	bool held = bits & 1;
	for (int p = 1; p < body->primitives; p++) {
		bool bit = bits >> p & 1;
		switch (body->primitive[p].operation) {
		case GNP_SOLID_UNION:
			held = held || bit;
			break;
		case GNP_SOLID_DIFFERENCE:
			held = held && !bit;
			break;
		default:
			held = held && bit;
		}
	}
	return held;
}

/* What the surface of primitive p is to the body, given who else holds the point. */
static int side(const struct gnp_solid_body *body, int p, unsigned bits)
{
	return (int)body_holds(body, bits | 1u << p) - (int)body_holds(body, bits & ~(1u << p));
}

int gnp_solid_body_side(const struct gnp_solid_body *body, const struct gnp_solid_face *face, const double x[3])
{
	if (face->primitive < 0)
		return 1;
	return side(body, face->primitive, holders(body, x, 1u << face->primitive));
}

static double cosine_of_jump(const double a[3], const double b[3])
{
	return gnp_dot(a, b) / sqrt(gnp_dot(a, a) * gnp_dot(b, b));
}

/* Whether x is within the primitive's other halves. */
static bool within_others(const struct gnp_solid_body *body, const struct gnp_solid_face *face, int except,
                          const double x[3])
{
	static const double TOLERANCE = 1e-9;
	const struct gnp_solid_primitive *primitive = &body->primitive[face->primitive];
	double gradient[3];
	for (int h = 0; h < primitive->halves; h++) {
		const struct gnp_solid_face *other = &body->face[primitive->half[h]];
		if (h != face->half && h != except && gnp_solid_face_level(other, x, gradient) > TOLERANCE)
			return false;
	}
	return true;
}

bool gnp_solid_body_creased(const struct gnp_solid_body *body, const struct gnp_solid_face *a,
                            const struct gnp_solid_face *b, const double x[3], const double gradient_a[3],
                            const double gradient_b[3])
{
	static const double COSINE = 0.984807753012208; /* of 10 degrees */
	int p = a->primitive, q = b->primitive;
	double cosine = cosine_of_jump(gradient_a, gradient_b);
	unsigned bits = holders(body, x, 1u << p | 1u << q), p_bit = 1u << p, q_bit = 1u << q;
	if (p == q)
		return cosine < COSINE && within_others(body, a, b->half, x) && side(body, p, bits) != 0;
	int side_p = side(body, p, bits) + side(body, p, bits | q_bit);
	int side_q = side(body, q, bits) + side(body, q, bits | p_bit);
	return side_p && side_q && cosine * side_p * side_q < COSINE && within_others(body, a, -1, x) &&
	       within_others(body, b, -1, x);
}
