#include "server/base/disk.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NAME_MAX_BYTES = 256 };

void gnpd_disk_init(struct gnpd_disk *disk, int folder, bool durable)
{
	*disk = (struct gnpd_disk){.folder = folder, .durable = durable, .write = write, .sync = fsync, .open = openat, .next = readdir};
}

gnp_status gnpd_disk_failure(int number, const char *what, const char *name, struct gnp_error *error)
{
	bool full = number == ENOSPC || number == EDQUOT || number == EFBIG;
	return gnp_error_set(error, full ? GNP_NO_SPACE : GNP_STORAGE, "%s %s: %s (jobs-dir)", what, name, strerror(number));
}

/* A write that takes nothing and gives no reason is a disk that is full. */
static bool write_all(const struct gnpd_disk *disk, int fd, const struct gnp_piece *piece)
{
	const char *data = piece->data;
	for (size_t done = 0; done < piece->size;) {
		ssize_t wrote = disk->write(fd, data + done, piece->size - done);
		if (wrote > 0)
			done += (size_t)wrote;
		else if (wrote == 0 || errno != EINTR) {
			errno = wrote == 0 ? ENOSPC : errno;
			return false;
		}
	}
	return true;
}

static bool sync_if_durable(const struct gnpd_disk *disk, int fd)
{
	return !disk->durable || disk->sync(fd) == 0;
}

/* errno says what went wrong. */
static bool write_file(const struct gnpd_disk *disk, const char *name, const struct gnp_piece *pieces, size_t count)
{
	int fd = openat(disk->folder, name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	if (fd < 0)
		return false;
	bool good = true;
	for (size_t i = 0; i < count && good; i++)
		good = write_all(disk, fd, &pieces[i]);
	good = good && sync_if_durable(disk, fd);
	int number = errno;
	if (close(fd) != 0 && good) {
		good = false;
		number = errno;
	}
	errno = number;
	return good;
}

gnp_status gnpd_disk_put(const struct gnpd_disk *disk, const char *name, const struct gnp_piece *pieces, size_t count,
                         struct gnp_error *error)
{
	char beside[NAME_MAX_BYTES];
	snprintf(beside, sizeof beside, "%s.new", name);
	bool replaces = faccessat(disk->folder, name, F_OK, AT_SYMLINK_NOFOLLOW) == 0;
	if (!write_file(disk, beside, pieces, count) || renameat(disk->folder, beside, disk->folder, name) != 0) {
		int number = errno;
		unlinkat(disk->folder, beside, 0);
		return gnpd_disk_failure(number, "cannot write", name, error);
	}
	if (sync_if_durable(disk, disk->folder))
		return GNP_OK;
	int number = errno;
	if (!replaces)
		unlinkat(disk->folder, name, 0);
	return gnpd_disk_failure(number, "cannot write", name, error);
}

int gnpd_disk_open(const struct gnpd_disk *disk, const char *name, size_t *size)
{
	struct stat information;
	int fd = disk->open(disk->folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
	if (fd < 0) {
		errno = errno == ELOOP || errno == ENXIO ? ENOENT : errno; /* a link, a socket */
		return -1;
	}
	int number = fstat(fd, &information) != 0 ? errno : S_ISREG(information.st_mode) ? 0 : ENOENT;
	if (number) {
		close(fd);
		errno = number;
		return -1;
	}
	*size = (size_t)information.st_size;
	return fd;
}

static gnp_status read_all(int fd, const char *name, size_t size, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_reserve(buffer, size, error);
	for (size_t done = 0; status == GNP_OK && done < size;) {
		ssize_t got = read(fd, buffer->data + buffer->size, size - done);
		if (got < 0 && errno == EINTR)
			continue;
		if (got <= 0)
			return gnpd_disk_failure(got < 0 ? errno : EIO, "cannot read", name, error);
		buffer->size += (size_t)got;
		done += (size_t)got;
	}
	return status;
}

gnp_status gnpd_disk_get(const struct gnpd_disk *disk, const char *name, size_t most, struct gnp_buffer *buffer, struct gnp_error *error)
{
	size_t size = 0;
	int fd = gnpd_disk_open(disk, name, &size);
	if (fd < 0)
		return errno == ENOENT ? gnp_error_set(error, GNP_NOT_FOUND, "%s: there is no such file", name)
		                       : gnpd_disk_failure(errno, "cannot open", name, error);
	gnp_status status = size > most ? gnp_error_set(error, GNP_TOO_LARGE, "%s: got %zu bytes, need at most %zu", name, size, most)
	                                : read_all(fd, name, size, buffer, error);
	close(fd);
	return status;
}

gnp_status gnpd_disk_remove(const struct gnpd_disk *disk, const char *name, struct gnp_error *error)
{
	if (unlinkat(disk->folder, name, 0) != 0)
		return errno == ENOENT ? GNP_OK : gnpd_disk_failure(errno, "cannot remove", name, error);
	return sync_if_durable(disk, disk->folder) ? GNP_OK : gnpd_disk_failure(errno, "cannot remove", name, error);
}
