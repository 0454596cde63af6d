/* A folder for files that live as long as a run. */
#ifndef GNP_WEIGHTS_TEMPORARY_H
#define GNP_WEIGHTS_TEMPORARY_H

#include "core/base/status.h"

enum { GNP_TEMPORARY_PATH = 256 };

/* Makes a folder of a new name in $TMPDIR or /tmp, for this user alone; the caller removes it. GNP_IO. */
gnp_status gnp_temporary_folder(char path[GNP_TEMPORARY_PATH], struct gnp_error *error);

#endif
