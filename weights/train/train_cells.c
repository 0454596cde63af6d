#include "weights/train/train_cells.h"

#include <stdbool.h>

#include "weights/train/train_fit.h"

/* Points of all patches together, as gnp_loss_cell takes them. */
struct cell {
	size_t points, *whose;         /* (points) the patch of each */
	struct gnp_jet *jets, *gradient;
	const struct gnp_truth **truth;
	double *rows;                  /* (points, 6, GNP_BASIS_MAX) of the basis there */
};

static bool take_cell(size_t most, struct cell *cell, struct gnp_scratch *scratch)
{
	*cell = (struct cell){.whose = gnp_scratch_take(scratch, most, sizeof *cell->whose),
	                      .jets = gnp_scratch_take(scratch, most, sizeof *cell->jets),
	                      .gradient = gnp_scratch_take(scratch, most, sizeof *cell->gradient),
	                      .truth = gnp_scratch_take(scratch, most, sizeof *cell->truth),
	                      .rows = gnp_scratch_take(scratch, most, 6 * GNP_BASIS_MAX * sizeof *cell->rows)};
	return cell->whose && cell->jets && cell->gradient && cell->truth && cell->rows;
}

/* Adds a point of a patch: its centre (0), where it was found and not where it came from, or another of its truth. */
static void add_point(struct cell *cell, struct gnp_basis basis, const struct gnp_train_patches *patches, size_t p,
                      size_t point, const double *coefficients)
{
	const struct gnp_patch *patch = &patches->patches[p];
	const struct gnp_truth *at = &patches->truth[patches->truth_start[p] + point];
	double u = point ? at->u : patch->u[0], v = point ? at->v : patch->v[0];
	cell->jets[cell->points] = gnp_train_fit_jet(basis, coefficients + p * gnp_basis_size(basis), patch, u, v,
	                                             cell->rows + 6 * GNP_BASIS_MAX * cell->points);
	cell->truth[cell->points] = at;
	cell->whose[cell->points++] = p;
}

/* Point i of `wanted` in a patch of `count` points: evenly from near to far, and further out in some patches than others; of one
 * alone, among the `nearest`. */
static size_t place_of(size_t i, size_t wanted, size_t p, size_t count, size_t nearest)
{
	if (wanted == 1)
		return (5 * p + 3) % (nearest < count ? nearest : count);
	return (count - 1) * (i * wanted + (5 * p + 3) % wanted) / (wanted * wanted) + (count > 1);
}

/* The loss of all points of a cell by a rule, and its gradients. */
static void judge_points(const struct gnp_train_cells *cells, const struct gnp_loss_rule *rule,
                         const struct gnp_train_patches *patches, struct cell *cell, double *dcoefficients,
                         double terms[GNP_LOSS_TERMS], double *loss)
{
	double part = (double)patches->count / (double)cells->batch, values[GNP_LOSS_TERMS];
	if (cell->points == 0)
		return;
	struct gnp_loss_scale scale = gnp_loss_scale_of(patches->cloud, &patches->patches[0]);
	*loss += part * gnp_loss_cell(rule, &scale, cell->truth, cell->jets, cell->points, values, cell->gradient);
	for (int t = 0; t < GNP_LOSS_TERMS; t++)
		terms[t] += part * values[t];
	for (size_t i = 0; i < cell->points; i++) {
		struct gnp_jet *g = &cell->gradient[i];
		*g = (struct gnp_jet){part * g->f, part * g->u, part * g->v, part * g->uu, part * g->uv, part * g->vv};
		gnp_train_fit_back(cells->basis, cell->rows + 6 * GNP_BASIS_MAX * i, g,
		                   dcoefficients + cell->whose[i] * gnp_basis_size(cells->basis));
	}
}

/* By a rule: the centres of all patches together (wanted = 0), or so many points of each. */
static gnp_status judge_cell(const struct gnp_train_cells *cells, const struct gnp_loss_rule *rule, size_t wanted,
                             const struct gnp_train_patches *patches, const double *coefficients,
                             double *dcoefficients, double terms[GNP_LOSS_TERMS], double *loss,
                             struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct cell cell;
	if (!gnp_loss_rule_asks(rule))
		return GNP_OK;
	if (!take_cell(patches->count * (wanted + 1), &cell, scratch))
		return gnp_no_memory("training", patches->count, "patches", error);
	for (size_t p = 0; p < patches->count; p++) {
		size_t count = patches->truth_start[p + 1] - patches->truth_start[p];
		if (count > 0 && wanted == 0)
			add_point(&cell, cells->basis, patches, p, 0, coefficients);
		for (size_t i = 0; count > 0 && i < wanted; i++)
			add_point(&cell, cells->basis, patches, p, place_of(i, wanted, p, count, cells->k / 3), coefficients);
	}
	judge_points(cells, rule, patches, &cell, dcoefficients, terms, loss);
	return GNP_OK;
}

gnp_status gnp_train_cells_judge(const struct gnp_train_cells *cells, const struct gnp_train_patches *patches,
                                 const double *coefficients, double *dcoefficients, struct gnp_loss_terms *terms,
                                 double *loss, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_loss_options *rules = cells->loss;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	gnp_status status = judge_cell(cells, &rules->cell, 0, patches, coefficients, dcoefficients, terms->cell, loss,
	                               scratch, error);
	if (status == GNP_OK)
		status = judge_cell(cells, &rules->near, rules->points, patches, coefficients, dcoefficients, terms->near,
		                    loss, scratch, error);
	gnp_scratch_release(scratch, mark);
	return status;
}
