#include "weights/validate/real_extra.h"

#include <math.h>
#include <string.h>

/* Rows as text with columns, or as Markdown with bars. */
struct style {
	const char *heading, *begin, *between, *end;
	bool ruled, told; /* with a rule below a table's head; with its notes */
};
static const struct style plain = {"%s\n", "", "  ", "", false, false};
static const struct style bars = {"## %s\n", "| ", " | ", " |", true, true};

static void write_words(const struct style *style, const char *first, const char *second, FILE *out)
{
	fprintf(out, "%s%-18s%s%-18s", style->begin, first, style->between, second);
}

static void write_head(const struct style *style, const char *first, const char *second, const char *const *heads,
                       size_t count, FILE *out)
{
	write_words(style, first, second, out);
	for (size_t i = 0; i < count; i++)
		fprintf(out, "%s%9s", style->between, heads[i]);
	fprintf(out, "%s\n", style->end);
	if (!style->ruled)
		return;
	fputs("| --- | --- |", out);
	for (size_t i = 0; i < count; i++)
		fputs(" ---: |", out);
	fputc('\n', out);
}

static void write_figure(const struct style *style, const char *format, double figure, FILE *out)
{
	char text[32] = "-";
	if (isfinite(figure))
		snprintf(text, sizeof text, format, figure);
	fprintf(out, "%s%9s", style->between, text);
}

/* In per cent. */
static double share(size_t part, size_t whole)
{
	return whole ? 100 * (double)part / (double)whole : NAN;
}

/* ---- Sums ---- */

/* A mean of figures, as far as there are any. */
struct mean {
	double sum;
	size_t count;
};

static void add_to(struct mean *mean, double figure)
{
	if (!isfinite(figure))
		return;
	mean->sum += figure;
	mean->count++;
}

static double of(const struct mean *mean)
{
	return mean->count ? mean->sum / (double)mean->count : NAN;
}

struct gnp_real_detail gnp_real_extra_sum(const struct gnp_real_table *table, enum gnp_real_detailed which,
                                          enum gnp_real_hardness hardness)
{
	struct gnp_real_detail sum = {0};
	struct mean angle = {0}, mean = {0}, gaussian = {0};
	for (size_t r = 0; r < table->row_count; r++) {
		const struct gnp_real_detail *own = &table->rows[r].details[which];
		if (hardness != GNP_REAL_HARDNESSES && table->rows[r].hardness != hardness)
			continue;
		sum.centres += own->centres;
		sum.near += own->near;
		sum.flagged += own->flagged;
		sum.found += own->found;
		sum.far += own->far;
		for (int b = 0; b < GNP_REAL_BARS; b++) {
			sum.normals_within[b] += own->normals_within[b];
			sum.curvature_within[b] += own->curvature_within[b];
		}
		add_to(&angle, own->centres ? own->angle : NAN);
		add_to(&mean, own->centres ? own->mean_curvature : NAN);
		add_to(&gaussian, own->centres ? own->gaussian_curvature : NAN);
	}
	sum.angle = of(&angle);
	sum.mean_curvature = of(&mean);
	sum.gaussian_curvature = of(&gaussian);
	return sum;
}

/* ---- Creases ---- */

static void write_crease(const struct style *style, const struct gnp_real_detail *detail, FILE *out)
{
	write_figure(style, "%.1f", share(detail->near, detail->centres), out);
	write_figure(style, "%.1f", share(detail->found, detail->flagged), out);
	write_figure(style, "%.1f", share(detail->found, detail->near), out);
	write_figure(style, "%.1f", share(detail->flagged - detail->found, detail->far), out);
	write_figure(style, "%.2f", detail->angle, out);
	write_figure(style, "%.2e", detail->mean_curvature, out);
	write_figure(style, "%.2e", detail->gaussian_curvature, out);
	fprintf(out, "%s\n", style->end);
}

static void write_creases(const struct gnp_real_table *table, const struct style *style, FILE *out)
{
	static const char *const heads[] = {"near", "precision", "recall", "false", "angle", "H", "K"};
	fprintf(out, style->heading, "Creases");
	if (style->told)
		fputs("The default `gnp` on exact bodies, at points everywhere. `near`: per cent of the points within a "
		      "spacing of an\n"
		      "edge, rim or tip; `precision` of those flagged (`crease` 1) that are near, `recall` of those near "
		      "that are flagged,\n"
		      "`false` of the others that are flagged, per cent. Of the others: root mean square angle in degrees, "
		      "relative\n"
		      "errors of H and K. Rows for all clouds count points together, and take the mean of figures.\n\n",
		      out);
	write_head(style, "creases of gnp", "sampling", heads, sizeof heads / sizeof *heads, out);
	for (size_t r = 0; r < table->row_count; r++) {
		const struct gnp_real_detail *own = &table->rows[r].details[GNP_REAL_DETAIL_GNP];
		if (own->centres == 0)
			continue;
		write_words(style, table->rows[r].cloud, table->rows[r].variant, out);
		write_crease(style, own, out);
	}
	for (int h = 0; h <= GNP_REAL_HARDNESSES; h++) {
		const struct gnp_real_detail sum = gnp_real_extra_sum(table, GNP_REAL_DETAIL_GNP, (enum gnp_real_hardness)h);
		write_words(style, "all clouds",
		            h < GNP_REAL_HARDNESSES ? gnp_real_hardness_name((enum gnp_real_hardness)h) : "", out);
		write_crease(style, &sum, out);
	}
	fputc('\n', out);
}

/* ---- Error bars ---- */

static void write_bars(const struct gnp_real_table *table, const struct style *style, FILE *out)
{
	static const char *const heads[] = {"points", "normal 1", "normal 2", "H 1", "H 2"};
	fprintf(out, style->heading, "Error bars");
	if (style->told)
		fputs("Per cent of the points farther than a spacing from every edge whose error is within 1 and 2 of the "
		      "standard errors\n"
		      "that the estimator gives: of the normal's angle by `normals_stderr`, of H by `mean_curvature_stderr`. "
		      "Honest ones\n"
		      "hold for 60 to 75 and 92 to 98. By what is hard about the exact bodies: edges are of even samples "
		      "without noise,\n"
		      "noise of any without gradient.\n\n",
		      out);
	write_head(style, "error bars", "clouds", heads, sizeof heads / sizeof *heads, out);
	for (int d = 0; d < GNP_REAL_DETAILS; d++)
		for (int h = 0; h < GNP_REAL_HARDNESSES; h++) {
			const struct gnp_real_detail sum =
				gnp_real_extra_sum(table, (enum gnp_real_detailed)d, (enum gnp_real_hardness)h);
			if (sum.centres == 0)
				continue;
			write_words(style, gnp_real_detail_name((unsigned)d), gnp_real_hardness_name((enum gnp_real_hardness)h),
			            out);
			fprintf(out, "%s%9zu", style->between, sum.far);
			for (int b = 0; b < GNP_REAL_BARS; b++)
				write_figure(style, "%.1f", share(sum.normals_within[b], sum.far), out);
			for (int b = 0; b < GNP_REAL_BARS; b++)
				write_figure(style, "%.1f", share(sum.curvature_within[b], sum.far), out);
			fprintf(out, "%s\n", style->end);
		}
	fputc('\n', out);
}

/* ---- Filter ---- */

static bool alike(const struct gnp_real_filter_row *a, const struct gnp_real_filter_row *b)
{
	return strcmp(a->variant, b->variant) == 0 && a->planted >= b->planted && a->planted <= b->planted;
}

/* The rows like the i-th, over all clouds. */
static void write_filtered(const struct gnp_real_table *table, size_t i, const struct style *style, FILE *out)
{
	const struct gnp_real_filter_row *first = &table->filters[i];
	struct mean dropped = {0}, found = {0};
	double most = 0, least = 100;
	for (size_t f = i; f < table->filter_count; f++) {
		const struct gnp_real_filter_row *row = &table->filters[f];
		if (!alike(row, first))
			continue;
		add_to(&dropped, share(row->filtered.dropped, row->filtered.good));
		add_to(&found, share(row->filtered.found, row->filtered.outliers));
		most = fmax(most, share(row->filtered.dropped, row->filtered.good));
		least = fmin(least, share(row->filtered.found, row->filtered.outliers));
	}
	char planted[32] = "none";
	if (first->planted > 0)
		snprintf(planted, sizeof planted, "10 %% by %g", first->planted);
	write_words(style, first->variant, planted, out);
	fprintf(out, "%s%9zu", style->between, dropped.count);
	write_figure(style, "%.2f", of(&dropped), out);
	write_figure(style, "%.2f", most, out);
	write_figure(style, "%.1f", of(&found), out);
	write_figure(style, "%.1f", found.count ? least : NAN, out);
	fprintf(out, "%s\n", style->end);
}

static void write_filter(const struct gnp_real_table *table, const struct style *style, FILE *out)
{
	static const char *const heads[] = {"clouds", "dropped", "most", "found", "least"};
	fprintf(out, style->heading, "Filter");
	if (style->told)
		fputs("The operation filter with its defaults on the samples: per cent of the good points it drops "
		      "(`dropped`; `most` on\n"
		      "any mesh), and of outliers planted that it drops (`found`; `least`): a tenth of the points displaced "
		      "by isotropic\n"
		      "Gaussian noise in units of the diagonal, of which those count that are then farther along the normal "
		      "than three\n"
		      "deviations of the noise, and than 0.3 spacings.\n\n",
		      out);
	write_head(style, "filter", "outliers planted", heads, sizeof heads / sizeof *heads, out);
	for (size_t i = 0; i < table->filter_count; i++) {
		bool first = true;
		for (size_t f = 0; f < i && first; f++)
			first = !alike(&table->filters[f], &table->filters[i]);
		if (first)
			write_filtered(table, i, style, out);
	}
	fputc('\n', out);
}

/* ---- Whole ---- */

static void write_styled(const struct gnp_real_table *table, const struct style *style, FILE *out)
{
	size_t centres[GNP_REAL_DETAILS], all = 0;
	for (int d = 0; d < GNP_REAL_DETAILS; d++)
		all += centres[d] = gnp_real_extra_sum(table, (enum gnp_real_detailed)d, GNP_REAL_HARDNESSES).centres;
	if (centres[GNP_REAL_DETAIL_GNP] > 0)
		write_creases(table, style, out);
	if (all > 0)
		write_bars(table, style, out);
	if (table->filter_count > 0)
		write_filter(table, style, out);
}

void gnp_real_extra_write_text(const struct gnp_real_table *table, FILE *out)
{
	write_styled(table, &plain, out);
}

void gnp_real_extra_write_markdown(const struct gnp_real_table *table, FILE *out)
{
	write_styled(table, &bars, out);
}

/* ---- JSON ---- */

static void write_number(const char *name, double value, FILE *out)
{
	if (isfinite(value))
		fprintf(out, ", \"%s\": %.6g", name, value);
	else
		fprintf(out, ", \"%s\": null", name);
}

static void write_detail(const struct gnp_real_row *row, unsigned which, FILE *out)
{
	const struct gnp_real_detail *d = &row->details[which];
	fprintf(out,
	        "    {\"cloud\": \"%s\", \"sampling\": \"%s\", \"kind\": \"%s\", \"method\": \"%s\", \"centres\": %zu, ",
	        row->cloud, row->variant, gnp_real_hardness_name(row->hardness), gnp_real_detail_name(which), d->centres);
	fprintf(out, "\"near\": %zu, \"flagged\": %zu, \"found\": %zu, \"far\": %zu", d->near, d->flagged, d->found,
	        d->far);
	write_number("rms", d->angle, out);
	write_number("mean_curvature", d->mean_curvature, out);
	write_number("gaussian_curvature", d->gaussian_curvature, out);
	fprintf(out, ", \"normals_within_1\": %zu, \"normals_within_2\": %zu, \"mean_curvature_within_1\": %zu, ",
	        d->normals_within[0], d->normals_within[1], d->curvature_within[0]);
	fprintf(out, "\"mean_curvature_within_2\": %zu}", d->curvature_within[1]);
}

void gnp_real_extra_write_json(const struct gnp_real_table *table, FILE *out)
{
	const char *between = "\n";
	fputs("  \"details\": [", out);
	for (size_t r = 0; r < table->row_count; r++)
		for (unsigned d = 0; d < GNP_REAL_DETAILS; d++) {
			if (table->rows[r].details[d].centres == 0)
				continue;
			fputs(between, out);
			write_detail(&table->rows[r], d, out);
			between = ",\n";
		}
	fputs("],\n  \"filter\": [", out);
	for (size_t f = 0; f < table->filter_count; f++) {
		const struct gnp_real_filter_row *row = &table->filters[f];
		fprintf(out,
		        "%s    {\"cloud\": \"%s\", \"sampling\": \"%s\", \"planted\": %g, \"good\": %zu, \"dropped\": %zu, ",
		        f ? ",\n" : "\n", row->cloud, row->variant, row->planted, row->filtered.good, row->filtered.dropped);
		fprintf(out, "\"outliers\": %zu, \"found\": %zu}", row->filtered.outliers, row->filtered.found);
	}
	fputs("],\n", out);
}
