#include "weights/train/train_files.h"

#include <stdio.h>
#include <string.h>

#include "weights/train/folder.h"

gnp_status gnp_train_files_name(const char *folder, struct gnp_train_files *out, struct gnp_error *error)
{
	struct {
		char *path;
		const char *name;
	} files[] = {{out->checkpoint, "checkpoint"}, {out->history, "history.csv"}, {out->curve, "curve.png"}};
	for (size_t i = 0; i < sizeof files / sizeof *files; i++)
		if (snprintf(files[i].path, PATH_MAX, "%s/%s", folder, files[i].name) >= PATH_MAX)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "checkpoint: got a name of %zu bytes, need a shorter one",
			                     strlen(folder));
	return gnp_folder_make(folder, error);
}
