#include "weights/validate/pde/pde_real_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "weights/validate/pde/pde_exact.h"
#include "weights/validate/pde/pde_vertices.h"

struct run {
	const struct gnp_models *models;
	struct gnp_pool *pool;
	struct gnp_task *task;
	FILE *log;
	struct gnp_pde_real_table *table;
};

const char *gnp_pde_section_name(unsigned section)
{
	static const char *const names[GNP_PDE_SECTIONS] = {"closed", "open", "exact"};
	return section < GNP_PDE_SECTIONS ? names[section] : NULL;
}

static void log_judged(const struct run *run, const struct gnp_pde_case *known, enum gnp_pde_side side,
                       const struct gnp_pde_judged *judged)
{
	if (!run->log)
		return;
	fprintf(run->log,
	        "%s, %s, %zu points, %s normals: eigenvalues %.4f %.4f (symmetric %.4f %.4f), Poisson %.4f (%.4f), "
	        "distances %.4f%s%s\n",
	        known->name, known->variant, known->count, side == GNP_PDE_GIVEN ? "given" : "own", judged->chosen.median,
	        judged->chosen.worst, judged->symmetric.median, judged->symmetric.worst, judged->chosen.poisson,
	        judged->symmetric.poisson, judged->distance, judged->failure[0] ? "; failed: " : "", judged->failure);
	fflush(run->log);
}

static gnp_status take_case(struct run *run, enum gnp_pde_section section, const struct gnp_pde_case *known,
                            struct gnp_error *error)
{
	struct gnp_pde_real_table *table = run->table;
	if (table->row_count == GNP_PDE_ROWS)
		return gnp_error_set(error, GNP_TOO_LARGE, "table: got more than %d clouds", GNP_PDE_ROWS);
	struct gnp_pde_real_row *row = &table->rows[table->row_count++];
	gnp_status status = GNP_OK;
	*row = (struct gnp_pde_real_row){.section = section,
	                                 .points = known->count,
	                                 .open = known->open,
	                                 .pieces = known->pieces,
	                                 .doubt = known->doubt};
	memcpy(row->name, known->name, sizeof row->name);
	memcpy(row->variant, known->variant, sizeof row->variant);
	for (int side = 0; side < (section == GNP_PDE_EXACT ? 1 : GNP_PDE_SIDES) && status == GNP_OK; side++) {
		enum gnp_pde_side whose = (enum gnp_pde_side)side;
		status = gnp_pde_case_judge(known, whose, run->models, run->pool, run->task, &row->judged[side], error);
		if (status == GNP_OK)
			log_judged(run, known, whose, &row->judged[side]);
	}
	return status;
}

static gnp_status take_mesh(void *context, const char *name, const struct gnp_real_mesh *mesh,
                            struct gnp_error *error)
{
	struct run *run = context;
	const struct gnp_pde_real_plan *plan = &run->table->plan;
	struct gnp_pde_mesh ready;
	struct gnp_pde_case known;
	gnp_status status = gnp_pde_mesh_make(mesh, &ready, error);
	if (status != GNP_OK)
		return status;
	enum gnp_pde_section section = ready.open ? GNP_PDE_OPEN : GNP_PDE_CLOSED;
	bool wanted =
		(plan->sections >> section & 1) && (!plan->points_most || ready.surface.vertex_count <= plan->points_most);
	if (wanted)
		status = gnp_pde_vertices_make(name, &ready, run->pool, run->task, &known, error);
	gnp_pde_mesh_clear(&ready);
	if (!wanted || status != GNP_OK)
		return status;
	status = take_case(run, section, &known, error);
	gnp_pde_case_clear(&known);
	return status;
}

static gnp_status take_exact(struct run *run, struct gnp_error *error)
{
	struct gnp_pde_exact_name name;
	gnp_status status = GNP_OK;
	for (size_t i = 0; gnp_pde_exact_name(i, &name) && status == GNP_OK; i++) {
		struct gnp_pde_case known;
		if (run->table->plan.points_most && name.points > run->table->plan.points_most)
			continue;
		status = gnp_pde_exact_make(i, run->pool, run->task, &known, error);
		if (status != GNP_OK)
			break;
		status = take_case(run, GNP_PDE_EXACT, &known, error);
		gnp_pde_case_clear(&known);
	}
	return status;
}

gnp_status gnp_pde_real_table_run(const struct gnp_pde_real_plan *plan, const struct gnp_models *models,
                                  struct gnp_pool *pool, struct gnp_task *task, FILE *log,
                                  struct gnp_pde_real_table *out, struct gnp_error *error)
{
	struct run run = {models, pool, task, log, out};
	gnp_status status = GNP_OK;
	out->plan = *plan;
	out->row_count = 0;
	if (plan->sections & (1u << GNP_PDE_CLOSED | 1u << GNP_PDE_OPEN))
		status = gnp_real_list_visit(&plan->meshes, take_mesh, &run, error);
	if (status == GNP_OK && plan->sections >> GNP_PDE_EXACT & 1)
		status = take_exact(&run, error);
	return status;
}
