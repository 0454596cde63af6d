#include "weights/validate/real_run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "weights/validate/method.h"
#include "weights/validate/real_body.h"
#include "weights/validate/real_list.h"
#include "weights/validate/real_scan.h"

struct run {
	const struct gnp_real_plan *plan;
	struct gnp_real_peers peers;
	const struct gnp_models *models; /* may be NULL */
	struct gnp_models *altered[GNP_ABLATION_PARTS];
	struct gnp_pool *pool;
	struct gnp_task *task;
	FILE *log;
	struct gnp_real_table table;
};

/* ---- One cloud ---- */

static struct gnp_real_score score_of_failure(size_t centres)
{
	return (struct gnp_real_score){.rms = 90, .median = 90, .sided = NAN, .curvature = NAN, .lost = centres};
}

static gnp_status judge(struct run *run, size_t c, const struct gnp_real_cloud *cloud, struct gnp_real_row *row,
                        struct gnp_error *error)
{
	const struct gnp_real_method *method = &run->table.methods[c];
	struct gnp_error why = {0};
	gnp_status status = gnp_real_method_judge(method, &run->peers, cloud, run->pool, row->scores[c],
	                                             &run->table.seconds[c], &why);
	if (status == GNP_OK)
		return GNP_OK;
	if (status == GNP_OUT_OF_MEMORY || status == GNP_CANCELLED)
		return gnp_error_set(error, status, "%s", why.text);
	for (size_t v = 0; v < method->variants; v++)
		row->scores[c][v] = score_of_failure(cloud->centre_count);
	if (run->log)
		fprintf(run->log, "%s, %s: %s failed: %s\n", row->cloud, row->variant, method->name, why.text);
	return GNP_OK;
}

/* What the estimators looked at closer say of themselves; where one fails it is left out, and the log says why. */
static gnp_status judge_details(struct run *run, const struct gnp_real_cloud *cloud, struct gnp_real_row *row,
                                struct gnp_error *error)
{
	row->hardness = cloud->hardness;
	for (unsigned d = 0; d < GNP_REAL_DETAILS && cloud->detailed; d++) {
		size_t c = gnp_real_table_find(&run->table, gnp_real_detail_name(d));
		struct gnp_error why = {0};
		if (c == run->table.method_count)
			continue;
		gnp_status status =
			gnp_real_detail_judge(&run->table.methods[c], cloud, run->plan->centres, run->pool, &row->details[d], &why);
		if (status == GNP_OUT_OF_MEMORY || status == GNP_CANCELLED)
			return gnp_error_set(error, status, "%s", why.text);
		if (status != GNP_OK && run->log)
			fprintf(run->log, "%s, %s: error bars of %s failed: %s\n", row->cloud, row->variant,
			        gnp_real_detail_name(d), why.text);
	}
	return gnp_task_check(run->task, error);
}

static void log_row(const struct run *run, const struct gnp_real_row *row)
{
	if (!run->log)
		return;
	fprintf(run->log, "%s, %s:", row->cloud, row->variant);
	for (size_t c = 0; c < run->table.method_count; c++)
		if (run->table.methods[c].part == GNP_ABLATION_NONE)
			fprintf(run->log, " %s %.2f", run->table.methods[c].name,
			        gnp_real_table_figure(row, c, gnp_real_table_variant(&run->table, row, c)));
	fputc('\n', run->log);
	fflush(run->log);
}

/* Judges a cloud, which is cleared in any case. */
static gnp_status take_cloud(struct run *run, enum gnp_real_section section, const char *name, const char *variant,
                             struct gnp_real_cloud *cloud, struct gnp_error *error)
{
	char whole[128];
	snprintf(whole, sizeof whole, "%s, %s", name, variant);
	gnp_status status = gnp_real_cloud_choose(cloud, run->plan->centres, gnp_real_cloud_seed(whole), error);
	struct gnp_real_row *row = status == GNP_OK ? gnp_real_table_add(&run->table) : NULL;
	if (status == GNP_OK && !row)
		status = gnp_no_memory("table", run->table.row_count + 1, "rows", error);
	if (status == GNP_OK && run->peers.folder[0])
		status = gnp_real_peers_give(&run->peers, cloud, error);
	if (status == GNP_OK) {
		row->section = section;
		row->points = cloud->count;
		row->centres = cloud->centre_count;
		snprintf(row->cloud, sizeof row->cloud, "%s", name);
		snprintf(row->variant, sizeof row->variant, "%s", variant);
	}
	for (size_t c = 0; c < run->table.method_count && status == GNP_OK; c++) {
		status = judge(run, c, cloud, row, error);
		if (status == GNP_OK)
			status = gnp_task_check(run->task, error);
	}
	if (status == GNP_OK)
		status = judge_details(run, cloud, row, error);
	if (status == GNP_OK)
		log_row(run, row);
	gnp_real_cloud_clear(cloud);
	return status;
}

/* ---- Meshes ---- */

static const struct sampling {
	const char *name;
	double noise;
	enum gnp_real_density density;
} samplings[] = {
	{"clean", 0, GNP_REAL_EVEN},           {"noise 0.12 %", 0.0012, GNP_REAL_EVEN},
	{"noise 0.6 %", 0.006, GNP_REAL_EVEN}, {"noise 1.2 %", 0.012, GNP_REAL_EVEN},
	{"stripes", 0, GNP_REAL_STRIPES},      {"gradient", 0, GNP_REAL_GRADIENT},
};

/* The default filter of a sample as it is, or with outliers planted, into a row of the table. What fails is left out,
 * and the log says why. */
static gnp_status filter_one(struct run *run, const char *name, const struct sampling *sampling,
                             const struct gnp_real_cloud *cloud, const struct gnp_real_mesh *mesh, double planted,
                             struct gnp_error *error)
{
	double spacing = sqrt(mesh->area / (double)cloud->count);
	const struct gnp_real_planting planting = {planted * mesh->diagonal,
	                                           fmax(3 * sampling->noise * mesh->diagonal, 0.3 * spacing),
	                                           gnp_real_cloud_seed(name)};
	struct gnp_real_filtered filtered;
	struct gnp_error why = {0};
	gnp_status status = gnp_real_filter_judge(cloud, &planting, run->models, run->pool, &filtered, &why);
	if (status == GNP_OUT_OF_MEMORY || status == GNP_CANCELLED)
		return gnp_error_set(error, status, "%s", why.text);
	if (status != GNP_OK) {
		if (run->log)
			fprintf(run->log, "%s, %s: the filter failed: %s\n", name, sampling->name, why.text);
		return gnp_task_check(run->task, error);
	}
	struct gnp_real_filter_row *row = gnp_real_table_add_filter(&run->table);
	if (!row)
		return gnp_no_memory("table", run->table.filter_count + 1, "rows", error);
	*row = (struct gnp_real_filter_row){.planted = planted, .filtered = filtered};
	snprintf(row->cloud, sizeof row->cloud, "%s", name);
	snprintf(row->variant, sizeof row->variant, "%s", sampling->name);
	return gnp_task_check(run->task, error);
}

/* Outliers are planted where points are dense alike and noise leaves room for them. */
static gnp_status filter_sample(struct run *run, const char *name, const struct sampling *sampling,
                                const struct gnp_real_cloud *cloud, const struct gnp_real_mesh *mesh,
                                struct gnp_error *error)
{
	static const double planted[] = {0, 5e-3, 2e-2};
	gnp_status status = GNP_OK;
	size_t plantings = sampling->density == GNP_REAL_EVEN && sampling->noise < 0.002 ? 3 : 1;
	for (size_t i = 0; i < plantings && status == GNP_OK && gnp_method_any(run->models); i++)
		status = filter_one(run, name, sampling, cloud, mesh, planted[i], error);
	return status;
}

static gnp_status take_samples(struct run *run, const char *name, const struct gnp_real_mesh *mesh,
                               struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof samplings / sizeof samplings[0] && status == GNP_OK; i++) {
		const struct gnp_real_sampling sampling = {run->plan->points, samplings[i].noise, samplings[i].density,
		                                           gnp_real_cloud_seed(name)};
		struct gnp_real_cloud cloud;
		status = gnp_real_cloud_sample(mesh, &sampling, &cloud, error);
		if (status != GNP_OK)
			break;
		status = filter_sample(run, name, &samplings[i], &cloud, mesh, error);
		if (status == GNP_OK)
			status = take_cloud(run, GNP_REAL_SAMPLES, name, samplings[i].name, &cloud, error);
		else
			gnp_real_cloud_clear(&cloud);
	}
	return status;
}

static gnp_status take_vertices(struct run *run, const char *name, const struct gnp_real_mesh *mesh,
                                struct gnp_error *error)
{
	struct gnp_real_cloud cloud;
	gnp_status status = gnp_real_cloud_vertices(mesh, &cloud, error);
	return status == GNP_OK ? take_cloud(run, GNP_REAL_VERTICES, name, "vertices", &cloud, error) : status;
}

static gnp_status take_mesh(void *context, const char *name, const struct gnp_real_mesh *mesh, struct gnp_error *error)
{
	struct run *run = context;
	struct gnp_real_mesh_fact *fact = gnp_real_table_add_mesh(&run->table);
	if (!fact)
		return gnp_no_memory("table", run->table.mesh_count + 1, "meshes", error);
	fact->vertices = mesh->vertex_count;
	fact->triangles = mesh->triangle_count;
	snprintf(fact->name, sizeof fact->name, "%s", name);
	gnp_status status = GNP_OK;
	if (run->plan->sections >> GNP_REAL_SAMPLES & 1)
		status = take_samples(run, name, mesh, error);
	if (status == GNP_OK && run->plan->sections >> GNP_REAL_VERTICES & 1)
		status = take_vertices(run, name, mesh, error);
	return status;
}

static gnp_status take_meshes(struct run *run, struct gnp_error *error)
{
	const struct gnp_real_list list = {run->plan->meshes, run->plan->only, run->plan->tune};
	return gnp_real_list_visit(&list, take_mesh, run, error);
}

/* ---- What needs no mesh ---- */

static gnp_status take_bodies(struct run *run, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	struct gnp_real_body_name name;
	for (size_t i = 0; gnp_real_body_name(i, &name) && status == GNP_OK; i++) {
		struct gnp_real_cloud cloud;
		status = gnp_real_body_make(i, run->pool, &cloud, error);
		if (status == GNP_OK)
			status = take_cloud(run, GNP_REAL_BODIES, name.surface, name.sampling, &cloud, error);
	}
	return status;
}

static gnp_status take_scans(struct run *run, struct gnp_error *error)
{
	static const double heights[] = {0, 20}, noises[] = {0, 0.1, 0.3}, ranges[] = {0, 0.01, 0.03};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < 9 && status == GNP_OK; i++) {
		const char *name = i >= 6 ? "lidar in a room" : i >= 3 ? "rows over waves" : "rows over a plane";
		struct gnp_real_cloud cloud;
		char variant[32];
		if (i < 6) {
			const struct gnp_real_rows rows = {8, heights[i / 3], noises[i % 3], gnp_real_cloud_seed(name)};
			snprintf(variant, sizeof variant, "ratio 8, noise %.1f", noises[i % 3]);
			status = gnp_real_scan_rows(&rows, &cloud, error);
		} else {
			const struct gnp_real_lidar lidar = {ranges[i % 3], gnp_real_cloud_seed(name)};
			snprintf(variant, sizeof variant, "noise %.0f cm", 100 * ranges[i % 3]);
			status = gnp_real_scan_lidar(&lidar, &cloud, error);
		}
		if (status == GNP_OK)
			status = take_cloud(run, GNP_REAL_SCANS, name, variant, &cloud, error);
	}
	return status;
}

/* ---- The whole ---- */

static gnp_status add_ablated(struct run *run, const struct gnp_models *models, struct gnp_error *error)
{
	struct gnp_real_table *table = &run->table;
	gnp_status status = GNP_OK;
	for (unsigned part = GNP_ABLATION_NONE + 1; part < GNP_ABLATION_PARTS && status == GNP_OK; part++) {
		enum gnp_ablation_part taken = (enum gnp_ablation_part)part;
		status = gnp_ablation_models(models, taken, run->plan->points, run->pool, &run->altered[part], error);
		if (status == GNP_OK)
			table->method_count =
				gnp_real_method_ablated(run->altered[part], taken, table->method_count, table->methods);
	}
	return status;
}

static void log_skipped(const struct run *run)
{
	if (run->log && !gnp_method_any(run->models))
		fputs("skipped: gnp and the filter, for want of the model for any cloud\n", run->log);
	for (size_t i = 0; run->log && gnp_real_peer_at(i); i++)
		if (!gnp_real_peers_have(&run->peers, gnp_real_peer_at(i)))
			fprintf(run->log, "skipped: %s\n", gnp_real_peer_at(i)->name);
}

static gnp_status fill(struct run *run, const struct gnp_models *models, struct gnp_error *error)
{
	unsigned sections = run->plan->sections;
	gnp_status status = GNP_OK;
	run->table.method_count = gnp_real_method_list(models, &run->peers, run->table.methods);
	log_skipped(run);
	if (run->plan->ablate)
		status = add_ablated(run, models, error);
	if (status == GNP_OK && sections & (1u << GNP_REAL_SAMPLES | 1u << GNP_REAL_VERTICES))
		status = take_meshes(run, error);
	if (status == GNP_OK && sections >> GNP_REAL_BODIES & 1)
		status = take_bodies(run, error);
	if (status == GNP_OK && sections >> GNP_REAL_SCANS & 1)
		status = take_scans(run, error);
	return status;
}

gnp_status gnp_real_run(const struct gnp_real_plan *plan, const struct gnp_models *models, struct gnp_pool *pool,
                        struct gnp_task *task, FILE *log, struct gnp_real_table *out, struct gnp_error *error)
{
	struct run run = {.plan = plan, .models = models, .pool = pool, .task = task, .log = log, .table = {.plan = *plan}};
	double begun = gnp_clock();
	gnp_status status = gnp_real_peers_open(plan->peers, &run.peers, error);
	if (status != GNP_OK)
		return status;
	status = fill(&run, models, error);
	gnp_real_peers_close(&run.peers);
	for (int part = 0; part < GNP_ABLATION_PARTS; part++)
		gnp_models_release(run.altered[part]);
	for (size_t c = 0; c < run.table.method_count; c++)
		if (run.table.methods[c].part != GNP_ABLATION_NONE) { /* those are gone */
			run.table.methods[c].model = NULL;
			run.table.methods[c].models = NULL;
		}
	run.table.wall = gnp_clock() - begun;
	if (status == GNP_OK)
		*out = run.table;
	else
		gnp_real_table_clear(&run.table);
	return status;
}
