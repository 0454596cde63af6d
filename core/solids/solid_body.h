/* A body: the faces of a solid, what boolean operations keep of them, and the curves where its normals jump.
 *
 * Faces of boolean bodies belong to primitives. A primitive is the set where the levels of all its halves (faces,
 * each standing for all that lie on the same surface) are negative, and the body is ((p0 op p1) op p2) ...: a point
 * of a primitive's face is on the body where it matters whether the primitive holds it, and is turned over where it
 * is the primitive's inside that is outside. */
#ifndef GNP_CORE_SOLID_BODY_H
#define GNP_CORE_SOLID_BODY_H

#include <stddef.h>

#include "core/solids/solid_face.h"

enum { GNP_SOLID_FACES = 64, GNP_SOLID_PRIMITIVES = 5, GNP_SOLID_HALVES = 12, GNP_SOLID_CURVES = 128 };
enum gnp_solid_operation { GNP_SOLID_UNION, GNP_SOLID_DIFFERENCE, GNP_SOLID_INTERSECTION };

struct gnp_solid_primitive {
	int operation; /* enum gnp_solid_operation, with what comes before */
	int halves, half[GNP_SOLID_HALVES]; /* faces */
};

/* A crease, rim or tip along a face: in parameters a line from p to q, or the circle about p of radius q[0]. */
struct gnp_solid_curve {
	int face;
	bool circle;
	double p[2], q[2];
};

struct gnp_solid_body {
	int faces, primitives, curves;
	uint32_t pieces; /* numbers used so far */
	struct gnp_solid_face face[GNP_SOLID_FACES];
	struct gnp_solid_primitive primitive[GNP_SOLID_PRIMITIVES];
	struct gnp_solid_curve curve[GNP_SOLID_CURVES];
	double area[GNP_SOLID_FACES + 1]; /* running sum of what is drawn from, filled by gnp_solid_body_measure */
};

/* The axes of body coordinates, at an origin. */
struct gnp_solid_frame gnp_solid_frame_at(double x, double y, double z);
/* A right-handed frame of random axes. */
struct gnp_solid_frame gnp_solid_frame_random(struct gnp_random *random);

/* Faces are numbered in the order they are added; each of these returns the new face's number. */
int gnp_solid_body_flat(struct gnp_solid_body *body, uint32_t piece, const double origin[3], const double a[3],
                        const double b[3], bool triangle); /* outside is along a x b */
int gnp_solid_body_frustum(struct gnp_solid_body *body, uint32_t piece, const struct gnp_solid_frame *frame,
                           const struct gnp_solid_frustum *frustum);
int gnp_solid_body_arc(struct gnp_solid_body *body, uint32_t piece, const struct gnp_solid_frame *frame,
                       const struct gnp_solid_arc *arc);
int gnp_solid_body_graph(struct gnp_solid_body *body, uint32_t piece, const struct gnp_solid_frame *frame,
                         const struct gnp_solid_graph *graph);

/* Opens a primitive; faces added to it by gnp_solid_body_half make a half of their own, or one with the half of an
 * earlier face. */
void gnp_solid_body_primitive(struct gnp_solid_body *body, int operation);
void gnp_solid_body_half(struct gnp_solid_body *body, int face);
void gnp_solid_body_same_half(struct gnp_solid_body *body, int face, int earlier);

void gnp_solid_body_line(struct gnp_solid_body *body, int face, double p0, double p1, double q0, double q1);
void gnp_solid_body_circle(struct gnp_solid_body *body, int face, double p0, double p1, double radius);

void gnp_solid_body_measure(struct gnp_solid_body *body);

/* The face a fraction t in [0, 1) of the area drawn from into the body. */
int gnp_solid_body_pick(const struct gnp_solid_body *body, double t);

/* Of a point on a face: 1 where it is on the body, -1 where it is and the face is turned over, 0 where it is not. */
int gnp_solid_body_side(const struct gnp_solid_body *body, const struct gnp_solid_face *face, const double x[3]);

/* True when the surfaces of two faces of primitives cross in a crease of the body at x, a point of both surfaces
 * with these gradients of their levels. */
bool gnp_solid_body_creased(const struct gnp_solid_body *body, const struct gnp_solid_face *a,
                            const struct gnp_solid_face *b, const double x[3], const double gradient_a[3],
                            const double gradient_b[3]);

#endif
