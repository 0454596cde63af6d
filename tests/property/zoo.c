#include "tests/property/zoo.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/random.h"

/* ---- Clouds: row i of n into p, and the outward normal ---- */

typedef void (*row_fn)(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3]);

static void set3(double v[3], double x, double y, double z)
{
	v[0] = x, v[1] = y, v[2] = z;
}

static void unit(double v[3])
{
	double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
	for (int c = 0; length > 0 && c < 3; c++)
		v[c] /= length;
}

static void sphere(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	double z = 1 - (2 * (double)i + 1) / (double)n, r = sqrt(1 - z * z), a = 2.39996323 * (double)i;
	(void)random;
	set3(p, r * cos(a), r * sin(a), z);
	memcpy(normal, p, 3 * sizeof *p);
}

static void random_sphere(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	(void)i, (void)n;
	for (int c = 0; c < 3; c++)
		p[c] = gnp_random_normal(random);
	unit(p);
	memcpy(normal, p, 3 * sizeof *p);
}

static void torus(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	double u = 6.283185307179586 * (double)i / (double)n * sqrt((double)n), v = 6.283185307179586 * (double)i * 0.6180339887;
	(void)random;
	set3(normal, cos(v) * cos(u), cos(v) * sin(u), sin(v));
	set3(p, (1 + 0.4 * cos(v)) * cos(u), (1 + 0.4 * cos(v)) * sin(u), 0.4 * sin(v));
}

static size_t side_of(size_t n)
{
	size_t side = (size_t)sqrt((double)n);
	return side ? side : 1;
}

static void plane(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	size_t side = side_of(n);
	(void)random;
	set3(p, (double)(i % side), (double)(i / side), 0);
	set3(normal, 0, 0, 1);
}

static void rows(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	size_t side = 4 * side_of(n);
	set3(p, (double)(i % side) + 0.5 * gnp_random_uniform(random), 8 * (double)(i / side), 0);
	set3(normal, 0, 0, 1);
}

static void sheets(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	plane(i / 2, n / 2 + 1, random, p, normal);
	p[2] = i % 2 ? 1.5 : 0;
	normal[2] = i % 2 ? 1 : -1;
}

static void line(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	(void)n, (void)random;
	set3(p, (double)i, 2 * (double)i, -(double)i);
	set3(normal, 1, 0, 1);
	unit(normal);
}

static void cube(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	size_t face = i % 6, axis = face / 2;
	(void)n;
	for (int c = 0; c < 3; c++)
		p[c] = 2 * gnp_random_uniform(random) - 1;
	set3(normal, 0, 0, 0);
	p[axis] = normal[axis] = face % 2 ? 1 : -1;
}

static void pieces(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	sphere(i / 2, n / 2 + 1, random, p, normal);
	p[0] += i % 2 ? 10 : 0;
}

static void volume(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	(void)i, (void)n;
	for (int c = 0; c < 3; c++)
		p[c] = gnp_random_uniform(random), normal[c] = gnp_random_normal(random);
	unit(normal);
}

static void lattice(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	size_t side = (size_t)cbrt((double)n) + 1;
	(void)random;
	set3(p, (double)(i % side), (double)(i / side % side), (double)(i / side / side));
	set3(normal, 0, 1, 0);
}

static void place(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	(void)i, (void)n, (void)random;
	set3(p, 1, 2, 3);
	set3(normal, 0, 0, 1);
}

static void twice(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	sphere(i / 2, n / 2 + 1, random, p, normal);
}

static void nearly_twice(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	sphere(i / 2, n / 2 + 1, random, p, normal);
	p[2] += i % 2 ? 1e-13 : 0;
}

static void far_point(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	sphere(i, n, random, p, normal);
	if (i == n / 2)
		p[0] += 1e7;
}

static void outliers(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	sphere(i, n, random, p, normal);
	for (int c = 0; i % 10 == 3 && c < 3; c++)
		p[c] *= 0.5 + gnp_random_uniform(random);
}

static void cap(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	sphere(i, 3 * n, random, p, normal);
}

static void not_a_number(size_t i, size_t n, struct gnp_random *random, double p[3], double normal[3])
{
	sphere(i, n, random, p, normal);
	if (i == n / 3)
		p[1] = i % 2 ? NAN : INFINITY;
}

static const struct {
	const char *name;
	row_fn row;
} clouds[] = {
#define CLOUDS(X)                                                                                                            \
	X(sphere) X(random_sphere) X(torus) X(plane) X(rows) X(sheets) X(line) X(cube) X(pieces) X(volume) X(lattice) X(place) \
	X(twice) X(nearly_twice) X(far_point) X(outliers) X(cap) X(not_a_number)
#define CLOUD(name) {#name, name},
	CLOUDS(CLOUD)
#undef CLOUD
};
#define CLOUD_NAME(name) #name,
const char *const zoo_clouds[] = {CLOUDS(CLOUD_NAME) NULL};
#undef CLOUD_NAME
const char *const zoo_normals[] = {"true", "wrong", "flipped", "long", "zero", "not_a_number", NULL};
const char *const zoo_masks[] = {"one", "some", "none", "all", "two", NULL};
const char *const zoo_values[] = {"random", "one", "zero", "linear", "spike", "huge", "tiny", "not_a_number", NULL};

static void make_rows(row_fn row, const struct spec *spec, size_t n, double *points, double *normals)
{
	struct gnp_random random, shaking;
	double scale = spec_number(spec, "scale", 1), moved = spec_number(spec, "moved", 0), noise = spec_number(spec, "shake", 0);
	gnp_random_seed(&random, (uint64_t)spec_number(spec, "seed", 0), 0);
	gnp_random_seed(&shaking, (uint64_t)spec_number(spec, "seed", 0), 1);
	for (size_t i = 0; i < n; i++) {
		row(i, n, &random, points + 3 * i, normals + 3 * i);
		for (int c = 0; c < 3; c++)
			points[3 * i + (size_t)c] = (points[3 * i + (size_t)c] + noise * gnp_random_normal(&shaking)) * scale + moved;
	}
}

static void spoil_normal(const char *how, size_t i, struct gnp_random *random, double normal[3])
{
	double factor = strcmp(how, "zero") == 0 && i % 7 == 0 ? 0 : strcmp(how, "flipped") == 0 && i % 2 ? -1 : strcmp(how, "long") == 0 ? 1e30 : 1;
	for (int c = 0; c < 3; c++)
		normal[c] = strcmp(how, "wrong") == 0 ? gnp_random_normal(random) : normal[c] * factor;
	if (strcmp(how, "not_a_number") == 0 && i % 11 == 5)
		normal[0] = NAN;
}

/* ---- Tensors ---- */

static void store(struct gnp_tensor *tensor, size_t i, double value)
{
	switch (tensor->datatype) {
	case GNP_FP64: ((double *)tensor->data)[i] = value; break;
	case GNP_FP32: ((float *)tensor->data)[i] = (float)value; break;
	case GNP_INT16: ((int16_t *)tensor->data)[i] = (int16_t)(fabs(value) < 32 ? 1000 * value : 0); break;
	case GNP_FP16: { /* the numbers of 8 bits before the point: enough for a coarse cloud */
		int exponent;
		double part = isfinite(value) ? frexp(value, &exponent) : (exponent = 0, 0);
		bool small = exponent < -13 || exponent > 15 || part == 0;
		unsigned bits = small ? 0 : ((unsigned)(exponent + 14) << 10) | ((unsigned)(fabs(part) * 2048) & 1023);
		((uint16_t *)tensor->data)[i] = (uint16_t)(bits | (value < 0 ? 0x8000 : 0));
		break;
	}
	default: ((unsigned char *)tensor->data)[i] = value != 0;
	}
}

static bool add(struct gnp_request *request, const char *name, enum gnp_datatype type, unsigned rank, const size_t *shape, const double *values)
{
	struct gnp_tensor *tensor;
	size_t elements;
	if (!gnp_tensor_elements(rank, shape, &elements) || gnp_tensors_add(&request->inputs, name, type, rank, shape, &tensor, NULL) != GNP_OK)
		return false;
	for (size_t i = 0; i < elements; i++)
		store(tensor, i, values[i]);
	return true;
}

static double mask_value(const char *word, size_t i, size_t n, struct gnp_random *random)
{
	bool some = gnp_random_below(random, 5) == 0;
	return strcmp(word, "all") == 0 || (strcmp(word, "one") == 0 && i == n / 2) || (strcmp(word, "some") == 0 && some) ? 1
	       : strcmp(word, "two") == 0 && i == n / 2                                                                  ? 2
	                                                                                                                  : 0;
}

static double column_value(const char *word, size_t i, size_t n, const double *point, struct gnp_random *random)
{
	double drawn = gnp_random_normal(random);
	if (strncmp(word, "random", 6) == 0)
		return drawn;
	if (strncmp(word, "linear", 6) == 0)
		return point[0] - 2 * point[2];
	if (strncmp(word, "spike", 5) == 0)
		return i == n / 2;
	if (strncmp(word, "not_a_number", 12) == 0)
		return i == n / 2 ? NAN : drawn;
	return strncmp(word, "huge", 4) == 0 ? 1e200 * drawn : strncmp(word, "tiny", 4) == 0 ? 1e-200 * drawn : strncmp(word, "one", 3) == 0;
}

static bool add_input(const struct spec *spec, const struct gnp_tensor_info *info, const char *word, size_t n, const double *points,
                      struct gnp_request *request)
{
	enum { SOME = 5 }; /* rows of an input that has not one a point */
	struct gnp_random random;
	const char *colon = strchr(word, ':');
	size_t rows = info->shape[0] == -1 ? n : SOME, columns = colon && info->rank > 1 ? strtoul(colon + 1, NULL, 10) : 1;
	size_t shape[] = {rows, columns}, count = rows * columns;
	double *values = calloc(count + 1, sizeof *values);
	gnp_random_seed(&random, (uint64_t)spec_number(spec, "seed", 0), 2);
	for (size_t i = 0; values && i < count; i++) {
		size_t point = rows == n || n == 0 ? i / columns : i % n;
		if (info->datatype == GNP_INT64)
			values[i] = floor(gnp_random_uniform(&random) * (double)n) + (strncmp(word, "huge", 4) == 0 ? 1e12 : 0);
		else
			values[i] = info->datatype == GNP_BOOL ? mask_value(word, i, n, &random)
			                                       : column_value(word, point, n, points + 3 * (n ? point : 0), &random);
	}
	bool done = values && add(request, info->name, info->datatype == GNP_BOOL ? GNP_UINT8 : GNP_FP64, info->rank, shape, values);
	free(values);
	return done;
}

static bool add_cloud(const struct spec *spec, row_fn row, size_t n, double *points, double *normals, struct gnp_request *request)
{
	enum gnp_datatype type;
	const char *how = spec_get(spec, "normals", NULL);
	const size_t shape[] = {n, 3};
	struct gnp_random random;
	if (!gnp_datatype_find(spec_get(spec, "type", "FP64"), &type))
		return false;
	make_rows(row, spec, n, points, normals);
	gnp_random_seed(&random, (uint64_t)spec_number(spec, "seed", 0), 3);
	for (size_t i = 0; how && i < n; i++)
		spoil_normal(how, i, &random, normals + 3 * i);
	return add(request, "points", type, 2, shape, points) && (!how || add(request, "normals", type == GNP_FP64 ? GNP_FP64 : GNP_FP32, 2, shape, normals));
}

static bool add_choices(const char *list, struct gnp_request *request)
{
	size_t count = 1;
	for (const char *at = list; (at = strchr(at, ',')) != NULL; at++)
		count++;
	request->outputs = calloc(count, sizeof *request->outputs);
	for (; request->outputs && *list; list += strcspn(list, ","), list += *list == ',') {
		struct gnp_output_choice *choice = &request->outputs[request->output_count++];
		snprintf(choice->name, sizeof choice->name, "%.*s", (int)strcspn(list, ","), list);
		choice->binary = true;
	}
	return request->outputs != NULL;
}

static bool add_words(const struct spec *spec, const struct gnp_operation *operation, size_t n, const double *points, struct gnp_request *request)
{
	bool done = true;
	for (size_t i = 0; i < spec->count && done; i++)
		if (!spec_is_own(spec->word[i].name))
			done = gnp_values_add_string(&request->parameters, spec->word[i].name, spec->word[i].value, NULL) == GNP_OK;
	for (size_t i = 0; i < operation->input_count && done; i++) {
		char word[SPEC_NAME];
		snprintf(word, sizeof word, "in:%s", operation->inputs[i].name);
		if (spec_get(spec, word, NULL))
			done = add_input(spec, &operation->inputs[i], spec_get(spec, word, NULL), n, points, request);
	}
	const char *list = spec_get(spec, "out", NULL);
	return done && (!list || add_choices(list, request));
}

static row_fn row_of(const char *name)
{
	for (size_t i = 0; i < sizeof clouds / sizeof *clouds; i++)
		if (strcmp(clouds[i].name, name) == 0)
			return clouds[i].row;
	return NULL;
}

bool zoo_request(const struct spec *spec, const struct gnp_operation *operation, struct gnp_request *request)
{
	row_fn row = row_of(spec_get(spec, "cloud", "sphere"));
	size_t n = (size_t)spec_number(spec, "n", 100);
	double *points = calloc(3 * n + 1, sizeof *points), *normals = calloc(3 * n + 1, sizeof *normals);
	*request = (struct gnp_request){.binary_default = true};
	bool done = row && points && normals && add_cloud(spec, row, n, points, normals, request) && add_words(spec, operation, n, points, request);
	free(points);
	free(normals);
	return done;
}
