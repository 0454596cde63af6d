#include "weights/validate/pde/pde_table_write.h"

#include <math.h>

#include "weights/validate/pde/pde_truth.h"

/* Rows as text with columns, or as Markdown with bars. */
struct style {
	const char *begin, *between, *end;
};

static void write_number(double error, FILE *out)
{
	if (isnan(error))
		fprintf(out, "%8s", "-");
	else
		fprintf(out, "%8.2e", error);
}

static void write_row(const struct gnp_pde_table *table, enum gnp_regime regime, unsigned e, unsigned s,
                      const struct style *style, FILE *out)
{
	double prepare = 0, solve = 0;
	fprintf(out,
	        "%s%-10s%s%-8s%s%-13s", style->begin, gnp_regime_info(regime)->name, style->between, gnp_pde_estimator(e), style->between, gnp_pde_system(s));
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++) {
		const struct gnp_pde_cell *cell = &table->cell[shape][regime][e][s];
		fprintf(out, "%s", style->between);
		write_number(cell->error, out);
		prepare += cell->prepare / GNP_PDE_SHAPES;
		solve += cell->solve / GNP_PDE_SHAPES;
	}
	fprintf(out, "%s%7.1f%s%7.3f%s\n", style->between, prepare, style->between, solve, style->end);
}

static void write_printed(enum gnp_regime regime, unsigned e, const struct style *style, FILE *out)
{
	fprintf(out,
	        "%s%-10s%s%-8s%s%-13s", style->begin, gnp_regime_info(regime)->name, style->between, gnp_pde_estimator(e), style->between, "the paper's");
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++) {
		fprintf(out, "%s", style->between);
		write_number(gnp_pde_printed(shape, regime, e), out);
	}
	fprintf(out, "%s%7s%s%7s%s\n", style->between, "", style->between, "", style->end);
}

static void write_along(const struct gnp_pde_table *table, const struct style *style, FILE *out)
{
	fprintf(out, "%s%-10s%s%-8s%s%-13s", style->begin, "noise-70", style->between, "exact", style->between, "square");
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++) {
		fprintf(out, "%s", style->between);
		write_number(table->along[shape], out);
	}
	fprintf(out, "%s%7s%s%7s%s\n", style->between, "", style->between, "", style->end);
}

static void write_rows(const struct gnp_pde_table *table, const struct style *style, FILE *out)
{
	for (int regime = 0; regime < GNP_REGIMES; regime++) {
		for (unsigned e = 0; e < GNP_PDE_ESTIMATORS; e++)
			for (unsigned s = 0; s < GNP_PDE_SYSTEMS; s++)
				write_row(table, (enum gnp_regime)regime, e, s, style, out);
		if (regime == GNP_REGIME_NOISE_70)
			write_along(table, style, out);
		for (unsigned e = 0; e < 2; e++)
			write_printed((enum gnp_regime)regime, e, style, out);
	}
}

static void write_head(const struct style *style, FILE *out)
{
	fprintf(out, "%s%-10s%s%-8s%s%-13s", style->begin, "regime", style->between, "geometry", style->between, "system");
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++)
		fprintf(out, "%s%8s", style->between, gnp_pde_shape(shape));
	fprintf(out, "%s%s%s%s%s\n", style->between, "prepare", style->between, "a solve", style->end);
}

/* The order between a size and the one before, in the spacing, which falls with the root of the number of points. */
static void write_convergence(const struct gnp_pde_table *table, const struct style *style, FILE *out)
{
	for (size_t i = 0; i < GNP_PDE_SIZES && table->sizes[i]; i++) {
		fprintf(out,
		        "%s%8zu%s%.2e%s", style->begin, table->sizes[i], style->between, table->convergence[i], style->between);
		if (i > 0)
			fprintf(out,
			        "%5.1f", 2 * log(table->convergence[i - 1] / table->convergence[i]) / log((double)table->sizes[i] / (double)table->sizes[i - 1]));
		fprintf(out, "%s%.1e", style->between, table->condition[i]);
		fprintf(out, "%s\n", style->end);
	}
}

void gnp_pde_table_write_text(const struct gnp_pde_table *table, FILE *out)
{
	static const struct style plain = {"", "  ", ""};
	fprintf(out,
	        "Laplace-Beltrami PDE, %zu points, %zu solutions: relative L2 error of u; seconds\n", table->points, table->solutions);
	write_head(&plain, out);
	write_rows(table, &plain, out);
	fprintf(out, "\nconvergence, bumpy torus, gnp, square: points, error, order in the spacing, condition\n");
	write_convergence(table, &plain, out);
}

void gnp_pde_table_write_markdown(const struct gnp_pde_table *table, FILE *out)
{
	static const struct style bars = {"| ", " | ", " |"};
	fprintf(out, "# The Laplace-Beltrami PDE: the paper's Table 2\n\n"
	             "Written by `make validate-pde`. Delta u = -f on %zu points, relative L2 error of u without its mean, averaged over %zu solutions u =\n"
	             "U restricted to the surface: U is a Fourier series of period 2 with all modes up to %d in each direction and coefficients\n"
	             "N(0, 1) / |m|^2, so that f, which follows exactly, has the flat spectrum the paper draws f with. The first three shapes are exact\n"
	             "stand-ins for the paper's meshes, the radial manifold stands in for its cow, so that its figures beside ours are of other shapes:\n"
	             "orders of magnitude compare, digits do not. Under outliers and noise points are filtered and projected by `gnp` first, as in the\n"
	             "paper; f stays with its point wherever that is moved. `geometry` says whose normals; functions are fitted with degree 5, of\n"
	             "least squares 4. Seconds are means over the shapes.\n\n"
	             "`exact` under noise is what cannot be helped: the points are moved along the exact surface as the noise moved them, and not\n"
	             "across it, so that only f and u are not where they belong.\n\n",
	        table->points, table->solutions, GNP_PDE_MODES);
	write_head(&bars, out);
	fprintf(out, "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n");
	write_rows(table, &bars, out);
	fprintf(out,
	        "\n## Convergence\nBumpy torus, clean, `gnp`, square; the order is in the spacing; the condition is the largest |eigenvalue| over\nthe smallest but zero.\n\n| points | error | order | condition |\n| ---: | ---: | ---: | ---: |\n");
	write_convergence(table, &bars, out);
}
