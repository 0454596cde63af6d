/* The operations that solve equations, from request to answer, on a sphere whose harmonics are known. */
#include "tests/bench/cloud_request.h"

#include <stdint.h>

#include "proto/file/file.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"

enum { COUNT = 3000 };

static const double *points_of(const struct gnp_request *request)
{
	return gnp_tensors_find(&request->inputs, "points")->data;
}

/* An input (COUNT, 2): scale_a z and scale_b (z^2 - 1/3), eigenfunctions of -Delta to 2 and 6. */
static void add_harmonics(struct gnp_request *request, const char *name, double scale_a, double scale_b)
{
	size_t shape[] = {COUNT, 2};
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(&request->inputs, name, GNP_FP64, 2, shape, &tensor, NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++) {
		double z = points_of(request)[3 * i + 2];
		((double *)tensor->data)[2 * i] = scale_a * z;
		((double *)tensor->data)[2 * i + 1] = scale_b * (z * z - 1.0 / 3);
	}
}

static void add_mask(struct gnp_request *request, const char *name, size_t ones, size_t value)
{
	size_t count = COUNT;
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(&request->inputs, name, GNP_UINT8, 1, &count, &tensor, NULL) == GNP_OK);
	memset(tensor->data, 0, tensor->size);
	for (size_t i = 0; i < ones; i++)
		((unsigned char *)tensor->data)[i] = (unsigned char)value;
}

static struct gnp_request begin(const char *parameters)
{
	struct gnp_request request = {0};
	add_sphere(&request, GNP_FP64, COUNT, 0);
	set_parameters(&request, parameters);
	return request;
}

/* A column of (COUNT, 2) against scale times the harmonics. */
static void check_harmonics(const struct gnp_request *request, const struct gnp_tensor *tensor, double scale_a, double scale_b, double within)
{
	double worst = 0;
	for (size_t i = 0; tensor && i < COUNT; i++) {
		double z = points_of(request)[3 * i + 2];
		worst = fmax(worst, fabs(gnp_tensor_get(tensor, 2 * i) - scale_a * z));
		worst = fmax(worst, fabs(gnp_tensor_get(tensor, 2 * i + 1) - scale_b * (z * z - 1.0 / 3)));
	}
	CHECK(tensor != NULL);
	CHECK_AT_MOST(worst, within);
}

static void end(struct gnp_request *request, struct gnp_response *response)
{
	gnp_response_clear(response);
	gnp_request_clear(request);
}

static void check_refused(const char *operation, struct gnp_request *request, const char *text_part)
{
	struct gnp_response response = {0};
	struct gnp_error error = {0};
	CHECK(run_request(operation, request, &response, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, text_part);
	CHECK(response.outputs.count == 0);
	end(request, &response);
}

static void poisson_solves_for_harmonics(void)
{
	static const char *const kinds[] = {"estimator=gmls k=50 degree=4 basis=total", "estimator=gmls k=50 degree=4 basis=total system=least_squares",
	                                    "estimator=gmls k=50 degree=4 basis=total solver=iterative"};
	for (size_t k = 0; k < 3; k++) {
		struct gnp_request request = begin(kinds[k]);
		struct gnp_response response = {0};
		add_harmonics(&request, "source", 2, 6);
		run_well("poisson", &request, &response);
		check_harmonics(&request, output(&response, "solution", GNP_FP64, COUNT, 2), 1, 1, 2e-3);
		output(&response, "misfit", GNP_FP64, 2, 0);
		output(&response, "mean", GNP_FP64, 2, 0);
		const struct gnp_tensor *residual = output(&response, "residual", GNP_FP64, 2, 0);
		CHECK_AT_MOST(residual ? gnp_tensor_get(residual, 0) : NAN, 1e-7);
		CHECK(number(&response, "right_hand_sides") == 2 && number(&response, "components") == 1 && number(&response, "operator_bytes") > 0);
		CHECK_STRING(text(&response, "solver"), k == 2 ? "iterative" : "direct");
		CHECK(!text(&response, "warnings")[0]);
		CHECK_NEAR(number(&response, "energy"), 1, 0.02);
		end(&request, &response);
	}
}

static void a_mean_is_taken_off_and_told(void)
{
	struct gnp_request request = begin("estimator=gmls k=50 degree=4 basis=total outputs=solution,mean");
	struct gnp_response response = {0};
	add_harmonics(&request, "source", 2, 6);
	double *source = gnp_tensors_find(&request.inputs, "source")->data;
	for (size_t i = 0; i < COUNT; i++)
		source[2 * i] += 5;
	run_well("poisson", &request, &response);
	CHECK(response.outputs.count == 2);
	check_harmonics(&request, output(&response, "solution", GNP_FP64, COUNT, 2), 1, 1, 2e-3);
	CHECK_NEAR(gnp_tensor_get(output(&response, "mean", GNP_FP64, 2, 0), 0), 5, 1e-2);
	CHECK_CONTAINS(text(&response, "warnings"), "1 of 2 right-hand sides had no zero mean");
	end(&request, &response);
}

/* Points so far off the sphere, in and out by turns, that neighbours say nothing of the surface. */
static void a_solution_not_to_be_believed_is_told(void)
{
	struct gnp_request request = begin("estimator=gmls k=50 degree=4 basis=total system=square");
	struct gnp_response response = {0};
	add_harmonics(&request, "source", 2, 6);
	double *points = gnp_tensors_find(&request.inputs, "points")->data;
	for (size_t i = 0; i < 3 * COUNT; i++)
		points[i] *= 1 + 0.1 * sin(3.7 * (double)(i / 3));
	run_well("poisson", &request, &response);
	CHECK(number(&response, "energy") > 1.5);
	CHECK_CONTAINS(text(&response, "warnings"), "2 of 2 solutions are not to be believed: their energy is up to ");
	end(&request, &response);
}

/* (10 - Delta) u = f, and points whose values are given. */
static void screening_and_given_values(void)
{
	struct gnp_request request = begin("estimator=gmls k=50 degree=4 basis=total screening=10");
	struct gnp_response response = {0};
	add_harmonics(&request, "source", 12, 16);
	run_well("poisson", &request, &response);
	check_harmonics(&request, output(&response, "solution", GNP_FP64, COUNT, 2), 1, 1, 2e-3);
	end(&request, &response);
	request = begin("estimator=gmls k=50 degree=4 basis=total");
	add_harmonics(&request, "source", 2, 6);
	add_mask(&request, "fixed", 100, 1);
	add_harmonics(&request, "values", 1, 1);
	run_well("poisson", &request, &response);
	check_harmonics(&request, output(&response, "solution", GNP_FP64, COUNT, 2), 1, 1, 2e-3);
	end(&request, &response);
}

static void add_rows(struct gnp_request *request, const char *name, unsigned rank, size_t rows, const double *values)
{
	const size_t shape[] = {rows, 2};
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(&request->inputs, name, GNP_FP64, rank, shape, &tensor, NULL) == GNP_OK);
	memcpy(tensor->data, values, tensor->size);
}

/* Strengths that cancel in one column, and are worth their area in the other: alpha u - Delta u = f has the integral
 * of f over alpha. */
static void sources_at_points_have_their_strength(void)
{
	struct gnp_request request = begin("estimator=gmls screening=2 system=symmetric");
	struct gnp_response response = {0};
	add_rows(&request, "source_points", 1, 2, (const double[]){7, 1234});
	add_rows(&request, "source_strengths", 2, 2, (const double[]){1, 3, -1, 5});
	run_well("poisson", &request, &response);
	const struct gnp_tensor *u = output(&response, "solution", GNP_FP64, COUNT, 2);
	double mean[2] = {0};
	for (size_t i = 0; u && i < 2 * COUNT; i++)
		mean[i % 2] += gnp_tensor_get(u, i) / COUNT;
	CHECK_NEAR(mean[0], 0, 0.01);
	CHECK_NEAR(mean[1], 8 / (2 * 4 * M_PI), 0.01);
	CHECK(u && gnp_tensor_get(u, 14) > 0.1 && gnp_tensor_get(u, 2468) < -0.1);
	end(&request, &response);
}

static void heat_keeps_snapshots(void)
{
	struct gnp_request request = begin("estimator=gmls dt=0.01 steps=5 snapshot_every=2 scheme=tr_bdf2");
	struct gnp_response response = {0};
	add_harmonics(&request, "initial", 1, 1);
	run_well("heat", &request, &response);
	const struct gnp_tensor *snapshots = gnp_tensors_find(&response.outputs, "snapshots"), *u = output(&response, "solution", GNP_FP64, COUNT, 2);
	const struct gnp_tensor *times = output(&response, "snapshot_time", GNP_FP64, 4, 0);
	CHECK(snapshots && snapshots->rank == 3 && snapshots->shape[0] == 4 && snapshots->shape[1] == COUNT && snapshots->shape[2] == 2);
	for (size_t i = 0; snapshots && u && i < 2 * COUNT; i++)
		CHECK(gnp_tensor_get(snapshots, 3 * 2 * COUNT + i) == gnp_tensor_get(u, i));
	CHECK(times && gnp_tensor_get(times, 2) == 0.04 && gnp_tensor_get(times, 3) == 0.05);
	check_harmonics(&request, u, exp(-0.1), exp(-0.3), 2e-3);
	end(&request, &response);
	request = begin("estimator=gmls dt=0.01 outputs=snapshots");
	add_harmonics(&request, "initial", 1, 1);
	check_refused("heat", &request, "snapshots: needs snapshot_every, got 0");
}

static void bad_inputs_are_named(void)
{
	struct gnp_request request = begin("estimator=gmls");
	check_refused("poisson", &request, "input \"source\": missing, and no source_points, values or flux instead");
	request = begin("estimator=gmls dt=1");
	check_refused("heat", &request, "input \"initial\": missing, and no source");
	request = begin("estimator=gmls");
	add_rows(&request, "source_strengths", 2, 1, (const double[]){1, 1});
	check_refused("poisson", &request, "source_strengths: need the input source_points, which says where they are");
	request = begin("estimator=gmls");
	add_rows(&request, "source_points", 1, 2, (const double[]){1, 3000});
	check_refused("poisson", &request, "source_points[1]: got 3000, need an index below 3000");
	request = begin("estimator=gmls");
	add_rows(&request, "source_points", 1, 2, (const double[]){1, 2});
	add_rows(&request, "source_strengths", 2, 1, (const double[]){1, 1});
	check_refused("poisson", &request, "source_strengths: got 1 rows, need 2 as source_points has");
	request = begin("estimator=gmls system=symmetric");
	add_harmonics(&request, "flux", 1, 1);
	check_refused("poisson", &request, "flux: the surface has no open edge");
	request = begin("estimator=gmls");
	add_harmonics(&request, "source", 2, 6);
	add_harmonics(&request, "values", 1, 1);
	check_refused("poisson", &request, "values: need the input fixed");
	request = begin("estimator=gmls");
	add_harmonics(&request, "source", 2, NAN);
	check_refused("poisson", &request, "source");
	request = begin("estimator=gmls");
	add_harmonics(&request, "source", 2, 6);
	add_mask(&request, "fixed", 3, 7);
	check_refused("poisson", &request, "fixed[0]: got 7, need 0 or 1");
	request = begin("estimator=gmls drop=0.9");
	add_harmonics(&request, "source", 2, 6);
	check_refused("poisson", &request, "drop: got 0.9");
	request = begin("estimator=gmls source=3000");
	check_refused("geodesic", &request, "source: got 3000, need at most 2999");
	request = begin("estimator=gmls");
	add_mask(&request, "sources", 0, 1);
	check_refused("geodesic", &request, "sources: got none");
	request = begin("estimator=gmls count=0");
	check_refused("spectrum", &request, "count: got 0");
	request = begin("estimator=gmls dt=0");
	add_harmonics(&request, "initial", 1, 1);
	check_refused("heat", &request, "dt: got 0");
}

/* The operator is made once: for other sources, not for another cloud or other parameters. */
static void operators_are_kept_between_requests(void)
{
	struct gnp_pool *pool;
	struct gnp_prepared_cache *cache;
	static const char *const parameters[] = {"estimator=gmls k=40", "estimator=gmls k=40", "estimator=gmls k=41", "estimator=gmls k=40 screening=1",
	                                         "estimator=gmls k=40"};
	static const bool kept[] = {false, true, false, false, true};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	CHECK(gnp_prepared_cache_create((size_t)1 << 30, &cache, NULL) == GNP_OK);
	for (size_t r = 0; r < 5; r++) {
		struct gnp_request request = begin(parameters[r]);
		struct gnp_response response = {0};
		struct gnp_call call;
		add_harmonics(&request, "source", (double)r + 1, 6);
		CHECK(gnp_call_prepare(gnp_operation_find("poisson"), &request, &(struct gnp_limits){.cache = cache}, &call, NULL) == GNP_OK);
		CHECK(call.memory > (size_t)COUNT * 1000);
		CHECK(gnp_call_run(&call, pool, NULL, &response, NULL) == GNP_OK);
		const struct gnp_value *found = gnp_values_find(&response.parameters, "operator_kept");
		CHECK(found && found->boolean == kept[r]);
		found = gnp_values_find(&response.parameters, "operator_bytes");
		CHECK(found && found->integer > 0 && (double)call.memory > 1.4 * (double)found->integer); /* what is held is less than what it took to make */
		end(&request, &response);
	}
	struct gnp_prepared_cache_state state = gnp_prepared_cache_state(cache);
	CHECK(state.entries == 3 && state.hits == 2 && state.misses == 3 && state.bytes > (size_t)3 * COUNT * 100);
	gnp_prepared_cache_free(cache);
	gnp_pool_free(pool);
}

/* A column is a byte a point in the body and forty at work: 15 MB of them made 500 MB that nobody had counted. */
static void every_right_hand_side_is_paid_for(void)
{
	enum { FEW = 8, MANY = 1000 };
	static const struct {
		const char *operation, *input;
	} cases[] = {{"poisson", "source"}, {"heat", "initial"}};
	for (size_t c = 0; c < 2; c++) {
		size_t memory[2] = {0};
		for (size_t i = 0; i < 2; i++) {
			struct gnp_request request = begin("estimator=gmls");
			struct gnp_call call;
			struct gnp_tensor *columns;
			CHECK(gnp_tensors_add(&request.inputs, cases[c].input, GNP_UINT8, 2, (size_t[]){COUNT, i ? MANY : FEW}, &columns, NULL) == GNP_OK);
			CHECK(gnp_call_prepare(gnp_operation_find(cases[c].operation), &request, NULL, &call, NULL) == GNP_OK);
			memory[i] = call.memory;
			gnp_request_clear(&request);
		}
		CHECK(memory[1] - memory[0] >= (size_t)(MANY - FEW) * (5 * sizeof(double) * COUNT + 3 * sizeof(double)));
	}
}

static void heat_decays_by_its_law(void)
{
	struct gnp_request request = begin("estimator=gmls k=50 degree=4 basis=total dt=0.01 steps=10");
	struct gnp_response response = {0};
	add_harmonics(&request, "initial", 1, 1);
	run_well("heat", &request, &response);
	check_harmonics(&request, output(&response, "solution", GNP_FP64, COUNT, 2), pow(1.02, -10), pow(1.06, -10), 1e-3);
	CHECK_NEAR(number(&response, "time"), 0.1, 1e-12);
	end(&request, &response);
}

static void geodesics_are_great_circles(void)
{
	struct gnp_request request = begin("estimator=gmls source=100");
	struct gnp_response response = {0};
	run_well("geodesic", &request, &response);
	const struct gnp_tensor *distance = output(&response, "distance", GNP_FP64, COUNT, 0);
	const double *p = points_of(&request), *o = p + 300;
	double error = 0;
	for (size_t i = 0; distance && i < COUNT; i++)
		error += fabs(gnp_tensor_get(distance, i) - acos(fmin(1, fmax(-1, p[3 * i] * o[0] + p[3 * i + 1] * o[1] + p[3 * i + 2] * o[2])))) / COUNT;
	CHECK(distance && gnp_tensor_get(distance, 100) == 0);
	CHECK_AT_MOST(error, 0.03);
	end(&request, &response);
}

static void spectrum_is_the_spheres(void)
{
	struct gnp_request request = begin("estimator=gmls k=50 degree=4 basis=total count=9");
	struct gnp_response response = {0};
	run_well("spectrum", &request, &response);
	const struct gnp_tensor *values = output(&response, "eigenvalues", GNP_FP64, 9, 0);
	static const double want[] = {0, 2, 2, 2, 6, 6, 6, 6, 6};
	for (size_t e = 0; values && e < 9; e++)
		CHECK_NEAR(gnp_tensor_get(values, e), want[e], 0.005 * want[e] + 1e-6);
	output(&response, "eigenvectors", GNP_FP64, COUNT, 9);
	end(&request, &response);
}

/* Where u is fixed the vectors are 0; of the eigenvalues about a value none is far from it. */
static void spectrum_has_fixed_points_and_a_shift(void)
{
	struct gnp_request request = begin("estimator=gmls count=3 system=symmetric");
	struct gnp_response response = {0};
	add_mask(&request, "fixed", COUNT / 2, 1);
	run_well("spectrum", &request, &response);
	const struct gnp_tensor *values = output(&response, "eigenvalues", GNP_FP64, 3, 0);
	const struct gnp_tensor *vectors = output(&response, "eigenvectors", GNP_FP64, COUNT, 3);
	CHECK(values && gnp_tensor_get(values, 0) > 1e-3);
	for (size_t i = 0; vectors && i < COUNT / 2 * 3; i++)
		CHECK(gnp_tensor_get(vectors, i) == 0);
	end(&request, &response);
	request = begin("estimator=gmls count=5 shift=6 system=symmetric");
	run_well("spectrum", &request, &response);
	values = output(&response, "eigenvalues", GNP_FP64, 5, 0);
	for (size_t e = 0; values && e < 5; e++)
		CHECK_NEAR(gnp_tensor_get(values, e), 6, 0.1);
	end(&request, &response);
}

static const char *line_of(const struct gnp_buffer *file, const char *begin)
{
	const char *line = strstr((const char *)file->data, begin);
	return line ? line + strlen(begin) : "";
}

/* Rows of S sum to zero, and its energy is that of the sphere; as Matrix Market one half is written, and the masses are
 * a diagonal. */
static void the_symmetric_laplacian_has_its_stiffness_and_masses(void)
{
	struct gnp_request request = begin("estimator=gmls system=symmetric");
	struct gnp_response response = {0};
	struct gnp_buffer file = {0};
	run_well("laplacian", &request, &response);
	const struct gnp_tensor *offsets = output(&response, "row_offsets", GNP_INT64, COUNT + 1, 0);
	size_t entries = offsets ? (size_t)gnp_tensor_get(offsets, COUNT) : 0;
	const struct gnp_tensor *columns = output(&response, "columns", GNP_INT64, entries, 0);
	const struct gnp_tensor *s = output(&response, "stiffness", GNP_FP64, entries, 0);
	const struct gnp_tensor *mass = output(&response, "mass", GNP_FP64, COUNT, 0);
	const struct gnp_tensor *values = output(&response, "values", GNP_FP64, entries, 0);
	double area = 0, z = 0;
	for (size_t i = 0; mass && s && columns && values && i < COUNT; i++) {
		double sum = 0;
		for (size_t e = (size_t)gnp_tensor_get(offsets, i); e < (size_t)gnp_tensor_get(offsets, i + 1); e++) {
			size_t j = (size_t)gnp_tensor_get(columns, e);
			double d = points_of(&request)[3 * i + 2] - points_of(&request)[3 * j + 2];
			sum += gnp_tensor_get(s, e);
			z -= gnp_tensor_get(s, e) * d * d / 2;
			double value = gnp_tensor_get(values, e);
			CHECK_NEAR(value, -gnp_tensor_get(s, e) / gnp_tensor_get(mass, i), 1e-9 * fabs(value));
		}
		CHECK_NEAR(sum, 0, 1e-12);
		area += gnp_tensor_get(mass, i);
	}
	CHECK_NEAR(area, 4 * acos(-1), 0.05);
	CHECK_NEAR(z, 2 * area / 3, 0.05); /* the energy of z is twice its square */
	CHECK(gnp_file_encode(&gnp_format_mtx, &response.outputs, NULL, &file, NULL) == GNP_OK);
	gnp_buffer_append(&file, "", 1, NULL);
	char size[64];
	snprintf(size, sizeof size, "%d %d %zu\n1 1 ", COUNT, COUNT, (entries + COUNT) / 2);
	CHECK(strncmp(line_of(&file, "%%MatrixMarket matrix coordinate real symmetric\n"), size, strlen(size)) == 0);
	gnp_buffer_clear(&file);
	struct gnp_tensors alone = {0};
	if (mass)
		gnp_tensors_add_data(&alone, "mass", GNP_FP64, 1, mass->shape, mass->data, false, NULL, NULL);
	CHECK(gnp_file_encode(&gnp_format_mtx, &alone, NULL, &file, NULL) == GNP_OK);
	gnp_buffer_append(&file, "", 1, NULL);
	snprintf(size, sizeof size, "%d %d %d\n1 1 ", COUNT, COUNT, COUNT);
	CHECK(strncmp(line_of(&file, "%%MatrixMarket matrix coordinate real symmetric\n"), size, strlen(size)) == 0);
	gnp_buffer_clear(&file);
	gnp_tensors_clear(&alone);
	end(&request, &response);
}

/* Row sums of the Laplacian are zero, and Delta z = -2 z; the same as Matrix Market. */
static void laplacian_comes_as_rows_and_as_matrix_market(void)
{
	struct gnp_request request = begin("estimator=gmls k=50 degree=4 basis=total");
	struct gnp_response response = {0};
	struct gnp_buffer file = {0};
	run_well("laplacian", &request, &response);
	const struct gnp_tensor *offsets = output(&response, "row_offsets", GNP_INT64, COUNT + 1, 0), *kept = output(&response, "kept", GNP_INT64, COUNT, 0);
	size_t entries = offsets ? (size_t)gnp_tensor_get(offsets, COUNT) : 0;
	const struct gnp_tensor *columns = output(&response, "columns", GNP_INT64, entries, 0), *values = output(&response, "values", GNP_FP64, entries, 0);
	CHECK(response.outputs.count == 4 && kept && columns && values);
	for (size_t i = 0; values && columns && i < COUNT; i++) {
		double sum = 0, z = 0;
		for (int64_t e = ((int64_t *)offsets->data)[i]; e < ((int64_t *)offsets->data)[i + 1]; e++) {
			double value = ((double *)values->data)[e];
			sum += value;
			z += value * points_of(&request)[3 * ((int64_t *)columns->data)[e] + 2];
		}
		CHECK_NEAR(sum, 0, 1e-7);
		CHECK_NEAR(z, -2 * points_of(&request)[3 * i + 2], 0.02);
	}
	CHECK(gnp_file_encode(&gnp_format_mtx, &response.outputs, &response.parameters, &file, NULL) == GNP_OK);
	gnp_buffer_append(&file, "", 1, NULL);
	char size[64];
	snprintf(size, sizeof size, "\n%d %d %zu\n1 1 ", COUNT, COUNT, entries);
	CHECK(strncmp((const char *)file.data, "%%MatrixMarket matrix coordinate real general\n% estimator gmls\n", 62) == 0);
	CHECK_CONTAINS((const char *)file.data, size);
	gnp_buffer_clear(&file);
	CHECK(gnp_file_encode(&gnp_format_mtx, &request.inputs, NULL, &file, NULL) == GNP_NOT_ACCEPTABLE);
	gnp_buffer_clear(&file);
	end(&request, &response);
}

/* Their squares leave the range of numbers: the answer was not a number, or nothing. */
static void sources_of_any_size_are_solved_for(void)
{
	static const double sizes[] = {1e-200, 1, 1e200};
	for (size_t s = 0; s < 3; s++) {
		struct gnp_request request = begin("estimator=gmls k=50 degree=4 basis=total");
		struct gnp_response response = {0};
		add_harmonics(&request, "source", 2 * sizes[s], 6 * sizes[s]);
		run_well("poisson", &request, &response);
		const struct gnp_tensor *solution = gnp_tensors_find(&response.outputs, "solution");
		for (size_t i = 0; solution && i < 2 * COUNT; i++)
			((double *)solution->data)[i] /= sizes[s];
		check_harmonics(&request, solution, 1, 1, 2e-3);
		for (size_t side = 0; side < 2; side++) {
			CHECK_AT_MOST(gnp_tensor_get(gnp_tensors_find(&response.outputs, "residual"), side), 1e-9);
			CHECK_AT_MOST(gnp_tensor_get(gnp_tensors_find(&response.outputs, "misfit"), side), 1e-2);
		}
		CHECK_NEAR(number(&response, "energy"), 1, 0.1);
		end(&request, &response);
	}
}

/* Rows of given points have another unit than the others: in a small one of length the residual was anything. */
static void a_residual_does_not_depend_on_the_unit_of_length(void)
{
	static const double units[] = {1e-12, 1, 1e12};
	for (size_t u = 0; u < 3; u++) {
		struct gnp_request request = begin("estimator=gmls outputs=solution,residual");
		struct gnp_response response = {0};
		add_harmonics(&request, "source", 2, 6);
		add_harmonics(&request, "values", 1, 1);
		add_mask(&request, "fixed", 100, 1);
		double *points = gnp_tensors_find(&request.inputs, "points")->data;
		for (size_t i = 0; i < 3 * COUNT; i++)
			points[i] *= units[u];
		run_well("poisson", &request, &response);
		CHECK_AT_MOST(number(&response, "residual"), 1e-9);
		CHECK(!strstr(text(&response, "warnings"), "residual: "));
		end(&request, &response);
	}
}

static void what_drowns_in_rounding_is_refused(void)
{
	struct gnp_request request = begin("estimator=gmls screening=1e100");
	add_harmonics(&request, "source", 1, 1);
	check_refused("poisson", &request, "screening: got 1e+100 (of heat: one over dt), need at most ");
	request = begin("estimator=gmls");
	double *points = gnp_tensors_find(&request.inputs, "points")->data;
	for (size_t i = 0; i < 3 * COUNT; i++)
		points[i] *= 1e-40;
	check_refused("laplacian", &request, "of the first one, equations need 1e-25..1e+25: take another unit of length");
}

/* 5 by 6 points of a plane, of which no stencil sees around itself. */
static void a_system_near_singular_is_told(void)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_tensor *points, *source;
	CHECK(gnp_tensors_add(&request.inputs, "points", GNP_FP64, 2, (size_t[]){30, 3}, &points, NULL) == GNP_OK);
	CHECK(gnp_tensors_add(&request.inputs, "source", GNP_FP64, 2, (size_t[]){30, 1}, &source, NULL) == GNP_OK);
	points = &request.inputs.items[0];
	for (size_t i = 0; i < 30; i++) {
		((double *)points->data)[3 * i] = (double)(i % 5);
		((double *)points->data)[3 * i + 1] = (double)(i / 5);
		((double *)points->data)[3 * i + 2] = 0;
		((double *)source->data)[i] = i == 15;
	}
	set_parameters(&request, "estimator=gmls system=square");
	run_well("poisson", &request, &response);
	CHECK(number(&response, "residual") > 1e-6);
	CHECK_CONTAINS(text(&response, "warnings"), "residual: the system was solved to a relative residual of ");
	end(&request, &response);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(poisson_solves_for_harmonics), TEST(a_mean_is_taken_off_and_told), TEST(a_solution_not_to_be_believed_is_told), TEST(screening_and_given_values),
	                                    TEST(bad_inputs_are_named), TEST(operators_are_kept_between_requests), TEST(every_right_hand_side_is_paid_for), TEST(heat_decays_by_its_law), TEST(sources_at_points_have_their_strength), TEST(heat_keeps_snapshots),
	                                    TEST(geodesics_are_great_circles), TEST(spectrum_is_the_spheres),
	                                    TEST(spectrum_has_fixed_points_and_a_shift),
	                                    TEST(the_symmetric_laplacian_has_its_stiffness_and_masses),
	                                    TEST(laplacian_comes_as_rows_and_as_matrix_market), TEST(sources_of_any_size_are_solved_for),
	                                    TEST(a_residual_does_not_depend_on_the_unit_of_length), TEST(what_drowns_in_rounding_is_refused),
	                                    TEST(a_system_near_singular_is_told)};
	return RUN_TESTS(tests);
}
