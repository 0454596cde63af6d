/* Writes a table to the file that an option of the command line names. */
#ifndef GNP_WEIGHTS_TABLE_FILE_H
#define GNP_WEIGHTS_TABLE_FILE_H

#include <stdio.h>

#include "clients/options.h"
#include "core/base/status.h"

/* Writes one table, in one form, into memory. */
typedef void (*gnp_table_write_fn)(const void *table, FILE *out);

/* Nothing where the option was not given. The file is whole or, on failure, the one that was there. GNP_IO,
 * GNP_OUT_OF_MEMORY. */
gnp_status gnp_table_file_save(const struct gnp_arguments *arguments, const char *option, gnp_table_write_fn write,
                               const void *table, struct gnp_error *error);

#endif
