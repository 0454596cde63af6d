#include "weights/validate/validation.h"

#include "weights/validate/judged.h"

/* A step for each shape drawn and one for each time it is judged. */
static size_t step_count(const struct gnp_table *table)
{
	size_t families = (size_t)__builtin_popcount(table->selection.families);
	return table->protocol.shapes * (families + gnp_selection_count(&table->selection));
}

static gnp_status finish_step(struct gnp_task *task, struct gnp_error *error)
{
	if (task)
		gnp_task_advance(task, 1);
	return gnp_task_check(task, error);
}

/* One method in the regime the subject is in. */
static gnp_status judge(const struct gnp_table *table, const struct gnp_subject *subject, const struct gnp_row *row,
                        struct gnp_pool *pool, double *errors, double *seconds, struct gnp_error *error)
{
	const struct gnp_sample *sample = &subject->sample;
	const struct gnp_cloud cloud = {sample->count, sample->points, sample->normals};
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_estimate estimate;
	options.estimator = (int)gnp_method_info(row->method)->estimator;
	options.model = gnp_table_model(table, row);
	options.k = gnp_table_k(table, row);
	options.quantities = gnp_score_quantities();
	double start = gnp_clock();
	gnp_status status =
		gnp_judged_at(&cloud, &options, subject->centres, subject->centre_count, pool, &estimate, error);
	if (status != GNP_OK)
		return status;
	*seconds += gnp_clock() - start;
	gnp_score_estimate(sample, subject->centres, &estimate, errors);
	gnp_estimate_clear(&estimate);
	return GNP_OK;
}

static gnp_status judge_shape(struct gnp_table *table, struct gnp_subject *subject, size_t shape, struct gnp_pool *pool,
                              struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_selection selection = table->selection;
	struct gnp_row row;
	gnp_status status = GNP_OK;
	int entered = -1;
	selection.families &= 1u << subject->family;
	for (bool more = gnp_selection_next(&selection, NULL, &row); more && status == GNP_OK;
	     more = gnp_selection_next(&selection, &row, &row)) {
		if (entered != (int)row.regime)
			status = gnp_subject_enter(subject, row.regime, error);
		entered = (int)row.regime;
		if (status == GNP_OK)
			status = judge(table, subject, &row, pool, gnp_table_errors(table, &row, shape),
			               &table->seconds[row.family][row.regime][row.method], error);
		if (status == GNP_OK)
			status = finish_step(task, error);
	}
	return status;
}

static gnp_status judge_family(struct gnp_table *table, enum gnp_family family, struct gnp_pool *pool, struct gnp_task *task,
                               struct gnp_error *error)
{
	struct gnp_draws draws = {.family = family};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < table->protocol.shapes && status == GNP_OK; i++) {
		struct gnp_subject subject;
		status = gnp_subject_draw(&table->protocol, &draws, pool, &subject, error);
		if (status != GNP_OK)
			return status;
		*gnp_table_shape(table, family, i) = (struct gnp_table_shape){subject.seed, subject.degree, subject.sharpness};
		status = finish_step(task, error);
		if (status == GNP_OK)
			status = judge_shape(table, &subject, i, pool, task, error);
		gnp_subject_clear(&subject);
	}
	table->drawn[family] = draws.drawn;
	return status;
}

gnp_status gnp_validation_run(struct gnp_table *table, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	gnp_task_stage(task, GNP_STAGE_ESTIMATE, step_count(table));
	for (int f = 0; f < GNP_FAMILIES && status == GNP_OK; f++)
		if (table->selection.families >> f & 1)
			status = judge_family(table, (enum gnp_family)f, pool, task, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	return status;
}
