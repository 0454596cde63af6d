#include "core/model/model.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/safetensors_write.h"

static const char extension[] = ".safetensors";

/* ---- From tensors ---- */

static void show_shape(const size_t *shape, size_t rank, char *text, size_t size)
{
	size_t length = (size_t)snprintf(text, size, "[");
	for (size_t d = 0; d < rank && length < size; d++)
		length += (size_t)snprintf(text + length, size - length, "%s%zu", d ? "," : "", shape[d]);
	if (length < size)
		snprintf(text + length, size - length, "]");
}

/* The parameter a row describes, to where the row says it lies in the block. */
static gnp_status take_tensor(const struct gnp_safetensors *file, const struct gnp_parameter_row *row,
                              float *parameters, struct gnp_error *error)
{
	const struct gnp_safetensors_tensor *tensor = gnp_safetensors_tensor_find(file, row->name);
	char need[64], got[80];
	show_shape(row->shape, row->rank, need, sizeof need);
	if (!tensor)
		return gnp_safetensors_refuse(file, error, "tensor \"%s\": missing, need shape %s", row->name, need);
	show_shape(tensor->shape, tensor->rank, got, sizeof got);
	if (tensor->rank != row->rank || memcmp(tensor->shape, row->shape, row->rank * sizeof *row->shape) != 0)
		return gnp_safetensors_refuse(file, error, "tensor \"%s\": shape: got %s, need %s", row->name, got, need);
	memcpy(parameters + row->offset, tensor->data, row->count * sizeof *parameters);
	return GNP_OK;
}

static gnp_status refuse_others(const struct gnp_safetensors *file, const struct gnp_architecture *architecture,
                                const struct gnp_layout *layout, struct gnp_error *error)
{
	const struct gnp_safetensors_tensor *tensor;
	for (size_t i = 0; (tensor = gnp_safetensors_tensor_at(file, i)); i++)
		if (!gnp_layout_find(layout, tensor->name))
			return gnp_safetensors_refuse(file, error,
			                              "tensor \"%.64s\": unknown, the trunk %s of %u layers with the head %s has %zu "
			                          "others", tensor->name, gnp_trunk_name(architecture->trunk), architecture->layers,
			                          gnp_head_name(architecture->head), layout->rows);
	return GNP_OK;
}

static gnp_status read_network(struct gnp_model *model, struct gnp_error *error)
{
	struct gnp_layout *layout = gnp_array_new(1, sizeof *layout);
	struct gnp_error cause = {0};
	float *parameters = NULL;
	if (!layout)
		return gnp_no_memory(model->name, 1, "layout", error);
	gnp_status status = gnp_architecture_layout(&model->architecture, layout, &cause);
	if (status != GNP_OK) {
		status = gnp_safetensors_refuse(model->file, error, "metadata: %s", cause.text);
		goto done;
	}
	model->parameter_count = layout->total;
	parameters = gnp_array_new(layout->total, sizeof *parameters);
	if (!parameters)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY,
		                       "%s: no memory for %zu parameters", model->name, layout->total);
	for (size_t i = 0; i < layout->rows && status == GNP_OK; i++)
		status = take_tensor(model->file, &layout->row[i], parameters, error);
	if (status == GNP_OK)
		status = refuse_others(model->file, &model->architecture, layout, error);
	if (status == GNP_OK)
		status = gnp_network_create(&model->architecture, parameters, &model->network, error);
done:
	free(parameters);
	free(layout);
	return status;
}

/* ---- A model ---- */

/* NAME of FOLDER/NAME.safetensors. */
static gnp_status read_name(struct gnp_model *model, struct gnp_error *error)
{
	const char *path = gnp_safetensors_path(model->file), *slash = strrchr(path, '/');
	const char *base = slash ? slash + 1 : path;
	size_t length = strlen(base), tail = sizeof extension - 1;
	if (length > tail && strcmp(base + length - tail, extension) == 0)
		length -= tail;
	if (length > GNP_MODEL_NAME_MAX)
		length = 0;
	memcpy(model->name, base, length);
	if (gnp_model_name_fits(model->name))
		return GNP_OK;
	return gnp_safetensors_refuse(model->file, error,
	                              "its name: need 1..%d of A-Z a-z 0-9 _ - . before %s", GNP_MODEL_NAME_MAX,
	                          extension);
}

gnp_status gnp_model_create_take(struct gnp_safetensors *file, struct gnp_model **out, struct gnp_error *error)
{
	struct gnp_model_description description;
	struct gnp_model *model = gnp_array_zero(1, sizeof *model);
	if (!model) {
		gnp_safetensors_free(file);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "model: no memory for %zu bytes", sizeof *model);
	}
	model->file = file;
	gnp_status status = read_name(model, error);
	if (status == GNP_OK)
		status = gnp_model_keys_read(file, &description, error);
	if (status == GNP_OK) {
		model->architecture = description.architecture;
		model->recipe = description.recipe;
		model->regime = description.regime;
		model->sha256 = gnp_safetensors_sha256(file);
		status = read_network(model, error);
		gnp_safetensors_drop_tensors(file);
	}
	if (status != GNP_OK) {
		gnp_model_free(model);
		return status;
	}
	*out = model;
	return GNP_OK;
}

gnp_status gnp_model_load(const char *path, struct gnp_model **out, struct gnp_error *error)
{
	struct gnp_safetensors *file;
	gnp_status status = gnp_safetensors_load(path, &file, error);
	return status == GNP_OK ? gnp_model_create_take(file, out, error) : status;
}

void gnp_model_free(struct gnp_model *model)
{
	if (!model)
		return;
	gnp_network_free(model->network);
	gnp_safetensors_free(model->file);
	free(model);
}

/* ---- To a file ---- */

/* What the description has for the keys of the table, then the others. */
static gnp_status write_metadata(const char *path, const struct gnp_model_source *source,
                                 char buffers[GNP_MODEL_KEYS_MAX][GNP_MODEL_VALUE_TEXT], struct gnp_safetensors_metadata *metadata,
                                 size_t *count, struct gnp_error *error)
{
	const struct gnp_model_description description = {source->architecture, source->recipe, source->regime, 0};
	gnp_status status = gnp_model_keys_write(path, &description, buffers, metadata, count, error);
	for (size_t i = 0; i < source->more_count && status == GNP_OK; i++) {
		if (!gnp_model_key_known(source->more[i].key))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "%.120s: metadata \"%.64s\": unknown key, need one of weights/README.md",
			                     path, source->more[i].key);
		metadata[(*count)++] = source->more[i];
	}
	return status;
}

gnp_status gnp_model_save(const char *path, const struct gnp_model_source *source, struct gnp_error *error)
{
	struct gnp_layout *layout = gnp_array_zero(1, sizeof *layout);
	struct gnp_safetensors_tensor *tensors = gnp_array_zero(GNP_PARAMETER_ROWS_MAX, sizeof *tensors);
	struct gnp_safetensors_metadata *metadata = gnp_array_new(GNP_MODEL_KEYS_MAX + source->more_count, sizeof *metadata);
	char buffers[GNP_MODEL_KEYS_MAX][GNP_MODEL_VALUE_TEXT] = {""};
	size_t metadata_count = 0;
	gnp_status status = GNP_OK;
	if (!layout || !tensors || !metadata)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "%.120s: no memory to write a model", path);
	if (status == GNP_OK)
		status = gnp_architecture_layout(&source->architecture, layout, error);
	if (status == GNP_OK)
		status = write_metadata(path, source, buffers, metadata, &metadata_count, error);
	for (size_t i = 0; status == GNP_OK && i < layout->rows; i++) {
		const struct gnp_parameter_row *row = &layout->row[i];
		tensors[i] = (struct gnp_safetensors_tensor){.name = row->name, .rank = row->rank, .data = source->parameters + row->offset};
		memcpy(tensors[i].shape, row->shape, row->rank * sizeof *row->shape);
	}
	if (status == GNP_OK)
		status = gnp_safetensors_save(path, &(struct gnp_safetensors_source){metadata, metadata_count, tensors, layout->rows}, error);
	free(metadata);
	free(tensors);
	free(layout);
	return status;
}
