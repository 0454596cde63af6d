#include "weights/validate/real_command.h"

#include <stdlib.h>

#include "clients/session.h"
#include "weights/validate/real_run.h"
#include "weights/validate/table_file.h"
#include "weights/validate/word_list.h"

static gnp_status parse_plan(const struct gnp_arguments *arguments, struct gnp_real_plan *plan, uint64_t *workers,
                             struct gnp_error *error)
{
	static const char *const other[] = {"estimators", "families", "regimes", "shapes"};
	bool quick = gnp_arguments_has(arguments, "quick"), full = gnp_arguments_has(arguments, "full");
	*plan = quick ? gnp_real_plan_quick() : gnp_real_plan_full();
	uint64_t points = plan->points, centres = full ? 0 : plan->centres;
	for (size_t i = 0; i < sizeof other / sizeof *other; i++)
		if (gnp_arguments_has(arguments, other[i]))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: is of table 1 or 2", other[i]);
	if (quick && full)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--quick: given with --full, need one of them");
	gnp_status status = gnp_arguments_integer(arguments, "points", 1000, 10000000, &points, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "centres", 1, 10000000, &centres, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "workers", 1, 1024, workers, error);
	plan->points = points;
	plan->centres = centres;
	plan->meshes = gnp_arguments_get(arguments, "meshes", NULL);
	plan->peers = gnp_arguments_get(arguments, "peers", NULL);
	plan->only = gnp_arguments_get(arguments, "only", NULL);
	plan->tune = gnp_arguments_has(arguments, "tune");
	plan->ablate = gnp_arguments_has(arguments, "ablate");
	return status == GNP_OK
	           ? gnp_word_list_parse(arguments, "sections", gnp_real_section_name, &plan->sections, error)
	           : status;
}

static gnp_status run_plan(const struct gnp_real_plan *plan, const struct gnp_models *models, unsigned workers,
                           struct gnp_real_table *table, struct gnp_error *error)
{
	struct gnp_session session;
	gnp_status status = gnp_session_open(&session, workers, error);
	if (status != GNP_OK)
		return status;
	atomic_store(&session.progress.phase, "validate");
	status = gnp_real_run(plan, models, session.pool, &session.task, stderr, table, error);
	gnp_session_close(&session);
	return status;
}

static void write_json(const void *table, FILE *out)
{
	gnp_real_table_write_json(table, out);
}

static void write_markdown(const void *table, FILE *out)
{
	gnp_real_table_write_markdown(table, out);
}

enum gnp_exit gnp_real_command(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_real_plan plan;
	struct gnp_real_table table;
	struct gnp_models *models = NULL;
	uint64_t workers = 0;
	if (parse_plan(arguments, &plan, &workers, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = gnp_models_load(gnp_arguments_get(arguments, "weights-dir", NULL), &models, error);
	if (status == GNP_OK)
		status = run_plan(&plan, models, (unsigned)workers, &table, error);
	if (status != GNP_OK) {
		gnp_models_release(models);
		return gnp_exit_of(status, false);
	}
	gnp_real_table_write_text(&table, stdout);
	status = gnp_table_file_save(arguments, "json", write_json, &table, error);
	if (status == GNP_OK)
		status = gnp_table_file_save(arguments, "markdown", write_markdown, &table, error);
	gnp_real_table_clear(&table);
	gnp_models_release(models);
	if (status == GNP_OK && fflush(stdout) != 0)
		status = gnp_error_set(error, GNP_IO, "standard output: cannot be written");
	return gnp_exit_of(status, false);
}
