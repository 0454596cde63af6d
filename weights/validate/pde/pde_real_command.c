#include "weights/validate/pde/pde_real_command.h"

#include <stdlib.h>

#include "clients/session.h"
#include "weights/validate/pde/pde_real_write.h"
#include "weights/validate/table_file.h"
#include "weights/validate/word_list.h"

static gnp_status parse_plan(const struct gnp_arguments *arguments, struct gnp_pde_real_plan *plan, uint64_t *workers,
                             struct gnp_error *error)
{
	static const char *const other[] = {"estimators", "families", "regimes", "shapes", "centres",
	                                    "points",     "peers",    "ablate",  "json"};
	for (size_t i = 0; i < sizeof other / sizeof *other; i++)
		if (gnp_arguments_has(arguments, other[i]))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: is not of table pde-real", other[i]);
	*plan = (struct gnp_pde_real_plan){.meshes = {gnp_arguments_get(arguments, "meshes", NULL),
	                                              gnp_arguments_get(arguments, "only", NULL),
	                                              gnp_arguments_has(arguments, "tune")},
	                                   .sections = (1u << GNP_PDE_SECTIONS) - 1,
	                                   .points_most = gnp_arguments_has(arguments, "quick") ? 6000 : 0};
	gnp_status status = gnp_arguments_integer(arguments, "workers", 1, 1024, workers, error);
	return status == GNP_OK ? gnp_word_list_parse(arguments, "sections", gnp_pde_section_name, &plan->sections, error)
	                        : status;
}

static void write_markdown(const void *table, FILE *out)
{
	gnp_pde_real_write_markdown(table, out);
}

static gnp_status run_plan(const struct gnp_pde_real_plan *plan, const struct gnp_models *models, unsigned workers,
                           struct gnp_pde_real_table *table, struct gnp_error *error)
{
	struct gnp_session session;
	gnp_status status = gnp_session_open(&session, workers, error);
	if (status != GNP_OK)
		return status;
	atomic_store(&session.progress.phase, "validate");
	status = gnp_pde_real_table_run(plan, models, session.pool, &session.task, stderr, table, error);
	gnp_session_close(&session);
	return status;
}

enum gnp_exit gnp_pde_real_command(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_pde_real_plan plan;
	struct gnp_models *models = NULL;
	uint64_t workers = 0;
	if (parse_plan(arguments, &plan, &workers, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	struct gnp_pde_real_table *table = malloc(sizeof *table);
	gnp_status status = table ? gnp_models_load(gnp_arguments_get(arguments, "weights-dir", NULL), &models, error)
	                          : gnp_no_memory("table", GNP_PDE_ROWS, "rows", error);
	if (status == GNP_OK)
		status = run_plan(&plan, models, (unsigned)workers, table, error);
	gnp_models_release(models);
	if (status == GNP_OK)
		gnp_pde_real_write_text(table, stdout);
	if (status == GNP_OK)
		status = gnp_table_file_save(arguments, "markdown", write_markdown, table, error);
	free(table);
	if (status == GNP_OK && fflush(stdout) != 0)
		status = gnp_error_set(error, GNP_IO, "standard output: cannot be written");
	return gnp_exit_of(status, false);
}
