/* Patches: a neighbourhood of the cloud in its own frame and scale (the paper's eqs. local_pca and patch_eq).
 *
 * The patch of centre x is all points within epsilon = 1.1 r_k; a longer row of neighbours adds a buffer beyond
 * it. Origin: the mean of the patch (not of the buffer). psi1, psi2, psi3: its principal axes, psi3 on the side of
 * the mean given normal, psi1 x psi2 = psi3. (u, v) are divided by the largest in-plane distance of a patch point
 * from the origin, heights w by max(2 std, delta0_ratio * epsilon) or as the source says. */
#ifndef GNP_CORE_PATCH_H
#define GNP_CORE_PATCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/vector.h"
#include "core/search/neighborhoods.h"

#define GNP_PATCH_TAU 1.1 /* epsilon = tau r_k */

struct gnp_patch {
	uint32_t centre;       /* index of the point it was built round */
	size_t k;              /* neighbours that set epsilon */
	size_t count;          /* points within epsilon: the first `count` of the arrays */
	size_t buffer_count;   /* points of the whole row */
	const uint32_t *index; /* (buffer_count) ascending by distance from the centre */
	double *u, *v, *w;     /* (buffer_count) scaled coordinates */
	double epsilon;
	double origin[3], frame[3][3]; /* rows psi1, psi2, psi3 */
	double scale_xy, scale_w;
};

/* What a cloud's patches have in common; arrays in curve order, borrowed. */
struct gnp_patch_source {
	const double *points;  /* (n, 3) */
	const double *normals; /* (n, 3) unit */
	size_t k;              /* neighbours, the centre included, that set epsilon */
	double delta0_ratio;   /* smallest height scale in units of epsilon, > 0 unless delta0 is */
	bool one_sheet;        /* origin, frame and height scale are those of the points that face as the centre does */
	double delta0;         /* the same as a length, which then counts; 0: delta0_ratio does */
	double height_scale;   /* heights are divided by this many standard deviations of them; 0: 2 */
};

/* Whether two unit normals may be of one sheet of a surface: those of two sheets back to back are opposite. */
static inline bool gnp_same_sheet(const double a[3], const double b[3])
{
	return gnp_dot(a, b) > 0.1;
}

/* Builds the patch of one row of neighbourhoods, which holds at least k points. u, v, w: (length of the row), filled.
 * GNP_DEGENERATE when the points of the patch coincide. O(length of the row), no memory of its own. */
gnp_status gnp_patch_build(const struct gnp_patch_source *source, const struct gnp_neighborhoods *neighborhoods,
                           size_t row, uint32_t centre, double *u, double *v, double *w, struct gnp_patch *patch,
                           struct gnp_error *error);

/* Scaled in-plane coordinates of a point in space. */
void gnp_patch_locate(const struct gnp_patch *patch, const double point[3], double *u, double *v);

/* Whether the patch's points leave a gap of more than about 120 degrees (113 to 126) round (u, v): the point lies
 * on an open boundary. */
bool gnp_patch_one_sided(const struct gnp_patch *patch, double u, double v);

#endif
