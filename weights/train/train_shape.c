#include "weights/train/train_shape.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "core/base/memory.h"
#include "core/search/order.h"
#include "core/shapes/shapes.h"
#include "weights/train/array_file.h"
#include "weights/train/folder.h"

enum { VERSION = 1, PIECES = 3 };

void gnp_train_shape_clear(struct gnp_train_shape *shape)
{
	free(shape->exact);
	free(shape->normals);
	free(shape->second_form);
	*shape = (struct gnp_train_shape){0};
}

static gnp_status reserve(size_t count, struct gnp_train_shape *shape, struct gnp_error *error)
{
	*shape = (struct gnp_train_shape){.count = count};
	shape->exact = gnp_array_new(count, 3 * sizeof *shape->exact);
	shape->normals = gnp_array_new(count, 3 * sizeof *shape->normals);
	shape->second_form = gnp_array_new(count, 6 * sizeof *shape->second_form);
	if (shape->exact && shape->normals && shape->second_form)
		return GNP_OK;
	gnp_train_shape_clear(shape);
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training shape: no memory for %zu points", count);
}

/* The arrays as the file holds them. */
static void pieces_of(const struct gnp_train_shape *shape, size_t count, struct gnp_array_piece pieces[PIECES])
{
	pieces[0] = (struct gnp_array_piece){shape->exact, 3 * count * sizeof *shape->exact};
	pieces[1] = (struct gnp_array_piece){shape->normals, 3 * count * sizeof *shape->normals};
	pieces[2] = (struct gnp_array_piece){shape->second_form, 6 * count * sizeof *shape->second_form};
}

static void title_of(const struct gnp_train_shape_key *key, char title[GNP_ARRAY_FILE_TITLE])
{
	snprintf(title, GNP_ARRAY_FILE_TITLE, "gnp-train-shape %d seed %llu degree %u points %zu", VERSION,
	         (unsigned long long)key->seed, key->degree, key->points);
}

static gnp_status path_of(const char *folder, const struct gnp_train_shape_key *key, char path[PATH_MAX],
                          struct gnp_error *error)
{
	int length = snprintf(path, PATH_MAX, "%s/radial-%llu-L%u-%zu.shape", folder, (unsigned long long)key->seed, key->degree,
	                      key->points);
	if (length < PATH_MAX)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "cache: got a name of %zu bytes, need a shorter one", strlen(folder));
}

/* ---- Making ---- */

static void take_point(const struct gnp_sample *sample, size_t from, struct gnp_train_shape *shape, size_t to)
{
	static const int entries[6] = {0, 1, 2, 4, 5, 8};
	memcpy(shape->exact + 3 * to, sample->exact + 3 * from, 3 * sizeof *shape->exact);
	for (int c = 0; c < 3; c++)
		shape->normals[3 * to + c] = (float)sample->normals[3 * from + c];
	for (int e = 0; e < 6; e++)
		shape->second_form[6 * to + e] = (float)sample->second_form[9 * from + entries[e]];
}

/* In curve order, so that the points of a patch lie close together in memory. */
static gnp_status take_sample(const struct gnp_sample *sample, struct gnp_train_shape *out, struct gnp_error *error)
{
	uint32_t *order = gnp_array_new(sample->count, sizeof *order);
	if (!order)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training shape: no memory for %zu points", sample->count);
	gnp_status status = gnp_order_compute(sample->exact, sample->count, order, error);
	if (status == GNP_OK)
		status = reserve(sample->count, out, error);
	for (size_t i = 0; status == GNP_OK && i < sample->count; i++)
		take_point(sample, order[i], out, i);
	free(order);
	return status;
}

static gnp_status make(const struct gnp_train_shape_key *key, struct gnp_pool *pool, struct gnp_task *task,
                       struct gnp_train_shape *out, struct gnp_error *error)
{
	struct gnp_shape *shape;
	struct gnp_sample sample;
	const struct gnp_sample_options clean = {.count = key->points, .seed = key->seed};
	gnp_status status = gnp_shape_create("radial", key->seed, key->degree, &shape, error);
	if (status != GNP_OK)
		return status;
	status = gnp_sample_create(shape, &clean, pool, task, &sample, error);
	gnp_shape_free(shape);
	if (status != GNP_OK)
		return status;
	status = take_sample(&sample, out, error);
	gnp_sample_clear(&sample);
	return status;
}

static gnp_status save(const char *path, const struct gnp_train_shape_key *key, const struct gnp_train_shape *shape,
                       struct gnp_error *error)
{
	struct gnp_array_piece pieces[PIECES];
	char title[GNP_ARRAY_FILE_TITLE];
	pieces_of(shape, shape->count, pieces);
	title_of(key, title);
	return gnp_array_file_write(path, title, pieces, PIECES, error);
}

static gnp_status make_and_save(const char *folder, const char *path, const struct gnp_train_shape_key *key,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_train_shape *out,
                                struct gnp_error *error)
{
	struct gnp_train_shape shape;
	gnp_status status = gnp_folder_make(folder, error);
	if (status == GNP_OK)
		status = make(key, pool, task, &shape, error);
	if (status != GNP_OK)
		return status;
	status = save(path, key, &shape, error);
	if (status == GNP_OK)
		*out = shape;
	else
		gnp_train_shape_clear(&shape);
	return status;
}

/* ---- Reading ---- */

static gnp_status read_file(const char *path, const struct gnp_train_shape_key *key, struct gnp_train_shape *out,
                            struct gnp_error *error)
{
	struct gnp_array_piece pieces[PIECES];
	struct gnp_train_shape shape;
	char title[GNP_ARRAY_FILE_TITLE];
	gnp_status status = reserve(key->points, &shape, error);
	if (status != GNP_OK)
		return status;
	pieces_of(&shape, shape.count, pieces);
	title_of(key, title);
	status = gnp_array_file_read(path, title, pieces, PIECES, error);
	if (status == GNP_OK)
		*out = shape;
	else
		gnp_train_shape_clear(&shape);
	return status;
}

gnp_status gnp_train_shape_load(const char *folder, const struct gnp_train_shape_key *key, struct gnp_pool *pool,
                                struct gnp_task *task, struct gnp_train_shape *out, struct gnp_error *error)
{
	char path[PATH_MAX];
	gnp_status status = path_of(folder, key, path, error);
	if (status != GNP_OK || read_file(path, key, out, NULL) == GNP_OK)
		return status;
	return make_and_save(folder, path, key, pool, task, out, error);
}

gnp_status gnp_train_shape_ensure(const char *folder, const struct gnp_train_shape_key *key, struct gnp_pool *pool,
                                  struct gnp_task *task, struct gnp_error *error)
{
	char path[PATH_MAX], title[GNP_ARRAY_FILE_TITLE];
	struct stat info;
	struct gnp_train_shape shape = {0};
	struct gnp_array_piece pieces[PIECES];
	gnp_status status = path_of(folder, key, path, error);
	if (status != GNP_OK)
		return status;
	pieces_of(&shape, key->points, pieces);
	title_of(key, title);
	if (stat(path, &info) == 0 && (size_t)info.st_size == gnp_array_file_size(title, pieces, PIECES))
		return GNP_OK;
	status = make_and_save(folder, path, key, pool, task, &shape, error);
	if (status == GNP_OK)
		gnp_train_shape_clear(&shape);
	return status;
}
