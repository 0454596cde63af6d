/* One face of a solid: a piece of a plane, of a surface of revolution (cylinder, cone, disc, sphere, torus) or of a
 * height field.
 *
 * A face maps two parameters from a domain of its own onto its surface. Beyond its domain the surface goes on, as
 * the zero level of a function that is positive outside: a distance, but for height fields. */
#ifndef GNP_CORE_SOLID_FACE_H
#define GNP_CORE_SOLID_FACE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/random.h"
#include "core/solids/solid_graph.h"

/* Body coordinates: x = origin + sum of y[c] axis[c]; the axes are unit vectors, right-handed. */
struct gnp_solid_frame {
	double origin[3], axis[3][3];
};

enum gnp_solid_face_type { GNP_SOLID_FLAT, GNP_SOLID_FRUSTUM, GNP_SOLID_ARC, GNP_SOLID_GRAPH };

/* The parallelogram p0 a + p1 b, 0 <= p <= 1, or its half p0 + p1 <= 1. */
struct gnp_solid_flat {
	double a[2], b[2]; /* in the frame's plane, b to the left of a */
	bool triangle;
};

/* A line turned about the frame's axis 2; parameters: how far along the line in [0, 1], angle. Outside is to the
 * right of the line, seen with the axis upwards and the radius to the right. */
struct gnp_solid_frustum {
	double radius[2], height[2], angle[2];
};

/* An arc of a circle of radius minor, its centre at radius major, turned about axis 2 (major 0: a sphere);
 * parameters: turn along the arc (0 outwards, pi/2 along the axis), angle. Outside is outside of the circle. */
struct gnp_solid_arc {
	double major, minor, turn[2], angle[2];
};

struct gnp_solid_face {
	int type; /* enum gnp_solid_face_type */
	struct gnp_solid_frame frame;
	union {
		struct gnp_solid_flat flat;
		struct gnp_solid_frustum frustum;
		struct gnp_solid_arc arc;
		struct gnp_solid_graph graph;
	};
	double sign;   /* 1, or -1 where the body's outside is this face's inside */
	uint32_t piece;
	int primitive, half; /* of a body made by boolean operations (solid_body.h); else -1 */
};

/* Exact geometry in body coordinates; normal and form include the face's sign. */
struct gnp_solid_geometry {
	double point[3], normal[3], form[9];
};

/* What draws are uniform over: the area, or for height fields a bound of it. */
double gnp_solid_face_area(const struct gnp_solid_face *face);

/* Draws parameters, uniform by area. False where the draw is refused: of all draws, area of the face /
 * gnp_solid_face_area succeed. */
bool gnp_solid_face_draw(const struct gnp_solid_face *face, struct gnp_random *random, double p[2]);

void gnp_solid_face_point(const struct gnp_solid_face *face, const double p[2], double x[3]);
void gnp_solid_face_evaluate(const struct gnp_solid_face *face, const double p[2], struct gnp_solid_geometry *out);

/* Level and its gradient (unit, along the normal at the surface; not for height fields) at any x. */
double gnp_solid_face_level(const struct gnp_solid_face *face, const double x[3], double gradient[3]);

/* Parameters of a point on the surface; false when it is not of the face's domain. */
bool gnp_solid_face_locate(const struct gnp_solid_face *face, const double x[3], double p[2]);

#endif
