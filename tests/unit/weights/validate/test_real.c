/* The real table: meshes, the clouds drawn from them, scans, angles, peers, summaries, and a run over a small mesh. */
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/linear/pca.h"
#include "tests/unit/test.h"
#include "weights/protocol/protocol.h"
#include "weights/validate/real_body.h"
#include "weights/validate/real_run.h"
#include "weights/validate/real_scan.h"

static struct gnp_pool *pool; /* of two workers, for every test */
static char folder[64];       /* for files of a test */

static const char *path_of(const char *name)
{
	static char path[128];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	return path;
}

/* A box of sides 1, 2 and 3, two triangles a side, turned outward. */
static const double corners[24] = {0, 0, 0, 1, 0, 0, 1, 2, 0, 0, 2, 0, 0, 0, 3, 1, 0, 3, 1, 2, 3, 0, 2, 3};
static const uint32_t sides[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                   3, 6, 2, 3, 7, 6, 0, 7, 3, 0, 4, 7, 1, 2, 6, 1, 6, 5};

static struct gnp_real_mesh box(void)
{
	struct gnp_real_mesh mesh;
	CHECK(gnp_real_mesh_create(corners, 8, sides, 12, &mesh, NULL) == GNP_OK);
	return mesh;
}

/* ---- Meshes ---- */

/* As deploy/mesh-to-triangles.js writes it; damage: 0 none, 1 a corner too many, 2 not finite, 3 a byte too few. */
static void write_ply(const char *name, const double *vertices, uint32_t vertex_count, const uint32_t *triangles,
                      uint32_t triangle_count, int damage)
{
	FILE *out = fopen(path_of(name), "wb");
	fprintf(out,
	        "ply\nformat binary_little_endian 1.0\nelement vertex %u\n"
	        "property float x\nproperty float y\nproperty float z\n"
	        "element face %u\nproperty list uchar int vertex_indices\nend_header\n",
	        vertex_count, triangle_count);
	for (size_t i = 0; i < 3 * (size_t)vertex_count; i++) {
		float value = damage == 2 && i == 5 ? NAN : (float)vertices[i];
		fwrite(&value, sizeof value, 1, out);
	}
	for (uint32_t t = 0; t < triangle_count; t++) {
		uint32_t own[3] = {triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2]};
		own[2] = damage == 1 && t == 7 ? vertex_count : own[2];
		fputc(3, out);
		fwrite(own, sizeof own, 1, out);
	}
	long size = ftell(out);
	fclose(out);
	if (damage == 3)
		CHECK(truncate(path_of(name), size - 1) == 0);
}

static void a_mesh_is_read_with_its_area_and_size(void)
{
	struct gnp_real_mesh mesh;
	struct gnp_error error = {0};
	write_ply("box.ply", corners, 8, sides, 12, 0);
	CHECK(gnp_real_mesh_read(path_of("box.ply"), &mesh, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(mesh.vertex_count == 8 && mesh.triangle_count == 12);
	CHECK_NEAR(mesh.area, 22, 1e-12);
	CHECK_NEAR(mesh.diagonal, sqrt(14), 1e-12);
	for (size_t t = 0; t < 12; t++) { /* outward, by the box's middle */
		double normal[3], area = gnp_real_mesh_normal(&mesh, t, normal), out[3];
		for (int c = 0; c < 3; c++)
			out[c] = mesh.vertices[3 * (size_t)mesh.triangles[3 * t] + c] - (c + 1) / 2.0;
		CHECK(gnp_dot(normal, out) > 0);
		CHECK_NEAR(fabs(normal[0]) + fabs(normal[1]) + fabs(normal[2]), 1, 1e-12);
		CHECK_NEAR(area, 3 * fabs(normal[0]) + 1.5 * fabs(normal[1]) + fabs(normal[2]), 1e-12);
	}
	gnp_real_mesh_clear(&mesh);
	unlink(path_of("box.ply"));
}

static void damaged_meshes_are_refused(void)
{
	static const char *const texts[] = {"face 7: got corner 8, there are 8 vertices", "vertex 1: not finite",
	                                    "bytes, need"};
	for (int damage = 1; damage <= 3; damage++) {
		struct gnp_real_mesh mesh;
		struct gnp_error error = {0};
		write_ply("box.ply", corners, 8, sides, 12, damage);
		CHECK(gnp_real_mesh_read(path_of("box.ply"), &mesh, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, texts[damage - 1]);
	}
	FILE *out = fopen(path_of("box.ply"), "w");
	fputs("ply\nformat ascii 1.0\n", out);
	fclose(out);
	struct gnp_real_mesh mesh;
	struct gnp_error error = {0};
	CHECK(gnp_real_mesh_read(path_of("box.ply"), &mesh, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "need a PLY file as deploy/mesh-to-triangles.js writes it");
	unlink(path_of("box.ply"));
}

/* The corner (0, 0, 0) has two triangles of the sides x = 0 (area 6) and y = 0 (area 3), and two of z = 0 (area 2). */
static void vertices_get_the_mean_of_their_triangles_by_area(void)
{
	struct gnp_real_mesh mesh = box();
	double normals[24], length = sqrt(6 * 6 + 3 * 3 + 2 * 2);
	gnp_real_mesh_vertex_normals(&mesh, normals);
	CHECK_NEAR(normals[0], -6 / length, 1e-12);
	CHECK_NEAR(normals[1], -3 / length, 1e-12);
	CHECK_NEAR(normals[2], -2 / length, 1e-12);
	struct gnp_real_cloud cloud;
	CHECK(gnp_real_cloud_vertices(&mesh, &cloud, NULL) == GNP_OK);
	CHECK(cloud.count == 8);
	CHECK_NEAR(cloud.points[23], 3, 0);
	gnp_real_cloud_clear(&cloud);
	gnp_real_mesh_clear(&mesh);
}

/* ---- Samples ---- */

static struct gnp_real_cloud sample(const struct gnp_real_mesh *mesh, size_t count, double noise,
                                    enum gnp_real_density density)
{
	const struct gnp_real_sampling sampling = {count, noise, density, gnp_real_cloud_seed("box")};
	struct gnp_real_cloud cloud;
	CHECK(gnp_real_cloud_sample(mesh, &sampling, &cloud, NULL) == GNP_OK);
	return cloud;
}

static void samples_lie_on_the_sides_as_often_as_these_are_large(void)
{
	enum { N = 40000 };
	struct gnp_real_mesh mesh = box();
	struct gnp_real_cloud cloud = sample(&mesh, N, 0, GNP_REAL_EVEN);
	static const double areas[3] = {6, 3, 2}, ends[3] = {1, 2, 3};
	double on[3][2] = {{0}}, mean[3] = {0};
	for (size_t i = 0; i < N; i++) {
		const double *normal = cloud.normals + 3 * i, *point = cloud.points + 3 * i;
		int axis = normal[0] != 0 ? 0 : normal[1] != 0 ? 1 : 2;
		CHECK_NEAR(fabs(normal[axis]), 1, 1e-12);
		CHECK_NEAR(point[axis], normal[axis] > 0 ? ends[axis] : 0, 1e-12);
		on[axis][normal[axis] > 0] += 1;
		for (int c = 0; c < 3; c++)
			mean[c] += point[c] / N;
	}
	for (int side = 0; side < 6; side++) {
		double share = areas[side / 2] / 22;
		CHECK_NEAR(on[side / 2][side % 2] / N, share, 4 * sqrt(share / N));
	}
	for (int c = 0; c < 3; c++) /* uniform within sides: triangles' halves count alike */
		CHECK_NEAR(mean[c], ends[c] / 2, 0.02);
	gnp_real_cloud_clear(&cloud);
	gnp_real_mesh_clear(&mesh);
}

static void noise_is_in_units_of_the_diagonal(void)
{
	enum { N = 20000 };
	struct gnp_real_mesh mesh = box();
	struct gnp_real_cloud clean = sample(&mesh, N, 0, GNP_REAL_EVEN), noisy = sample(&mesh, N, 0.012, GNP_REAL_EVEN);
	double squares[3] = {0};
	for (size_t i = 0; i < 3 * N; i++)
		squares[i % 3] += (noisy.points[i] - clean.points[i]) * (noisy.points[i] - clean.points[i]) / N;
	for (int c = 0; c < 3; c++)
		CHECK_NEAR(sqrt(squares[c]) / (0.012 * sqrt(14)), 1, 0.02);
	CHECK(memcmp(clean.normals, noisy.normals, 3 * N * sizeof(double)) == 0);
	gnp_real_cloud_clear(&clean);
	gnp_real_cloud_clear(&noisy);
	gnp_real_mesh_clear(&mesh);
}

/* Along the longest side, z: twenty stripes, of which the odd ones have a tenth; the gradient's density at z = 3 is a
 * tenth of that at 0. */
static void densities_are_as_their_names_say(void)
{
	enum { N = 40000 };
	struct gnp_real_mesh mesh = box();
	struct gnp_real_cloud stripes = sample(&mesh, N, 0, GNP_REAL_STRIPES);
	struct gnp_real_cloud gradient = sample(&mesh, N, 0, GNP_REAL_GRADIENT);
	double dense = 0, sparse = 0, low = 0, high = 0;
	for (size_t i = 0; i < N; i++) {
		double along = stripes.points[3 * i + 2] / 3 * 20, z = gradient.points[3 * i + 2];
		bool side = stripes.normals[3 * i + 2] == 0;
		dense += side && (int)along % 2 == 0;
		sparse += side && (int)along % 2 == 1;
		low += gradient.normals[3 * i + 2] == 0 && z < 0.3;
		high += gradient.normals[3 * i + 2] == 0 && z > 2.7;
	}
	CHECK_NEAR(sparse / dense, 0.1, 0.01);
	CHECK_NEAR(high / low, (0.1 + 0.045) / (1 - 0.045), 0.02);
	gnp_real_cloud_clear(&stripes);
	gnp_real_cloud_clear(&gradient);
	gnp_real_mesh_clear(&mesh);
}

static void centres_are_distinct_and_of_those_that_may_be_judged(void)
{
	struct gnp_real_cloud cloud;
	unsigned char seen[100] = {0};
	CHECK(gnp_real_cloud_create(100, &cloud, NULL) == GNP_OK);
	cloud.unjudged = calloc(100, 1);
	for (size_t i = 0; i < 50; i++)
		cloud.unjudged[2 * i] = 1;
	CHECK(gnp_real_cloud_choose(&cloud, 30, 1, NULL) == GNP_OK);
	CHECK(cloud.centre_count == 30);
	for (size_t i = 0; i < 30; i++) {
		CHECK(cloud.centres[i] % 2 == 1 && !seen[cloud.centres[i]]);
		seen[cloud.centres[i]] = 1;
	}
	free(cloud.centres);
	CHECK(gnp_real_cloud_choose(&cloud, 0, 1, NULL) == GNP_OK && cloud.centre_count == 50);
	gnp_real_cloud_clear(&cloud);
	CHECK(gnp_real_cloud_seed("a") >= GNP_SEED_REAL && gnp_real_cloud_seed("a") != gnp_real_cloud_seed("b"));
	CHECK(gnp_seed_is_validation(gnp_real_cloud_seed("a")) &&
	      gnp_seed_check_training(gnp_real_cloud_seed("a"), NULL) != GNP_OK);
}

/* ---- Scans and bodies ---- */

static void rows_are_apart_by_their_ratio(void)
{
	const struct gnp_real_rows rows = {8, 20, 0, 7};
	struct gnp_real_cloud cloud;
	CHECK(gnp_real_scan_rows(&rows, &cloud, NULL) == GNP_OK);
	CHECK(cloud.count == 400 * 50);
	CHECK_NEAR(cloud.points[3] - cloud.points[0], 1, 1e-12);
	CHECK_NEAR(cloud.points[3 * 400 + 1] - cloud.points[1], 8, 1e-12);
	for (size_t i = 0; i + 1 < 400; i++) { /* normals against differences along the row */
		double step[3], along;
		for (int c = 0; c < 3; c++)
			step[c] = cloud.points[3 * (i + 1) + c] - cloud.points[3 * i + c];
		along = gnp_dot(step, cloud.normals + 3 * i) + gnp_dot(step, cloud.normals + 3 * (i + 1));
		CHECK_NEAR(along, 0, 1e-3);
		CHECK(cloud.normals[3 * i + 2] > 0);
	}
	gnp_real_cloud_clear(&cloud);
}

/* From the origin: no point lies within a box, those on a plane face it, and every wall and box is hit. */
static void the_lidar_sees_what_faces_it(void)
{
	const struct gnp_real_lidar lidar = {0, 7};
	struct gnp_real_cloud cloud;
	size_t on_walls = 0, on_boxes = 0;
	CHECK(gnp_real_scan_lidar(&lidar, &cloud, NULL) == GNP_OK);
	CHECK(cloud.count == 32 * 900);
	for (size_t i = 0; i < cloud.count; i++) {
		const double *p = cloud.points + 3 * i, *n = cloud.normals + 3 * i;
		CHECK(gnp_dot(p, n) < 0);
		CHECK_NEAR(gnp_dot(n, n), 1, 1e-12);
		bool wall = fabs(fabs(p[0]) - 5) < 1e-9 || fabs(fabs(p[1]) - 4) < 1e-9 || fabs(p[2] + 1.2) < 1e-9 ||
		            fabs(p[2] - 1.8) < 1e-9;
		on_walls += wall;
		on_boxes += !wall;
		CHECK(fabs(p[0]) < 5 + 1e-9 && fabs(p[1]) < 4 + 1e-9 && p[2] > -1.2 - 1e-9 && p[2] < 1.8 + 1e-9);
		CHECK(
			!(p[0] > 1.5 + 1e-9 && p[0] < 2.7 - 1e-9 && p[1] > -2 + 1e-9 && p[1] < -0.8 - 1e-9 && p[2] < -0.2 - 1e-9));
	}
	CHECK(on_walls > 15000 && on_boxes > 3000);
	gnp_real_cloud_clear(&cloud);
}

static void bodies_are_made_with_their_truth(void)
{
	struct gnp_real_body_name name;
	size_t count = 0, partly = 0;
	while (gnp_real_body_name(count, &name))
		count++;
	CHECK(count > 30);
	for (size_t i = 0; i < 12; i++) {
		struct gnp_real_cloud cloud;
		size_t unjudged = 0;
		CHECK(gnp_real_body_make(i, pool, &cloud, NULL) == GNP_OK);
		for (size_t j = 0; j < cloud.count; j++) {
			CHECK_NEAR(gnp_dot(cloud.normals + 3 * j, cloud.normals + 3 * j), 1, 1e-9);
			CHECK(isfinite(cloud.mean_curvature[j]));
			CHECK(isfinite(cloud.gaussian_curvature[j]));
			CHECK(!cloud.unjudged || !cloud.unjudged[j] || cloud.edge[j] <= 1);
			unjudged += cloud.unjudged && cloud.unjudged[j];
		}
		partly += unjudged > 0 && unjudged < cloud.count / 2;
		gnp_real_cloud_clear(&cloud);
	}
	CHECK(partly >= 2);
	struct gnp_real_cloud facets; /* the last; planes have no curvature that could be judged */
	gnp_real_body_name(count - 1, &name);
	CHECK_STRING(name.surface, "solid: facets");
	CHECK(gnp_real_body_make(count - 1, pool, &facets, NULL) == GNP_OK);
	for (size_t j = 0; j < facets.count; j++)
		CHECK(facets.mean_curvature[j] == 0);
	gnp_real_cloud_clear(&facets);
}

/* ---- Angles ---- */

static void angles_are_those_put_in(void)
{
	enum { N = 1000 };
	static double truth[3 * N], normals[3 * N];
	static uint32_t at[N];
	struct gnp_random random;
	struct gnp_real_score score;
	double squares = 0;
	gnp_random_seed(&random, 1, 0);
	for (size_t i = 0; i < N; i++) {
		double other[3], side[3], *own = truth + 3 * i, degrees = 20.0 * (double)i / N, turn = degrees * M_PI / 180;
		for (int c = 0; c < 3; c++) {
			own[c] = gnp_random_normal(&random);
			other[c] = gnp_random_normal(&random);
		}
		double length = sqrt(gnp_dot(own, own));
		for (int c = 0; c < 3; c++)
			own[c] /= length;
		gnp_cross(own, other, side);
		double across = sqrt(gnp_dot(side, side));
		at[N - 1 - i] = (uint32_t)i;
		for (int c = 0; c < 3; c++) /* of any length; every fourth on the other side */
			normals[3 * (N - 1 - i) + c] = (i % 4 == 0 ? -3 : 3) * (cos(turn) * own[c] + sin(turn) * side[c] / across);
		squares += degrees * degrees / N;
	}
	CHECK(gnp_real_score_normals(truth, at, N, normals, &score, NULL) == GNP_OK);
	CHECK_NEAR(score.rms, sqrt(squares), 1e-9);
	CHECK_NEAR(score.median, 20 * 499.0 / N, 1e-9);
	CHECK_NEAR(score.within[0], 0.25, 1.1e-3);
	CHECK_NEAR(score.within[1], 0.5, 1.1e-3);
	CHECK_NEAR(score.within[2], 0.75, 1.1e-3);
	CHECK_NEAR(score.sided, 0.75, 1e-9);
	CHECK(score.lost == 0 && isnan(score.curvature));
	for (size_t i = 0; i < 3 * N / 2; i++) /* half of them lost: not finite, or 0 */
		normals[i] = i % 2 ? NAN : 0;
	CHECK(gnp_real_score_normals(truth, at, N, normals, &score, NULL) == GNP_OK);
	CHECK(score.lost == N / 2 && score.rms > 60);
}

static void curvature_goes_with_its_normal(void)
{
	const double truth[6] = {0, 0, 1, 0, 0, 1}, known[2] = {-1, 2}, normals[6] = {0, 0, 1, 0, 0, -1};
	const double estimated[2] = {-1.1, -2};
	const uint32_t at[2] = {0, 1};
	const double zero[2] = {0, 0};
	CHECK_NEAR(gnp_real_score_curvature(truth, known, at, 2, normals, estimated), 0.1 / sqrt(5), 1e-12);
	CHECK(isnan(gnp_real_score_curvature(truth, zero, at, 2, normals, estimated)));
}

/* ---- Summaries ---- */

/* Methods one, pca (two variants) and other over two rows. */
static struct gnp_real_table small_table(void)
{
	static const unsigned k[2] = {10, 18};
	static const double figures[2][4] = {{2, 8, 4, 5}, {9, 3, 6, 6}}; /* one, pca's two, other */
	struct gnp_real_table table = {.method_count = 3, .plan = {.points = 100000, .centres = 7}};
	static const char *const names[] = {"one", "pca", "other"};
	for (int c = 0; c < 3; c++) {
		table.methods[c] = (struct gnp_real_method){.variants = c == 1 ? 2 : 1, .k = c == 1 ? k : NULL};
		snprintf(table.methods[c].name, sizeof table.methods[c].name, "%s", names[c]);
	}
	for (int r = 0; r < 2; r++) {
		struct gnp_real_row *row = gnp_real_table_add(&table);
		snprintf(row->cloud, sizeof row->cloud, "cloud %d", r);
		snprintf(row->variant, sizeof row->variant, "clean");
		for (int f = 0; f < 4; f++) {
			struct gnp_real_score *score = &row->scores[f == 0 ? 0 : f == 3 ? 2 : 1][f == 2];
			score->rms = figures[r][f];
			score->within[2] = 1 - figures[r][f] / 100;
		}
	}
	return table;
}

static void summaries_compare_with_the_best_variant(void)
{
	struct gnp_real_table table = small_table();
	CHECK(gnp_real_table_variant(&table, &table.rows[0], 1) == 1 &&
	      gnp_real_table_variant(&table, &table.rows[1], 1) == 0);
	const struct gnp_real_summary one = gnp_real_table_summary(&table, GNP_REAL_SAMPLES, 0);
	CHECK(one.rows == 2);
	CHECK_NEAR(one.ratio, (2.0 / 4 + 9.0 / 3) / 2, 1e-12);
	CHECK_NEAR(one.best, 0.5, 1e-12);
	CHECK_NEAR(one.worst, 9.0 / 3, 1e-12);
	CHECK_NEAR(one.mean, 5.5, 1e-12);
	CHECK_NEAR(one.least, 0.91, 1e-12);
	const struct gnp_real_summary pca = gnp_real_table_summary(&table, GNP_REAL_SAMPLES, 1);
	CHECK_NEAR(pca.ratio, 1, 1e-12);
	CHECK_NEAR(pca.worst, 2, 1e-12);
	table.methods[0].part = GNP_ABLATION_REMOVED; /* nobody is compared with what is not whole */
	CHECK_NEAR(gnp_real_table_summary(&table, GNP_REAL_SAMPLES, 1).best, 1, 1e-12);
	gnp_real_table_clear(&table);
}

static void the_table_is_written_three_ways(void)
{
	struct gnp_real_table table = small_table();
	char *text = NULL;
	size_t size = 0;
	FILE *out = open_memstream(&text, &size);
	gnp_real_table_write_text(&table, out);
	gnp_real_table_write_markdown(&table, out);
	gnp_real_table_write_json(&table, out);
	fclose(out);
	CHECK_CONTAINS(text, "| cloud 1            | clean              |       0 "
	                     "|        9.00 |   3.00 (10) |        6.00 |");
	CHECK_CONTAINS(text, "| one          |  1.750 |   50.0 |   3.00 |   5.50 |");
	CHECK_CONTAINS(text, "Judged are 7 points a cloud");
	CHECK_CONTAINS(text, "{\"method\": \"pca\", \"part\": \"whole\", \"k\": 18, \"rms\": 4, \"median\": null");
	CHECK_CONTAINS(text, "\"ratio_to_pca\": 1.75");
	free(text);
	gnp_real_table_clear(&table);
}

/* ---- A run ---- */

enum { ROUND = 60, ACROSS = 30 };

/* A torus of triangles as the mesh "ring", and the list that names it to judge and another one to tune by. */
static void write_ring(void)
{
	static double vertices[3 * ROUND * ACROSS];
	static uint32_t triangles[6 * ROUND * ACROSS];
	for (uint32_t i = 0; i < ROUND; i++)
		for (uint32_t j = 0; j < ACROSS; j++) {
			double a = 2 * M_PI * i / ROUND, b = 2 * M_PI * j / ACROSS, *vertex = vertices + 3 * (i * ACROSS + j);
			uint32_t right = (i + 1) % ROUND, up = (j + 1) % ACROSS, *corner = triangles + 6 * (i * ACROSS + j);
			vertex[0] = (2 + cos(b)) * cos(a);
			vertex[1] = (2 + cos(b)) * sin(a);
			vertex[2] = sin(b);
			const uint32_t four[6] = {i * ACROSS + j, right * ACROSS + j,  right * ACROSS + up,
			                          i * ACROSS + j, right * ACROSS + up, i * ACROSS + up};
			memcpy(corner, four, sizeof four);
		}
	write_ply("ring.ply", vertices, ROUND * ACROSS, triangles, 2 * ROUND * ACROSS, 0);
	FILE *out = fopen(path_of("meshes.txt"), "w");
	fputs("absent tune\nring judge\n", out);
	fclose(out);
}

/* A peer that gives no normals, and one that fails. */
static void write_peers(void)
{
	FILE *out = fopen(path_of("open3d"), "w");
	fputs("#!/bin/sh\nhead -c $((5 * 6 * $(wc -c <\"$4\"))) /dev/zero >\"$5\"\necho 0.25\n", out); /* 24 bytes for 4 */
	fclose(out);
	out = fopen(path_of("cgal"), "w");
	fputs("#!/bin/sh\nexit 3\n", out);
	fclose(out);
	CHECK(chmod(path_of("open3d"), 0700) == 0 && chmod(path_of("cgal"), 0700) == 0);
}

static void remove_files(void)
{
	static const char *const files[] = {"ring.ply", "meshes.txt", "open3d", "cgal"};
	for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
		unlink(path_of(files[i]));
}

static struct gnp_real_table run(unsigned workers, unsigned sections, FILE *log)
{
	const struct gnp_real_plan plan = {
		.meshes = folder, .peers = folder, .points = 3000, .centres = 150, .sections = sections};
	struct gnp_real_table table = {0};
	struct gnp_pool *own;
	struct gnp_error error = {0};
	CHECK(gnp_pool_create(workers, &own, NULL) == GNP_OK);
	CHECK(gnp_real_run(&plan, NULL, own, NULL, log, &table, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	gnp_pool_free(own);
	return table;
}

/* Without models: our other estimators, PCA, and the peers. */
static void a_run_judges_every_cloud_alike_for_any_worker_count(void)
{
	char *said = NULL;
	size_t size = 0;
	FILE *log = open_memstream(&said, &size);
	write_ring();
	write_peers();
	struct gnp_real_table one = run(1, 1u << GNP_REAL_SAMPLES | 1u << GNP_REAL_VERTICES, log);
	struct gnp_real_table two = run(2, 1u << GNP_REAL_SAMPLES | 1u << GNP_REAL_VERTICES, NULL);
	fclose(log);
	remove_files();
	CHECK_CONTAINS(said, "skipped: pcl_mls\n");
	CHECK_CONTAINS(said, "ring, noise 1.2 %: cgal_jets failed: ");
	free(said);
	CHECK(one.row_count == 7 && two.row_count == 7 && one.mesh_count == 1 &&
	      one.meshes[0].triangles == 2 * ROUND * ACROSS);
	CHECK(gnp_real_table_find(&one, "pcl_pca") == one.method_count);
	size_t adaptive = gnp_real_table_find(&one, "adaptive"), pca = gnp_real_table_find(&one, "pca");
	size_t none = gnp_real_table_find(&one, "open3d_pca");
	CHECK_NEAR(one.seconds[none], 7 * 0.25, 1e-9);
	for (size_t r = 0; r < one.row_count; r++) {
		CHECK(memcmp(one.rows[r].scores, two.rows[r].scores, sizeof one.rows[r].scores) == 0);
		CHECK(one.rows[r].centres == 150);
		CHECK(one.rows[r].scores[none][2].lost == 150 && one.rows[r].scores[none][2].rms == 90);
		CHECK(gnp_real_table_score(&one, &one.rows[r], gnp_real_table_find(&one, "cgal_jets"))->rms == 90);
	}
	CHECK_AT_MOST(gnp_real_table_score(&one, &one.rows[0], adaptive)->rms, 4); /* facets of 6 to 12 degrees */
	CHECK_AT_MOST(gnp_real_table_score(&one, &one.rows[0], pca)->rms, 5);
	CHECK(one.rows[0].scores[adaptive][0].sided > 0.99 && isnan(one.rows[0].scores[pca][0].sided));
	CHECK(gnp_real_table_score(&one, &one.rows[3], pca)->rms >
	      1.5 * gnp_real_table_score(&one, &one.rows[0], pca)->rms);
	gnp_real_table_clear(&one);
	gnp_real_table_clear(&two);
}

/* The table's PCA of 10 points against one that looks at every point. */
static void the_tables_pca_is_that_of_the_nearest_points(void)
{
	struct gnp_real_cloud cloud;
	struct gnp_real_score scores[GNP_REAL_VARIANTS], brute;
	double seconds = 0, normals[3 * 20];
	struct gnp_real_method methods[GNP_REAL_METHODS_MAX];
	CHECK(gnp_real_method_list(NULL, NULL, methods) == 3);
	CHECK(gnp_real_body_make(1, pool, &cloud, NULL) == GNP_OK); /* a noisy torus of 2,000 points */
	CHECK(gnp_real_cloud_choose(&cloud, 20, 1, NULL) == GNP_OK);
	CHECK(gnp_real_method_judge(&methods[2], NULL, &cloud, pool, scores, &seconds, NULL) == GNP_OK);
	for (size_t i = 0; i < 20; i++) {
		uint32_t near[10];
		double limit = 0; /* grows past one point after the other */
		for (int n = 0; n < 10; n++) {
			double best = INFINITY;
			for (size_t j = 0; j < cloud.count; j++) {
				double d[3], square;
				for (int c = 0; c < 3; c++)
					d[c] = cloud.points[3 * j + c] - cloud.points[3 * (size_t)cloud.centres[i] + c];
				square = gnp_dot(d, d);
				if (square < best && (n == 0 || square > limit)) {
					best = square;
					near[n] = (uint32_t)j;
				}
			}
			limit = best;
		}
		struct gnp_pca fit;
		gnp_pca_fit(cloud.points, near, 10, &fit);
		memcpy(normals + 3 * i, fit.axes[2], sizeof fit.axes[2]);
	}
	CHECK(gnp_real_score_normals(cloud.normals, cloud.centres, 20, normals, &brute, NULL) == GNP_OK);
	CHECK_NEAR(scores[0].rms, brute.rms, 1e-9);
	CHECK(seconds > 0);
	gnp_real_cloud_clear(&cloud);
}

static void folders_without_meshes_are_refused(void)
{
	struct gnp_real_plan plan = {.points = 3000, .centres = 10, .sections = 1u << GNP_REAL_SAMPLES};
	struct gnp_real_table table;
	struct gnp_error error = {0}, other = {0};
	CHECK(gnp_real_run(&plan, NULL, pool, NULL, NULL, &table, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "deploy/fetch-meshes.sh");
	write_ring();
	plan.meshes = folder;
	plan.only = "rings,in";
	CHECK(gnp_real_run(&plan, NULL, pool, NULL, NULL, &table, &other) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(other.text, "names no mesh that is wanted");
	remove_files();
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(a_mesh_is_read_with_its_area_and_size),
		TEST(damaged_meshes_are_refused),
		TEST(vertices_get_the_mean_of_their_triangles_by_area),
		TEST(samples_lie_on_the_sides_as_often_as_these_are_large),
		TEST(noise_is_in_units_of_the_diagonal),
		TEST(densities_are_as_their_names_say),
		TEST(centres_are_distinct_and_of_those_that_may_be_judged),
		TEST(rows_are_apart_by_their_ratio),
		TEST(the_lidar_sees_what_faces_it),
		TEST(bodies_are_made_with_their_truth),
		TEST(angles_are_those_put_in),
		TEST(curvature_goes_with_its_normal),
		TEST(summaries_compare_with_the_best_variant),
		TEST(the_table_is_written_three_ways),
		TEST(a_run_judges_every_cloud_alike_for_any_worker_count),
		TEST(the_tables_pca_is_that_of_the_nearest_points),
		TEST(folders_without_meshes_are_refused),
	};
	strcpy(folder, "/tmp/gnp-test-XXXXXX");
	if (!mkdtemp(folder) || gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int code = RUN_TESTS(tests);
	gnp_pool_free(pool);
	rmdir(folder);
	return code;
}
