/* Writes the table of errors as text and as Markdown (table.h). */
#include <inttypes.h>
#include <string.h>

#include "weights/validate/table.h"

/* One layout for people, plain or as Markdown. */
struct style {
	const char *heading, *open, *between, *close, *paragraph;
	bool ruled; /* a line of dashes below a table's headings, an empty one before it and before a list */
};
static const struct style text = {"\n%s\n", "  ", "  ", "\n", "\n%s\n", false};
static const struct style markdown = {"\n## %s\n", "| ", " | ", " |\n", "\n%s\n", true};

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

static void write_columns(const struct style *style, const char *second, FILE *out)
{
	struct line line = {{"regime"}}, rule;
	snprintf(line.cells[1], CELL, "%s", second);
	for (int s = 0; s < GNP_SCORES; s++)
		snprintf(line.cells[2 + s], CELL, "%s", gnp_score_heading((enum gnp_score)s));
	snprintf(line.cells[COLUMNS - 1], CELL, "seconds");
	if (style->ruled)
		fputs("\n", out);
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
	const char *name = gnp_method_info(row->method)->name;
	struct line mean = line_of(row->regime, name, "mean"), median = line_of(row->regime, name, "median");
	for (int s = 0; s < GNP_SCORES; s++) {
		enum gnp_score score = (enum gnp_score)s;
		snprintf(mean.cells[2 + s], CELL, "%.2e%c", gnp_table_mean(table, row, score),
		         gnp_table_beats(table, row, score) ? '+' : ' ');
		snprintf(median.cells[2 + s], CELL, "%.2e ", gnp_table_median(table, row, score));
	}
	snprintf(mean.cells[COLUMNS - 1], CELL, "%.1f", table->seconds[row->family][row->regime][row->method]);
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
	write_columns(style, "model", out);
	selection.families &= 1u << family;
	for (bool more = gnp_selection_next(&selection, NULL, &row), first = true; more; first = false) {
		if (first || row.regime != previous.regime)
			write_published(style, &row, out);
		write_row(style, table, &row, out);
		previous = row;
		more = gnp_selection_next(&selection, &previous, &row);
	}
}

/* An item of a list, the first of it or not. */
static void write_item(const struct style *style, bool first, const char *item, FILE *out)
{
	fprintf(out, "%s- %s\n", style->ruled && first ? "\n" : "", item);
}

static void write_verdicts(const struct style *style, const struct gnp_table *table, FILE *out)
{
	for (int c = 0; c < GNP_METHODS; c++) {
		const struct gnp_verdict verdict = gnp_table_verdict(table, (enum gnp_method)c);
		char line[160];
		snprintf(line, sizeof line, "%s: %d of %d cells below the paper's GNP row, %d of %d judged cells below both of its rows.",
		         gnp_method_info((enum gnp_method)c)->name, verdict.below_gnp, verdict.cells, verdict.below_both, verdict.judged);
		if (verdict.cells)
			fprintf(out, style->paragraph, line);
	}
}

/* Quotients over `limit` are marked. */
static void write_ratios(const struct style *style, const struct gnp_table *table, enum gnp_method other, double limit,
                         FILE *out)
{
	struct gnp_row row;
	int cells = 0, within = 0;
	char note[160];
	bool more = gnp_table_next_ratio(table, other, NULL, &row);
	if (!more)
		return;
	snprintf(note, sizeof note, "gnp over %s", gnp_method_info(other)->name);
	fprintf(out, style->heading, note);
	write_columns(style, "family", out);
	for (; more; more = gnp_table_next_ratio(table, other, &row, &row)) {
		const double *seconds = table->seconds[row.family][row.regime];
		struct line line = line_of(row.regime, gnp_family_name(row.family), "");
		for (int s = 0; s < GNP_SCORES; s++, cells++) {
			double ratio = gnp_table_ratio(table, &row, other, (enum gnp_score)s);
			within += ratio <= limit;
			snprintf(line.cells[2 + s], CELL, "%.3g%c", ratio, ratio <= limit ? ' ' : '!');
		}
		snprintf(line.cells[COLUMNS - 1], CELL, "%.2f", seconds[GNP_METHOD_GNP] / seconds[other]);
		write_line(style, &line, out);
	}
	snprintf(note, sizeof note,
	         "The quotients of their means, and of their seconds: below 1 gnp is the better. "
	         "At most %g (else !): %d of %d.",
	         limit, within, cells);
	fprintf(out, style->paragraph, note);
}

/* Weights serve all families alike, so the rows of one say it. */
static void write_weights(const struct style *style, const struct gnp_table *table, FILE *out)
{
	struct gnp_selection selection = table->selection;
	struct gnp_row row;
	bool first = true;
	selection.families &= ~(selection.families - 1);
	for (bool more = gnp_selection_next(&selection, NULL, &row); more; more = gnp_selection_next(&selection, &row, &row)) {
		const struct gnp_model *model = gnp_table_model(table, &row);
		if (!model)
			continue;
		if (first)
			fprintf(out, style->heading, "Weights");
		char item[240];
		snprintf(item, sizeof item, "%s, %s: %s, head %s, k = %d, sha256 %s", gnp_method_info(row.method)->name,
		         gnp_regime_info(row.regime)->name, model->name, gnp_head_name(model->architecture.head),
		         gnp_table_k(table, &row), model->sha256);
		write_item(style, first, item, out);
		first = false;
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
	"Every estimator is given the cloud with the exact normals, from which it takes the side that is outward; adaptive\n"
	"and fit also leave out of a patch the points whose normals are turned away from its centre's, and gnp sees them. gnp\n"
	"is the default, with the same weights in every regime and no k (the one shown is not used); fit and pooled are the\n"
	"estimator gnp with the weights trained for the regime, which bring their own k; that of others is the regime's.";

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
	for (int r = 0, listed = 0; r < GNP_REGIMES; r++) {
		const struct gnp_regime_info *info = gnp_regime_info((enum gnp_regime)r);
		snprintf(line, sizeof line, "%s: %s", info->name, info->help);
		if (table->selection.regimes >> r & 1)
			write_item(style, listed++ == 0, line, out);
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
	fprintf(out, style->heading, "Summary");
	write_verdicts(style, table, out);
	write_ratios(style, table, GNP_METHOD_FIT, 1.5, out);
	write_ratios(style, table, GNP_METHOD_ADAPTIVE, 1, out);
	write_weights(style, table, out);
	fprintf(out, style->heading, "Protocol");
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
