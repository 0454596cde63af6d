#include "server/base/reserve.h"

#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "core/base/headroom.h"

enum {
	SLABS = 8,
	SLAB_BYTES = 8 << 20,
	RESERVE_BYTES = SLABS * SLAB_BYTES,
	SMALL_BYTES = 64 << 10, /* the largest piece that anybody gets from it */
	UNIT = 64,              /* pieces begin at multiples of it; so long is the header before each */
	WAIT_SECONDS = 10,
	TRIES_A_SECOND = 100
};

static char *_Atomic base; /* NULL: there is none */
/* Pieces of a slab are given out one after the other; with the last that is freed it is whole again. There are
 * several, because some pieces stay for long. */
static struct {
	size_t used, live; /* bytes given out since it was whole; pieces in use */
} slabs[SLABS];
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; /* of them */
static _Thread_local bool urgent; /* this thread's `new` found nothing: it may take large pieces */
static _Thread_local unsigned tries;

static void map_reserve(void)
{
	void *space = mmap(NULL, RESERVE_BYTES, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
	atomic_store(&base, space == MAP_FAILED ? NULL : space);
}

/* std::set_new_handler, which FLANN brings along; NULL without it. */
typedef void (*new_handler)(void);
static new_handler (*set_new_handler)(new_handler);

/* What `new` calls when malloc failed; on return it tries again. Without a handler it throws. */
static void find_memory(void)
{
	if (!urgent) {
		urgent = true;
		tries = 0;
	} else if (tries++ < WAIT_SECONDS * TRIES_A_SECOND) {
		usleep(1000000 / TRIES_A_SECOND);
	} else {
		set_new_handler(NULL);
	}
}

/* A thread begins anew: what it once lacked is forgotten. */
static bool most_is_whole(void)
{
	size_t whole = 0;
	urgent = false;
	pthread_mutex_lock(&lock);
	for (size_t s = 0; s < SLABS; s++)
		whole += slabs[s].used == 0;
	pthread_mutex_unlock(&lock);
	return whole > SLABS / 2;
}

static void install(void)
{
	/* By its name in the C++ ABI: there is no header of it for C. */
	*(void **)&set_new_handler = dlsym(RTLD_DEFAULT, "_ZSt15set_new_handlerPFvvE");
	if (set_new_handler)
		set_new_handler(find_memory);
	map_reserve();
	gnp_headroom_install(most_is_whole);
}

void gnpd_reserve_install(void)
{
	static pthread_once_t once = PTHREAD_ONCE_INIT;
	pthread_once(&once, install);
}

#ifndef __has_feature
#define __has_feature(feature) 0
#endif
#if !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__ && !__has_feature(address_sanitizer) && \
	!__has_feature(thread_sanitizer) && !__has_feature(memory_sanitizer)

/* The C library's own, under names that stay when its malloc is replaced. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *piece, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *piece);
void *memalign(size_t alignment, size_t size);
void *valloc(size_t size);
void *pvalloc(size_t size);
size_t malloc_usable_size(void *piece);

static bool is_reserved(const void *piece)
{
	const char *start = atomic_load_explicit(&base, memory_order_relaxed);
	return start && (const char *)piece >= start && (const char *)piece < start + RESERVE_BYTES;
}

static size_t *size_of(void *piece)
{
	return (size_t *)(void *)((char *)piece - UNIT);
}

/* Lock held. From the first slab with room. */
static void *take_piece(size_t size)
{
	size_t whole = (size + UNIT - 1) / UNIT * UNIT + UNIT, s = 0;
	while (s < SLABS && whole > SLAB_BYTES - slabs[s].used)
		s++;
	if (s == SLABS)
		return NULL;
	char *header = atomic_load(&base) + s * SLAB_BYTES + slabs[s].used;
	slabs[s].used += whole;
	slabs[s].live++;
	*(size_t *)(void *)header = size;
	return header + UNIT;
}

static void *take(size_t size)
{
	if (!atomic_load(&base) || (size > SMALL_BYTES && !urgent) || size > SLAB_BYTES - 2 * UNIT)
		return NULL;
	pthread_mutex_lock(&lock);
	void *piece = take_piece(size);
	pthread_mutex_unlock(&lock);
	return piece;
}

static void give_back(const void *piece)
{
	size_t s = (size_t)((const char *)piece - atomic_load(&base)) / SLAB_BYTES;
	pthread_mutex_lock(&lock);
	if (--slabs[s].live == 0)
		slabs[s].used = 0;
	pthread_mutex_unlock(&lock);
}

void *malloc(size_t size)
{
	void *piece = __libc_malloc(size);
	return piece ? piece : take(size);
}

void *calloc(size_t count, size_t size)
{
	size_t bytes;
	void *piece = __libc_calloc(count, size);
	if (piece || __builtin_mul_overflow(count, size, &bytes))
		return piece;
	piece = take(bytes);
	return piece ? memset(piece, 0, bytes) : NULL;
}

void free(void *piece)
{
	if (is_reserved(piece))
		give_back(piece);
	else
		__libc_free(piece);
}

/* The C library keeps its own under no other name. */
size_t malloc_usable_size(void *piece)
{
	static size_t (*_Atomic next)(void *);
	size_t (*usable)(void *) = atomic_load(&next);
	if (is_reserved(piece))
		return *size_of(piece);
	if (!usable) {
		*(void **)&usable = dlsym(RTLD_NEXT, "malloc_usable_size");
		atomic_store(&next, usable);
	}
	return usable ? usable(piece) : 0;
}

/* The C library frees a piece that is to have no size, and leaves one alone that it has no room for. */
void *realloc(void *piece, size_t size)
{
	bool reserved = is_reserved(piece);
	void *moved = reserved ? NULL : __libc_realloc(piece, size);
	if (moved || (piece && !reserved && size == 0))
		return moved;
	moved = reserved ? malloc(size) : take(size);
	if (!moved || !piece)
		return moved;
	size_t before = malloc_usable_size(piece);
	memcpy(moved, piece, size < before ? size : before);
	free(piece);
	return moved;
}

void *memalign(size_t alignment, size_t size)
{
	void *piece = __libc_memalign(alignment, size);
	return piece || alignment > UNIT ? piece : take(size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
	return memalign(alignment, size);
}

/* Whole pages, which the reserve has none of. */
void *valloc(size_t size)
{
	return memalign((size_t)sysconf(_SC_PAGESIZE), size);
}

void *pvalloc(size_t size)
{
	size_t page = (size_t)sysconf(_SC_PAGESIZE), bytes;
	if (__builtin_add_overflow(size, page - 1, &bytes)) {
		errno = ENOMEM;
		return NULL;
	}
	return valloc(bytes / page * page);
}

int posix_memalign(void **out, size_t alignment, size_t size)
{
	if (alignment % sizeof(void *) || alignment == 0 || (alignment & (alignment - 1)))
		return EINVAL;
	void *piece = memalign(alignment, size);
	if (piece)
		*out = piece;
	return piece ? 0 : ENOMEM;
}

#endif
