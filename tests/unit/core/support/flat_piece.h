/* A made-up support of a plane: 48 points of a grid about the first, its centre, and what is said of its fit. */
#ifndef GNP_TESTS_FLAT_PIECE_H
#define GNP_TESTS_FLAT_PIECE_H

#include <math.h>
#include <string.h>

#include "core/support/weighted_members.h"
#include "tests/unit/test.h"

enum { FLAT_COUNT = GNP_SUPPORT_SINGLES, FLAT_SIDE = 7 };

struct flat_piece {
	double points[3 * FLAT_COUNT];
	struct gnp_support support;
	struct gnp_weighted_fit fit;
	float outputs[GNP_WEIGHTED_OUTPUTS];
	double residual[GNP_SUPPORT_NODES];
	struct gnp_weighted_near near;
};

/* By distance from the middle of the grid, whose lines are a unit apart. */
static inline void flat_piece_points(struct flat_piece *piece)
{
	bool taken[FLAT_SIDE * FLAT_SIDE] = {false};
	for (size_t i = 0; i < FLAT_COUNT; i++) {
		size_t best = 0;
		double least = INFINITY;
		for (size_t g = 0; g < FLAT_SIDE * FLAT_SIDE; g++) {
			double x = (double)(g % FLAT_SIDE) - FLAT_SIDE / 2, y = (double)(g / FLAT_SIDE) - FLAT_SIDE / 2;
			if (!taken[g] && x * x + y * y < least) {
				least = x * x + y * y;
				best = g;
			}
		}
		taken[best] = true;
		piece->points[3 * i] = (double)(best % FLAT_SIDE) - FLAT_SIDE / 2;
		piece->points[3 * i + 1] = (double)(best / FLAT_SIDE) - FLAT_SIDE / 2;
		piece->points[3 * i + 2] = 0;
		piece->support.distance[i] = sqrt(least);
	}
}

/* No outlier and no crease; the errors are next to none; residuals alternate by `noise`; R = 1. */
static inline void flat_piece_make(double noise, struct flat_piece *piece)
{
	memset(piece, 0, sizeof *piece);
	flat_piece_points(piece);
	struct gnp_support *s = &piece->support;
	s->points = s->nodes = FLAT_COUNT;
	s->radius = 1;
	for (size_t c = 0; c < 3; c++)
		s->frame[c][c] = 1;
	for (size_t i = 0; i < FLAT_COUNT; i++) {
		s->member[i] = (uint32_t)i;
		s->start[i + 1] = (uint16_t)(i + 1);
		s->weight[i] = 1;
		piece->residual[i] = i % 2 ? noise : -noise;
		piece->fit.weight[i] = 1;
	}
	piece->fit.solved = true;
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++) /* the factor's diagonal holds inverses: leverage 0.01 */
		piece->fit.factor[i * GNP_TAYLOR_STRIDE + i] = 0.1;
	for (int o = 0; o < GNP_WEIGHTED_OUTPUTS; o++)
		piece->outputs[o] = -5;
	piece->near = (struct gnp_weighted_near){s, &piece->fit, piece->outputs, piece->residual, noise, 4, {1e-8, 1e-8}};
}

#endif
