#include "weights/validate/real_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[GNP_REAL_SECTIONS] = {"samples", "vertices", "bodies", "scans"};
static const char *const titles[GNP_REAL_SECTIONS] = {"Samples on the triangles of meshes", "Vertices of meshes",
                                                      "Exact bodies and open patches",
                                                      "Scan lines and a spinning lidar"};
static const double ANGLE_LEAST = 0.1; /* degrees; smaller ones are equal */

const char *gnp_real_section_name(unsigned section)
{
	return section < GNP_REAL_SECTIONS ? names[section] : NULL;
}

const char *gnp_real_section_title(enum gnp_real_section section)
{
	return titles[section];
}

const char *gnp_real_detail_name(unsigned which)
{
	static const char *const of[GNP_REAL_DETAILS] = {"gnp", "adaptive"};
	return of[which];
}

const char *gnp_real_hardness_name(enum gnp_real_hardness hardness)
{
	static const char *const of[GNP_REAL_HARDNESSES] = {"smooth", "edges", "noise", "uneven"};
	return of[hardness];
}

struct gnp_real_plan gnp_real_plan_full(void)
{
	return (struct gnp_real_plan){.points = 100000, .centres = 5000, .sections = (1u << GNP_REAL_SECTIONS) - 1};
}

struct gnp_real_plan gnp_real_plan_quick(void)
{
	return (struct gnp_real_plan){.points = 20000, .centres = 500, .sections = (1u << GNP_REAL_SECTIONS) - 1};
}

void gnp_real_table_clear(struct gnp_real_table *table)
{
	free(table->rows);
	free(table->meshes);
	free(table->filters);
	table->rows = NULL;
	table->meshes = NULL;
	table->filters = NULL;
	table->row_count = table->mesh_count = table->filter_count = 0;
}

struct gnp_real_row *gnp_real_table_add(struct gnp_real_table *table)
{
	struct gnp_real_row *rows = realloc(table->rows, (table->row_count + 1) * sizeof *rows);
	if (!rows)
		return NULL;
	table->rows = rows;
	struct gnp_real_row *row = &rows[table->row_count++];
	memset(row, 0, sizeof *row);
	for (size_t c = 0; c < GNP_REAL_METHODS_MAX; c++)
		for (size_t v = 0; v < GNP_REAL_VARIANTS; v++)
			row->scores[c][v] = gnp_real_score_none();
	return row;
}

struct gnp_real_mesh_fact *gnp_real_table_add_mesh(struct gnp_real_table *table)
{
	struct gnp_real_mesh_fact *meshes = realloc(table->meshes, (table->mesh_count + 1) * sizeof *meshes);
	if (!meshes)
		return NULL;
	table->meshes = meshes;
	memset(&meshes[table->mesh_count], 0, sizeof *meshes);
	return &meshes[table->mesh_count++];
}

struct gnp_real_filter_row *gnp_real_table_add_filter(struct gnp_real_table *table)
{
	struct gnp_real_filter_row *filters = realloc(table->filters, (table->filter_count + 1) * sizeof *filters);
	if (!filters)
		return NULL;
	table->filters = filters;
	memset(&filters[table->filter_count], 0, sizeof *filters);
	return &filters[table->filter_count++];
}

/* ---- Figures ---- */

double gnp_real_table_figure(const struct gnp_real_row *row, size_t method, size_t variant)
{
	const struct gnp_real_score *score = &row->scores[method][variant];
	return row->section == GNP_REAL_VERTICES ? score->median : score->rms;
}

size_t gnp_real_table_variant(const struct gnp_real_table *table, const struct gnp_real_row *row, size_t method)
{
	size_t best = 0;
	for (size_t v = 1; v < table->methods[method].variants; v++)
		if (gnp_real_table_figure(row, method, v) < gnp_real_table_figure(row, method, best))
			best = v;
	return best;
}

const struct gnp_real_score *gnp_real_table_score(const struct gnp_real_table *table, const struct gnp_real_row *row,
                                                  size_t method)
{
	return &row->scores[method][gnp_real_table_variant(table, row, method)];
}

size_t gnp_real_table_find(const struct gnp_real_table *table, const char *name)
{
	size_t c = 0;
	while (c < table->method_count && strcmp(table->methods[c].name, name) != 0)
		c++;
	return c;
}

double gnp_real_table_best(const struct gnp_real_table *table, const struct gnp_real_row *row, size_t method)
{
	return fmax(gnp_real_table_figure(row, method, gnp_real_table_variant(table, row, method)), ANGLE_LEAST);
}

/* The smallest figure of the others. */
static double best_other(const struct gnp_real_table *table, const struct gnp_real_row *row, size_t method)
{
	double best = INFINITY;
	for (size_t c = 0; c < table->method_count; c++)
		if (c != method && table->methods[c].part == GNP_ABLATION_NONE)
			best = fmin(best, gnp_real_table_best(table, row, c));
	return best;
}

static void add_row(const struct gnp_real_table *table, const struct gnp_real_row *row, size_t method, size_t pca,
                    struct gnp_real_summary *sum)
{
	const struct gnp_real_score *score = gnp_real_table_score(table, row, method);
	double own = gnp_real_table_best(table, row, method), other = best_other(table, row, method);
	sum->rows++;
	sum->ratio += pca < table->method_count ? own / gnp_real_table_best(table, row, pca) : NAN;
	sum->best += own <= other;
	sum->worst = fmax(sum->worst, own / other);
	sum->mean += own;
	for (int limit = 0; limit < GNP_REAL_WITHIN; limit++)
		sum->within[limit] += score->within[limit];
	sum->least = fmin(sum->least, score->within[GNP_REAL_WITHIN - 1]);
	sum->sided += score->sided;
}

struct gnp_real_summary gnp_real_table_summary(const struct gnp_real_table *table, enum gnp_real_section section,
                                               size_t method)
{
	struct gnp_real_summary sum = {.least = 1};
	size_t pca = gnp_real_table_find(table, "pca");
	for (size_t r = 0; r < table->row_count; r++)
		if (table->rows[r].section == section)
			add_row(table, &table->rows[r], method, pca, &sum);
	sum.ratio /= (double)sum.rows;
	sum.best /= (double)sum.rows;
	sum.mean /= (double)sum.rows;
	for (int limit = 0; limit < GNP_REAL_WITHIN; limit++)
		sum.within[limit] /= (double)sum.rows;
	sum.sided /= (double)sum.rows;
	return sum;
}
