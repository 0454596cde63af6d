#include "reserve.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { RESERVE_BYTES = 4 << 20, SMALL_BYTES = 64 << 10, WAIT_SECONDS = 10, TRIES_A_SECOND = 100 };

/* NULL: given up, or not there yet. */
static void *_Atomic reserve;

/* What `new` calls when malloc failed; on return it tries again. */
static void find_memory(void)
{
	static _Thread_local unsigned tries;
	void *held = atomic_exchange(&reserve, NULL);
	if (held) {
		free(held);
		tries = 0;
		return;
	}
	if (tries++ < WAIT_SECONDS * TRIES_A_SECOND) {
		usleep(1000000 / TRIES_A_SECOND);
		return;
	}
	fputs("gnp: memory is exhausted within a library that needs it\n", stderr);
	abort();
}

/* std::set_new_handler, by its name in the C++ ABI: the library brings it along, and there is no header of it for C. */
static void install(void)
{
	typedef void (*handler)(void);
	handler (*set_new_handler)(handler);
	*(void **)&set_new_handler = dlsym(RTLD_DEFAULT, "_ZSt15set_new_handlerPFvvE");
	if (set_new_handler)
		set_new_handler(find_memory);
}

static bool make_whole(void)
{
	void *none = NULL, *piece;
	if (atomic_load(&reserve))
		return true;
	piece = malloc(RESERVE_BYTES);
	if (piece && !atomic_compare_exchange_strong(&reserve, &none, piece))
		free(piece); /* another thread was faster */
	return piece != NULL;
}

gnp_status gnp_reserve_enter(const char *what, size_t bytes, struct gnp_error *error)
{
	static pthread_once_t once = PTHREAD_ONCE_INIT;
	pthread_once(&once, install);
	void *probe = make_whole() ? malloc(bytes + SMALL_BYTES) : NULL;
	if (!probe)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu bytes", what, bytes + RESERVE_BYTES);
	free(probe);
	return GNP_OK;
}
