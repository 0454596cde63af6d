/* The real table as JSON: every score of every variant, cloud by cloud. */
#include <math.h>

#include "weights/validate/real_extra.h"

static void write_number(const char *name, double value, const char *after, FILE *out)
{
	if (isfinite(value))
		fprintf(out, "\"%s\": %.6g%s", name, value, after);
	else
		fprintf(out, "\"%s\": null%s", name, after);
}

static void write_score(const struct gnp_real_method *method, size_t variant, const struct gnp_real_score *score,
                        FILE *out)
{
	fprintf(out, "      {\"method\": \"%s\", \"part\": \"%s\", ", method->name,
	        gnp_ablation_name(method->part));
	if (method->k)
		fprintf(out, "\"k\": %u, ", method->k[variant]);
	write_number("rms", score->rms, ", ", out);
	write_number("median", score->median, ", ", out);
	write_number("within_5", score->within[0], ", ", out);
	write_number("within_10", score->within[1], ", ", out);
	write_number("within_15", score->within[2], ", ", out);
	write_number("sided", score->sided, ", ", out);
	write_number("mean_curvature", score->curvature, ", ", out);
	fprintf(out, "\"lost\": %zu}", score->lost);
}

static void write_row(const struct gnp_real_table *table, const struct gnp_real_row *row, FILE *out)
{
	const char *between = "\n";
	fprintf(out,
	        "    {\"section\": \"%s\", \"cloud\": \"%s\", \"sampling\": \"%s\", \"points\": %zu, \"centres\": %zu, "
	        "\"scores\": [",
	        gnp_real_section_name(row->section), row->cloud, row->variant, row->points, row->centres);
	for (size_t c = 0; c < table->method_count; c++)
		for (size_t v = 0; v < table->methods[c].variants; v++) {
			fputs(between, out);
			write_score(&table->methods[c], v, &row->scores[c][v], out);
			between = ",\n";
		}
	fputs("]}", out);
}

static void write_summary(const struct gnp_real_table *table, enum gnp_real_section section, size_t method,
                          FILE *out)
{
	const struct gnp_real_summary sum = gnp_real_table_summary(table, section, method);
	fprintf(out, "    {\"section\": \"%s\", \"method\": \"%s\", \"part\": \"%s\", \"clouds\": %zu, ",
	        gnp_real_section_name(section), table->methods[method].name,
	        gnp_ablation_name(table->methods[method].part), sum.rows);
	write_number("ratio_to_pca", sum.ratio, ", ", out);
	write_number("best_share", sum.best, ", ", out);
	write_number("worst_ratio", sum.worst, ", ", out);
	write_number("mean_angle", sum.mean, ", ", out);
	write_number("least_within_15", sum.least, ", ", out);
	write_number("seconds_in_all", table->seconds[method], "}", out);
}

void gnp_real_table_write_json(const struct gnp_real_table *table, FILE *out)
{
	const char *between = "\n";
	fprintf(out, "{\n  \"points\": %zu, \"centres\": %zu, \"tune\": %s,\n", table->plan.points, table->plan.centres,
	        table->plan.tune ? "true" : "false");
	fprintf(out, "  \"seconds\": %.1f,\n  \"summary\": [", table->wall);
	for (unsigned s = 0; s < GNP_REAL_SECTIONS; s++)
		for (size_t c = 0; c < table->method_count; c++) {
			fputs(between, out);
			write_summary(table, (enum gnp_real_section)s, c, out);
			between = ",\n";
		}
	fputs("],\n", out);
	gnp_real_extra_write_json(table, out);
	fputs("  \"clouds\": [", out);
	for (size_t r = 0; r < table->row_count; r++) {
		fputs(r ? ",\n" : "\n", out);
		write_row(table, &table->rows[r], out);
	}
	fputs("]\n}\n", out);
}
