/* Where a training keeps its files: a folder with the checkpoint, history.csv and curve.png. */
#ifndef GNP_WEIGHTS_TRAIN_FILES_H
#define GNP_WEIGHTS_TRAIN_FILES_H

#include <limits.h>

#include "core/base/status.h"

struct gnp_train_files {
	char checkpoint[PATH_MAX], history[PATH_MAX], curve[PATH_MAX];
};

/* Names the files and makes the folder. GNP_INVALID_ARGUMENT: its name is too long. */
gnp_status gnp_train_files_name(const char *folder, struct gnp_train_files *out, struct gnp_error *error);

#endif
