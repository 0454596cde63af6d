/* What decoders ask of a budget: as much as they keep once they are done, and nothing is taken that was not granted. */
#include "tests/unit/test.h"


#include "proto/file/file.h"
#include "proto/oip/oip.h"

/* A budget that counts. */
struct purse {
	size_t limit, held, most, largest;
};

static gnp_status reserve(void *context, size_t bytes, struct gnp_error *error)
{
	struct purse *purse = context;
	if (bytes > purse->limit - purse->held)
		return gnp_error_set(error, GNP_TOO_LARGE, "purse: holds %zu, %zu more", purse->held, bytes);
	purse->held += bytes;
	purse->most = purse->held > purse->most ? purse->held : purse->most;
	purse->largest = bytes > purse->largest ? bytes : purse->largest;
	return GNP_OK;
}

static void release(void *context, size_t bytes)
{
	struct purse *purse = context;
	CHECK(bytes <= purse->held);
	purse->held -= bytes;
}

static size_t owned_bytes(const struct gnp_tensors *tensors)
{
	size_t bytes = 0;
	for (size_t i = 0; i < tensors->count; i++)
		bytes += tensors->items[i].owned ? tensors->items[i].size : 0;
	return bytes;
}

static const struct gnp_tensor_info inputs[] = {{.name = "fixed", .datatype = GNP_BOOL, .rank = 1, .shape = {-1}},
                                                {.name = "source", .datatype = GNP_FP64, .rank = 2, .shape = {-1, -2}}};
static const struct gnp_file_wants wants = {.inputs = inputs, .input_count = 2};

static gnp_status decode(const struct gnp_format *format, const void *body, size_t size, struct purse *purse, struct gnp_tensors *tensors,
                         struct gnp_error *error)
{
	const struct gnp_budget budget = {reserve, release, purse};
	tensors->budget = &budget;
	gnp_status status = gnp_file_decode(format, body, size, &wants, tensors, error);
	tensors->budget = NULL;
	return status;
}

/* What is held in the end is what the tensors take; with a byte less than the most that was held, the body is refused. */
static void check_body(const struct gnp_format *format, const void *body, size_t size)
{
	struct purse purse = {.limit = SIZE_MAX};
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(decode(format, body, size, &purse, &tensors, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK(purse.held == owned_bytes(&tensors) && purse.held > 0);
	gnp_tensors_clear(&tensors);
	struct purse less = {.limit = purse.most - 1};
	CHECK(decode(format, body, size, &less, &tensors, &error) == GNP_TOO_LARGE);
	CHECK_CONTAINS(error.text, "purse: holds ");
	CHECK(tensors.count == 0);
}

/* A cloud of n points with a mask, a source of two columns and, where the format keeps its type, of half precision. */
static void make_cloud(size_t n, enum gnp_datatype datatype, struct gnp_tensors *tensors)
{
	size_t vectors[] = {n, 3}, columns[] = {n, 2};
	struct gnp_tensor *points, *normals, *fixed, *source;
	CHECK(gnp_tensors_add(tensors, "points", datatype, 2, vectors, &points, NULL) == GNP_OK);
	memset(points->data, 0, points->size);
	CHECK(gnp_tensors_add(tensors, "normals", datatype, 2, vectors, &normals, NULL) == GNP_OK);
	memset(normals->data, 0, normals->size);
	CHECK(gnp_tensors_add(tensors, "fixed", GNP_UINT8, 1, &n, &fixed, NULL) == GNP_OK);
	memset(fixed->data, 0, fixed->size);
	CHECK(gnp_tensors_add(tensors, "source", GNP_FP64, 2, columns, &source, NULL) == GNP_OK);
	memset(source->data, 0, source->size);
}

static void what_is_kept_is_what_is_held(void)
{
	static const struct gnp_format *formats[] = {&gnp_format_ply, &gnp_format_npz, &gnp_format_xyz, &gnp_format_json};
	for (size_t f = 0; f < sizeof formats / sizeof *formats; f++) {
		struct gnp_tensors tensors = {0};
		struct gnp_buffer file = {0};
		make_cloud(3000, GNP_FP32, &tensors);
		CHECK(gnp_file_encode(formats[f], &tensors, NULL, &file, NULL) == GNP_OK);
		check_body(formats[f], file.data, file.size);
		gnp_tensors_clear(&tensors);
		gnp_buffer_clear(&file);
	}
}

static void arrays_that_are_converted_give_their_first_form_back(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_buffer file = {0};
	make_cloud(100, GNP_INT16, &tensors);
	CHECK(gnp_file_encode(&gnp_format_npz, &tensors, NULL, &file, NULL) == GNP_OK);
	check_body(&gnp_format_npz, file.data, file.size);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&file);
}

/* Ten points of 25 million columns are no cloud: that is seen before they are inflated. */
static void shapes_of_archives_are_looked_at_first(void)
{
	static const struct {
		const char *name;
		unsigned rank;
		size_t shape[3];
		const char *text;
	} cases[] = {{"points", 2, {10, 25}, "points: array of rank 2 with 25 columns, need (n,3) or (n,6) with normals"},
	             {"points", 3, {10, 3, 2}, "points: array of rank 3 with 3 columns"},
	             {"normals", 2, {10, 6}, "normals: array of rank 2 with 6 columns, need (n,3)"},
	             {"fixed", 2, {10, 25}, "fixed: array of rank 2, need rank 1"},
	             {"source", 3, {10, 5, 5}, "source: array of rank 3, need rank 2"}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct gnp_tensors tensors = {0}, decoded = {0};
		struct gnp_buffer file = {0};
		struct gnp_tensor *tensor;
		struct gnp_error error = {0};
		struct purse empty = {0};
		CHECK(gnp_tensors_add(&tensors, cases[i].name, GNP_FP64, cases[i].rank, cases[i].shape, &tensor, NULL) == GNP_OK);
		memset(tensor->data, 0, tensor->size);
		CHECK(gnp_file_encode(&gnp_format_npz, &tensors, NULL, &file, NULL) == GNP_OK);
		CHECK(decode(&gnp_format_npz, file.data, file.size, &empty, &decoded, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, cases[i].text);
		gnp_tensors_clear(&tensors);
		gnp_buffer_clear(&file);
	}
}

/* What libzip makes of a directory is many times its bytes. */
static void archives_of_many_entries_are_not_opened(void)
{
	enum { ENTRIES = 4097, ENTRY = 46 };
	unsigned char *body = calloc(ENTRIES + 1, ENTRY);
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	for (size_t i = 0; i < ENTRIES; i++)
		memcpy(body + i * ENTRY, "PK\1\2", 4);
	memcpy(body + ENTRIES * ENTRY, "PK\5\6", 4);
	CHECK(gnp_file_decode(&gnp_format_npz, body, ENTRIES * ENTRY + 22, NULL, &tensors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "npz: more than 4096 entries");
	free(body);
}

static void other_files(void)
{
	static const char obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
	static const char ascii[] = "# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA ascii\n0 0 0\n1 1 1\n";
	check_body(&gnp_format_obj, obj, strlen(obj));
	check_body(&gnp_format_pcd, ascii, strlen(ascii));
}

/* LZF of a run of zeros: a literal, then as many copies of 264 bytes as it takes. */
static size_t write_lzf(unsigned char *out, uint32_t plain)
{
	unsigned char *p = out;
	*p++ = 0;
	*p++ = 0;
	for (uint32_t left = plain - 1; left;) {
		uint32_t length = left < 264 ? left : 264;
		if (left - length && left - length < 9)
			length -= 9;
		*p++ = 7 << 5;
		*p++ = (unsigned char)(length - 9);
		*p++ = 0;
		left -= length;
	}
	return (size_t)(p - out);
}

/* Files that become many times what they are: 1 MB of PCD was 90 MB before anyone asked. */
static void compressed_points_ask_before_they_are_inflated(void)
{
	enum { POINTS = 1 << 20, PLAIN = 12 * POINTS };
	unsigned char *body = malloc(PLAIN / 80 + 4096);
	int head = sprintf((char *)body, "# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH %d\nHEIGHT 1\nDATA binary_compressed\n", POINTS);
	uint32_t sizes[2] = {0, PLAIN};
	sizes[0] = (uint32_t)write_lzf(body + head + 8, PLAIN);
	memcpy(body + head, sizes, sizeof sizes);
	size_t size = (size_t)head + 8 + sizes[0];
	struct purse purse = {.limit = PLAIN + PLAIN / 2};
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	check_body(&gnp_format_pcd, body, size);
	CHECK(decode(&gnp_format_pcd, body, size, &purse, &tensors, &error) == GNP_TOO_LARGE);
	free(body);
}

/* A table of more columns than are wanted is held while it is read, and asked for as it grows. */
static void tables_ask_as_they_grow(void)
{
	struct gnp_buffer text = {0};
	struct purse purse = {.limit = 1 << 20};
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	for (int i = 0; i < 20000; i++)
		CHECK(gnp_buffer_printf(&text, NULL, "%d 2 3 4 5 6 7 8 9 10\n", i) == GNP_OK);
	check_body(&gnp_format_xyz, text.data, text.size);
	CHECK(decode(&gnp_format_xyz, text.data, text.size, &purse, &tensors, &error) == GNP_TOO_LARGE);
	CHECK(purse.most > 1 << 19 && purse.most <= 1 << 20);
	gnp_buffer_clear(&text);
}

static gnp_status decode_oip(const char *json, struct purse *purse, struct gnp_request *request, struct gnp_error *error)
{
	const struct gnp_budget budget = {reserve, release, purse};
	request->inputs.budget = &budget;
	gnp_status status = gnp_oip_decode_request((const unsigned char *)json, strlen(json), GNP_OIP_NO_HEADER, request, error);
	request->inputs.budget = NULL;
	return status;
}

/* Two characters of JSON are eight bytes of a tensor. */
static void requests_in_json_ask(void)
{
	enum { POINTS = 1000 };
	struct gnp_buffer json = {0};
	struct gnp_request request = {0};
	struct gnp_error error = {0};
	struct purse purse = {.limit = SIZE_MAX};
	CHECK(gnp_buffer_printf(&json, NULL, "{\"inputs\":[{\"name\":\"points\",\"datatype\":\"FP64\",\"shape\":[%d,3],\"data\":[0", POINTS) == GNP_OK);
	for (int i = 1; i < 3 * POINTS; i++)
		CHECK(gnp_buffer_append(&json, ",0", 2, NULL) == GNP_OK);
	CHECK(gnp_buffer_append(&json, "]}]}", 5, NULL) == GNP_OK);
	CHECK(decode_oip((const char *)json.data, &purse, &request, &error) == GNP_OK);
	CHECK(purse.held == 24 * POINTS && owned_bytes(&request.inputs) == purse.held);
	gnp_request_clear(&request);
	struct purse less = {.limit = purse.most - 1};
	CHECK(decode_oip((const char *)json.data, &less, &request, &error) == GNP_TOO_LARGE);
	gnp_buffer_clear(&json);
}

/* 300 bytes of jansson's for every "{}," of a body. */
static void structure_of_json_is_asked_for_and_given_back(void)
{
	struct gnp_buffer json = {0};
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(gnp_buffer_printf(&json, NULL, "{\"points\":[[0,0,0]],\"x\":{\"y\":{") == GNP_OK);
	for (int i = 0; i < 1000; i++)
		CHECK(gnp_buffer_printf(&json, NULL, "%s\"%d\":{}", i ? "," : "", i) == GNP_OK);
	CHECK(gnp_buffer_printf(&json, NULL, "}}}") == GNP_OK);
	struct purse purse = {.limit = SIZE_MAX}, less = {.limit = 100 * json.size};
	CHECK(decode(&gnp_format_json, json.data, json.size, &purse, &tensors, &error) == GNP_OK);
	CHECK(purse.largest > 100 * json.size && purse.held == 24);
	gnp_tensors_clear(&tensors);
	CHECK(decode(&gnp_format_json, json.data, json.size, &less, &tensors, &error) == GNP_TOO_LARGE);
	gnp_buffer_clear(&json);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(what_is_kept_is_what_is_held), TEST(arrays_that_are_converted_give_their_first_form_back),
	                                    TEST(shapes_of_archives_are_looked_at_first), TEST(archives_of_many_entries_are_not_opened), TEST(other_files), TEST(compressed_points_ask_before_they_are_inflated), TEST(tables_ask_as_they_grow),
	                                    TEST(requests_in_json_ask), TEST(structure_of_json_is_asked_for_and_given_back)};
	return RUN_TESTS(tests);
}
