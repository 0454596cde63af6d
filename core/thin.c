#include "thin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"

/* Kept points hashed by the cube of side `distance` they lie in; those of one slot are chained. */
struct grid {
	const double *points;
	double corner[3], side;
	uint32_t mask;
	uint32_t *slot; /* (mask + 1) the last point put in, plus 1; 0: none */
	uint32_t *next; /* (count) the one before it in its slot, plus 1 */
};

/* Cubes are counted modulo 2^32: far clouds of tiny sides collide, which costs time and nothing else. */
static void cube_of(const struct grid *grid, const double *p, int64_t cube[3])
{
	for (int c = 0; c < 3; c++)
		cube[c] = (int64_t)fmin(floor((p[c] - grid->corner[c]) / grid->side), 9e15);
}

static uint32_t slot_of(const struct grid *grid, const int64_t cube[3])
{
	uint64_t h = (uint64_t)cube[0] * 0x9E3779B97F4A7C15u ^ (uint64_t)cube[1] * 0xC2B2AE3D27D4EB4Fu ^ (uint64_t)cube[2] * 0x165667B19E3779F9u;
	return (uint32_t)(h >> 32 ^ h) & grid->mask;
}

static int any_in_slot(const struct grid *grid, const int64_t cube[3], const double *p)
{
	for (uint32_t at = grid->slot[slot_of(grid, cube)]; at; at = grid->next[at - 1]) {
		const double *q = grid->points + 3 * (size_t)(at - 1);
		double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
		if (x * x + y * y + z * z < grid->side * grid->side)
			return 1;
	}
	return 0;
}

static int any_near(const struct grid *grid, const int64_t cube[3], const double *p)
{
	for (int64_t x = -1; x <= 1; x++)
		for (int64_t y = -1; y <= 1; y++)
			for (int64_t z = -1; z <= 1; z++)
				if (any_in_slot(grid, (int64_t[3]){cube[0] + x, cube[1] + y, cube[2] + z}, p))
					return 1;
	return 0;
}

static void put(struct grid *grid, const int64_t cube[3], uint32_t point)
{
	uint32_t slot = slot_of(grid, cube);
	grid->next[point] = grid->slot[slot];
	grid->slot[slot] = point + 1;
}

static int grid_make(const double *points, size_t count, double distance, struct grid *grid)
{
	size_t slots = 64;
	while (slots < 2 * count)
		slots *= 2;
	*grid = (struct grid){.points = points, .side = distance, .mask = (uint32_t)(slots - 1)};
	grid->slot = gnp_array_zero(slots, sizeof *grid->slot);
	grid->next = gnp_array_new(count, sizeof *grid->next);
	for (int c = 0; c < 3; c++) {
		grid->corner[c] = INFINITY;
		for (size_t i = 0; i < count; i++)
			grid->corner[c] = fmin(grid->corner[c], points[3 * i + (size_t)c]);
	}
	return grid->slot && grid->next;
}

gnp_status gnp_thin(const double *points, size_t count, double distance, const uint32_t *order, size_t certain,
                    struct gnp_task *task, unsigned char *keep, size_t *kept, struct gnp_error *error)
{
	enum { POLL = 4096 };
	struct grid grid;
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
		if (i % POLL == 0)
			status = gnp_task_check(task, error);
	}
	free(grid.slot);
	free(grid.next);
	return status;
}
