#include "weights/validate/pde/pde_real_write.h"

#include <math.h>

#include "core/operators/laplacian.h"

struct style {
	const char *begin, *between, *end;
};

static const struct style plain = {"", "  ", ""}, bars = {"| ", " | ", " |"};

/* In per cent. */
static void write_error(double error, const struct style *style, FILE *out)
{
	fputs(style->between, out);
	if (isnan(error))
		fprintf(out, "%6s", "-");
	else
		fprintf(out, "%6.2f", 100 * error);
}

static const char *took(const struct gnp_pde_judged *judged)
{
	return judged->chosen.system == GNP_SYSTEM_SQUARE ? "square" : "symmetric";
}

/* ---- Meshes ---- */

static void write_mesh_head(const struct style *style, FILE *out)
{
	static const char *const columns[] = {"normals",   "auto took", "pieces", "median",    "worst", "its median",
	                                      "its worst", "Poisson",   "its",    "distances", "worst", "area"};
	fprintf(out, "%s%-15s%s%6s", style->begin, "vertices of", style->between, "points");
	for (size_t i = 0; i < sizeof columns / sizeof *columns; i++)
		fprintf(out, "%s%6s", style->between, columns[i]);
	fprintf(out, "%s\n", style->end);
	if (style == &bars)
		fputs("| --- | ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
		      out);
}

static void write_mesh(const struct gnp_pde_real_row *row, enum gnp_pde_side side, const struct style *style,
                       FILE *out)
{
	const struct gnp_pde_judged *judged = &row->judged[side];
	fprintf(out, "%s%-15s%s%6zu%s%-5s%s%-9s%s%zu of %zu", style->begin, row->name, style->between, row->points,
	        style->between, side == GNP_PDE_OWN ? "own" : "given", style->between, took(judged), style->between,
	        judged->chosen.pieces, row->pieces);
	const double errors[] = {judged->chosen.median,   judged->chosen.worst,   judged->symmetric.median,
	                         judged->symmetric.worst, judged->chosen.poisson, judged->symmetric.poisson,
	                         judged->distance,        judged->distance_worst, judged->area - 1};
	for (size_t i = 0; i < sizeof errors / sizeof *errors; i++)
		write_error(errors[i], style, out);
	fprintf(out, "%s\n", style->end);
}

/* ---- Exact surfaces ---- */

static void write_exact_head(const struct style *style, FILE *out)
{
	static const char *const columns[] = {"auto took", "median", "worst",     "its median", "its worst",
	                                      "Poisson",   "its",    "heat",      "its",        "fixed rim",
	                                      "its",       "worst value", "its", "distances", "worst", "area"};
	fprintf(out, "%s%-11s%s%-23s%s%6s", style->begin, "surface", style->between, "points are", style->between,
	        "points");
	for (size_t i = 0; i < sizeof columns / sizeof *columns; i++)
		fprintf(out, "%s%6s", style->between, columns[i]);
	fprintf(out, "%s\n", style->end);
	if (style == &bars)
		fputs("| --- | --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: "
		      "| ---: | ---: | ---: | ---: |\n",
		      out);
}

static void write_exact(const struct gnp_pde_real_row *row, const struct style *style, FILE *out)
{
	const struct gnp_pde_judged *judged = &row->judged[GNP_PDE_OWN];
	fprintf(out, "%s%-11s%s%-23s%s%6zu%s%-9s", style->begin, row->name, style->between, row->variant, style->between,
	        row->points, style->between, took(judged));
	const double errors[] = {
		judged->chosen.median,    judged->chosen.worst,        judged->symmetric.median, judged->symmetric.worst,
		judged->chosen.poisson,   judged->symmetric.poisson,   judged->chosen.heat,      judged->symmetric.heat,
		judged->chosen.dirichlet, judged->symmetric.dirichlet, judged->chosen.dirichlet_worst,
		judged->symmetric.dirichlet_worst, judged->distance, judged->distance_worst,
		judged->area - 1};
	for (size_t i = 0; i < sizeof errors / sizeof *errors; i++)
		write_error(errors[i], style, out);
	fprintf(out, "%s\n", style->end);
}

/* ---- The whole ---- */

static size_t count_rows(const struct gnp_pde_real_table *table, enum gnp_pde_section section)
{
	size_t count = 0;
	for (size_t i = 0; i < table->row_count; i++)
		count += table->rows[i].section == section;
	return count;
}

static void write_section(const struct gnp_pde_real_table *table, enum gnp_pde_section section,
                          const struct style *style, FILE *out)
{
	if (section == GNP_PDE_EXACT)
		write_exact_head(style, out);
	else
		write_mesh_head(style, out);
	for (size_t i = 0; i < table->row_count; i++) {
		const struct gnp_pde_real_row *row = &table->rows[i];
		if (row->section != section)
			continue;
		if (section == GNP_PDE_EXACT)
			write_exact(row, style, out);
		for (int side = 0; section != GNP_PDE_EXACT && side < GNP_PDE_SIDES; side++)
			write_mesh(row, (enum gnp_pde_side)side, style, out);
	}
}

static void write_failures(const struct gnp_pde_real_table *table, FILE *out)
{
	for (size_t i = 0; i < table->row_count; i++)
		for (int side = 0; side < GNP_PDE_SIDES; side++)
			if (table->rows[i].judged[side].failure[0])
				fprintf(out, "- %s, %s, %s normals: %s\n", table->rows[i].name, table->rows[i].variant,
				        side == GNP_PDE_OWN ? "own" : "given", table->rows[i].judged[side].failure);
}

void gnp_pde_real_write_text(const struct gnp_pde_real_table *table, FILE *out)
{
	fputs("equations on real and exact surfaces: relative errors in per cent\n", out);
	for (unsigned section = 0; section < GNP_PDE_SECTIONS; section++) {
		if (!count_rows(table, (enum gnp_pde_section)section))
			continue;
		fprintf(out, "\n%s\n", gnp_pde_section_name(section));
		write_section(table, (enum gnp_pde_section)section, &plain, out);
	}
	write_failures(table, out);
}

/* What the table's judge aims at, and how many clouds are there: by default, points alone. */
static void write_aims(const struct gnp_pde_real_table *table, enum gnp_pde_section section, FILE *out)
{
	size_t clouds = 0, values = 0, poisson = 0, distances = 0;
	for (size_t i = 0; i < table->row_count; i++) {
		const struct gnp_pde_real_row *row = &table->rows[i];
		const struct gnp_pde_judged *judged = &row->judged[GNP_PDE_OWN];
		bool detailed = row->points >= 8000;
		if (row->section != section)
			continue;
		clouds++;
		values += judged->chosen.median <= (detailed ? 0.03 : 0.1) && judged->chosen.worst <= (detailed ? 0.15 : 0.3);
		poisson += judged->chosen.poisson <= 0.05;
		distances += judged->distance <= 0.03;
	}
	fprintf(out,
	        "\nBy default and from points alone, of %zu clouds %zu have eigenvalues within 3 %% at the median and 15 %%\n"
	        "at worst (10 %% and 30 %% below 8,000 points), %zu Poisson's equation within 5 %%, and %zu distances within\n"
	        "3 %% on average.\n",
	        clouds, values, poisson, distances);
}

static void write_doubts(const struct gnp_pde_real_table *table, FILE *out)
{
	double least = INFINITY, most = 0;
	for (size_t i = 0; i < table->row_count; i++)
		if (table->rows[i].section != GNP_PDE_EXACT) {
			least = fmin(least, table->rows[i].doubt);
			most = fmax(most, table->rows[i].doubt);
		}
	fprintf(out,
	        "Distances are shortest paths over eight points on an edge; by what changes from four, they are %.2f to\n"
	        "%.2f %% too long.\n",
	        100 * least, 100 * most);
}

static const char intro[] =
	"# Equations on real and exact surfaces\n\n"
	"Written by `make validate-pde-real`; errors in per cent, relative. `auto took` says which operator `system=auto`\n"
	"solved Poisson's equation with; columns `its` are of `system=symmetric`. Eigenvalues are the lowest but zero,\n"
	"and `pieces` says how many are zero, of how many that should be. Poisson is L2 of u without its mean; distances\n"
	"are by `geodesic` from three points, mean and worst over points three spacings away and farther; area is what\n"
	"the cells' sum is off. Normals are estimated from the points (`own`, the default) or come with them (`given`: the\n"
	"means of the triangles' about each vertex), which settles the sides and what edges part.\n\n";

static const char meshes[] =
	"The truth is of the mesh's own triangles, which the library does not see: cotangents with a third of each\n"
	"triangle as masses, 20 eigenvalues; f is three bells of both signs. Vertices at one place are one; triangles\n"
	"without area are left out, those given twice count once, pieces of less than a hundredth of the vertices are left\n"
	"out, and an edge of three triangles or more is taken as it is.\n";

void gnp_pde_real_write_markdown(const struct gnp_pde_real_table *table, FILE *out)
{
	static const char *const titles[GNP_PDE_SECTIONS] = {"Vertices of closed meshes", "Vertices of meshes with rims",
	                                                     "Exact surfaces"};
	fputs(intro, out);
	fputs(meshes, out);
	write_doubts(table, out);
	if (table->plan.meshes.only)
		fprintf(out, "Here are %s alone.\n", table->plan.meshes.only);
	for (unsigned s = 0; s < GNP_PDE_SECTIONS; s++) {
		enum gnp_pde_section section = (enum gnp_pde_section)s;
		if (!count_rows(table, section))
			continue;
		fprintf(out, "\n## %s\n", titles[section]);
		if (section == GNP_PDE_EXACT)
			fputs("20 eigenvalues, of spheres 24; heat is that of an eigenfunction when it has fallen to 1 / e, in\n"
			      "400 steps; `fixed rim` is Poisson's equation with u given there, `worst value` the\n"
			      "worst eigenvalue of functions that are zero there. Points lie on rims unless said.\n\n",
			      out);
		else
			fputs("\n", out);
		write_section(table, section, &bars, out);
		if (section != GNP_PDE_EXACT)
			write_aims(table, section, out);
	}
	write_failures(table, out);
}
