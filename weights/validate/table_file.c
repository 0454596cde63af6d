#include "weights/validate/table_file.h"

#include <stdlib.h>

#include "clients/file_io.h"

gnp_status gnp_table_file_save(const struct gnp_arguments *arguments, const char *option, gnp_table_write_fn write,
                               const void *table, struct gnp_error *error)
{
	const char *path = gnp_arguments_get(arguments, option, NULL);
	char *data = NULL;
	size_t size = 0;
	if (!path)
		return GNP_OK;
	FILE *out = open_memstream(&data, &size);
	if (out)
		write(table, out);
	bool whole = out && !ferror(out);
	if (out)
		whole = fclose(out) == 0 && whole;
	gnp_status status = whole ? gnp_file_write(path, data, size, error)
	                          : gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for the table", path);
	free(data);
	return status;
}
