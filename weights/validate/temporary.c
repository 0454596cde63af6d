#include "weights/validate/temporary.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

gnp_status gnp_temporary_folder(char path[GNP_TEMPORARY_PATH], struct gnp_error *error)
{
	const char *told = getenv("TMPDIR"), *where = told && *told ? told : "/tmp";
	char chance[7] = "";
	memset(chance, 'X', sizeof chance - 1); /* what mkdtemp replaces */
	int length = snprintf(path, GNP_TEMPORARY_PATH, "%s/gnp-validate-%s", where, chance);
	if (length >= GNP_TEMPORARY_PATH)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "TMPDIR: got %zu bytes, need at most %d", strlen(where),
		                     GNP_TEMPORARY_PATH - 24);
	return mkdtemp(path) ? GNP_OK : gnp_error_set(error, GNP_IO, "%s: cannot be made", path);
}
