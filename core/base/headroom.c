#include "core/base/headroom.h"

#include <stdatomic.h>
#include <stdlib.h>

/* Beyond what a call takes by its size: the small pieces of its bookkeeping, and of what other threads may take of them
 * meanwhile where there is no guard that keeps some back. */
enum { BOOKKEEPING = (64 << 10) + 1, UNGUARDED = 512 << 10 };

static bool (*_Atomic guard)(void); /* one for the process, as there is one malloc */

void gnp_headroom_install(bool (*may_enter)(void))
{
	atomic_store(&guard, may_enter);
}

gnp_status gnp_headroom_need(const char *what, size_t bytes, struct gnp_error *error)
{
	bool (*may_enter)(void) = atomic_load(&guard);
	/* volatile, or the compiler makes none */
	void *volatile trial = !may_enter ? malloc(bytes + UNGUARDED) : may_enter() ? malloc(bytes + BOOKKEEPING) : NULL;
	if (!trial)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu bytes", what, bytes);
	free(trial);
	return GNP_OK;
}
