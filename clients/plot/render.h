/* Draws pictures of point clouds: every point is a small disc in its tangent plane (a surfel). Discs that overlap
 * within a disc's radius of the nearest are blended, normals and values alike, and the picture is lit and coloured
 * afterwards, so that a cloud looks like the surface it samples. Orthographic; hidden surfaces are removed by a depth
 * buffer. */
#ifndef GNP_CLIENTS_RENDER_H
#define GNP_CLIENTS_RENDER_H

#include <stddef.h>

#include "clients/plot/colormap.h"
#include "clients/plot/picture.h"
#include "core/base/status.h"

/* Borrowed data and the view. */
struct gnp_scene {
	size_t count;
	const double *points;  /* (count, 3) */
	const double *normals; /* (count, 3), any non-zero length; NULL: discs face the viewer and nearer ones are lighter */
	const double *radii;   /* (count) of the discs, in the unit of points */
	const double *values;  /* (count) coloured by range; NULL: one colour, no colour bar */
	struct gnp_value_range range;
	const char *title;     /* over the colour bar; may be NULL */
	double azimuth, elevation; /* degrees; the viewer is at (cos el cos az, cos el sin az, sin el) */
	int up;                /* axis that is up: 0 x, 1 y, 2 z */
	size_t width, height;  /* pixels */
};

/* Draws the scene on white. count at least 1, every number finite except values. On failure *picture is unchanged. */
gnp_status gnp_render(const struct gnp_scene *scene, struct gnp_picture *picture, struct gnp_error *error);

#endif
