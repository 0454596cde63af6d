/* The real table as text and as Markdown: a summary a section, then every cloud. */
#include <math.h>
#include <string.h>

#include "weights/validate/real_extra.h"

/* Rows as text with columns, or as Markdown with bars. */
struct style {
	const char *begin, *between, *end;
};
static const struct style plain = {"", "  ", ""}, bars = {"| ", " | ", " |"};

static bool is_whole(const struct gnp_real_table *table, size_t method)
{
	return table->methods[method].part == GNP_ABLATION_NONE;
}

static size_t rows_of(const struct gnp_real_table *table, enum gnp_real_section section)
{
	size_t rows = 0;
	for (size_t r = 0; r < table->row_count; r++)
		rows += table->rows[r].section == section;
	return rows;
}

static void write_rule(const struct style *style, size_t words, size_t numbers, FILE *out)
{
	if (style != &bars)
		return;
	fputc('|', out);
	for (size_t i = 0; i < words + numbers; i++)
		fputs(i < words ? " --- |" : " ---: |", out);
	fputc('\n', out);
}

static void write_angle(double degrees, FILE *out)
{
	if (isnan(degrees))
		fprintf(out, "%6s", "-");
	else
		fprintf(out, "%6.2f", degrees);
}

static void write_share(double share, FILE *out)
{
	if (isnan(share))
		fprintf(out, "%6s", "-");
	else
		fprintf(out, "%6.1f", 100 * share);
}

/* ---- Summaries ---- */

static void write_summary_row(const struct gnp_real_table *table, enum gnp_real_section section, size_t method,
                              const struct style *style, FILE *out)
{
	const struct gnp_real_summary sum = gnp_real_table_summary(table, section, method);
	fprintf(out, "%s%-12s", style->begin, table->methods[method].name);
	fprintf(out, "%s%6.3f%s%6.1f%s%6.2f%s", style->between, sum.ratio, style->between, 100 * sum.best, style->between,
	        sum.worst, style->between);
	write_angle(sum.mean, out);
	for (int limit = 0; limit < GNP_REAL_WITHIN; limit++) {
		fputs(style->between, out);
		write_share(sum.within[limit], out);
	}
	fputs(style->between, out);
	write_share(sum.least, out);
	fputs(style->between, out);
	write_share(sum.sided, out);
	fprintf(out, "%s\n", style->end);
}

static void write_summary(const struct gnp_real_table *table, enum gnp_real_section section, const struct style *style,
                          FILE *out)
{
	static const char *const heads[] = {"to PCA", "best %", "worst", "angle", "< 5", "< 10", "< 15", "least", "side"};
	enum { HEADS = sizeof heads / sizeof heads[0] };
	fprintf(out, "%s%-12s", style->begin, "");
	for (size_t i = 0; i < HEADS; i++)
		fprintf(out, "%s%6s", style->between, heads[i]);
	fprintf(out, "%s\n", style->end);
	write_rule(style, 1, HEADS, out);
	for (size_t c = 0; c < table->method_count; c++)
		if (is_whole(table, c))
			write_summary_row(table, section, c, style, out);
	fputc('\n', out);
}

/* ---- Clouds ---- */

static void write_cloud(const struct gnp_real_table *table, const struct gnp_real_row *row, const struct style *style,
                        FILE *out)
{
	fprintf(out, "%s%-18s%s%-18s%s%7zu", style->begin, row->cloud, style->between, row->variant, style->between,
	        row->points);
	for (size_t c = 0; c < table->method_count; c++) {
		if (!is_whole(table, c))
			continue;
		size_t variant = gnp_real_table_variant(table, row, c);
		char text[32];
		int length = snprintf(text, sizeof text, "%.2f", gnp_real_table_figure(row, c, variant));
		if (table->methods[c].k)
			snprintf(text + length, sizeof text - (size_t)length, " (%u)", table->methods[c].k[variant]);
		fprintf(out, "%s%11s", style->between, text);
	}
	fprintf(out, "%s\n", style->end);
}

static void write_clouds(const struct gnp_real_table *table, enum gnp_real_section section, const struct style *style,
                         FILE *out)
{
	size_t columns = 1;
	fprintf(out, "%s%-18s%s%-18s%s%7s", style->begin, "cloud", style->between, "sampling", style->between, "points");
	for (size_t c = 0; c < table->method_count; c++)
		if (is_whole(table, c)) {
			fprintf(out, "%s%11s", style->between, table->methods[c].name);
			columns++;
		}
	fprintf(out, "%s\n", style->end);
	write_rule(style, 2, columns, out);
	for (size_t r = 0; r < table->row_count; r++)
		if (table->rows[r].section == section)
			write_cloud(table, &table->rows[r], style, out);
	fputc('\n', out);
}

static void write_curvature(double error, const struct style *style, FILE *out)
{
	if (isnan(error))
		fprintf(out, "%s%11s", style->between, "-");
	else
		fprintf(out, "%s%11.2e", style->between, error);
}

/* Errors of mean curvature, where it is known. */
static void write_curvatures(const struct gnp_real_table *table, const struct style *style, FILE *out)
{
	fprintf(out, "%s%-18s%s%-18s", style->begin, "relative error of H", style->between, "sampling");
	size_t columns = 0;
	for (size_t c = 0; c < table->method_count; c++)
		if (is_whole(table, c) && table->methods[c].kind == GNP_REAL_ESTIMATOR) {
			fprintf(out, "%s%11s", style->between, table->methods[c].name);
			columns++;
		}
	fprintf(out, "%s\n", style->end);
	write_rule(style, 2, columns, out);
	for (size_t r = 0; r < table->row_count; r++) {
		if (table->rows[r].section != GNP_REAL_BODIES)
			continue;
		fprintf(out, "%s%-18s%s%-18s", style->begin, table->rows[r].cloud, style->between, table->rows[r].variant);
		for (size_t c = 0; c < table->method_count; c++)
			if (is_whole(table, c) && table->methods[c].kind == GNP_REAL_ESTIMATOR)
				write_curvature(table->rows[r].scores[c][0].curvature, style, out);
		fprintf(out, "%s\n", style->end);
	}
	fputc('\n', out);
}

static void write_seconds(const struct gnp_real_table *table, const struct style *style, FILE *out)
{
	fprintf(out, "%s%-12s%s%8s%s\n", style->begin, "", style->between, "seconds", style->end);
	write_rule(style, 1, 1, out);
	for (size_t c = 0; c < table->method_count; c++)
		if (is_whole(table, c))
			fprintf(out, "%s%-12s%s%8.1f%s\n", style->begin, table->methods[c].name, style->between,
			        table->seconds[c], style->end);
	fputc('\n', out);
}

/* ---- Ablation ---- */

/* The mean over the section's rows of a method's figure over that of the whole one of its name. */
static double ratio_to_whole(const struct gnp_real_table *table, enum gnp_real_section section, size_t method)
{
	size_t whole = gnp_real_table_find(table, table->methods[method].name), rows = 0;
	double sum = 0;
	for (size_t r = 0; r < table->row_count; r++)
		if (table->rows[r].section == section) {
			const struct gnp_real_row *row = &table->rows[r];
			sum += gnp_real_table_best(table, row, method) / gnp_real_table_best(table, row, whole);
			rows++;
		}
	return sum / (double)rows;
}

/* The method of a whole one's name with a part taken away; method_count where its model has no such part. */
static size_t find_part(const struct gnp_real_table *table, size_t whole, unsigned part)
{
	size_t c = 0;
	while (c < table->method_count && !(table->methods[c].part == (enum gnp_ablation_part)part &&
	                                    strcmp(table->methods[c].name, table->methods[whole].name) == 0))
		c++;
	return c;
}

static void write_part(const struct gnp_real_table *table, size_t whole, unsigned part, const struct style *style,
                       FILE *out)
{
	size_t altered = find_part(table, whole, part);
	fprintf(out, "%s%-16s%s%-18s", style->begin, table->methods[whole].name, style->between, gnp_ablation_name(part));
	for (int s = 0; s < GNP_REAL_SECTIONS; s++)
		if (altered < table->method_count && rows_of(table, (enum gnp_real_section)s) > 0)
			fprintf(out, "%s%8.3f", style->between, ratio_to_whole(table, (enum gnp_real_section)s, altered));
		else
			fprintf(out, "%s%8s", style->between, "-");
	fprintf(out, "%s\n", style->end);
}

static bool has_model(const struct gnp_real_table *table, size_t method)
{
	return is_whole(table, method) && table->methods[method].model;
}

static void write_ablation(const struct gnp_real_table *table, const struct style *style, FILE *out)
{
	fprintf(out, "%s%-16s%s%-18s", style->begin, "model", style->between, "part");
	for (int s = 0; s < GNP_REAL_SECTIONS; s++)
		fprintf(out, "%s%8s", style->between, gnp_real_section_name((unsigned)s));
	fprintf(out, "%s\n", style->end);
	write_rule(style, 2, GNP_REAL_SECTIONS, out);
	for (size_t c = 0; c < table->method_count; c++)
		for (unsigned part = GNP_ABLATION_NONE + 1; part < GNP_ABLATION_PARTS && has_model(table, c); part++)
			write_part(table, c, part, style, out);
	fputc('\n', out);
}

/* Which files the models were. */
static void write_weights(const struct gnp_real_table *table, FILE *out)
{
	fputs("## Weights\n", out);
	for (size_t c = 0; c < table->method_count; c++)
		if (is_whole(table, c) && table->methods[c].model)
			fprintf(out, "- %s: sha256 %s\n", table->methods[c].name, table->methods[c].model->sha256);
}

/* ---- Whole ---- */

void gnp_real_table_write_text(const struct gnp_real_table *table, FILE *out)
{
	for (int s = 0; s < GNP_REAL_SECTIONS; s++) {
		enum gnp_real_section section = (enum gnp_real_section)s;
		if (rows_of(table, section) == 0)
			continue;
		fprintf(out, "%s (%zu clouds)\n", gnp_real_section_title(section), rows_of(table, section));
		write_summary(table, section, &plain, out);
		write_clouds(table, section, &plain, out);
	}
	if (rows_of(table, GNP_REAL_BODIES) > 0)
		write_curvatures(table, &plain, out);
	gnp_real_extra_write_text(table, out);
	if (table->plan.ablate)
		write_ablation(table, &plain, out);
	write_seconds(table, &plain, out);
}

static void write_meshes(const struct gnp_real_table *table, FILE *out)
{
	if (table->mesh_count == 0)
		return;
	fprintf(out, "%s (`deploy/fetch-meshes.sh`), with their triangles:\n",
	        table->plan.tune ? "The meshes for decisions in training" : "The meshes that judge and are not trained on");
	for (size_t i = 0; i < table->mesh_count; i++)
		fprintf(out, "%s%s %zu%s",
		        i > 0 && i % 6 == 0 ? "\n"
		        : i > 0             ? " "
		                            : "",
		        table->meshes[i].name, table->meshes[i].triangles, i + 1 < table->mesh_count ? "," : ".\n\n");
}

static void write_introduction(const struct gnp_real_table *table, FILE *out)
{
	fputs("# Real surfaces\n\nWritten by `make validate-real`: normals of clouds without given ones, on surfaces\n"
	      "that nobody made for us. ", out);
	if (table->plan.centres > 0)
		fprintf(out, "Judged are %zu points a cloud, drawn by seeds of validation.\n", table->plan.centres);
	else
		fputs("Judged are all points.\n", out);
	fputs("Angles are in degrees between lines, so that sides do not count; root mean squares, of vertices medians.\n"
	      "What gives no normal counts as 90. `gnp` is the default, one model for every cloud; then those of the\n"
	      "regimes by name, our estimators without weights, plain PCA, and programs of others (`tests/peers`). In\n"
	      "parentheses: the neighbours taken, the point itself included; of 10, 18, 30, 50 and 112 the best for\n"
	      "each cloud counts, which nobody knows beforehand.\n\n"
	      "Summaries: `to PCA` is the mean ratio to the best PCA; `best %` the share of clouds on which nobody else\n"
	      "is better; `worst` the largest ratio to the best of the others; `angle` the mean figure; `< 5`, `< 10`,\n"
	      "`< 15` the shares of points within so many degrees; `least` the smallest share within 15 on any cloud;\n"
	      "`side` the share of normals on the truth's side. Ratios take no angle for less than a tenth of a\n"
	      "degree.\n\n",
	      out);
	if (table->plan.points != gnp_real_plan_full().points)
		fprintf(out, "Written with `--points %zu`: the samples on triangles; PCPNet's protocol has 100,000.\n\n",
		        table->plan.points);
	write_meshes(table, out);
}

static const char *const notes[GNP_REAL_SECTIONS] = {
	[GNP_REAL_SAMPLES] =
		"PCPNet's protocol: points drawn on the triangles by area, isotropic Gaussian noise in per cent of the\n"
		"bounding box's diagonal; stripes: twenty across the longest side, every other one with a tenth of the\n"
		"density; gradient: the density falls to a tenth. The truth is the triangle's normal.\n",
	[GNP_REAL_VERTICES] =
		"The truth is the mean of the triangles' normals about a vertex, weighed by area; figures are medians.\n",
	[GNP_REAL_BODIES] =
		"Smooth surfaces, and a body of each kind with creases, rims, thin sheets, tips or rough detail\n"
		"(`core/solids/solid.h`), of which points within a spacing of creases, rims and tips are not judged, but\n"
		"where \"edges too\" is said. Noise in mean spacings, isotropic. The truth of facets is the triangle's\n"
		"normal.\n",
	[GNP_REAL_SCANS] =
		"Rows are 8 times as far apart as points in a row; noise in spacings within a row. The lidar has 32\n"
		"beams; noise along the beam.\n",
};

void gnp_real_table_write_markdown(const struct gnp_real_table *table, FILE *out)
{
	write_introduction(table, out);
	for (int s = 0; s < GNP_REAL_SECTIONS; s++) {
		enum gnp_real_section section = (enum gnp_real_section)s;
		if (rows_of(table, section) == 0)
			continue;
		fprintf(out, "## %s\n%zu clouds. %s\n", gnp_real_section_title(section), rows_of(table, section), notes[s]);
		write_summary(table, section, &bars, out);
		write_clouds(table, section, &bars, out);
		if (section == GNP_REAL_BODIES)
			write_curvatures(table, &bars, out);
	}
	gnp_real_extra_write_markdown(table, out);
	if (table->plan.ablate) {
		fputs("## Ablation\nThe mean ratio of the figures to those of the whole model; 1: the part does nothing; -:\n"
		      "the model has none.\n",
		      out);
		for (unsigned part = GNP_ABLATION_NONE + 1; part < GNP_ABLATION_PARTS; part++)
			fprintf(out, "%s: %s. ", gnp_ablation_name(part), gnp_ablation_help(part));
		fputs("\n\n", out);
		write_ablation(table, &bars, out);
	}
	fprintf(out,
	        "## Seconds\nOver all clouds, at the points judged alone where a program can; orientation and the search\n"
	        "of neighbours included. The whole table took %.0f s.\n\n",
	        table->wall);
	write_seconds(table, &bars, out);
	write_weights(table, out);
}
