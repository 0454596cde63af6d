#include "core/cloud/thin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

/* Kept points hashed by the cube of side `distance` they lie in; those of one slot are chained. */
struct grid {
	const double *points;
	double side;
	double unit, near; /* a power of two that brings the side to 1..2, where its square, `near`, is a number like any other */
	uint32_t mask;
	uint32_t *slot; /* (mask + 1) the last point put in, plus 1; 0: none */
	uint32_t *next; /* (count) the one before it in its slot, plus 1 */
	size_t looked;  /* slots and points looked at so far */
};

/* Beyond 2^53 cubes doubles lie no nearer than a side, so that only equal coordinates matter: farther out their bits stand for the cube. */
static int64_t cube_along(double x, double side)
{
	double cube = floor(x / side);
	int64_t bits;
	if (fabs(cube) < 0x1p54)
		return (int64_t)cube;
	memcpy(&bits, &x, sizeof bits);
	return bits;
}

static void cube_of(const struct grid *grid, const double *p, int64_t cube[3])
{
	for (int c = 0; c < 3; c++)
		cube[c] = cube_along(p[c], grid->side);
}

static uint32_t slot_of(const struct grid *grid, const uint64_t cube[3])
{
	uint64_t h = 0;
	for (int c = 0; c < 3; c++) {
		h = (h ^ cube[c]) * 0x9E3779B97F4A7C15u;
		h ^= h >> 32;
	}
	return (uint32_t)h & grid->mask;
}

static int any_in_slot(struct grid *grid, uint32_t slot, const double *p)
{
	grid->looked++;
	for (uint32_t at = grid->slot[slot]; at; at = grid->next[at - 1]) {
		const double *q = grid->points + 3 * (size_t)(at - 1);
		double x = grid->unit * (p[0] - q[0]), y = grid->unit * (p[1] - q[1]), z = grid->unit * (p[2] - q[2]);
		grid->looked++;
		if (x * x + y * y + z * z < grid->near)
			return 1;
	}
	return 0;
}

static int any_near(struct grid *grid, const int64_t cube[3], const double *p)
{
	for (int i = 0; i < 27; i++) {
		/* the point's own cube first: there most others are found */
		int shift = (i + 13) % 27;
		const uint64_t other[3] = {(uint64_t)cube[0] + (uint64_t)(shift / 9 - 1), (uint64_t)cube[1] + (uint64_t)(shift / 3 % 3 - 1),
		                           (uint64_t)cube[2] + (uint64_t)(shift % 3 - 1)};
		if (any_in_slot(grid, slot_of(grid, other), p))
			return 1;
	}
	return 0;
}

static void put(struct grid *grid, const int64_t cube[3], uint32_t point)
{
	uint32_t slot = slot_of(grid, (const uint64_t[3]){(uint64_t)cube[0], (uint64_t)cube[1], (uint64_t)cube[2]});
	grid->next[point] = grid->slot[slot];
	grid->slot[slot] = point + 1;
}

static int grid_make(const double *points, size_t count, double distance, struct grid *grid)
{
	size_t slots = 64;
	while (slots < 2 * count)
		slots *= 2;
	double unit = ldexp(1, distance < 0x1p-1000 ? 1000 : -ilogb(distance));
	*grid = (struct grid){.points = points, .side = distance, .unit = unit, .near = unit * distance * (unit * distance),
	                      .mask = (uint32_t)(slots - 1)};
	grid->slot = gnp_array_zero(slots, sizeof *grid->slot);
	grid->next = gnp_array_new(count, sizeof *grid->next);
	return grid->slot && grid->next;
}

gnp_status gnp_thin(const double *points, size_t count, double distance, const uint32_t *order, size_t certain,
                    struct gnp_task *task, unsigned char *keep, size_t *kept, struct gnp_error *error)
{
	enum { POLL = 1 << 18 }; /* some milliseconds */
	struct grid grid;
	size_t polled = 0;
	gnp_status status = GNP_OK;
	if (!grid_make(points, count, distance, &grid))
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "thinning: no memory for %zu points", count);
	*kept = 0;
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		size_t point = order ? order[i] : i;
		int64_t cube[3];
		cube_of(&grid, points + 3 * point, cube);
		keep[point] = i < certain || !any_near(&grid, cube, points + 3 * point);
		if (keep[point])
			put(&grid, cube, (uint32_t)point);
		*kept += keep[point];
		if (i == 0 || grid.looked - polled > POLL) {
			polled = grid.looked;
			status = gnp_task_check(task, error);
		}
	}
	free(grid.slot);
	free(grid.next);
	return status;
}
