/* One front of a multifrontal factor: dense blocks, column-major.
 *
 *   [ P11 P12 ]  width pivots        P = panel (rows, width), over = P12 (width, border),
 *   [ P21 F22 ]  border rows         border_block = F22 (border, border)
 *
 * Of a symmetric front the lower triangles alone: there is no P12, and rows stay where they are. */
#ifndef GNP_CORE_FACTOR_FRONT_H
#define GNP_CORE_FACTOR_FRONT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct gnp_factor_front {
	bool symmetric;
	size_t rows, width, border; /* rows = width + border */
	double *panel;        /* (rows, width) becomes L11 \ U11 over L21 */
	double *over;         /* (width, border) becomes U12; NULL where symmetric */
	double *border_block; /* (border, border) becomes what later fronts take in */
	uint32_t *pivot;      /* (width) row exchanged with the k-th at step k, within the front */
};

/* Adds columns [begin, end) of a child's border block, whose row and column i sits at place[i] of the front. */
void gnp_factor_front_add(struct gnp_factor_front *front, const double *block, size_t border, const uint32_t *place,
                          size_t begin, size_t end);

/* Factors the pivot block, exchanging its rows. Returns width, or the step that found no pivot above `smallest`. */
size_t gnp_factor_front_pivot(struct gnp_factor_front *front, double smallest);

/* Columns of the border that are worth a call. */
enum { GNP_FACTOR_FRONT_COLUMNS = 96 };

/* The rest, after it: L21 for border rows [begin, end); then, when all of those are done, U12 and F22 for border
 * columns. */
void gnp_factor_front_rows(struct gnp_factor_front *front, size_t begin, size_t end);
void gnp_factor_front_columns(struct gnp_factor_front *front, size_t begin, size_t end);

#endif
