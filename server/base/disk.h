/* Writes and reads files that are there whole or not at all, whatever happens to the process or the machine meanwhile.
 */
#ifndef GNPD_DISK_H
#define GNPD_DISK_H

#include <dirent.h>
#include <stdbool.h>
#include <sys/types.h>

#include "core/base/checkpoint.h"
#include "core/base/status.h"
#include "proto/tensor/message.h"

struct gnpd_disk {
	int folder;   /* the directory, open */
	bool durable; /* what was put survives the machine; else it survives the process alone */
	/* Those of the system, or a test's; open: for reading alone. */
	ssize_t (*write)(int fd, const void *data, size_t size);
	int (*sync)(int fd);
	int (*open)(int folder, const char *name, int flags, ...);
	struct dirent *(*next)(DIR *directory);
};

/* write(2), fsync(2), openat(2), readdir(3). */
void gnpd_disk_init(struct gnpd_disk *disk, int folder, bool durable);

/* A failure of the system as a status: GNP_NO_SPACE where room has run out, else GNP_STORAGE. what, name: for the text. */
gnp_status gnpd_disk_failure(int number, const char *what, const char *name, struct gnp_error *error);

/* Puts the pieces, one after the other, into the file: written as name.new, synced, renamed, the folder synced. On failure the file is
 * what it was before and there is no name.new; where only the last sync failed, a file that was not there before is removed, and one
 * that took another's place stays, for the other is gone: which of the two a crash of the machine would leave is not known, and who counts
 * bytes by what was put counts the other's until the next is put. */
gnp_status gnpd_disk_put(const struct gnpd_disk *disk, const char *name, const struct gnp_piece *pieces, size_t count,
                         struct gnp_error *error);

/* Appends the file's bytes; more than `most` is GNP_TOO_LARGE, no such file GNP_NOT_FOUND. */
gnp_status gnpd_disk_get(const struct gnpd_disk *disk, const char *name, size_t most, struct gnp_buffer *buffer, struct gnp_error *error);

/* Open for reading, or -1 and errno, which is ENOENT too for what is no regular file. *size: its bytes. */
int gnpd_disk_open(const struct gnpd_disk *disk, const char *name, size_t *size);

/* Removes the file for good; one that is not there is fine. */
gnp_status gnpd_disk_remove(const struct gnpd_disk *disk, const char *name, struct gnp_error *error);

#endif
