#include "core/operators/operator_check.h"

#include <math.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/operators/energy.h"

static const double jumps_most = 5e-4;   /* of all edges: none where normals are right */
static const double rows_most = 2.5e-3;  /* of all rows: none where the surface is resolved, 1e-3 where it is rough */
static const double reduced_most = 0.05; /* of all rows: in lattices some neighbours lie on one conic */
enum { FEWEST = 3, OUTWEIGHED = 5 };     /* so many at least, by chance there are one or two; others to its own weight: 1.1 to 2.5 where resolved */

void gnp_operator_check_draw(size_t count, double *numbers)
{
	struct gnp_random random;
	gnp_random_seed(&random, 1, 0);
	for (size_t i = 0; i < count; i++)
		numbers[i] = gnp_random_normal(&random);
}

void gnp_operator_check_energy(const double *energy, size_t count, const struct gnp_domain *domain,
                               struct gnp_warnings *warnings)
{
	double worst = 1;
	for (size_t r = 0; r < count; r++)
		if (!(energy[r] >= GNP_ENERGY_LEAST && energy[r] <= GNP_ENERGY_MOST) && !(fabs(energy[r] - 1) <= fabs(worst - 1)))
			worst = energy[r];
	if (worst == 1)
		return;
	if (gnp_domain_is_closed(domain))
		gnp_warnings_add(warnings, GNP_WARNING_OPERATOR,
		                 "its answers are not to be believed: solutions of random right-hand sides have %.3g times "
		                 "the energy that a second discretisation explains, need %g to %g: points too uneven, too few or too noisy for the surface",
		                 worst, GNP_ENERGY_LEAST, GNP_ENERGY_MOST);
	else
		gnp_warnings_add(warnings, GNP_WARNING_OPERATOR,
		                 "its answers are not to be believed: solutions of random right-hand sides have %.3g times "
		                 "the energy that a second discretisation explains, need %g to %g: the surface has a boundary (%zu cells are open) where "
		                 "values have to be given", worst, GNP_ENERGY_LEAST, GNP_ENERGY_MOST, domain->open);
}

static bool is_jump(const struct gnp_prepared *prepared, size_t i, size_t j)
{
	const double steep = 0.4, agreeing = 0.5; /* the sine of the angle to both tangent planes; the cosine between the normals */
	const double *m = prepared->normals + 3 * i, *n = prepared->normals + 3 * j;
	double way[3], height = 0, square = 0;
	for (int c = 0; c < 3; c++) {
		way[c] = prepared->points[3 * j + (size_t)c] - prepared->points[3 * i + (size_t)c];
		height += way[c] * (m[c] + n[c]) / 2; /* on one sheet what it bends away at either end cancels */
		square += way[c] * way[c];
	}
	return gnp_dot(m, n) > agreeing && fabs(height) > steep * sqrt(square);
}

void gnp_operator_check_crossings(const struct gnp_prepared *prepared, const struct gnp_stiffness *volumes,
                                  struct gnp_warnings *warnings)
{
	size_t jumps = 0, edges = volumes->start[volumes->count] / 2;
	for (size_t i = 0; i < volumes->count; i++)
		for (size_t e = volumes->start[i]; e < volumes->start[i + 1]; e++)
			jumps += volumes->column[e] > i && is_jump(prepared, i, volumes->column[e]);
	if (jumps >= FEWEST && (double)jumps > jumps_most * (double)edges)
		gnp_warnings_add(warnings, GNP_WARNING_CROSSINGS,
		                 "%.3g %% of the edges between cells, more than %g %%, leave the surface steeply for a point that "
		                 "faces the same way: sheets lie too close for their spacing, noise is as large, or normals are wrong, and answers cross over",
		                 100 * (double)jumps / (double)edges, 100 * jumps_most);
}

/* Delta's row: its own weight is negative, the others' mostly positive. */
static bool is_bad_row(const struct gnp_collocation *matrices, size_t i, size_t column)
{
	const double *value = matrices->value[GNP_DERIVATIVE_LAPLACIAN];
	double own = 0, others = 0;
	for (size_t e = matrices->row_offsets[i]; e < matrices->row_offsets[i + 1]; e++)
		if (matrices->column[e] == column)
			own -= value[e];
		else
			others += fabs(value[e]);
	return !(others <= OUTWEIGHED * own);
}

void gnp_operator_check_rows(const struct gnp_collocation *matrices, size_t open, struct gnp_warnings *warnings)
{
	size_t bad = 0;
	if (!matrices->value[GNP_DERIVATIVE_LAPLACIAN])
		return;
	for (size_t c = 0; c < matrices->columns; c++)
		bad += is_bad_row(matrices, matrices->kept[c], c);
	if (bad >= FEWEST && (double)bad > rows_most * (double)matrices->columns)
		gnp_warnings_add(warnings, GNP_WARNING_STENCILS,
		                 "%.3g %% of the rows, more than %g %%, have a weight of their own that is positive or less than "
		                 "a fifth of the others': equations with this matrix are not to be believed, its points are too uneven or at a boundary "
		                 "(%zu cells are open)", 100 * (double)bad / (double)matrices->columns, 100 * rows_most, open);
}

void gnp_operator_check_stencils(const struct gnp_collocation *matrices, unsigned degree, struct gnp_warnings *warnings)
{
	if ((double)matrices->reduced > reduced_most * (double)matrices->rows)
		gnp_warnings_add(warnings, GNP_WARNING_DEGENERATE,
		                 "%.3g %% of the stencils, more than %g %%, are of a lower degree than %u as their neighbours "
		                 "determine no more", 100 * (double)matrices->reduced / (double)matrices->rows, 100 * reduced_most, degree);
}
