/* gnp convert: writes a file in another format, with all fields or some. */
#include <stdlib.h>
#include <string.h>

#include "clients/command.h"
#include "clients/fields.h"
#include "clients/file_io.h"

static const struct gnp_option options[] = {
	{"output", 'o', "FILE", "where to write (default: standard output)"},
	{"format", 0, "NAME", "format of the output (default: by extension; ply on standard output)"},
	{"input-format", 0, "NAME", "format of the input (default: by extension, else by its first bytes)"},
	{"fields", 0, "A,B,...", "what to keep, in this order (default: all)"},
	{"type", 0, "TYPE", "fp32 or fp64 for floating-point fields (default: as they are)"},
};

static bool is_real(enum gnp_datatype datatype)
{
	return datatype == GNP_FP16 || datatype == GNP_FP32 || datatype == GNP_FP64;
}

/* The field as it is (borrowed) or with its numbers as `wanted`; GNP_DATATYPE_COUNT keeps the type. */
static gnp_status add_field(struct gnp_tensors *tensors, const struct gnp_tensor *field, enum gnp_datatype wanted,
                            struct gnp_error *error)
{
	struct gnp_tensor *tensor;
	size_t elements = 0;
	if (wanted == GNP_DATATYPE_COUNT || wanted == field->datatype || !is_real(field->datatype))
		return gnp_tensors_add_data(tensors, field->name, field->datatype, field->rank, field->shape, field->data, false,
		                            NULL, error);
	gnp_status status = gnp_tensors_add(tensors, field->name, wanted, field->rank, field->shape, &tensor, error);
	if (status != GNP_OK)
		return status;
	gnp_tensor_elements(field->rank, field->shape, &elements);
	for (size_t i = 0; i < elements; i++) {
		double value = gnp_tensor_get(field, i);
		if (wanted == GNP_FP32)
			((float *)tensor->data)[i] = (float)value;
		else
			((double *)tensor->data)[i] = value;
	}
	return GNP_OK;
}

static gnp_status add_named(const struct gnp_tensors *all, const char *names, enum gnp_datatype wanted,
                            struct gnp_tensors *kept, struct gnp_error *error)
{
	char *copy = strdup(names), *rest = NULL;
	gnp_status status = GNP_OK;
	if (!copy)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "--fields: no memory");
	for (char *name = strtok_r(copy, ",", &rest); name && status == GNP_OK; name = strtok_r(NULL, ",", &rest)) {
		const struct gnp_tensor *field = gnp_field_find(all, name);
		status = field ? add_field(kept, field, wanted, error)
		               : gnp_error_set(error, GNP_NOT_FOUND, "field %.64s: not in the file", name);
	}
	free(copy);
	return status;
}

static gnp_status keep(const struct gnp_tensors *all, const char *names, enum gnp_datatype wanted,
                       struct gnp_tensors *kept, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (names)
		return add_named(all, names, wanted, kept, error);
	for (size_t i = 0; i < all->count && status == GNP_OK; i++)
		status = add_field(kept, &all->items[i], wanted, error);
	return status;
}

static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	(void)command;
	const char *output = gnp_arguments_get(arguments, "output", "-"), *type = gnp_arguments_get(arguments, "type", NULL);
	enum gnp_datatype wanted = GNP_DATATYPE_COUNT;
	const struct gnp_format *format;
	if (gnp_file_format_out(gnp_arguments_get(arguments, "format", NULL), output, &format, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	if (type)
		wanted = strcmp(type, "fp32") == 0 ? GNP_FP32 : strcmp(type, "fp64") == 0 ? GNP_FP64 : GNP_BYTES;
	if (wanted == GNP_BYTES) {
		gnp_error_set(error, GNP_INVALID_ARGUMENT, "--type: got '%s', need fp32 or fp64", type);
		return GNP_EXIT_USAGE;
	}
	struct gnp_buffer content = {0};
	struct gnp_tensors all = {0}, kept = {0};
	const char *input_format = gnp_arguments_get(arguments, "input-format", NULL);
	gnp_status status = gnp_file_load(arguments->operands[0], input_format, &content, &all, error);
	if (status == GNP_OK)
		status = keep(&all, gnp_arguments_get(arguments, "fields", NULL), wanted, &kept, error);
	if (status == GNP_OK)
		status = gnp_file_save(output, format, &kept, NULL, error);
	gnp_tensors_clear(&kept);
	gnp_tensors_clear(&all);
	gnp_buffer_clear(&content);
	return gnp_exit_of(status, false);
}

const struct gnp_command gnp_command_convert = {
	.name = "convert",
	.operands = "IN [OPTIONS] -o OUT",
	.help = "turn a cloud's file into another format",
	.options = options,
	.option_count = sizeof options / sizeof options[0],
	.operands_least = 1,
	.operands_most = 1,
	.run = run,
};
