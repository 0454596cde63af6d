/* Makes a folder and those above it that are not there. GNP_IO names the one that cannot be made. */
#ifndef GNP_WEIGHTS_FOLDER_H
#define GNP_WEIGHTS_FOLDER_H

#include "core/base/status.h"

gnp_status gnp_folder_make(const char *path, struct gnp_error *error);

#endif
