#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "published.h"
#include "table.h"

/* One layout for people, plain or as Markdown. */
struct style {
	const char *heading, *open, *between, *close, *paragraph;
	bool ruled; /* a line of dashes below the headings */
};
static const struct style text = {"\n%s\n", "  ", "  ", "\n", "\n%s\n", false};
static const struct style markdown = {"\n## %s\n\n", "| ", " | ", " |\n", "\n%s\n", true};

enum { COLUMNS = 3 + GNP_SCORES, CELL = 24 };
static const int WIDTHS[COLUMNS] = {-10, -16, 10, 14, 10, 10, 10, 8};

struct line {
	char cells[COLUMNS][CELL];
};

static void write_line(const struct style *style, const struct line *line, FILE *out)
{
	for (int c = 0; c < COLUMNS; c++)
		fprintf(out, "%s%*s", c ? style->between : style->open, WIDTHS[c], line->cells[c]);
	fputs(style->close, out);
}

static void write_columns(const struct style *style, FILE *out)
{
	struct line line = {{"regime", "model"}}, rule;
	for (int s = 0; s < GNP_SCORES; s++)
		snprintf(line.cells[2 + s], CELL, "%s", gnp_score_heading((enum gnp_score)s));
	snprintf(line.cells[COLUMNS - 1], CELL, "seconds");
	write_line(style, &line, out);
	for (int c = 0; c < COLUMNS; c++)
		snprintf(rule.cells[c], CELL, "%s", WIDTHS[c] < 0 ? "---" : "---:");
	if (style->ruled)
		write_line(style, &rule, out);
}

static struct line line_of(enum gnp_regime regime, const char *model, const char *what)
{
	struct line line = {0};
	snprintf(line.cells[0], CELL, "%s", gnp_regime_info(regime)->name);
	snprintf(line.cells[1], CELL, "%.10s%s%s", model, *what ? ", " : "", what);
	return line;
}

static void write_published(const struct style *style, const struct gnp_row *row, FILE *out)
{
	for (int m = 0; m < GNP_PUBLISHED_MODELS; m++) {
		enum gnp_published_model model = (enum gnp_published_model)m;
		struct line line = line_of(row->regime, gnp_published_name(model), "paper");
		for (int s = 0; s < GNP_SCORES; s++) {
			enum gnp_score score = (enum gnp_score)s;
			bool outlying = gnp_published_is_outlying(row->family, row->regime, model, score);
			snprintf(line.cells[2 + s], CELL, "%.2e%c", gnp_published_error(row->family, row->regime, model, score),
			         outlying ? '?' : ' ');
		}
		write_line(style, &line, out);
	}
}

static void write_row(const struct style *style, const struct gnp_table *table, const struct gnp_row *row, FILE *out)
{
	const char *name = gnp_estimator_at(row->estimator)->name;
	struct line mean = line_of(row->regime, name, "mean"), median = line_of(row->regime, name, "median");
	for (int s = 0; s < GNP_SCORES; s++) {
		enum gnp_score score = (enum gnp_score)s;
		snprintf(mean.cells[2 + s], CELL, "%.2e%c", gnp_table_mean(table, row, score),
		         gnp_table_beats(table, row, score) ? '+' : ' ');
		snprintf(median.cells[2 + s], CELL, "%.2e ", gnp_table_median(table, row, score));
	}
	snprintf(mean.cells[COLUMNS - 1], CELL, "%.1f", table->seconds[row->family][row->regime][row->estimator]);
	write_line(style, &mean, out);
	write_line(style, &median, out);
}

static void write_family(const struct style *style, const struct gnp_table *table, enum gnp_family family, FILE *out)
{
	struct gnp_selection selection = table->selection;
	struct gnp_row row, previous;
	char heading[80];
	snprintf(heading, sizeof heading, "%s manifolds", gnp_family_name(family));
	fprintf(out, style->heading, heading);
	write_columns(style, out);
	selection.families &= 1u << family;
	for (bool more = gnp_selection_next(&selection, NULL, &row), first = true; more; first = false) {
		if (first || row.regime != previous.regime)
			write_published(style, &row, out);
		write_row(style, table, &row, out);
		previous = row;
		more = gnp_selection_next(&selection, &previous, &row);
	}
}

static void write_verdicts(const struct style *style, const struct gnp_table *table, FILE *out)
{
	for (int e = 0; e < GNP_ESTIMATOR_KINDS; e++) {
		struct gnp_selection selection = table->selection;
		struct gnp_row row;
		int judged = 0, below = 0;
		double target;
		selection.estimators &= 1u << e;
		for (bool more = gnp_selection_next(&selection, NULL, &row); more; more = gnp_selection_next(&selection, &row, &row))
			for (int s = 0; s < GNP_SCORES; s++) {
				judged += gnp_published_target(row.family, row.regime, (enum gnp_score)s, &target);
				below += gnp_table_beats(table, &row, (enum gnp_score)s);
			}
		char verdict[120];
		snprintf(verdict, sizeof verdict, "%s: %d of %d judged cells below both of the paper's rows.",
		         gnp_estimator_at((enum gnp_estimator_kind)e)->name, below, judged);
		if (judged)
			fprintf(out, style->paragraph, verdict);
	}
}

static const char *const COLUMNS_NOTE =
	"Columns: normal is the mean of 1 - n.n' over the centres; the others are relative L2 errors over the centres of a shape,\n"
	"tensors by their Frobenius norm in the frame of the estimator's patch (shape is the second fundamental form). Truth is the\n"
	"geometry of the surface point a centre was displaced from. Means and medians are over shapes. Seconds are wall time of\n"
	"all shapes of a row, the search for neighbours in the whole cloud included.";

static const char *const MARKS_NOTE =
	"+ marks a mean below both of the paper's rows. ? marks the paper's two cells that do not fit their row and column (the\n"
	"normal a hundred times better and the metric three thousand times worse than at k = 30): those columns are not judged there.";

static const char *const NORMALS_NOTE =
	"Every estimator is given the cloud with the exact normals, from which it takes the side that is outward;\n"
	"adaptive also leaves out of a patch the points whose normals are turned away from its centre's.";

static const char *const RULE_NOTE =
	"The paper's toroidal law has members folded more sharply than the spacing of the points, which no patch can resolve. A draw\n"
	"is judged when it is resolved: its largest |principal curvature| times epsilon is at most 1, with epsilon = 1.1 r_30 and\n"
	"r_30 = sqrt(30 A / (pi N)) for the area A and N points.";

static void write_protocol(const struct style *style, const struct gnp_table *table, FILE *out)
{
	char line[240];
	snprintf(line, sizeof line,
	         "Shapes a family: %zu. Quasi-uniform points a shape: %zu. Centres a shape: %zu, each estimated in its own patch.\n"
	         "Seeds: from %" PRIu64 " on, which no training may use.",
	         table->protocol.shapes, table->protocol.points, table->protocol.centres, GNP_SEED_VALIDATION);
	fprintf(out, style->paragraph, line);
	for (int r = 0; r < GNP_REGIMES; r++) {
		const struct gnp_regime_info *info = gnp_regime_info((enum gnp_regime)r);
		if (table->selection.regimes >> r & 1)
			fprintf(out, "%s- %s: %s\n", style->ruled && r == 0 ? "\n" : "", info->name, info->help);
	}
	fprintf(out, style->paragraph, COLUMNS_NOTE);
	fprintf(out, style->paragraph, MARKS_NOTE);
	fprintf(out, style->paragraph, NORMALS_NOTE);
	if (!(table->selection.families >> GNP_FAMILY_TOROIDAL & 1))
		return;
	fprintf(out, style->paragraph, RULE_NOTE);
	snprintf(line, sizeof line, "Toroidal draws: %zu. Skipped by this rule: %zu.", table->drawn[GNP_FAMILY_TOROIDAL],
	         table->drawn[GNP_FAMILY_TOROIDAL] - table->protocol.shapes);
	fprintf(out, "%s\n", line);
}

static void write_styled(const struct style *style, const struct gnp_table *table, FILE *out)
{
	for (int f = 0; f < GNP_FAMILIES; f++)
		if (table->selection.families >> f & 1)
			write_family(style, table, (enum gnp_family)f, out);
	write_verdicts(style, table, out);
	write_protocol(style, table, out);
}

void gnp_table_write_text(const struct gnp_table *table, FILE *out)
{
	fputs("Table 1: accuracy and robustness at patch centres\n", out);
	write_styled(&text, table, out);
}

void gnp_table_write_markdown(const struct gnp_table *table, FILE *out)
{
	fputs("# Validation\n\nThe paper's Table 1, accuracy and robustness at patch centres, by `make validate` (`gnp-validate`).\n", out);
	write_styled(&markdown, table, out);
}

/* ---- JSON ---- */

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

static void write_json_published(const struct gnp_row *row, FILE *out)
{
	for (int m = 0; m < GNP_PUBLISHED_MODELS; m++) {
		enum gnp_published_model model = (enum gnp_published_model)m;
		double errors[GNP_SCORES];
		char name[CELL];
		for (int s = 0; s < GNP_SCORES; s++)
			errors[s] = gnp_published_error(row->family, row->regime, model, (enum gnp_score)s);
		snprintf(name, sizeof name, "paper_%s", gnp_published_name(model));
		write_scores(name, errors, out);
		fputs(",\n    ", out);
	}
}

static void write_json_verdict(const struct gnp_table *table, const struct gnp_row *row, FILE *out)
{
	double target;
	fputs("\"below_both\": {", out);
	for (int s = 0; s < GNP_SCORES; s++) {
		enum gnp_score score = (enum gnp_score)s;
		bool judged = gnp_published_target(row->family, row->regime, score, &target);
		fprintf(out, "%s\"%s\": %s", s ? ", " : "", gnp_score_name(score),
		        !judged ? "null" : gnp_table_beats(table, row, score) ? "true" : "false");
	}
	fputs("}", out);
}

static void write_json_row(const struct gnp_table *table, const struct gnp_row *row, FILE *out)
{
	const struct gnp_regime_info *regime = gnp_regime_info(row->regime);
	double mean[GNP_SCORES], median[GNP_SCORES];
	for (int s = 0; s < GNP_SCORES; s++) {
		mean[s] = gnp_table_mean(table, row, (enum gnp_score)s);
		median[s] = gnp_table_median(table, row, (enum gnp_score)s);
	}
	fprintf(out, "   {\"family\": \"%s\", \"regime\": \"%s\", \"k\": %d, \"estimator\": \"%s\", \"seconds\": %.2f,\n    ",
	        gnp_family_name(row->family), regime->name, regime->k, gnp_estimator_at(row->estimator)->name,
	        table->seconds[row->family][row->regime][row->estimator]);
	write_scores("mean", mean, out);
	fputs(",\n    ", out);
	write_scores("median", median, out);
	fputs(",\n    ", out);
	write_json_published(row, out);
	write_json_verdict(table, row, out);
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
	fputs("},\n  \"resolved\": \"largest |principal curvature| * epsilon <= 1, epsilon = 1.1 sqrt(30 A / (pi N)); toroidal only\"},\n"
	      " \"rows\": [\n",
	      out);
	for (bool more = gnp_selection_next(&table->selection, NULL, &row); more;) {
		write_json_row(table, &row, out);
		more = gnp_selection_next(&table->selection, &row, &row);
		fputs(more ? ",\n" : "\n", out);
	}
	fputs(" ]}\n", out);
}
