#include "weights/validate/pde/pde_torus.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "weights/validate/pde/pde_form.h"

enum { CELLS = 2000, TURNS = 9, EACH = 12 };

static double away(double tube)
{
	return GNP_PDE_TORUS_TURN + GNP_PDE_TORUS_TUBE * cos(tube);
}

/* Cell i with its neighbours along the tube, which closes. */
static void fill_row(size_t i, double turns, struct gnp_pde_form *form)
{
	double step = 2 * M_PI / CELLS, h = GNP_PDE_TORUS_TUBE * step, at = step * (double)i;
	double before = away(at - step / 2) / h, after = away(at + step / 2) / h;
	size_t low = (i + CELLS - 1) % CELLS, high = (i + 1) % CELLS, e = 3 * i;
	const struct {
		size_t column;
		double value;
	} entry[3] = {{low, -before}, {i, before + after + turns * turns * h / away(at)}, {high, -after}};
	size_t first = i == 0 ? 1 : i == CELLS - 1 ? 2 : 0; /* columns ascend */
	for (size_t k = 0; k < 3; k++) {
		form->stiffness.column[e + k] = (uint32_t)entry[(first + k) % 3].column;
		form->stiffness.value[e + k] = entry[(first + k) % 3].value;
	}
	form->stiffness.row_offsets[i + 1] = e + 3;
	form->mass[i] = away(at) * h;
}

static gnp_status solve_turns(size_t turns, double *points, struct gnp_pool *pool, struct gnp_task *task,
                              double *value, struct gnp_error *error)
{
	struct gnp_pde_form form = {.mass = gnp_array_new(CELLS, sizeof(double)), .points = points};
	gnp_status status = form.mass ? gnp_csr_allocate(CELLS, CELLS, 3 * CELLS, &form.stiffness, error)
	                              : gnp_no_memory("torus", CELLS, "cells", error);
	for (size_t i = 0; i < CELLS && status == GNP_OK; i++)
		fill_row(i, (double)turns, &form);
	if (status == GNP_OK)
		status = gnp_pde_form_lowest(&form, EACH, pool, task, value, error);
	gnp_pde_form_clear(&form);
	return status;
}

gnp_status gnp_pde_torus_values(size_t count, struct gnp_pool *pool, struct gnp_task *task, double *value,
                                struct gnp_error *error)
{
	double all[2 * TURNS * EACH];
	size_t found = 0;
	double *points = gnp_array_zero(CELLS, 3 * sizeof *points);
	gnp_status status = points ? GNP_OK : gnp_no_memory("torus", CELLS, "cells", error);
	for (size_t i = 0; i < CELLS && status == GNP_OK; i++) {
		points[3 * i] = cos(2 * M_PI * (double)i / CELLS);
		points[3 * i + 1] = sin(2 * M_PI * (double)i / CELLS);
	}
	for (size_t turns = 0; turns < TURNS && status == GNP_OK; turns++) {
		double own[EACH];
		status = solve_turns(turns, points, pool, task, own, error);
		for (size_t k = 0; k < EACH && status == GNP_OK; k++)
			for (int twice = 0; twice <= (turns > 0); twice++) /* cosine and sine */
				all[found++] = own[k];
	}
	free(points);
	if (status != GNP_OK)
		return status;
	qsort(all, found, sizeof *all, gnp_double_compare);
	for (size_t k = 0; k < count; k++)
		value[k] = all[k];
	return GNP_OK;
}

gnp_status gnp_pde_torus_set(struct gnp_pde_case *known, struct gnp_pool *pool, struct gnp_task *task,
                             struct gnp_error *error)
{
	for (size_t i = 0; i < known->count; i++) {
		const double *x = known->points + 3 * i;
		double w = hypot(x[0], x[1]), r = GNP_PDE_TORUS_TUBE, cosine = (w - GNP_PDE_TORUS_TURN) / r, turn = x[1] / w;
		double *n = known->normals + 3 * i;
		n[0] = cosine * x[0] / w;
		n[1] = cosine * x[1] / w;
		n[2] = x[2] / r;
		known->solution[i] = turn + cosine;
		known->source[i] =
			turn / (w * w) + (GNP_PDE_TORUS_TURN * cosine + r * (2 * cosine * cosine - 1)) / (r * r * w);
	}
	return gnp_pde_torus_values(known->pieces + known->eigenvalues, pool, task, known->eigenvalue, error);
}
