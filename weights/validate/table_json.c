/* Writes the table of errors as JSON (table.h). */
#include <inttypes.h>
#include <math.h>

#include "core/estimators/estimators.h"
#include "weights/validate/table.h"

static void write_number(double value, FILE *out)
{
	if (isfinite(value))
		fprintf(out, "%.6e", value);
	else
		fputs("null", out);
}

static void write_scores(const char *name, const double errors[GNP_SCORES], FILE *out)
{
	fprintf(out, "\"%s\": {", name);
	for (int s = 0; s < GNP_SCORES; s++) {
		fprintf(out, "%s\"%s\": ", s ? ", " : "", gnp_score_name((enum gnp_score)s));
		write_number(errors[s], out);
	}
	fputs("}", out);
}

static void write_published(const struct gnp_row *row, FILE *out)
{
	for (int m = 0; m < GNP_PUBLISHED_MODELS; m++) {
		enum gnp_published_model model = (enum gnp_published_model)m;
		double errors[GNP_SCORES];
		char name[16];
		for (int s = 0; s < GNP_SCORES; s++)
			errors[s] = gnp_published_error(row->family, row->regime, model, (enum gnp_score)s);
		snprintf(name, sizeof name, "paper_%s", gnp_published_name(model));
		write_scores(name, errors, out);
		fputs(",\n    ", out);
	}
}

static void write_verdicts(const struct gnp_table *table, const struct gnp_row *row, FILE *out)
{
	double target;
	fputs("\"below_gnp\": {", out);
	for (int s = 0; s < GNP_SCORES; s++)
		fprintf(out, "%s\"%s\": %s", s ? ", " : "", gnp_score_name((enum gnp_score)s),
		        gnp_table_beats_one(table, row, GNP_PUBLISHED_GNP, (enum gnp_score)s) ? "true" : "false");
	fputs("},\n    \"below_both\": {", out);
	for (int s = 0; s < GNP_SCORES; s++) {
		enum gnp_score score = (enum gnp_score)s;
		bool judged = gnp_published_target(row->family, row->regime, score, &target);
		fprintf(out, "%s\"%s\": %s", s ? ", " : "", gnp_score_name(score),
		        !judged ? "null" : gnp_table_beats(table, row, score) ? "true" : "false");
	}
	fputs("}", out);
}

static void write_model(const struct gnp_model *model, FILE *out)
{
	if (model)
		fprintf(out, "{\"name\": \"%s\", \"sha256\": \"%s\", \"head\": \"%s\"}", model->name, model->sha256,
		        gnp_head_name(model->architecture.head));
	else
		fputs("null", out);
}

static void write_row(const struct gnp_table *table, const struct gnp_row *row, FILE *out)
{
	const struct gnp_method_info *method = gnp_method_info(row->method);
	double mean[GNP_SCORES], median[GNP_SCORES];
	for (int s = 0; s < GNP_SCORES; s++) {
		mean[s] = gnp_table_mean(table, row, (enum gnp_score)s);
		median[s] = gnp_table_median(table, row, (enum gnp_score)s);
	}
	fprintf(out, "   {\"family\": \"%s\", \"regime\": \"%s\", \"contender\": \"%s\", \"estimator\": \"%s\", \"k\": %d,\n    \"weights\": ",
	        gnp_family_name(row->family), gnp_regime_info(row->regime)->name, method->name,
	        gnp_estimator_at(method->estimator)->name, gnp_table_k(table, row));
	write_model(gnp_table_model(table, row), out);
	fprintf(out, ", \"seconds\": %.2f,\n    ", table->seconds[row->family][row->regime][row->method]);
	write_scores("mean", mean, out);
	fputs(",\n    ", out);
	write_scores("median", median, out);
	fputs(",\n    ", out);
	write_published(row, out);
	write_verdicts(table, row, out);
	fputs(",\n    \"shapes\": [", out);
	for (size_t i = 0; i < table->protocol.shapes; i++) {
		const struct gnp_table_shape *shape = gnp_table_shape(table, row->family, i);
		fprintf(out, "%s\n     {\"seed\": %" PRIu64 ", \"degree\": %u, \"sharpness\": %.4f, ", i ? "," : "", shape->seed,
		        shape->degree, shape->sharpness);
		write_scores("errors", gnp_table_errors(table, row, i), out);
		fputs("}", out);
	}
	fputs("]}", out);
}

static void write_summary(const struct gnp_table *table, FILE *out)
{
	bool first = true;
	fputs(" \"summary\": [", out);
	for (int c = 0; c < GNP_METHODS; c++) {
		const struct gnp_verdict verdict = gnp_table_verdict(table, (enum gnp_method)c);
		if (!verdict.cells)
			continue;
		fprintf(out, "%s\n   {\"contender\": \"%s\", \"cells\": %d, \"below_gnp\": %d, \"judged\": %d, \"below_both\": %d}",
		        first ? "" : ",", gnp_method_info((enum gnp_method)c)->name, verdict.cells, verdict.below_gnp,
		        verdict.judged, verdict.below_both);
		first = false;
	}
	fputs("],\n", out);
}

/* The means of gnp over those of another method. */
static void write_ratios(const struct gnp_table *table, enum gnp_method other, FILE *out)
{
	struct gnp_row row;
	bool first = true;
	fprintf(out, " \"gnp_over_%s\": [", gnp_method_info(other)->name);
	for (bool more = gnp_table_next_ratio(table, other, NULL, &row); more;
	     more = gnp_table_next_ratio(table, other, &row, &row), first = false) {
		double ratios[GNP_SCORES];
		for (int s = 0; s < GNP_SCORES; s++)
			ratios[s] = gnp_table_ratio(table, &row, other, (enum gnp_score)s);
		fprintf(out, "%s\n   {\"family\": \"%s\", \"regime\": \"%s\", ", first ? "" : ",", gnp_family_name(row.family),
		        gnp_regime_info(row.regime)->name);
		write_scores("ratio", ratios, out);
		fputs("}", out);
	}
	fputs("],\n", out);
}

void gnp_table_write_json(const struct gnp_table *table, FILE *out)
{
	const struct gnp_protocol *protocol = &table->protocol;
	struct gnp_row row;
	fprintf(out,
	        "{\"table\": 1,\n \"protocol\": {\"points\": %zu, \"shapes\": %zu, \"centres\": %zu, \"first_seed\": %" PRIu64
	        ", \"drawn\": {",
	        protocol->points, protocol->shapes, protocol->centres, GNP_SEED_VALIDATION);
	for (int f = 0; f < GNP_FAMILIES; f++)
		fprintf(out, "%s\"%s\": %zu", f ? ", " : "", gnp_family_name((enum gnp_family)f), table->drawn[f]);
	fputs("},\n  \"resolved\": \"largest |principal curvature| * epsilon <= 1, epsilon = 1.1 sqrt(30 A / (pi N)); toroidal only\"},\n",
	      out);
	write_summary(table, out);
	write_ratios(table, GNP_METHOD_FIT, out);
	write_ratios(table, GNP_METHOD_ADAPTIVE, out);
	fputs(" \"rows\": [\n", out);
	for (bool more = gnp_selection_next(&table->selection, NULL, &row); more;) {
		write_row(table, &row, out);
		more = gnp_selection_next(&table->selection, &row, &row);
		fputs(more ? ",\n" : "\n", out);
	}
	fputs(" ]}\n", out);
}
