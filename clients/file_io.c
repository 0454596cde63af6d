#include "clients/file_io.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/file/file.h"
#include "proto/file/formats.h"
#include "proto/file/sniff.h"

static bool is_standard(const char *path)
{
	return strcmp(path, "-") == 0;
}

static gnp_status read_descriptor(int descriptor, const char *name, struct gnp_buffer *out, struct gnp_error *error)
{
	enum { PIECE = 1 << 20 };
	struct gnp_buffer content = {0};
	for (;;) {
		gnp_status status = gnp_buffer_reserve(&content, PIECE, error);
		if (status != GNP_OK) {
			gnp_buffer_clear(&content);
			return status;
		}
		ssize_t got = read(descriptor, content.data + content.size, PIECE);
		if (got < 0 && errno == EINTR)
			continue;
		if (got < 0) {
			int reason = errno;
			gnp_buffer_clear(&content);
			return gnp_error_set(error, GNP_IO, "%s: cannot read: %s", name, strerror(reason));
		}
		if (got == 0)
			break;
		content.size += (size_t)got;
	}
	*out = content;
	return GNP_OK;
}

gnp_status gnp_file_read(const char *path, struct gnp_buffer *out, struct gnp_error *error)
{
	if (is_standard(path))
		return read_descriptor(STDIN_FILENO, "standard input", out, error);
	int descriptor = open(path, O_RDONLY | O_CLOEXEC);
	if (descriptor < 0)
		return gnp_error_set(error, GNP_IO, "%s: cannot open: %s", path, strerror(errno));
	gnp_status status = read_descriptor(descriptor, path, out, error);
	close(descriptor);
	return status;
}

/* 0, or the errno of what failed. */
static int write_all(int descriptor, const unsigned char *data, size_t size)
{
	while (size) {
		ssize_t put = write(descriptor, data, size);
		if (put < 0 && errno == EINTR)
			continue;
		if (put < 0)
			return errno;
		data += put;
		size -= (size_t)put;
	}
	return 0;
}

static gnp_status write_directly(const char *path, const void *data, size_t size, struct gnp_error *error)
{
	bool standard = is_standard(path);
	int descriptor = standard ? STDOUT_FILENO : open(path, O_WRONLY | O_CLOEXEC);
	int reason = descriptor < 0 ? errno : write_all(descriptor, data, size);
	if (descriptor >= 0 && !standard && close(descriptor) != 0 && !reason)
		reason = errno;
	if (reason)
		return gnp_error_set(error, GNP_IO, "%s: cannot write: %s", standard ? "standard output" : path, strerror(reason));
	return GNP_OK;
}

/* 0, or the errno of what failed; then nothing is left behind. */
static int write_renamed(const char *path, const void *data, size_t size)
{
	char temporary[PATH_MAX];
	int length = snprintf(temporary, sizeof temporary, "%s.%ld.tmp", path, (long)getpid());
	if (length < 0 || (size_t)length >= sizeof temporary)
		return ENAMETOOLONG;
	int descriptor = open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
	if (descriptor < 0)
		return errno;
	int reason = write_all(descriptor, data, size);
	if (close(descriptor) != 0 && !reason)
		reason = errno;
	if (!reason && rename(temporary, path) != 0)
		reason = errno;
	if (reason)
		unlink(temporary);
	return reason;
}

gnp_status gnp_file_write(const char *path, const void *data, size_t size, struct gnp_error *error)
{
	struct stat info;
	if (is_standard(path))
		return write_directly(path, data, size, error);
	bool exists = stat(path, &info) == 0;
	if (exists && S_ISDIR(info.st_mode))
		return gnp_error_set(error, GNP_IO, "%s: cannot write: %s", path, strerror(EISDIR));
	if (exists && !S_ISREG(info.st_mode))
		return write_directly(path, data, size, error);
	/* A symbolic link stays one: its target is what is replaced. */
	char resolved[PATH_MAX];
	const char *target = exists && realpath(path, resolved) ? resolved : path;
	int reason = write_renamed(target, data, size);
	if (reason)
		return gnp_error_set(error, GNP_IO, "%s: cannot write: %s", path, strerror(reason));
	return GNP_OK;
}

static const char *extension(const char *path)
{
	const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path, *dot = strrchr(name, '.');
	return dot && dot != name ? dot + 1 : "";
}

/* "ply, npy, ...": the formats that can be read or written. */
static void list_formats(bool (*usable)(const struct gnp_format *), char *text, size_t size)
{
	const struct gnp_format *format;
	size_t used = 0;
	text[0] = 0;
	for (size_t i = 0; (format = gnp_format_at(i)) && used < size; i++)
		if (usable(format))
			used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "", format->name);
}

static gnp_status check_format(bool known, bool (*usable)(const struct gnp_format *), const struct gnp_format *found, const char *what,
                               const char *verb, const struct gnp_format **format, struct gnp_error *error)
{
	char list[128];
	if (known && usable(found)) {
		*format = found;
		return GNP_OK;
	}
	list_formats(usable, list, sizeof list);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: not a format that can be %s, need one of %s (by extension or --%s)",
	                     what, verb, list, usable == gnp_format_readable ? "input-format" : "format");
}

bool gnp_file_format_any(const char *name, const char *path, const struct gnp_buffer *content, const struct gnp_format **format)
{
	return gnp_format_by_name(name ? name : extension(path), format) || (!name && gnp_format_by_magic(content->data, content->size, format));
}

gnp_status gnp_file_format_in(const char *name, const char *path, const struct gnp_buffer *content,
                              const struct gnp_format **format, struct gnp_error *error)
{
	const struct gnp_format *found = NULL;
	bool known = gnp_file_format_any(name, path, content, &found);
	return check_format(known, gnp_format_readable, found, name ? name : path, "read", format, error);
}

gnp_status gnp_file_format_out(const char *name, const char *path, const struct gnp_format **format, struct gnp_error *error)
{
	const struct gnp_format *found = NULL;
	bool known = gnp_format_by_name(name ? name : is_standard(path) ? "ply" : extension(path), &found);
	return check_format(known, gnp_format_writable, found, name ? name : path, "written", format, error);
}

gnp_status gnp_file_load(const char *path, const char *format_name, struct gnp_buffer *content,
                         struct gnp_tensors *tensors, struct gnp_error *error)
{
	gnp_status status = gnp_file_read(path, content, error);
	return status == GNP_OK ? gnp_file_unpack(path, format_name, content, tensors, error) : status;
}

gnp_status gnp_file_unpack(const char *path, const char *format_name, const struct gnp_buffer *content, struct gnp_tensors *tensors,
                           struct gnp_error *error)
{
	const struct gnp_format *format;
	gnp_status status = gnp_file_format_in(format_name, path, content, &format, error);
	if (status != GNP_OK)
		return status;
	struct gnp_error cause = {0};
	status = gnp_file_decode_all(format, content->data, content->size, tensors, &cause);
	if (status != GNP_OK)
		return gnp_error_set(error, status, "%s: %s", path, cause.text);
	return GNP_OK;
}

gnp_status gnp_file_save(const char *path, const struct gnp_format *format, const struct gnp_tensors *tensors,
                         const struct gnp_values *comments, struct gnp_error *error)
{
	struct gnp_buffer encoded = {0};
	gnp_status status = gnp_file_encode(format, tensors, comments, &encoded, error);
	if (status == GNP_OK)
		status = gnp_file_write(path, encoded.data, encoded.size, error);
	gnp_buffer_clear(&encoded);
	return status;
}
