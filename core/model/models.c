#include "core/model/models.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "core/base/names.h"

enum { MODELS_MAX = 1024 };

struct gnp_models {
	atomic_size_t references;
	size_t count;
	struct gnp_model **models; /* (count) */
	char folder[PATH_MAX];
};

static int is_weights(const struct dirent *entry)
{
	static const char extension[] = ".safetensors";
	size_t length = strlen(entry->d_name), tail = sizeof extension - 1;
	return entry->d_name[0] != '.' && length > tail && strcmp(entry->d_name + length - tail, extension) == 0;
}

static int by_bytes(const struct dirent **a, const struct dirent **b)
{
	return strcmp((*a)->d_name, (*b)->d_name);
}

static void free_entries(struct dirent **entries, int count)
{
	for (int i = 0; i < count; i++)
		free(entries[i]);
	free(entries);
}

/* ---- The default folders ---- */

static bool folder_has_weights(const char *folder)
{
	struct dirent **entries;
	int count = scandir(folder, &entries, is_weights, by_bytes);
	if (count >= 0)
		free_entries(entries, count);
	return count > 0;
}

/* Where `make install` puts them beside the program; "" when that cannot be told. */
static void installed_folder(char folder[PATH_MAX])
{
	char program[PATH_MAX];
	ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
	program[length > 0 ? length : 0] = '\0';
	char *slash = strrchr(program, '/');
	if (slash)
		*slash = '\0';
	if (!slash || snprintf(folder, PATH_MAX, "%s/../share/gnpd/weights", program) >= PATH_MAX)
		folder[0] = '\0';
}

/* "" when none has any. */
static void default_folder(char folder[PATH_MAX])
{
	installed_folder(folder);
	if (folder[0] && folder_has_weights(folder))
		return;
	strcpy(folder, folder_has_weights("weights") ? "weights" : "");
}

/* ---- A set ---- */

static gnp_status load_file(struct gnp_models *models, const char *name, struct gnp_error *error)
{
	char path[PATH_MAX + 1 + NAME_MAX];
	snprintf(path, sizeof path, "%s/%s", models->folder, name);
	gnp_status status = gnp_model_load(path, &models->models[models->count], error);
	models->count += status == GNP_OK;
	return status;
}

static gnp_status load_folder(struct gnp_models *models, struct gnp_error *error)
{
	struct dirent **entries;
	int count = scandir(models->folder, &entries, is_weights, by_bytes);
	gnp_status status = GNP_OK;
	if (count < 0)
		return gnp_error_set(error, GNP_IO, "%.200s: %s", models->folder, strerror(errno));
	models->models = gnp_array_new((size_t)count, sizeof *models->models);
	if (!models->models)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "%.200s: no memory for %d models", models->folder, count);
	else if (count > MODELS_MAX)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                       "%.200s: got %d models, need at most %d", models->folder, count, MODELS_MAX);
	for (int i = 0; i < count && status == GNP_OK; i++)
		status = load_file(models, entries[i]->d_name, error);
	free_entries(entries, count);
	return status;
}

static void models_free(struct gnp_models *models)
{
	for (size_t i = 0; i < models->count; i++)
		gnp_model_free(models->models[i]);
	free(models->models);
	free(models);
}

gnp_status gnp_models_load(const char *folder, struct gnp_models **out, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	struct gnp_models *models = gnp_array_zero(1, sizeof *models);
	if (!models)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "models: no memory for %zu bytes", sizeof *models);
	atomic_init(&models->references, 1);
	if (!folder || !*folder)
		default_folder(models->folder);
	else if ((size_t)snprintf(models->folder, sizeof models->folder, "%s", folder) >= sizeof models->folder)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.80s...: got %zu bytes of path, need at most %zu", folder,
		                       strlen(folder), sizeof models->folder - 1);
	if (status == GNP_OK && models->folder[0])
		status = load_folder(models, error);
	if (status != GNP_OK) {
		models_free(models);
		return status;
	}
	*out = models;
	return GNP_OK;
}

struct gnp_models *gnp_models_retain(struct gnp_models *models)
{
	if (models)
		atomic_fetch_add(&models->references, 1);
	return models;
}

void gnp_models_release(struct gnp_models *models)
{
	if (models && atomic_fetch_sub(&models->references, 1) == 1)
		models_free(models);
}

const char *gnp_models_folder(const struct gnp_models *models)
{
	return models ? models->folder : "";
}

size_t gnp_models_count(const struct gnp_models *models)
{
	return models ? models->count : 0;
}

const struct gnp_model *gnp_models_at(const struct gnp_models *models, size_t i)
{
	return i < gnp_models_count(models) ? models->models[i] : NULL;
}

gnp_status gnp_models_find(const struct gnp_models *models, const char *name, const struct gnp_model **out,
                           struct gnp_error *error)
{
	struct gnp_names known;
	const struct gnp_model *model;
	for (size_t i = 0; (model = gnp_models_at(models, i)); i++) {
		if (strcmp(model->name, name) == 0) {
			*out = model;
			return GNP_OK;
		}
	}
	gnp_names_begin(&known, name, strlen(name));
	for (size_t i = 0; (model = gnp_models_at(models, i)); i++)
		gnp_names_add(&known, model->name);
	if (!gnp_models_at(models, 0))
		return gnp_error_set(error, GNP_UNAVAILABLE, "weights: got \"%.63s\", known: none are loaded", name);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "weights: got \"%.63s\", known: %s", name, gnp_names_end(&known));
}
