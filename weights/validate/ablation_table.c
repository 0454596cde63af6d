#include "weights/validate/ablation_table.h"

#include <math.h>

#include "weights/validate/validation.h"

static const unsigned ALTERED = 1u << GNP_METHOD_GNP | 1u << GNP_METHOD_FIT;

/* The means of a table's rows. */
static void take_means(const struct gnp_table *table, double mean[GNP_METHODS][GNP_FAMILIES][GNP_REGIMES][GNP_SCORES])
{
	struct gnp_row row;
	for (bool more = gnp_selection_next(&table->selection, NULL, &row); more;
	     more = gnp_selection_next(&table->selection, &row, &row))
		for (int s = 0; s < GNP_SCORES && ALTERED >> row.method & 1; s++)
			mean[row.method][row.family][row.regime][s] = gnp_table_mean(table, &row, (enum gnp_score)s);
}

/* The rows of gnp and fit alone. */
static struct gnp_selection rows_altered(const struct gnp_selection *selection)
{
	struct gnp_selection own = *selection;
	for (int r = 0; r < GNP_REGIMES; r++)
		own.methods[r] &= ALTERED;
	return own;
}

static gnp_status judge_part(const struct gnp_table *whole, enum gnp_ablation_part part, struct gnp_pool *pool,
                             struct gnp_task *task, struct gnp_ablation_table *out, struct gnp_error *error)
{
	struct gnp_selection selection = rows_altered(&whole->selection);
	struct gnp_models *altered = NULL;
	struct gnp_table table;
	gnp_status status = gnp_ablation_models(whole->models, part, whole->protocol.points, pool, &altered, error);
	if (status != GNP_OK)
		return status;
	gnp_selection_restrict(&selection, altered);
	bool any = gnp_selection_count(&selection) > 0;
	if (any)
		status = gnp_table_create(&whole->protocol, &selection, altered, &table, error);
	gnp_models_release(altered);
	if (!any || status != GNP_OK)
		return status;
	status = gnp_validation_run(&table, pool, task, error);
	if (status == GNP_OK)
		take_means(&table, out->mean[part]);
	gnp_table_clear(&table);
	return status;
}

gnp_status gnp_ablation_table_run(const struct gnp_table *whole, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_ablation_table *out, struct gnp_error *error)
{
	struct gnp_ablation_table table;
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof table.mean / sizeof(double); i++)
		(&table.mean[0][0][0][0][0])[i] = NAN;
	take_means(whole, table.mean[GNP_ABLATION_NONE]);
	for (unsigned part = GNP_ABLATION_NONE + 1; part < GNP_ABLATION_PARTS && status == GNP_OK; part++)
		status = judge_part(whole, (enum gnp_ablation_part)part, pool, task, &table, error);
	if (status == GNP_OK)
		*out = table;
	return status;
}

/* ---- Writing ---- */

/* Rows as text with columns, or as Markdown with bars. */
struct style {
	const char *begin, *between, *end;
};

static bool is_judged(const double mean[GNP_SCORES])
{
	return !(isnan(mean[0]) && isnan(mean[GNP_SCORES - 1]));
}

static void write_row(const struct style *style, const struct gnp_row *row, unsigned part,
                      const double mean[GNP_SCORES], FILE *out)
{
	fprintf(out, "%s%-5s%s%-8s%s%-10s%s%-16s", style->begin, gnp_method_info(row->method)->name, style->between,
	        gnp_family_name(row->family), style->between, gnp_regime_info(row->regime)->name, style->between,
	        gnp_ablation_name(part));
	for (int s = 0; s < GNP_SCORES; s++)
		if (is_judged(mean))
			fprintf(out, "%s%14.2e", style->between, mean[s]);
		else
			fprintf(out, "%s%14s", style->between, "-");
	fprintf(out, "%s\n", style->end);
}

static void write_rows(const struct gnp_ablation_table *table, const struct style *style, FILE *out)
{
	for (int m = 0; m < GNP_METHODS; m++)
		for (int f = 0; f < GNP_FAMILIES; f++)
			for (int r = 0; r < GNP_REGIMES; r++) {
				const struct gnp_row row = {(enum gnp_family)f, (enum gnp_regime)r, (enum gnp_method)m};
				for (unsigned part = 0; part < GNP_ABLATION_PARTS && is_judged(table->mean[0][m][f][r]); part++)
					write_row(style, &row, part, table->mean[part][m][f][r], out);
			}
}

static void write_head(const struct style *style, FILE *out)
{
	fprintf(out, "%s%-5s%s%-8s%s%-10s%s%-16s", style->begin, "model", style->between, "family", style->between,
	        "regime", style->between, "part");
	for (int s = 0; s < GNP_SCORES; s++)
		fprintf(out, "%s%14s", style->between, gnp_score_heading((enum gnp_score)s));
	fprintf(out, "%s\n", style->end);
}

void gnp_ablation_table_write_text(const struct gnp_ablation_table *table, FILE *out)
{
	static const struct style plain = {"", "  ", ""};
	fputs("\nablation of the models of gnp and fit\n", out);
	write_head(&plain, out);
	write_rows(table, &plain, out);
}

void gnp_ablation_table_write_markdown(const struct gnp_ablation_table *table, FILE *out)
{
	static const struct style bars = {"| ", " | ", " |"};
	fputs("\n## Ablation\nMean errors of `gnp` and `fit` with a part of their models taken away; -: they have none.",
	      out);
	for (unsigned part = GNP_ABLATION_NONE + 1; part < GNP_ABLATION_PARTS; part++)
		fprintf(out, "%s %s: %s.", part == GNP_ABLATION_NONE + 1 ? "" : "\n", gnp_ablation_name(part),
		        gnp_ablation_help(part));
	fputs("\n\n", out);
	write_head(&bars, out);
	fputs("| --- | --- | --- | --- |", out);
	for (int s = 0; s < GNP_SCORES; s++)
		fputs(" ---: |", out);
	fputc('\n', out);
	write_rows(table, &bars, out);
}
