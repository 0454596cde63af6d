/* What a request does when memory is exhausted: each allocation between its first line and its answer fails once, and three in a row. The
 * linker puts the functions below in place of malloc and its kin for all of our code (see the Makefile), under any sanitizer; leaks show
 * under SAN=address. Libraries' own allocations are failed in tests/e2e/test_exhaustion.py. */
#include "tests/unit/test.h"

#include <fcntl.h>
#include <jansson.h>
#include <stdatomic.h>
#include <unistd.h>
#include <zlib.h>

#include "core/base/pool.h"
#include "proto/file/file.h"
#include "proto/json/json_memory.h"
#include "proto/oip/oip.h"
#include "proto/operation/operations.h"
#include "server/access/guard.h"
#include "server/api/openapi.h"
#include "server/api/request.h"
#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/base/log.h"
#include "server/config/config.h"
#include "server/jobs/job_watch.h"
#include "server/jobs/jobs.h"
#include "server/work/loader.h"

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *piece, size_t size);
char *__real_strdup(const char *text);
char *__real_strndup(const char *text, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *piece, size_t size);
char *__wrap_strdup(const char *text);
char *__wrap_strndup(const char *text, size_t size);

static atomic_long asked, first_doomed = -1, last_doomed = -1;

static bool doomed(void)
{
	long number = atomic_fetch_add(&asked, 1);
	return number >= atomic_load(&first_doomed) && number <= atomic_load(&last_doomed);
}

void *__wrap_malloc(size_t size) { return doomed() ? NULL : __real_malloc(size); }
void *__wrap_calloc(size_t count, size_t size) { return doomed() ? NULL : __real_calloc(count, size); }
void *__wrap_realloc(void *piece, size_t size) { return doomed() ? NULL : __real_realloc(piece, size); }
char *__wrap_strdup(const char *text) { return doomed() ? NULL : __real_strdup(text); }
char *__wrap_strndup(const char *text, size_t size) { return doomed() ? NULL : __real_strndup(text, size); }

enum { COUNT = 60 };

static struct gnpd_config config;
static struct gnpd_log events;
static struct gnpd_metrics metrics;
static struct gnpd_server server = {.engine = {.config = &config, .log = &events, .metrics = &metrics}};

/* One kind of request. */
struct kind {
	const char *uri, *content_type, *encoding;
	char inference_length[24]; /* "" for none */
	const void *body;
	size_t size;
	int code; /* of the answer when memory is there */
};

static void fill(struct gnpd_request *request, const struct kind *kind)
{
	strcpy(request->method, kind->size ? "POST" : "GET");
	struct gnpd_work *work = &request->work;
	work->content_type = kind->content_type;
	work->content_encoding = kind->encoding;
	work->inference_length = kind->inference_length[0] ? kind->inference_length : NULL;
	work->query = request->target.query;
	work->body.data = __real_malloc(kind->size ? kind->size : 1);
	work->body.size = work->body.capacity = kind->size;
	if (kind->size)
		memcpy(work->body.data, kind->body, kind->size);
}

static void check_reply(const struct gnpd_request *request, long number)
{
	const struct gnp_buffer *body = &request->reply.body;
	if (request->reply.code == 200)
		return;
	json_t *root = json_loadb((const char *)body->data, body->size, 0, NULL);
	const char *code = json_string_value(json_object_get(root, "code"));
	if (request->reply.code == 503 && number >= 0)
		CHECK_STRING(code, "out_of_memory");
	CHECK(code && json_string_value(json_object_get(root, "error")));
	json_decref(root);
}

/* From its first line to its answer, as http.c leads it. The code of the answer; 0: the connection would be dropped. number: of the
 * allocation that fails, < 0 for none. */
static int handle(const struct kind *kind, long number, long count)
{
	struct gnp_error error = {0};
	atomic_store(&asked, 0);
	atomic_store(&first_doomed, number);
	atomic_store(&last_doomed, number < 0 ? -1 : number + count - 1);
	struct gnpd_request *request = gnpd_request_create(&server, kind->uri);
	gnp_status status = GNP_OUT_OF_MEMORY;
	if (request) {
		fill(request, kind);
		status = gnpd_routes_match(request, &error);
	}
	if (status == GNP_OK) {
		request->work.operation = request->model ? gnp_operation_find(request->model) : NULL;
		request->work.codec = gnpd_routes_codec(request->route);
		gnpd_work_begin(&request->work, 60, "work-seconds", NULL);
		status = request->route->handler(request, &error);
	}
	error.status = status;
	if (request && status != GNP_OK)
		gnpd_reply_error(request, &error);
	atomic_store(&first_doomed, -1);
	atomic_store(&last_doomed, -1);
	if (request)
		check_reply(request, number);
	int code = request ? request->reply.code : 0;
	gnpd_request_free(request);
	return code;
}

static void sweep(const struct kind *kind)
{
	CHECK(handle(kind, -1, 0) == kind->code);
	long all = atomic_load(&asked), refused = 0;
	for (long count = 1; count <= 3; count += 2)
		for (long number = 0; number < all; number++) {
			int code = handle(kind, number, count);
			refused += code == 503 || code == 0;
			if (code != kind->code && code != 503 && code != 0)
				fprintf(stderr, "%s, %s: allocation %ld of %ld: code %d\n", kind->uri, kind->content_type ? kind->content_type : "", number, all, code);
			CHECK(code == kind->code || code == 503 || code == 0);
			CHECK(gnpd_queue_state(server.engine.queue).bytes == 0);
		}
	CHECK(refused > 0);
}

/* Points of a sphere, and what stands beside them. */
static void make_cloud(struct gnp_tensors *tensors, const char *extra)
{
	size_t points_shape[] = {COUNT, 3}, extra_shape[] = {COUNT, 1};
	struct gnp_tensor *tensor;
	CHECK(gnp_tensors_add(tensors, "points", GNP_FP32, 2, points_shape, &tensor, NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++) {
		double z = 1 - (2 * (double)i + 1) / COUNT, r = sqrt(1 - z * z), turn = 2.399963229728653 * (double)i;
		const float p[3] = {(float)(r * cos(turn)), (float)(r * sin(turn)), (float)z};
		memcpy((float *)tensor->data + 3 * i, p, sizeof p);
	}
	if (!extra)
		return;
	CHECK(gnp_tensors_add(tensors, extra, GNP_FP64, 2, extra_shape, &tensor, NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++)
		((double *)tensor->data)[i] = 1 - (2 * (double)i + 1) / COUNT;
}

static void sweep_format(const struct gnp_format *format, const char *uri)
{
	struct gnp_tensors tensors = {0};
	struct gnp_buffer body = {0};
	make_cloud(&tensors, NULL);
	CHECK(gnp_file_encode(format, &tensors, NULL, &body, NULL) == GNP_OK);
	sweep(&(struct kind){.uri = uri, .content_type = gnp_format_media_type(format), .body = body.data, .size = body.size, .code = 200});
	gnp_buffer_clear(&body);
	gnp_tensors_clear(&tensors);
}

static void files_in_and_out(void)
{
	sweep_format(&gnp_format_ply, "/v1/estimate?estimator=gmls&k=20");
	sweep_format(&gnp_format_npy, "/v1/estimate?estimator=gmls&k=20&format=json");
	sweep_format(&gnp_format_npz, "/v1/estimate?estimator=gmls&k=20");
	sweep_format(&gnp_format_xyz, "/v1/estimate?estimator=gmls&k=20");
	sweep_format(&gnp_format_json, "/v1/estimate?estimator=gmls&k=20&format=vtk");
}

static void sweep_text(const char *uri, const char *content_type, const char *head, const char *row)
{
	struct gnp_tensors tensors = {0};
	struct gnp_buffer body = {0};
	make_cloud(&tensors, NULL);
	const float *p = tensors.items[0].data;
	CHECK(gnp_buffer_append(&body, head, strlen(head), NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++)
		CHECK(gnp_buffer_printf(&body, NULL, "%s%.7g %.7g %.7g\n", row, p[3 * i], p[3 * i + 1], p[3 * i + 2]) == GNP_OK);
	sweep(&(struct kind){.uri = uri, .content_type = content_type, .body = body.data, .size = body.size, .code = 200});
	gnp_buffer_clear(&body);
	gnp_tensors_clear(&tensors);
}

static void files_in(void)
{
	sweep_text("/v1/estimate?estimator=gmls&k=20", "application/x-pcd",
	           "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 60\nHEIGHT 1\nPOINTS 60\nDATA ascii\n", "");
	sweep_text("/v1/estimate?estimator=gmls&k=20", "model/obj", "# sphere\n", "v ");
	sweep_text("/v1/estimate?estimator=gmls&k=20", "application/ply",
	           "ply\nformat ascii 1.0\nelement vertex 60\nproperty float x\nproperty float y\nproperty float z\nend_header\n", "");
}

static void compressed_bodies(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_buffer body = {0};
	unsigned char packed[4096];
	uLongf size = sizeof packed;
	make_cloud(&tensors, NULL);
	CHECK(gnp_file_encode(&gnp_format_ply, &tensors, NULL, &body, NULL) == GNP_OK);
	CHECK(compress(packed, &size, body.data, body.size) == Z_OK);
	sweep(&(struct kind){.uri = "/v1/estimate?estimator=gmls&k=20", .encoding = "deflate", .body = packed, .size = size, .code = 200});
	gnp_buffer_clear(&body);
	gnp_tensors_clear(&tensors);
}

/* A /v2 request with binary tensors; parameters: name and value, then the next. */
static void sweep_infer(const char *uri, const char *extra, const char *const *parameters)
{
	struct gnp_request request = {.binary_default = true};
	struct gnp_buffer body = {0};
	size_t header;
	make_cloud(&request.inputs, extra);
	for (; *parameters; parameters += 2)
		CHECK(gnp_values_add_string(&request.parameters, parameters[0], parameters[1], NULL) == GNP_OK);
	CHECK(gnp_oip_encode_request(&request, &body, &header, NULL) == GNP_OK);
	struct kind kind = {.uri = uri, .body = body.data, .size = body.size, .code = 200};
	snprintf(kind.inference_length, sizeof kind.inference_length, "%zu", header);
	sweep(&kind);
	gnp_buffer_clear(&body);
	gnp_request_clear(&request);
}

static void inference(void)
{
	static const char *const gmls[] = {"estimator", "gmls", NULL}, *const adaptive[] = {"estimator", "adaptive", NULL};
	static const char json[] = "{\"id\":\"a\",\"parameters\":{\"estimator\":\"gmls\",\"k\":16},\"outputs\":[{\"name\":\"normals\"}],\"inputs\":[{\"name\":"
	                           "\"points\",\"datatype\":\"FP64\",\"shape\":[16,3],\"data\":[[0,0,1],[1,0,0],[0,1,0],[0.6,0.8,0],[0.8,0,0.6],[0,0.6,"
	                           "0.8],[0.6,0,0.8],[0.8,0.6,0],[0,0.8,0.6],[-1,0,0],[0,-1,0],[0,0,-1],[-0.6,-0.8,0],[-0.8,0,-0.6],[0,-0.6,-0.8],"
	                           "[-0.6,0,-0.8]]}]}";
	sweep_infer("/v2/models/estimate/infer", NULL, gmls);
	sweep_infer("/v2/models/estimate/infer", NULL, adaptive);
	sweep(&(struct kind){.uri = "/v2/models/estimate/infer", .body = json, .size = sizeof json - 1, .code = 200});
}

static void operations(void)
{
	static const char *const gmls[] = {"estimator", "gmls", NULL};
	static const char *const source[] = {"estimator", "gmls", "source", "0", NULL};
	sweep_infer("/v2/models/filter/infer", NULL, gmls);
	sweep_infer("/v2/models/poisson/infer", "source", gmls);
	sweep_infer("/v2/models/heat/infer", "initial", gmls);
	sweep_infer("/v2/models/geodesic/infer", NULL, source);
	sweep_infer("/v2/models/laplacian/infer", NULL, gmls);
}

static void what_takes_no_body(void)
{
	static const char *const uris[] = {"/v2", "/v2/models/flow", "/v2/models/estimate/stats", "/v2/health/ready", "/metrics", "/openapi.yaml"};
	for (size_t i = 0; i < sizeof uris / sizeof uris[0]; i++)
		sweep(&(struct kind){.uri = uris[i], .code = 200});
	sweep(&(struct kind){.uri = "/v2/models/nothing", .code = 404});
	sweep(&(struct kind){.uri = "/v1/estimate?k=%41&k=2", .body = "ply\n", .size = 4, .code = 400});
}

/* What is told of jobs; e2e/test_exhaustion.py submits some. */
static void jobs(void)
{
	sweep(&(struct kind){.uri = "/v1/jobs?limit=3", .code = 200});
	sweep(&(struct kind){.uri = "/v1/jobs/066121009272871a8efb27b8507d8c?wait=1s", .code = 404});
}

static bool start(char *folder)
{
	gnpd_config_defaults(&config);
	config.access_log = false;
	snprintf(config.weights_dir, sizeof config.weights_dir, "%s", folder);
	gnpd_log_init(&events, GNPD_LOG_TEXT, GNPD_LOG_ERROR, open("/dev/null", O_WRONLY)); /* it warns of the empty folder */
	gnpd_metrics_init(&metrics);
	gnp_json_memory_init();
	struct gnpd_engine *engine = &server.engine;
	return gnpd_openapi_write(&server.openapi, NULL) == GNP_OK && gnp_pool_create(2, &engine->pool, NULL) == GNP_OK &&
	       gnpd_loader_create(engine, &engine->loader, NULL) == GNP_OK &&
	       gnp_prepared_cache_create(0, &engine->cache, NULL) == GNP_OK &&
	       gnpd_queue_create(1, 10, 1u << 30, &engine->queue, NULL) == GNP_OK &&
	       gnpd_guard_create("", &server.guard, NULL) == GNP_OK &&
	       gnpd_watchers_create(&config, &server.watchers, NULL) == GNP_OK &&
	       gnpd_jobs_create(engine, server.watchers, &server.jobs, NULL) == GNP_OK;
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(files_in_and_out), TEST(files_in), TEST(compressed_bodies), TEST(inference), TEST(operations),
	                                    TEST(what_takes_no_body), TEST(jobs)};
	char folder[] = "/tmp/gnpd-exhaustion.XXXXXX";
	if (!mkdtemp(folder) || !start(folder))
		return 2;
	int failed = RUN_TESTS(tests);
	gnpd_jobs_free(server.jobs);
	gnpd_watchers_free(server.watchers);
	gnpd_guard_free(server.guard);
	gnpd_queue_free(server.engine.queue);
	gnp_prepared_cache_free(server.engine.cache);
	gnpd_loader_free(server.engine.loader);
	gnp_pool_free(server.engine.pool);
	gnp_buffer_clear(&server.openapi);
	close(events.fd);
	gnpd_log_fini(&events);
	rmdir(folder);
	return failed;
}
