#include "weights/train/folder.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

gnp_status gnp_folder_make(const char *path, struct gnp_error *error)
{
	char part[PATH_MAX];
	size_t length = strlen(path);
	if (length >= sizeof part)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "folder: got a name of %zu bytes, need a shorter one", length);
	for (size_t end = 1; end <= length; end++) {
		if (path[end] && path[end] != '/')
			continue;
		snprintf(part, sizeof part, "%.*s", (int)end, path);
		if (mkdir(part, 0777) != 0 && errno != EEXIST)
			return gnp_error_set(error, GNP_IO, "%s: cannot make the folder: %s", part, strerror(errno));
	}
	return GNP_OK;
}
