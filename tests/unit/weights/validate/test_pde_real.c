/* Equations on real and exact surfaces: what is known of them, how errors are counted, and the table. */
#include "weights/validate/pde/pde_real_write.h"

#include <unistd.h>

#include "core/linear/linalg.h"
#include "core/operators/laplacian.h"
#include "tests/unit/test.h"
#include "weights/validate/pde/pde_cotangent.h"
#include "weights/validate/pde/pde_exact.h"
#include "weights/validate/pde/pde_torus.h"
#include "weights/validate/pde/pde_vertices.h"

static struct gnp_pool *pool;
static const struct gnp_models *models;

/* A torus of the shape's radii as a mesh of long x round cells, two triangles each. */
static struct gnp_pde_mesh torus(uint32_t round, uint32_t along)
{
	double *at = malloc(round * along * 3 * sizeof *at);
	uint32_t *list = malloc(6 * round * along * sizeof *list);
	struct gnp_real_mesh raw = {0};
	struct gnp_pde_mesh mesh = {.edge_count = 0};
	for (uint32_t i = 0; i < along; i++)
		for (uint32_t j = 0; j < round; j++) {
			double turn = 2 * M_PI * i / along, tube = 2 * M_PI * j / round,
				   w = GNP_PDE_TORUS_TURN + GNP_PDE_TORUS_TUBE * cos(tube);
			uint32_t o = i * round + j, next = (i + 1) % along * round + j, up = i * round + (j + 1) % round,
					 across = (i + 1) % along * round + (j + 1) % round, cell[6] = {o, next, across, o, across, up};
			memcpy(at + 3 * o, (double[3]){w * cos(turn), w * sin(turn), GNP_PDE_TORUS_TUBE * sin(tube)},
			       3 * sizeof *at);
			memcpy(list + 6 * o, cell, sizeof cell);
		}
	CHECK(gnp_real_mesh_create(at, round * along, list, 2 * round * along, &raw, NULL) == GNP_OK);
	CHECK(gnp_pde_mesh_make(&raw, &mesh, NULL) == GNP_OK);
	gnp_real_mesh_clear(&raw);
	free(at);
	free(list);
	return mesh;
}

/* The equation along the tube against a fine mesh. */
static void eigenvalues_of_a_torus(void)
{
	struct gnp_pde_mesh mesh = torus(120, 240);
	struct gnp_pde_form form;
	double value[21], found[21];
	CHECK(mesh.open == 0 && mesh.pieces == 1);
	CHECK(gnp_pde_cotangent_make(&mesh, &form, NULL) == GNP_OK);
	CHECK(gnp_pde_form_lowest(&form, 21, pool, NULL, found, NULL) == GNP_OK);
	CHECK(gnp_pde_torus_values(21, pool, NULL, value, NULL) == GNP_OK);
	CHECK_NEAR(value[0], 0, 1e-9);
	for (size_t k = 1; k < 21; k++)
		CHECK_NEAR(found[k] / value[k], 1, 2e-3);
	gnp_pde_form_clear(&form);
	gnp_pde_mesh_clear(&mesh);
}

/* What is known of every exact surface fits together: fields have no mean where there is no flux, and energies of
 * solutions are what their sources say; rims are where they should be, distances no shorter than straight. */
static void exact_surfaces_are_consistent(void)
{
	struct gnp_pde_exact_name name;
	size_t i = 0;
	for (; gnp_pde_exact_name(i, &name); i++) {
		struct gnp_pde_case known;
		double mean = 0, square = 0;
		if (name.points > 6000)
			continue;
		CHECK(gnp_pde_exact_make(i, pool, NULL, &known, NULL) == GNP_OK);
		CHECK_STRING(known.name, name.surface);
		CHECK(known.count >= name.points && known.count <= name.points * 21 / 20);
		for (size_t p = 0; p < known.count; p++) {
			mean += known.source[p];
			square += known.source[p] * known.source[p];
			CHECK(!known.fixed || !known.fixed[p] || fabs(known.dirichlet[p]) < 1e-12);
		}
		CHECK_AT_MOST(fabs(mean) / sqrt(square * (double)known.count), 0.05);
		CHECK(known.eigenvalue[0] == 0 && known.eigenvalue[1] > 0);
		for (size_t k = 1; k <= known.eigenvalues; k++)
			CHECK(known.eigenvalue[k] >= known.eigenvalue[k - 1]);
		for (size_t s = 0; s < GNP_PDE_SOURCES; s++) {
			const double *from = known.points + 3 * (size_t)known.at[s];
			CHECK_NEAR(known.distance[s * known.count + known.at[s]], 0, 1e-7);
			for (size_t p = 0; p < known.count; p++) {
				const double *x = known.points + 3 * p;
				double straight = sqrt(pow(x[0] - from[0], 2) + pow(x[1] - from[1], 2) + pow(x[2] - from[2], 2));
				CHECK(known.distance[s * known.count + p] >= straight * (1 - 1e-7) - 1e-7);
			}
		}
		gnp_pde_case_clear(&known);
	}
	CHECK(i == 17);
}

/* Half a sphere has each l (l + 1) for even functions l + 1 times, for those that are zero at its rim l times. */
static void half_spheres_have_half_the_spectrum(void)
{
	static const double natural[10] = {0, 2, 2, 6, 6, 6, 12, 12, 12, 12}, zero[6] = {2, 6, 6, 12, 12, 12};
	struct gnp_pde_case known;
	CHECK(gnp_pde_exact_make(7, pool, NULL, &known, NULL) == GNP_OK);
	CHECK_STRING(known.name, "half-sphere");
	for (size_t k = 0; k < 10; k++)
		CHECK(known.eigenvalue[k] == natural[k]);
	for (size_t k = 0; k < 6; k++)
		CHECK(known.dirichlet_value[k] == zero[k]);
	gnp_pde_case_clear(&known);
}

/* A cloud that the library solves well is judged well; the same with the truth doubled is off by that. */
static void errors_are_relative(void)
{
	struct gnp_pde_case known;
	struct gnp_pde_judged judged;
	struct gnp_error error = {0};
	CHECK(gnp_pde_exact_make(9, pool, NULL, &known, NULL) == GNP_OK); /* a jittered square */
	CHECK(gnp_pde_case_judge(&known, GNP_PDE_GIVEN, models, pool, NULL, &judged, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK_STRING(judged.failure, "");
	CHECK(judged.symmetric.system == GNP_SYSTEM_SYMMETRIC && judged.symmetric.pieces == 1);
	CHECK_AT_MOST(judged.symmetric.worst, 0.01);
	CHECK_AT_MOST(judged.symmetric.median, judged.symmetric.worst);
	CHECK_AT_MOST(judged.symmetric.poisson, 0.01);
	CHECK_AT_MOST(judged.symmetric.heat, 0.01);
	CHECK_AT_MOST(judged.symmetric.dirichlet, 0.01);
	CHECK_AT_MOST(judged.symmetric.dirichlet_worst, 0.02);
	CHECK_AT_MOST(judged.distance, 0.02);
	CHECK_NEAR(judged.area, 1, 0.01);
	for (size_t k = 0; k <= known.eigenvalues; k++)
		known.eigenvalue[k] *= 2;
	for (size_t p = 0; p < known.count; p++) {
		known.solution[p] = 2 * known.solution[p] + 5; /* the mean does not count */
		known.distance[p] = known.distance[known.count + p] = known.distance[2 * known.count + p] = INFINITY;
	}
	CHECK(gnp_pde_case_judge(&known, GNP_PDE_OWN, models, pool, NULL, &judged, NULL) == GNP_OK);
	CHECK_NEAR(judged.symmetric.median, 0.5, 0.01);
	CHECK_NEAR(judged.symmetric.poisson, 0.5, 0.01);
	CHECK(judged.distance == 1 && judged.distance_worst == 1); /* there is a way where there should be none */
	gnp_pde_case_clear(&known);
}

/* Masses are the area, the source has no mean, paths are a little too long. */
static void vertices_know_their_mesh(void)
{
	struct gnp_pde_mesh mesh = torus(60, 120);
	struct gnp_pde_case known;
	CHECK(gnp_pde_vertices_make("ring", &mesh, pool, NULL, &known, NULL) == GNP_OK);
	CHECK(known.count == 7200 && known.pieces == 1 && known.open == 0 && known.eigenvalues == 20);
	double total = 0, mean = 0, doubt = known.doubt;
	for (size_t i = 0; i < known.count; i++) {
		total += known.mass[i];
		mean += known.mass[i] * known.source[i];
	}
	CHECK_NEAR(total, 4 * M_PI * M_PI * GNP_PDE_TORUS_TURN * GNP_PDE_TORUS_TUBE, 0.02);
	CHECK_NEAR(mean, 0, 1e-12);
	CHECK(doubt > 1e-4 && doubt < 3e-3);
	CHECK(known.distance[known.at[0]] == 0 && known.distance[known.at[1]] > 1);
	gnp_pde_case_clear(&known);
	gnp_pde_mesh_clear(&mesh);
}

static void write_ply(const char *path, const struct gnp_real_mesh *mesh)
{
	FILE *out = fopen(path, "wb");
	CHECK(out != NULL);
	if (!out)
		return;
	fprintf(out,
	        "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty float x\nproperty float y\nproperty "
	        "float z\n"
	        "element face %zu\nproperty list uchar int vertex_indices\nend_header\n",
	        mesh->vertex_count, mesh->triangle_count);
	for (size_t i = 0; i < 3 * mesh->vertex_count; i++) {
		float value = (float)mesh->vertices[i];
		fwrite(&value, sizeof value, 1, out);
	}
	for (size_t t = 0; t < mesh->triangle_count; t++) {
		fputc(3, out);
		fwrite(mesh->triangles + 3 * t, sizeof *mesh->triangles, 3, out);
	}
	fclose(out);
}

static void table_is_filled_and_written(void)
{
	char folder[] = "/tmp/gnp-pde-real-XXXXXX", path[64];
	static struct gnp_pde_real_table table;
	struct gnp_pde_mesh mesh = torus(30, 60);
	struct gnp_error error = {0};
	char *text = NULL;
	size_t size = 0;
	CHECK(mkdtemp(folder) != NULL);
	snprintf(path, sizeof path, "%s/ring.ply", folder);
	write_ply(path, &mesh.surface);
	snprintf(path, sizeof path, "%s/meshes.txt", folder);
	FILE *list = fopen(path, "w");
	CHECK(list && fputs("ring judge\nother tune\n", list) >= 0 && fclose(list) == 0);
	const struct gnp_pde_real_plan plan = {
		.meshes = {folder, NULL, false}, .sections = (1u << GNP_PDE_SECTIONS) - 1, .points_most = 2000};
	CHECK(gnp_pde_real_table_run(&plan, models, pool, NULL, NULL, &table, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(table.row_count == 3 && table.rows[0].section == GNP_PDE_CLOSED && table.rows[0].points == 1800);
	CHECK_AT_MOST(table.rows[0].judged[GNP_PDE_OWN].symmetric.worst, 0.03);
	CHECK_AT_MOST(table.rows[0].judged[GNP_PDE_GIVEN].distance, 0.03);
	CHECK_AT_MOST(table.rows[1].judged[GNP_PDE_OWN].chosen.worst, 0.01); /* an even sphere */
	CHECK_AT_MOST(table.rows[2].judged[GNP_PDE_OWN].chosen.worst, 0.03); /* a random one */
	FILE *out = open_memstream(&text, &size);
	gnp_pde_real_write_markdown(&table, out);
	gnp_pde_real_write_text(&table, out);
	fclose(out);
	CHECK_CONTAINS(text, "## Vertices of closed meshes");
	CHECK_CONTAINS(text, "| ring            |   1800 | given | ");
	CHECK_CONTAINS(text, "of 1 clouds 1 have eigenvalues within 3 %");
	CHECK_CONTAINS(text, "| sphere      | random                  |   2000 | symmetric |");
	CHECK(strstr(text, "Vertices of meshes with rims") == NULL);
	free(text);
	unlink(path);
	snprintf(path, sizeof path, "%s/ring.ply", folder);
	unlink(path);
	rmdir(folder);
	gnp_pde_mesh_clear(&mesh);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(eigenvalues_of_a_torus), TEST(exact_surfaces_are_consistent), TEST(half_spheres_have_half_the_spectrum),
		TEST(errors_are_relative),    TEST(vertices_know_their_mesh),      TEST(table_is_filled_and_written)};
	struct gnp_models *loaded;
	gnp_linalg_init();
	CHECK(gnp_pool_create(0, &pool, NULL) == GNP_OK);
	CHECK(gnp_models_load("weights", &loaded, NULL) == GNP_OK); /* tests run in the repository's root */
	models = loaded;
	int failed = RUN_TESTS(tests);
	gnp_models_release(loaded);
	gnp_pool_free(pool);
	return failed;
}
