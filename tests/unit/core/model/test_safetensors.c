/* Files of weights against numpy's (tests/oracles/oracle_safetensors.py), hostile ones by hand, and damaged ones at random. An argument
 * that is a number asks for that many rounds of damage. */
#include "tests/unit/test.h"

#include <stdint.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/model/safetensors.h"
#include "core/model/safetensors_write.h"

static int rounds = 3000;

static const float scalar = -2.5f;
static const float lift[12] = {-.625f, -.5f, -.375f, -.25f, -.125f, 0, .125f, .25f, .375f, .5f, .625f, .75f};
static const float edges[3] = {0x1p-149f, 0x1.fffffep127f, -0.0f};
static const struct gnp_safetensors_metadata metadata[] = {
	{"note", "quotes \" and \\, caf\xc3\xa9"}, {"trunk", "edge"}, {"empty", ""}};
static const struct gnp_safetensors_tensor tensors[] = {
	{"scalar", 0, {0}, 1, &scalar}, {"lift.weight", 2, {4, 3}, 12, lift}, {"b", 1, {3}, 3, edges}};
static const struct gnp_safetensors_source source = {metadata, 3, tensors, 3};

static void check_same(const struct gnp_safetensors *file)
{
	CHECK(gnp_safetensors_tensor_count(file) == 3);
	for (size_t i = 0; i < 3; i++) {
		const struct gnp_safetensors_tensor *want = &tensors[i], *got = gnp_safetensors_tensor_at(file, i);
		CHECK(got && got == gnp_safetensors_tensor_find(file, want->name));
		if (!got)
			continue;
		CHECK_STRING(got->name, want->name);
		CHECK(got->rank == want->rank && got->count == want->count);
		CHECK(memcmp(got->shape, want->shape, want->rank * sizeof *want->shape) == 0);
		CHECK(memcmp(got->data, want->data, want->count * sizeof(float)) == 0);
		CHECK(gnp_safetensors_metadata_at(file, i) != NULL);
		CHECK_STRING(gnp_safetensors_metadata_find(file, metadata[i].key), metadata[i].value);
	}
	CHECK(!gnp_safetensors_tensor_at(file, 3) && !gnp_safetensors_metadata_at(file, 3));
	CHECK(!gnp_safetensors_tensor_find(file, "lift") && !gnp_safetensors_metadata_find(file, "trun"));
}

/* The digest by another program. */
static void check_digest(const char *path, const char *digest)
{
	char command[600], want[65] = "";
	snprintf(command, sizeof command, "sha256sum '%s'", path);
	FILE *out = popen(command, "r");
	CHECK(out && fscanf(out, "%64s", want) == 1);
	if (out)
		pclose(out);
	CHECK_STRING(digest, want);
}

static void a_file_of_numpys_is_read(void)
{
	static const char path[] = "tests/oracles/data/numpy.safetensors"; /* tests run in the repository's root */
	struct gnp_safetensors *file = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_safetensors_load(path, &file, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	if (!file)
		return;
	check_same(file);
	CHECK_STRING(gnp_safetensors_path(file), path);
	check_digest(path, gnp_safetensors_sha256(file));
	gnp_safetensors_drop_tensors(file);
	CHECK(gnp_safetensors_tensor_count(file) == 0 && !gnp_safetensors_tensor_at(file, 0) && !gnp_safetensors_tensor_find(file, "b"));
	CHECK_STRING(gnp_safetensors_metadata_find(file, "trunk"), "edge");
	gnp_safetensors_free(file);
}

static void what_is_written_is_read_by_us_and_by_numpy(void)
{
	char folder[] = "/tmp/gnp-weights-XXXXXX", path[64], command[160];
	struct gnp_safetensors *file = NULL;
	CHECK(mkdtemp(folder) != NULL);
	snprintf(path, sizeof path, "%s/a.safetensors", folder);
	for (int again = 0; again < 2; again++) /* the second time over the first */
		CHECK(gnp_safetensors_save(path, &source, NULL) == GNP_OK);
	CHECK(gnp_safetensors_load(path, &file, NULL) == GNP_OK);
	if (file) {
		check_same(file);
		check_digest(path, gnp_safetensors_sha256(file));
	}
	gnp_safetensors_free(file);
	if (system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") == 0) {
		snprintf(command, sizeof command, "/usr/bin/python3 tests/oracles/oracle_safetensors.py check %s", path);
		CHECK(system(command) == 0);
	}
	unlink(path);
	CHECK(rmdir(folder) == 0); /* nothing is left beside the file */
}

static void the_order_of_metadata_makes_no_difference(void)
{
	const struct gnp_safetensors_metadata turned[] = {metadata[2], metadata[0], metadata[1]};
	const struct gnp_safetensors_source other = {turned, 3, tensors, 3};
	void *a = NULL, *b = NULL;
	size_t size = 0, other_size = 0;
	CHECK(gnp_safetensors_encode("a", &source, &a, &size, NULL) == GNP_OK);
	CHECK(gnp_safetensors_encode("a", &other, &b, &other_size, NULL) == GNP_OK);
	CHECK(a && b && size == other_size && memcmp(a, b, size) == 0);
	free(a);
	free(b);
}

static void check_source_refused(const struct gnp_safetensors_source *bad, const char *part)
{
	struct gnp_error error = {0};
	void *bytes = NULL;
	size_t size;
	CHECK(gnp_safetensors_encode("out", bad, &bytes, &size, &error) != GNP_OK);
	CHECK_CONTAINS(error.text, "out: ");
	CHECK_CONTAINS(error.text, part);
	CHECK(bytes == NULL);
	free(bytes);
}

static void what_no_reader_takes_is_not_written(void)
{
	const float bad = NAN;
	const struct gnp_safetensors_metadata twice[] = {{"k", "1"}, {"k", "2"}}, latin = {"k", "caf\xe9"};
	const struct gnp_safetensors_tensor nan = {"x", 0, {0}, 1, &bad}, deep = {"x", 9, {1}, 1, &scalar},
	                                huge = {"x", 2, {SIZE_MAX / 2, 9}, 1, &scalar}, empty = {"x", 1, {0}, 0, NULL},
	                                same[] = {tensors[0], tensors[0]}, line = {"a\nb", 0, {0}, 1, &scalar};
	check_source_refused(&(struct gnp_safetensors_source){twice, 2, tensors, 1}, "duplicate");
	check_source_refused(&(struct gnp_safetensors_source){&latin, 1, tensors, 1}, "unable to decode byte 0xe9");
	check_source_refused(&(struct gnp_safetensors_source){NULL, 0, &nan, 1}, "tensor \"x\": value 0: got nan");
	check_source_refused(&(struct gnp_safetensors_source){NULL, 0, &deep, 1}, "rank 9");
	check_source_refused(&(struct gnp_safetensors_source){NULL, 0, &huge, 1}, "tensor \"x\"");
	check_source_refused(&(struct gnp_safetensors_source){NULL, 0, &empty, 1}, "shape: got [0], need");
	check_source_refused(&(struct gnp_safetensors_source){NULL, 0, same, 2}, "duplicate");
	check_source_refused(&(struct gnp_safetensors_source){NULL, 0, &line, 1}, "control characters");
}

/* A header's length, the header, and a number of bytes of data, in memory of their exact size. */
static unsigned char *make_file(uint64_t length, const char *header, size_t data_size, size_t *size)
{
	size_t header_size = strlen(header);
	unsigned char *image = calloc(1, 8 + header_size + data_size);
	for (int i = 0; i < 8; i++)
		image[i] = (unsigned char)(length >> 8 * i);
	memcpy(image + 8, header, header_size);
	*size = 8 + header_size + data_size;
	return image;
}

static void check_refused(const unsigned char *image, size_t size, const char *part)
{
	struct gnp_error error = {0};
	struct gnp_safetensors *file = NULL;
	CHECK(gnp_safetensors_decode("bad.safetensors", image, size, &file, &error) == GNP_INVALID_ARGUMENT);
	CHECK(error.status == GNP_INVALID_ARGUMENT && file == NULL);
	CHECK_CONTAINS(error.text, "bad.safetensors: ");
	CHECK_CONTAINS(error.text, part);
	gnp_safetensors_free(file);
}

#define A(shape, offsets) "\"a\":{\"dtype\":\"F32\",\"shape\":" shape ",\"data_offsets\":" offsets "}"
#define B(shape, offsets) "\"b\":{\"dtype\":\"F32\",\"shape\":" shape ",\"data_offsets\":" offsets "}"

static void hostile_headers_are_refused_by_name(void)
{
	static const struct {
		const char *header;
		size_t data;
		const char *part;
	} rows[] = {
		{"{" A("[2]", "[0,8]") "}", 4, "tensor \"a\": shape: got [2] of 4 bytes each, the file has 4 bytes of data"},
		{"{" A("[2]", "[0,8]") "}", 12, "got 12 bytes of data, need the 8 of its 1 tensors"},
		{"{}", 4, "got 4 bytes of data, need the 0 of its 0 tensors"},
		{"{" A("[2]", "[0,8]") "," B("[2]", "[4,12]") "}", 12, "tensor \"b\": begins at byte 4 of the data and overlaps \"a\", need 8"},
		{"{" A("[2]", "[0,8]") "," B("[2]", "[0,8]") "}", 8, "tensor \"b\": begins at byte 0 of the data and overlaps \"a\", need 8"},
		{"{" A("[1]", "[0,4]") "," B("[1]", "[8,12]") "}", 12, "tensor \"b\": begins at byte 8 of the data and leaves a hole, need 4"},
		{"{" A("[1]", "[4,8]") "}", 8, "tensor \"a\": begins at byte 4 of the data and leaves a hole, need 0"},
		{"{" A("[1]", "[-4,0]") "}", 8, "tensor \"a\": data_offsets: got [-4,0], need two ascending integers of 0..8"},
		{"{" A("[1]", "[8,4]") "}", 8, "data_offsets: got [8,4]"},
		{"{" A("[1]", "[4,12]") "}", 8, "data_offsets: got [4,12]"},
		{"{" A("[1]", "[0,4.0]") "}", 8, "data_offsets: got [0,4.0]"},
		{"{" A("[1]", "[0]") "}", 8, "data_offsets: got [0]"},
		{"{" A("[1]", "[0,4,8]") "}", 8, "data_offsets: got [0,4,8]"},
		{"{" A("[1]", "null") "}", 8, "data_offsets: got null"},
		{"{" A("[1]", "[0,8]") "}", 8, "tensor \"a\": data_offsets: got 8 bytes, need 4 for its shape"},
		{"{" A("[1]", "[0,99999999999999999999]") "}", 8, "too big integer"},
		{"{" A("[4611686018427387904,4]", "[0,8]") "}", 8, "tensor \"a\": shape: got [4611686018427387904,4] of 4 bytes each"},
		{"{" A("[4611686018427387905]", "[0,4]") "}", 8, "tensor \"a\": shape: got [4611686018427387905]"},
		{"{" A("[-1,-1]", "[0,4]") "}", 4, "tensor \"a\": shape: got [-1,-1], need at most 8 integers of at least 1"},
		{"{" A("[0]", "[0,0]") "}", 0, "shape: got [0], need"},
		{"{" A("[1,1,1,1,1,1,1,1,1]", "[0,4]") "}", 4, "shape: got [1,1,1,1,1,1,1,1,1], need"},
		{"{" A("\"1\"", "[0,4]") "}", 4, "shape: got \"1\", need"},
		{"{" A("[true]", "[0,4]") "}", 4, "shape: got [true], need"},
		{"{\"a\":{\"dtype\":\"F16\",\"shape\":[2],\"data_offsets\":[0,4]}}", 4, "tensor \"a\": dtype: got \"F16\", need \"F32\""},
		{"{\"a\":{\"dtype\":\"F64\",\"shape\":[1],\"data_offsets\":[0,8]}}", 8, "dtype: got \"F64\""},
		{"{\"a\":{\"dtype\":1,\"shape\":[1],\"data_offsets\":[0,8]}}", 8, "dtype: got 1"},
		{"{\"a\":{\"shape\":[1],\"data_offsets\":[0,4]}}", 4, "tensor \"a\": dtype: got none, need \"F32\""},
		{"{\"a\":{\"dtype\":\"F32\",\"data_offsets\":[0,4]}}", 4, "tensor \"a\": shape: got none"},
		{"{\"a\":{\"dtype\":\"F32\",\"shape\":[1]}}", 4, "tensor \"a\": data_offsets: got none"},
		{"{\"a\":{\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[0,4],\"strides\":[1]}}", 4, "tensor \"a\": unknown key \"strides\""},
		{"{\"a\":[1,2]}", 4, "tensor \"a\": dtype: got none"},
		{"{\"a\":null}", 4, "tensor \"a\": dtype: got none"},
		{"{" A("[1]", "[0,4]") "," A("[1]", "[4,8]") "}", 8, "duplicate object key"},
		{"{\"a\":{\"dtype\":\"F32\",\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[0,4]}}", 4, "duplicate object key"},
		{"{\"__metadata__\":{\"k\":\"1\",\"k\":\"2\"}}", 0, "duplicate object key"},
		{"{\"__metadata__\":{\"k\":1}}", 0, "__metadata__: \"k\" is no string, need one"},
		{"{\"__metadata__\":[]}", 0, "__metadata__: need an object of strings"},
		{"{\"__metadata__\":{\"\":\"1\"}}", 0, "__metadata__ name \"\" of 0 bytes"},
		{"{\"\":{}}", 0, "tensor name \"\" of 0 bytes: need 1..128"},
		{"{\"a\\u0001\":{}}", 0, "control characters"},
		{"{\"a\\u0000\":{}}", 0, "not strict JSON"},
		{"{\"a\xff\":{}}", 0, "not strict JSON"},
		{"{\"a\xc0\xaf\":{}}", 0, "not strict JSON"},
		{"{\"a\\ud800\":{}}", 0, "not strict JSON"},
		{"{\"a\":{", 0, "not strict JSON at byte"},
		{"{} {}", 0, "not strict JSON at byte"},
		{"[1]", 0, "header: got byte 0x5b first, need {"},
		{" {}", 0, "header: got byte 0x20 first, need {"},
		{"{\"a\":{\"shape\":[[[1]]]}}", 0, "header: nested deeper than 4"},
	};
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		size_t size;
		unsigned char *image = make_file(strlen(rows[i].header), rows[i].header, rows[i].data, &size);
		check_refused(image, size, rows[i].part);
		free(image);
	}
}

static void quotes_and_braces_in_names_are_no_nesting(void)
{
	static const char header[] = "{\"[[[[[[\\\"{{{{{\\\\\":{\"dtype\":\"F32\",\"shape\":[],\"data_offsets\":[0,4]}}   ";
	struct gnp_safetensors *file = NULL;
	size_t size;
	unsigned char *image = make_file(sizeof header - 1, header, 4, &size);
	CHECK(gnp_safetensors_decode("a", image, size, &file, NULL) == GNP_OK);
	CHECK(file && gnp_safetensors_tensor_find(file, "[[[[[[\"{{{{{\\"));
	gnp_safetensors_free(file);
	free(image);
}

static void hostile_lengths_are_refused_before_memory_is_taken(void)
{
	static const struct {
		uint64_t length;
		const char *header, *part;
	} rows[] = {
		{1000000000000, "{}", "header length: got 1000000000000 in a file of 10 bytes, need 2..2"},
		{UINT64_MAX, "{}", "header length: got 18446744073709551615"},
		{UINT64_MAX - 7, "{}", "header length: got 18446744073709551608"},
		{3, "{}", "header length: got 3 in a file of 10 bytes"},
		{1, "{}", "header length: got 1 in"},
		{0, "{}", "header length: got 0 in"},
		{0, "", "got 8 bytes, need 10.."},
	};
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		size_t size;
		unsigned char *image = make_file(rows[i].length, rows[i].header, 0, &size);
		check_refused(image, size, rows[i].part);
		free(image);
	}
	check_refused((const unsigned char *)"", 0, "got 0 bytes, need 10..");
}

static void the_first_value_that_is_no_number_is_named(void)
{
	static const char header[] = "{" A("[1]", "[0,4]") "," B("[2,3]", "[4,28]") "}";
	static const struct {
		float value;
		const char *part;
	} rows[] = {{NAN, "tensor \"b\": value 4: got nan, need a finite number"},
	            {INFINITY, "tensor \"b\": value 4: got inf, need a finite number"},
	            {-INFINITY, "tensor \"b\": value 4: got -inf, need a finite number"}};
	for (size_t i = 0; i < 3; i++) {
		size_t size;
		unsigned char *image = make_file(sizeof header - 1, header, 28, &size);
		memcpy(image + size - 8, &rows[i].value, sizeof rows[i].value);
		check_refused(image, size, rows[i].part);
		free(image);
	}
}

static void paths_that_hold_no_file_are_named(void)
{
	char fifo[] = "/tmp/gnp-weights-XXXXXX";
	struct gnp_safetensors *file = NULL;
	struct gnp_error none = {0}, folder = {0}, pipe_error = {0};
	CHECK(gnp_safetensors_load("tests/oracles/data/none.safetensors", &file, &none) == GNP_IO);
	CHECK_STRING(none.text, "tests/oracles/data/none.safetensors: No such file or directory");
	CHECK(gnp_safetensors_load("tests/oracles/data", &file, &folder) == GNP_IO);
	CHECK_STRING(folder.text, "tests/oracles/data: need a regular file");
	CHECK(mkdtemp(fifo) && rmdir(fifo) == 0 && mkfifo(fifo, 0600) == 0);
	CHECK(gnp_safetensors_load(fifo, &file, &pipe_error) == GNP_IO);
	CHECK_CONTAINS(pipe_error.text, "need a regular file");
	unlink(fifo);
	CHECK(gnp_safetensors_save("tests/no/such/folder", &source, &(struct gnp_error){0}) == GNP_IO);
}

static uint64_t next_random(uint64_t *state)
{
	*state ^= *state << 13;
	*state ^= *state >> 7;
	*state ^= *state << 17;
	return *state;
}

/* A damaged copy in memory of its exact size; most damage in the header, some of it a digit for a digit. */
static unsigned char *damage(const unsigned char *data, size_t size, uint64_t *state, size_t *out_size)
{
	static const unsigned char telling[] = "\0\xff\x7f\x80-0123456789[]{}\",:e. ";
	size_t kept = next_random(state) % 4 ? size : next_random(state) % (size + 1);
	unsigned char *copy = malloc(kept ? kept : 1);
	memcpy(copy, data, kept);
	for (unsigned edits = (unsigned)(next_random(state) % 5); edits && kept; edits--) {
		size_t at = next_random(state) % (next_random(state) % 4 ? kept < 300 ? kept : 300 : kept);
		switch (next_random(state) % 4) {
		case 0: copy[at] ^= (unsigned char)(1u << next_random(state) % 8); break;
		case 1: copy[at] = telling[next_random(state) % (sizeof telling - 1)]; break;
		case 2: copy[at] = copy[at] >= '0' && copy[at] <= '9' ? (unsigned char)('0' + next_random(state) % 10) : copy[at]; break;
		default: copy[at] = data[next_random(state) % size]; break;
		}
	}
	*out_size = kept;
	return copy;
}

static void damaged_files_are_answered(void)
{
	void *bytes = NULL;
	size_t size = 0, taken = 0;
	uint64_t state = 0x9e3779b97f4a7c15u;
	CHECK(gnp_safetensors_encode("a", &source, &bytes, &size, NULL) == GNP_OK);
	for (int i = 0; i < rounds && bytes; i++) {
		struct gnp_safetensors *file = NULL;
		struct gnp_error error = {0};
		size_t kept;
		float sum = 0;
		unsigned char *copy = damage(bytes, size, &state, &kept);
		gnp_status status = gnp_safetensors_decode("a", copy, kept, &file, &error);
		CHECK(status == GNP_OK ? file && !error.text[0] : !file && error.text[0] && error.status == status);
		for (size_t t = 0; file && t < gnp_safetensors_tensor_count(file); t++) /* every value is there and finite */
			for (size_t j = 0; j < gnp_safetensors_tensor_at(file, t)->count; j++)
				sum += 0 * gnp_safetensors_tensor_at(file, t)->data[j];
		CHECK(sum == 0);
		taken += file != NULL;
		gnp_safetensors_free(file);
		free(copy);
	}
	CHECK(taken > (size_t)rounds / 50 && taken < (size_t)rounds); /* damage that matters and damage that does not */
	free(bytes);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(a_file_of_numpys_is_read), TEST(what_is_written_is_read_by_us_and_by_numpy),
		TEST(the_order_of_metadata_makes_no_difference), TEST(what_no_reader_takes_is_not_written),
		TEST(hostile_headers_are_refused_by_name), TEST(quotes_and_braces_in_names_are_no_nesting),
		TEST(hostile_lengths_are_refused_before_memory_is_taken), TEST(the_first_value_that_is_no_number_is_named),
		TEST(paths_that_hold_no_file_are_named), TEST(damaged_files_are_answered)};
	if (argc > 1 && atoi(argv[1]) > 0) {
		rounds = atoi(argv[1]);
		argc = 1;
	}
	return RUN_TESTS(tests);
}
