/* The truth that equations on real surfaces are held against: meshes made ready, cotangents, eigenvalues, solutions and
 * shortest paths, on surfaces where all of it is known. */
#include "core/base/vector.h"
#include "core/linear/linalg.h"
#include "tests/unit/test.h"
#include "weights/validate/pde/pde_cotangent.h"
#include "weights/validate/pde/pde_paths.h"

static struct gnp_pool *pool;
static const double pi = 3.14159265358979323846;

/* Every triangle in four, with vertices on the unit sphere; sides have vertices of their own for each triangle, which
 * pde_mesh makes one. */
static struct gnp_real_mesh icosphere(int times)
{
	static const double g = 1.618033988749894848;
	const double corner[12][3] = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
	                              {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
	static const uint32_t faces[60] = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
	                                   4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
	                                   6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
	size_t triangles = 20;
	double *at = malloc(60 * 3 * sizeof *at);
	for (size_t k = 0; k < 60; k++)
		memcpy(at + 3 * k, corner[faces[k]], 3 * sizeof *at);
	for (int time = 0; time <= times; time++) {
		for (size_t k = 0; k < 3 * triangles; k++) {
			double length = sqrt(gnp_dot(at + 3 * k, at + 3 * k));
			for (size_t c = 0; c < 3; c++)
				at[3 * k + c] /= length;
		}
		if (time == times)
			break;
		double *finer = malloc(triangles * 36 * sizeof *finer);
		for (size_t t = 0; t < triangles; t++)
			for (size_t d = 0; d < 9; d++) {
				const double *p = at + 9 * t;
				size_t v = d / 3, c = d % 3;
				for (size_t part = 0; part < 3; part++) /* at corner `part`, and in the middle */
					finer[36 * t + 9 * part + d] = (p[3 * part + c] + p[3 * ((part + v) % 3) + c]) / 2;
				finer[36 * t + 27 + d] = (p[3 * v + c] + p[3 * ((v + 1) % 3) + c]) / 2;
			}
		free(at);
		at = finer;
		triangles *= 4;
	}
	uint32_t *list = malloc(3 * triangles * sizeof *list);
	for (size_t k = 0; k < 3 * triangles; k++)
		list[k] = (uint32_t)k;
	struct gnp_real_mesh mesh = {0};
	CHECK(gnp_real_mesh_create(at, 3 * triangles, list, triangles, &mesh, NULL) == GNP_OK);
	free(at);
	free(list);
	return mesh;
}

static struct gnp_pde_mesh ready(struct gnp_real_mesh mesh)
{
	struct gnp_pde_mesh made = {.edge_count = 0};
	struct gnp_error error = {0};
	CHECK(gnp_pde_mesh_make(&mesh, &made, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	gnp_real_mesh_clear(&mesh);
	return made;
}

/* The unit square of n x n cells of two triangles, in the plane z = x. */
static struct gnp_real_mesh tilted_square(uint32_t n)
{
	double *at = malloc((n + 1) * (n + 1) * 3 * sizeof *at);
	uint32_t *list = malloc(6 * n * n * sizeof *list);
	for (uint32_t i = 0; i <= n; i++)
		for (uint32_t j = 0; j <= n; j++)
			memcpy(at + 3 * (i * (n + 1) + j),
			       (double[3]){(double)i / n / sqrt(2), (double)j / n, (double)i / n / sqrt(2)}, 3 * sizeof *at);
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t j = 0; j < n; j++) {
			uint32_t o = i * (n + 1) + j, cell[6] = {o, o + n + 1, o + n + 2, o, o + n + 2, o + 1};
			memcpy(list + 6 * (i * n + j), cell, sizeof cell);
		}
	struct gnp_real_mesh mesh = {0};
	CHECK(gnp_real_mesh_create(at, (n + 1) * (n + 1), list, 2 * n * n, &mesh, NULL) == GNP_OK);
	free(at);
	free(list);
	return mesh;
}

static void places_become_vertices(void)
{
	struct gnp_pde_mesh mesh = ready(icosphere(3));
	CHECK(mesh.surface.vertex_count == 642 && mesh.surface.triangle_count == 1280 && mesh.edge_count == 1920);
	CHECK(mesh.open == 0 && mesh.crowded == 0 && mesh.pieces == 1);
	for (size_t p = 0; p < 3 * mesh.surface.triangle_count; p++) { /* an edge lies across its corner */
		const uint32_t *end = mesh.edge + 2 * mesh.edge_of[p];
		uint32_t corner = mesh.surface.triangles[p];
		CHECK(end[0] < end[1] && end[0] != corner && end[1] != corner);
	}
	gnp_pde_mesh_clear(&mesh);
	mesh = ready(tilted_square(10));
	CHECK(mesh.surface.vertex_count == 121 && mesh.open == 40 && mesh.crowded == 0 && mesh.edge_count == 320);
	gnp_pde_mesh_clear(&mesh);
}

/* Two tetrahedra that share a face, the face twice; a triangle of one line; and a piece of three vertices beside
 * many. */
static void what_is_no_surface_is_left_out(void)
{
	const double at[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}, {0.5, 0, 0}};
	const uint32_t list[][3] = {{0, 1, 2}, {2, 1, 0}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3},
	                            {1, 0, 4}, {2, 1, 4}, {0, 2, 4}, {0, 5, 1}};
	struct gnp_real_mesh raw, sphere = icosphere(3);
	CHECK(gnp_real_mesh_create(&at[0][0], 6, &list[0][0], 9, &raw, NULL) == GNP_OK);
	struct gnp_pde_mesh mesh = ready(raw);
	CHECK(mesh.surface.vertex_count == 5 && mesh.surface.triangle_count == 7 && mesh.crowded == 3 && mesh.open == 0);
	gnp_pde_mesh_clear(&mesh);
	for (size_t c = 0; c < 9; c++)
		sphere.vertices[c] += 5;
	size_t triangles = sphere.triangle_count;
	mesh = ready(sphere);
	CHECK(mesh.pieces == 1 && mesh.surface.triangle_count == triangles - 1 && mesh.surface.vertex_count == 642 &&
	      mesh.open == 3);
	gnp_pde_mesh_clear(&mesh);
	const uint32_t line[3] = {0, 5, 1};
	struct gnp_error error = {0};
	CHECK(gnp_real_mesh_create(&at[0][0], 6, line, 1, &raw, NULL) == GNP_OK);
	CHECK(gnp_pde_mesh_make(&raw, &mesh, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "got no triangle with an area");
	gnp_real_mesh_clear(&raw);
}

/* l (l + 1), each 2 l + 1 times, with an error that falls as the square of the spacing. */
static void eigenvalues_of_a_sphere(void)
{
	double worst[2] = {0};
	for (int finer = 0; finer < 2; finer++) {
		struct gnp_pde_mesh mesh = ready(icosphere(3 + finer));
		struct gnp_pde_form form;
		double value[25], area = 0;
		CHECK(gnp_pde_cotangent_make(&mesh, &form, NULL) == GNP_OK);
		CHECK(gnp_pde_form_lowest(&form, 25, pool, NULL, value, NULL) == GNP_OK);
		CHECK_NEAR(value[0], 0, 1e-9);
		for (int k = 1, l = 1; k < 25; k++, l += k == (l + 1) * (l + 1))
			worst[finer] = fmax(worst[finer], fabs(value[k] / (l * (l + 1)) - 1));
		for (size_t i = 0; i < mesh.surface.vertex_count; i++)
			area += form.mass[i];
		CHECK_NEAR(area, mesh.surface.area, 1e-12);
		gnp_pde_form_clear(&form);
		gnp_pde_mesh_clear(&mesh);
	}
	CHECK_AT_MOST(worst[0], 0.03);
	CHECK_AT_MOST(worst[1], worst[0] / 3.5);
}

/* -Delta of a harmonic of degree two is six times it; two spheres apart have a mean each. */
static void solutions_on_spheres(void)
{
	struct gnp_real_mesh one = icosphere(4), two;
	size_t n = one.vertex_count, triangles = one.triangle_count;
	double *at = malloc(6 * n * sizeof *at), worst = 0;
	uint32_t *list = malloc(6 * triangles * sizeof *list);
	for (size_t i = 0; i < 6 * n; i++)
		at[i] = one.vertices[i % (3 * n)] + 4 * (double)(i >= 3 * n);
	for (size_t k = 0; k < 6 * triangles; k++)
		list[k] = (uint32_t)k;
	CHECK(gnp_real_mesh_create(at, 2 * n, list, 2 * triangles, &two, NULL) == GNP_OK);
	struct gnp_pde_mesh mesh = ready(two);
	struct gnp_pde_form form;
	size_t points = mesh.surface.vertex_count;
	double *source = malloc(points * sizeof *source), *u = malloc(points * sizeof *u);
	CHECK(mesh.pieces == 2 && points == 2 * 2562);
	CHECK(gnp_pde_cotangent_make(&mesh, &form, NULL) == GNP_OK);
	for (size_t i = 0; i < points; i++) {
		const double *x = mesh.surface.vertices + 3 * i;
		source[i] = x[0] > 2 ? 6 * (x[0] - 4) * (x[1] - 4) + 7 : 12 * x[0] * x[1] - 3;
	}
	CHECK(gnp_pde_form_solve(&form, source, pool, NULL, u, NULL) == GNP_OK);
	for (size_t i = 0; i < points; i++) {
		const double *x = mesh.surface.vertices + 3 * i;
		worst = fmax(worst, fabs(u[i] - (x[0] > 2 ? (x[0] - 4) * (x[1] - 4) : 2 * x[0] * x[1])));
	}
	CHECK_AT_MOST(worst, 0.01);
	gnp_pde_form_clear(&form);
	gnp_pde_mesh_clear(&mesh);
	gnp_real_mesh_clear(&one);
	free(at);
	free(list);
	free(source);
	free(u);
}

/* On a plane distances are straight: never below, and twice the points on an edge are much nearer. Across a face of
 * many triangles from one corner; along the square's sides they are exact. */
static void paths_on_a_plane_are_straight(void)
{
	struct gnp_pde_mesh mesh = ready(tilted_square(20));
	size_t n = mesh.surface.vertex_count;
	double *distance = malloc(n * sizeof *distance), mean[3] = {0};
	static const unsigned densities[3] = {2, 4, 8};
	for (int d = 0; d < 3; d++) {
		CHECK(gnp_pde_paths(&mesh, 0, densities[d], distance, NULL) == GNP_OK);
		CHECK(distance[0] == 0);
		for (size_t i = 1; i < n; i++) {
			const double *x = mesh.surface.vertices + 3 * i;
			double straight = sqrt(gnp_dot(x, x));
			CHECK(distance[i] >= straight * (1 - 1e-14));
			mean[d] += (distance[i] / straight - 1) / (double)n;
			if (x[1] == 0)
				CHECK_NEAR(distance[i], straight, 1e-14);
		}
	}
	CHECK_AT_MOST(mean[0], 0.01);
	CHECK_AT_MOST(mean[1], mean[0] / 2.5);
	CHECK_AT_MOST(mean[2], mean[1] / 2.5);
	free(distance);
	gnp_pde_mesh_clear(&mesh);
}

/* Great circles; and there is no way to another piece. */
static void paths_on_a_sphere(void)
{
	struct gnp_pde_mesh mesh = ready(icosphere(5));
	size_t n = mesh.surface.vertex_count;
	double *distance = malloc(n * sizeof *distance), mean = 0;
	CHECK(gnp_pde_paths(&mesh, 7, 8, distance, NULL) == GNP_OK);
	for (size_t i = 0; i < n; i++) {
		double turn = acos(fmax(-1, fmin(1, gnp_dot(mesh.surface.vertices + 3 * i, mesh.surface.vertices + 21))));
		mean += fabs(distance[i] - turn) / turn / (double)n * (i != 7);
		CHECK_AT_MOST(distance[i], pi * 1.01);
	}
	CHECK_AT_MOST(mean, 0.002);
	free(distance);
	gnp_pde_mesh_clear(&mesh);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(places_become_vertices),        TEST(what_is_no_surface_is_left_out),
	                                    TEST(eigenvalues_of_a_sphere),       TEST(solutions_on_spheres),
	                                    TEST(paths_on_a_plane_are_straight), TEST(paths_on_a_sphere)};
	gnp_linalg_init();
	CHECK(gnp_pool_create(0, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
