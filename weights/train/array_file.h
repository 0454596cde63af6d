/* Reads and writes files of arrays as they lie in memory, for this machine alone: one line of text, "TITLE sha256
 * DIGEST\n", and the arrays one after the other; the digest is theirs. The title says what they are, so a file of
 * something else is never taken for them. */
#ifndef GNP_WEIGHTS_ARRAY_FILE_H
#define GNP_WEIGHTS_ARRAY_FILE_H

#include <stddef.h>

#include "core/base/status.h"

enum { GNP_ARRAY_FILE_PIECES = 8, GNP_ARRAY_FILE_TITLE = 400 }; /* at most; the title in bytes */

struct gnp_array_piece {
	void *data;
	size_t size; /* bytes */
};

/* Bytes of the whole file. */
size_t gnp_array_file_size(const char *title, const struct gnp_array_piece *pieces, size_t count);

/* Writes all of it or nothing (file_io.h). */
gnp_status gnp_array_file_write(const char *path, const char *title, const struct gnp_array_piece *pieces, size_t count,
                                struct gnp_error *error);

/* Fills the pieces. GNP_IO: it cannot be read; GNP_INVALID_ARGUMENT: it has another title or size, or its digest does not hold.
 * On failure the pieces' contents are undefined. */
gnp_status gnp_array_file_read(const char *path, const char *title, const struct gnp_array_piece *pieces, size_t count,
                               struct gnp_error *error);

#endif
