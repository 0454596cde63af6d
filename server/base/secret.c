#include "server/base/secret.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static gnp_status check_file(const char *what, const char *path, bool private, size_t limit, const struct stat *file,
                             struct gnp_error *error)
{
	unsigned mode = file->st_mode & 07777;
	if (!S_ISREG(file->st_mode))
		return gnp_error_set(error, GNP_IO, "%s: %s: not a regular file", what, path);
	if ((size_t)file->st_size > limit)
		return gnp_error_set(error, GNP_IO, "%s: %s: got %lld bytes, need at most %zu", what, path, (long long)file->st_size, limit);
	if (!private)
		return GNP_OK;
	if (mode & 027)
		return gnp_error_set(error, GNP_IO, "%s: %s: got mode %04o, which lets others read or write it, need 0600 or 0640", what,
		                     path, mode);
	if (file->st_uid != 0 && file->st_uid != geteuid())
		return gnp_error_set(error, GNP_IO, "%s: %s: belongs to user %u, need %u or root", what, path, (unsigned)file->st_uid,
		                     (unsigned)geteuid());
	return GNP_OK;
}

/* What is there now: the file may grow or shrink meanwhile. */
static gnp_status read_all(const char *what, const char *path, int fd, size_t limit, char *data, size_t *size,
                           struct gnp_error *error)
{
	size_t have = 0;
	for (;;) {
		ssize_t got = read(fd, data + have, limit + 1 - have);
		if (got < 0 && errno == EINTR)
			continue;
		if (got < 0)
			return gnp_error_set(error, GNP_IO, "%s: %s: %s", what, path, strerror(errno));
		if (got == 0)
			break;
		have += (size_t)got;
		if (have > limit)
			return gnp_error_set(error, GNP_IO, "%s: %s: got more than %zu bytes, need at most that", what, path, limit);
	}
	data[have] = '\0';
	*size = have;
	return GNP_OK;
}

gnp_status gnpd_secret_read(const char *what, const char *path, bool private, size_t limit, char **data, size_t *size,
                            struct gnp_error *error)
{
	struct stat file;
	/* Non-blocking, so that a pipe under this name does not wait for a writer. */
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	if (fd < 0 || fstat(fd, &file) != 0) {
		gnp_error_set(error, GNP_IO, "%s: %s: %s", what, path, strerror(errno));
		if (fd >= 0)
			close(fd);
		return GNP_IO;
	}
	gnp_status status = check_file(what, path, private, limit, &file, error);
	char *text = status == GNP_OK ? malloc(limit + 2) : NULL;
	if (status == GNP_OK && !text)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu bytes", what, limit + 2);
	if (status == GNP_OK)
		status = read_all(what, path, fd, limit, text, size, error);
	close(fd);
	if (status == GNP_OK)
		*data = text;
	else
		free(text);
	return status;
}
