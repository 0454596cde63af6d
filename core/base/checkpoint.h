/* Lets long work outlive the process it runs in. Now and then the work hands over what it needs to go on, and a later
 * run of the same work begins from what was handed over last. The answer is that of a run that was never interrupted.
 */
#ifndef GNP_CORE_CHECKPOINT_H
#define GNP_CORE_CHECKPOINT_H

#include <stddef.h>

#include "core/base/status.h"

struct gnp_piece {
	const void *data;
	size_t size;
};

struct gnp_checkpoint {
	double seconds;    /* at least so many between two, and at least ten times what the last took; 0: whenever there is something new,
	                      whatever it takes */
	/* Keeps the pieces, one after the other, in place of what was kept before. Called by the thread that drives the work; when it
	 * fails the work goes on, and what was kept before still is. */
	gnp_status (*save)(void *context, const struct gnp_piece *pieces, size_t count, struct gnp_error *error);
	void *context;
	const unsigned char *kept; /* what was kept last, (size) bytes; NULL: nothing, the work begins at its start */
	size_t size;
};

#endif
