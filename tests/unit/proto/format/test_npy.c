/* NPY and NPZ against numpy itself (tests/oracles/oracle_numpy.py), where it is installed, and hand-made hostile files. */
#include "tests/unit/test.h"

#include <stdint.h>
#include <unistd.h>

#include "proto/file/file.h"

static unsigned char *read_file(const char *folder, const char *name, size_t *size)
{
	char path[512];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	FILE *file = fopen(path, "rb");
	CHECK(file != NULL);
	unsigned char *data = malloc(1 << 16);
	*size = file ? fread(data, 1, 1 << 16, file) : 0;
	if (file)
		fclose(file);
	return realloc(data, *size ? *size : 1); /* the exact size, for the address sanitizer */
}

static void write_file(const char *folder, const char *name, const struct gnp_buffer *buffer)
{
	char path[512];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	FILE *file = fopen(path, "wb");
	CHECK(file && fwrite(buffer->data, 1, buffer->size, file) == buffer->size);
	if (file)
		fclose(file);
}

static int oracle(const char *verb, const char *folder)
{
	char command[600];
	snprintf(command, sizeof command, "/usr/bin/python3 tests/oracles/oracle_numpy.py %s %s", verb, folder);
	return system(command);
}

static bool has_numpy(void)
{
	return system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") == 0;
}

static void check_array(const char *folder, const char *name, bool is_unsigned, bool boolean, unsigned rank, size_t count)
{
	size_t size;
	unsigned char *data = read_file(folder, name, &size);
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(gnp_file_decode_all(&gnp_format_npy, data, size, &tensors, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	const struct gnp_tensor *tensor = tensors.count ? &tensors.items[0] : NULL;
	CHECK(tensor && tensor->rank == rank && tensor->size == count * gnp_datatype_size(tensor->datatype));
	int wrong = 0;
	for (size_t i = 0; tensor && i < count; i++)
		wrong += gnp_tensor_get(tensor, i) != (boolean ? (double)(i % 2) : 7 * (double)i - (is_unsigned ? 0 : 40));
	if (wrong)
		CHECK_STRING("wrong elements in", name);
	gnp_tensors_clear(&tensors);
	free(data);
}

static void check_arrays(const char *folder)
{
	char path[300], name[100];
	int is_unsigned, boolean, rank, count, seen = 0;
	snprintf(path, sizeof path, "%s/list", folder);
	FILE *list = fopen(path, "r");
	while (list && fscanf(list, "%99s %d %d %d %d", name, &is_unsigned, &boolean, &rank, &count) == 5) {
		check_array(folder, name, is_unsigned, boolean, (unsigned)rank, (size_t)count);
		seen++;
	}
	CHECK(seen == 18 * 5 * 2 * 3);
	if (list)
		fclose(list);
}

static void check_archive(const char *folder, const char *name)
{
	size_t size;
	unsigned char *data = read_file(folder, name, &size);
	struct gnp_tensors tensors = {0}, all = {0};
	struct gnp_error error = {0}, limit = {0};
	CHECK(gnp_file_decode(&gnp_format_npz, data, size, NULL, &tensors, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	const struct gnp_tensor *points = gnp_tensors_find(&tensors, "points"), *normals = gnp_tensors_find(&tensors, "normals");
	CHECK(tensors.count == 2 && points && points->datatype == GNP_FP32 && points->shape[0] == 6);
	CHECK(points && gnp_tensor_get(points, 17) == 79);
	CHECK(normals && normals->datatype == GNP_FP64 && gnp_tensor_get(normals, 17) == 79);
	CHECK(gnp_file_decode(&gnp_format_npz, data, size, &(struct gnp_file_wants){.max_points = 5}, &tensors, &limit) == GNP_TOO_LARGE);
	CHECK_STRING(limit.text, "points: got 6, need at most 5");
	CHECK(gnp_file_decode_all(&gnp_format_npz, data, size, &all, NULL) == GNP_OK);
	CHECK(all.count == 3 && gnp_tensors_find(&all, "xyz") && gnp_tensors_find(&all, "extra")->rank == 3);
	for (size_t cut = 0; cut < size; cut += 7)
		CHECK(gnp_file_decode(&gnp_format_npz, data, cut, NULL, &tensors, NULL) == GNP_INVALID_ARGUMENT);
	data[150] ^= 0x40; /* in the first array: its checksum is wrong now */
	CHECK(gnp_file_decode_all(&gnp_format_npz, data, size, &all, NULL) == GNP_INVALID_ARGUMENT);
	gnp_tensors_clear(&tensors);
	gnp_tensors_clear(&all);
	free(data);
}

static void check_refused_file(const char *folder, const char *name, const char *want)
{
	size_t size;
	unsigned char *data = read_file(folder, name, &size);
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(gnp_file_decode_all(&gnp_format_npy, data, size, &tensors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, want);
	free(data);
}

static void write_ours(const char *folder)
{
	struct gnp_tensors tensors = {0};
	struct gnp_values comments = {0};
	struct gnp_buffer buffer = {0};
	size_t vectors[] = {2, 3}, matrix[] = {2, 2, 2}, rows = 2;
	float points[] = {0, 1, 2, 3, 4, 5};
	double metric[8];
	bool flags[] = {true, false};
	for (int i = 0; i < 8; i++)
		metric[i] = i / 10.0;
	gnp_tensors_add_data(&tensors, "points", GNP_FP32, 2, vectors, points, false, NULL, NULL);
	gnp_tensors_add_data(&tensors, "metric", GNP_FP64, 3, matrix, metric, false, NULL, NULL);
	struct gnp_error error = {0};
	CHECK(gnp_file_encode(&gnp_format_npy, &tensors, NULL, &buffer, &error) == GNP_OK);
	write_file(folder, "ours.npy", &buffer);
	buffer.size = 0;
	gnp_tensors_add_data(&tensors, "flags", GNP_BOOL, 1, &rows, flags, false, NULL, NULL);
	CHECK(gnp_file_encode(&gnp_format_npy, &tensors, NULL, &buffer, &error) == GNP_NOT_ACCEPTABLE);
	CHECK_CONTAINS(error.text, "npy: holds one array beside points, got 3");
	gnp_values_add_string(&comments, "estimator", "gmls", NULL);
	CHECK(gnp_file_encode(&gnp_format_npz, &tensors, &comments, &buffer, NULL) == GNP_OK);
	write_file(folder, "ours.npz", &buffer);
	gnp_buffer_clear(&buffer);
	gnp_tensors_clear(&tensors);
	gnp_values_clear(&comments);
}

static void numpy_and_we_read_each_other(void)
{
	char folder[] = "/tmp/gnp-test-npy-XXXXXX", command[64];
	if (!has_numpy()) {
		printf("test_npy: numpy_and_we_read_each_other skipped, /usr/bin/python3 has no numpy\n");
		return;
	}
	if (!mkdtemp(folder)) {
		CHECK(!"mkdtemp");
		return;
	}
	CHECK(oracle("write", folder) == 0);
	check_arrays(folder);
	check_archive(folder, "stored.npz");
	check_archive(folder, "deflated.npz");
	check_refused_file(folder, "object.npy", "npy: descr \"|O\": need booleans, integers or f2, f4, f8");
	check_refused_file(folder, "struct.npy", "npy: structured arrays are not supported");
	check_refused_file(folder, "complex.npy", "descr \"<c8\"");
	check_refused_file(folder, "text.npy", "descr \"<U2\"");
	write_ours(folder);
	CHECK(oracle("read", folder) == 0);
	snprintf(command, sizeof command, "rm -rf %s", folder);
	CHECK(system(command) == 0);
}

/* A version 1.0 file with this dictionary and that many zero bytes of data. */
static size_t make_npy(unsigned char *file, const char *dictionary, size_t data)
{
	size_t length = strlen(dictionary);
	memcpy(file, "\x93NUMPY\x01\x00", 8);
	file[8] = (unsigned char)length;
	file[9] = (unsigned char)(length >> 8);
	memcpy(file + 10, dictionary, length);
	memset(file + 10 + length, 0, data);
	return 10 + length + data;
}

static void check_refused(const char *dictionary, size_t data, const char *want)
{
	unsigned char file[2048];
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	size_t size = make_npy(file, dictionary, data);
	CHECK(gnp_file_decode(&gnp_format_npy, file, size, NULL, &tensors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, want);
	CHECK(tensors.count == 0);
}

static void hostile_headers_are_refused(void)
{
#define DICT(descr, shape) "{'descr': '" descr "', 'fortran_order': False, 'shape': " shape ", }\n"
	check_refused(DICT("<f4", "(2, 3)"), 23, "the shape needs 24 bytes, the file has 23");
	check_refused(DICT("<f4", "(2, 3)"), 25, "the shape needs 24 bytes, the file has 25");
	check_refused(DICT("<f4", "(9223372036854775807, 3)"), 24, "the shape's product overflows");
	check_refused(DICT("<f8", "(6148914691236517206, 3)"), 16, "overflows");
	check_refused(DICT("<f4", "(99999999999999999999999, 3)"), 24, "an extent overflows");
	check_refused(DICT("<f4", "(1000000000000, 3)"), 24, "the shape needs 12000000000000 bytes");
	check_refused(DICT("<f4", "(-1, 3)"), 24, "shape: need integers of at least 0");
	check_refused(DICT("<f4", "(1,1,1,1,1,1,1,1,1)"), 4, "rank over 8");
	check_refused(DICT("<f4", "(2, 3"), 24, "shape");
	check_refused(DICT("<f16", "(2, 3)"), 24, "descr \"<f16\"");
	check_refused(DICT("<f4", "(2, 2)"), 16, "points: array of rank 2 with 2 columns, need (n,3) or (n,6) with normals");
	check_refused(DICT("<f4", "(6,)"), 24, "points: array of rank 1");
	check_refused("{'descr': '<f4', 'fortran_order': False, }\n", 24, "the header has no shape");
	check_refused("{'shape': (2, 3), }\n", 24, "the header has no descr");
	check_refused("", 0, "npy");
	unsigned char file[256];
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	size_t size = make_npy(file, DICT("<f4", "(2, 3)"), 24);
	for (size_t cut = 0; cut < size; cut++)
		CHECK(gnp_file_decode(&gnp_format_npy, file, cut, NULL, &tensors, NULL) == GNP_INVALID_ARGUMENT);
	file[6] = 9;
	CHECK(gnp_file_decode(&gnp_format_npy, file, size, NULL, &tensors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "version 9.0, need 1.0, 2.0 or 3.0");
}

static void six_columns_are_points_and_normals(void)
{
	unsigned char file[256];
	struct gnp_tensors tensors = {0};
	size_t size = make_npy(file, DICT("|u1", "(2, 6)"), 12);
	for (int i = 0; i < 12; i++)
		file[size - 12 + (size_t)i] = (unsigned char)(i % 6 < 3 ? i + 1 : i % 6 == 5);
	CHECK(gnp_file_decode(&gnp_format_npy, file, size, NULL, &tensors, NULL) == GNP_OK);
	const struct gnp_tensor *points = gnp_tensors_find(&tensors, "points"), *normals = gnp_tensors_find(&tensors, "normals");
	CHECK(points && points->datatype == GNP_FP32 && gnp_tensor_get(points, 3) == 7);
	CHECK(normals && gnp_tensor_get(normals, 5) == 1 && gnp_tensor_get(normals, 4) == 0);
	gnp_tensors_clear(&tensors);
	struct gnp_error error = {0};
	file[size - 1] = 200; /* a colour */
	CHECK(gnp_file_decode(&gnp_format_npy, file, size, NULL, &tensors, &error) == GNP_INVALID_ARGUMENT && tensors.count == 0);
	CHECK_STRING(error.text, "points: row 1: columns 4 to 6 have length 200, need unit normals or the first three columns alone where they are colours");
}

static void not_a_zip_file_is_refused(void)
{
	struct gnp_tensors tensors = {0};
	struct gnp_error error = {0};
	CHECK(gnp_file_decode(&gnp_format_npz, (const unsigned char *)"PK\x03\x04 nothing", 12, NULL, &tensors, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "npz: Not a zip archive");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(numpy_and_we_read_each_other), TEST(hostile_headers_are_refused),
	                                    TEST(six_columns_are_points_and_normals), TEST(not_a_zip_file_is_refused)};
	return RUN_TESTS(tests);
}
