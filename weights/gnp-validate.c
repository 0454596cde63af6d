/* gnp-validate: judges every estimator, the learned one with the weights of each regime, by the paper's Table 1, and
 * solutions of the Laplace-Beltrami PDE by its Table 2, and prints them beside what the paper printed. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/options.h"
#include "clients/program.h"
#include "clients/session.h"
#include "weights/validate/ablation_table.h"
#include "weights/validate/pde/pde_real_command.h"
#include "weights/validate/pde/pde_table_write.h"
#include "weights/validate/real_command.h"
#include "weights/validate/table_file.h"
#include "weights/validate/validation.h"
#include "weights/validate/word_list.h"

static const struct gnp_option options[] = {
	{"full", 0, NULL, "the whole protocol: 40 shapes a family, 2,000 centres each (the default)"},
	{"quick", 0, NULL, "4 shapes a family, 500 centres each, without pooled unless it is asked for"},
	{"table", 0, "N", "which of the paper's tables: 1, geometry, or 2, the Laplace-Beltrami PDE (with --quick, "
	                  "--points, --regimes, --markdown); real: normals on meshes and scans; pde-real: equations on "
	                  "meshes and exact surfaces"},
	{"estimators", 0, "LIST", "some of gnp, fit, pooled, gmls, adaptive (all whose weights are loaded)"},
	{"weights-dir", 0, "DIR", "folder of the weights (../share/gnpd/weights beside the program, else ./weights)"},
	{"families", 0, "LIST", "some of radial, toroidal"},
	{"regimes", 0, "LIST", "some of clean-30, clean-50, outlier-50, noise-70"},
	{"shapes", 0, "N", "shapes a family"},
	{"centres", 0, "N", "centres a cloud"},
	{"points", 0, "N", "points a cloud (100000)"},
	{"workers", 0, "N", "threads (as many as there are cores)"},
	{"meshes", 0, "DIR", "tables real and pde-real: folder that deploy/fetch-meshes.sh filled"},
	{"peers", 0, "DIR", "table real: folder of programs of others to judge beside ours (none)"},
	{"sections", 0, "LIST", "table real: some of samples, vertices, bodies, scans; pde-real: closed, open, exact"},
	{"only", 0, "LIST", "tables real and pde-real: these meshes alone"},
	{"tune", 0, NULL, "tables real and pde-real: the meshes for decisions in training instead of those that judge"},
	{"ablate", 0, NULL, "tables 1 and real: each model without its trunk, with a random one, with constant outputs, "
	                    "with node weights of one"},
	{"json", 0, "FILE", "write the table, shape by shape, as JSON"},
	{"markdown", 0, "FILE", "write the table as Markdown"},
	{"help", 0, NULL, "this text"},
};
enum { OPTIONS = sizeof options / sizeof options[0] };

static const char *family_name(unsigned i)
{
	return gnp_family_name((enum gnp_family)i);
}

static const char *regime_name(unsigned i)
{
	const struct gnp_regime_info *info = gnp_regime_info((enum gnp_regime)i);
	return info ? info->name : NULL;
}

static const char *method_name(unsigned i)
{
	const struct gnp_method_info *info = gnp_method_info((enum gnp_method)i);
	return info ? info->name : NULL;
}

struct plan {
	struct gnp_protocol protocol;
	struct gnp_selection selection;
	bool named; /* the methods were: all of them are needed */
	uint64_t workers;
};

static const unsigned QUICK_METHODS =
	1u << GNP_METHOD_GNP | 1u << GNP_METHOD_FIT | 1u << GNP_METHOD_GMLS | 1u << GNP_METHOD_ADAPTIVE;

static gnp_status parse_sizes(const struct gnp_arguments *arguments, struct plan *plan, struct gnp_error *error)
{
	uint64_t table = 1, shapes = plan->protocol.shapes, centres = plan->protocol.centres, points = plan->protocol.points;
	const struct {
		const char *name;
		uint64_t least, most, *value;
	} sizes[] = {{"table", 1, 2, &table},
	             {"shapes", 1, 10000, &shapes},
	             {"centres", 1, 1000000, &centres},
	             {"points", 1000, 10000000, &points},
	             {"workers", 1, 1024, &plan->workers}};
	for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
		gnp_status status = gnp_arguments_integer(arguments, sizes[i].name, sizes[i].least, sizes[i].most, sizes[i].value, error);
		if (status != GNP_OK)
			return status;
	}
	plan->protocol = (struct gnp_protocol){.points = points, .shapes = shapes, .centres = centres};
	return GNP_OK;
}

/* What only the real table knows would be passed over. */
static gnp_status refuse_real(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	static const char *const names[] = {"meshes", "peers", "sections", "only", "tune"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (gnp_arguments_has(arguments, names[i]))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: is of table real or pde-real", names[i]);
	return GNP_OK;
}

static gnp_status parse_plan(const struct gnp_arguments *arguments, struct plan *plan, struct gnp_error *error)
{
	bool quick = gnp_arguments_has(arguments, "quick");
	if (quick && gnp_arguments_has(arguments, "full"))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--quick: given with --full, need one of them");
	unsigned methods = quick ? QUICK_METHODS : (1u << GNP_METHODS) - 1;
	*plan = (struct plan){quick ? gnp_protocol_quick() : gnp_protocol_full(), gnp_selection_all(),
	                      gnp_arguments_has(arguments, "estimators"), 0};
	gnp_status status = refuse_real(arguments, error);
	if (status == GNP_OK)
		status = parse_sizes(arguments, plan, error);
	if (status == GNP_OK)
		status = gnp_word_list_parse(arguments, "estimators", method_name, &methods, error);
	gnp_selection_take(&plan->selection, methods);
	if (status == GNP_OK)
		status = gnp_word_list_parse(arguments, "families", family_name, &plan->selection.families, error);
	if (status == GNP_OK)
		status = gnp_word_list_parse(arguments, "regimes", regime_name, &plan->selection.regimes, error);
	return status;
}

/* Table 1, and where it was asked for that of altered models. */
struct judged {
	struct gnp_table table;
	struct gnp_ablation_table ablation;
	bool ablated;
};

static gnp_status run_plan(const struct plan *plan, struct judged *judged, struct gnp_error *error)
{
	struct gnp_session session;
	gnp_status status = gnp_session_open(&session, (unsigned)plan->workers, error);
	if (status != GNP_OK)
		return status;
	atomic_store(&session.progress.phase, "validate");
	status = gnp_validation_run(&judged->table, session.pool, &session.task, error);
	if (status == GNP_OK && judged->ablated)
		status = gnp_ablation_table_run(&judged->table, session.pool, &session.task, &judged->ablation, error);
	gnp_session_close(&session);
	return status;
}

/* A table of either kind as a file. */
static void write_json(const void *table, FILE *out)
{
	gnp_table_write_json(&((const struct judged *)table)->table, out);
}

static void write_markdown(const void *table, FILE *out)
{
	const struct judged *judged = table;
	gnp_table_write_markdown(&judged->table, out);
	if (judged->ablated)
		gnp_ablation_table_write_markdown(&judged->ablation, out);
}

static void write_pde_markdown(const void *table, FILE *out)
{
	gnp_pde_table_write_markdown(table, out);
}

/* Says what is not judged for want of weights, which is left out unless it was named. */
static void restrict_plan(struct plan *plan, const struct gnp_models *models)
{
	struct gnp_selection wanted = plan->selection;
	struct gnp_row row;
	if (plan->named)
		return;
	gnp_selection_restrict(&plan->selection, models);
	wanted.families &= ~(wanted.families - 1); /* weights serve all families alike */
	for (bool more = gnp_selection_next(&wanted, NULL, &row); more; more = gnp_selection_next(&wanted, &row, &row))
		if (!gnp_selection_has(&plan->selection, &row)) {
			const struct gnp_model *model;
			struct gnp_error why = {0};
			gnp_method_model(row.method, row.regime, models, &model, &why);
			fprintf(stderr, "gnp-validate: without %s\n", why.text);
		}
}

/* The table for a plan, still empty. */
static gnp_status open_table(const struct gnp_arguments *arguments, struct plan *plan, struct gnp_table *table,
                             struct gnp_error *error)
{
	struct gnp_models *models;
	gnp_status status = gnp_models_load(gnp_arguments_get(arguments, "weights-dir", NULL), &models, error);
	if (status != GNP_OK)
		return status;
	restrict_plan(plan, models);
	status = gnp_table_create(&plan->protocol, &plan->selection, models, table, error);
	gnp_models_release(models);
	return status;
}

/* ---- Table 2 ---- */

static gnp_status parse_pde_plan(const struct gnp_arguments *arguments, struct gnp_pde_plan *plan, uint64_t *workers, struct gnp_error *error)
{
	static const char *const other[] = {"estimators", "families", "shapes", "centres", "json", "ablate"};
	*plan = gnp_arguments_has(arguments, "quick") ? gnp_pde_plan_quick() : gnp_pde_plan_full();
	uint64_t points = plan->points;
	for (size_t i = 0; i < sizeof other / sizeof *other; i++)
		if (gnp_arguments_has(arguments, other[i]))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: is of table 1", other[i]);
	gnp_status status = refuse_real(arguments, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "points", 1000, 10000000, &points, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "workers", 1, 1024, workers, error);
	plan->points = points;
	return status == GNP_OK ? gnp_word_list_parse(arguments, "regimes", regime_name, &plan->regimes, error) : status;
}

static enum gnp_exit validate_pde(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_pde_plan plan;
	struct gnp_pde_table table;
	struct gnp_models *models = NULL;
	struct gnp_session session;
	uint64_t workers = 0;
	if (parse_pde_plan(arguments, &plan, &workers, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = gnp_models_load(gnp_arguments_get(arguments, "weights-dir", NULL), &models, error);
	if (status == GNP_OK)
		status = gnp_session_open(&session, (unsigned)workers, error);
	if (status == GNP_OK) {
		atomic_store(&session.progress.phase, "validate");
		status = gnp_pde_table_run(&plan, models, session.pool, &session.task, stderr, &table, error);
		gnp_session_close(&session);
	}
	gnp_models_release(models);
	if (status == GNP_OK)
		gnp_pde_table_write_text(&table, stdout);
	if (status == GNP_OK)
		status = gnp_table_file_save(arguments, "markdown", write_pde_markdown, &table, error);
	return gnp_exit_of(status, false);
}

static enum gnp_exit validate(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	if (strcmp(gnp_arguments_get(arguments, "table", "1"), "2") == 0)
		return validate_pde(arguments, error);
	if (strcmp(gnp_arguments_get(arguments, "table", "1"), "real") == 0)
		return gnp_real_command(arguments, error);
	if (strcmp(gnp_arguments_get(arguments, "table", "1"), "pde-real") == 0)
		return gnp_pde_real_command(arguments, error);
	struct plan plan;
	struct judged judged = {.ablated = gnp_arguments_has(arguments, "ablate")};
	if (parse_plan(arguments, &plan, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = open_table(arguments, &plan, &judged.table, error);
	if (status != GNP_OK)
		return gnp_exit_of(status, false);
	status = run_plan(&plan, &judged, error);
	if (status == GNP_OK)
		gnp_table_write_text(&judged.table, stdout);
	if (status == GNP_OK && judged.ablated)
		gnp_ablation_table_write_text(&judged.ablation, stdout);
	if (status == GNP_OK)
		status = gnp_table_file_save(arguments, "json", write_json, &judged, error);
	if (status == GNP_OK)
		status = gnp_table_file_save(arguments, "markdown", write_markdown, &judged, error);
	gnp_table_clear(&judged.table);
	if (status == GNP_OK && fflush(stdout) != 0)
		status = gnp_error_set(error, GNP_IO, "standard output: cannot be written");
	return gnp_exit_of(status, false);
}

int main(int argc, char **argv)
{
	static const struct gnp_program program = {"gnp-validate", "judges the estimators by the paper's Table 1", options, OPTIONS, validate};
	return gnp_program_main(&program, argc, argv);
}
