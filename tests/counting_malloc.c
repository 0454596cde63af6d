/* counting_malloc.so, for LD_PRELOAD into test_memory_estimates: counts the bytes that are allocated and the most there
 * were at a time, of the whole process, FLANN's, CHOLMOD's and OpenBLAS's among them. It stands in place of the C
 * library's malloc, also below a program that has a malloc of its own on top of that (__libc_malloc). Pieces count by
 * what they take, with the header the C library keeps before each. */
#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *piece, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *piece);
void *memalign(size_t alignment, size_t size);

static atomic_size_t live, peak;

size_t counting_malloc_live(void);
size_t counting_malloc_peak(void);
void counting_malloc_restart(void);

size_t counting_malloc_live(void)
{
	return atomic_load(&live);
}

size_t counting_malloc_peak(void)
{
	return atomic_load(&peak);
}

/* From here on the peak is that of what follows. */
void counting_malloc_restart(void)
{
	atomic_store(&peak, atomic_load(&live));
}

/* The C library's own. dlsym does not allocate where it finds what it looks for. */
static void *next(const char *name)
{
	return dlsym(RTLD_NEXT, name);
}

#define NEXT(function, type, ...)                        \
	static type (*_Atomic real)(__VA_ARGS__);            \
	type (*own)(__VA_ARGS__) = atomic_load(&real);       \
	if (!own) {                                          \
		*(void **)&own = next(#function);                \
		atomic_store(&real, own);                        \
	}

static size_t bytes_of(void *piece)
{
	enum { HEADER = 8 };
	NEXT(malloc_usable_size, size_t, void *)
	return piece ? own(piece) + HEADER : 0;
}

static void *add(void *piece)
{
	size_t bytes = bytes_of(piece), now = atomic_fetch_add(&live, bytes) + bytes, most = atomic_load(&peak);
	while (now > most && !atomic_compare_exchange_weak(&peak, &most, now))
		continue;
	return piece;
}

void *__libc_malloc(size_t size)
{
	NEXT(__libc_malloc, void *, size_t)
	return add(own(size));
}

void *__libc_calloc(size_t count, size_t size)
{
	NEXT(__libc_calloc, void *, size_t, size_t)
	return add(own(count, size));
}

void *__libc_memalign(size_t alignment, size_t size)
{
	NEXT(__libc_memalign, void *, size_t, size_t)
	return add(own(alignment, size));
}

/* A piece that grows where it lies, or by moved pages, never is there twice. */
void *__libc_realloc(void *piece, size_t size)
{
	NEXT(__libc_realloc, void *, void *, size_t)
	size_t before = bytes_of(piece);
	void *moved = own(piece, size);
	if (!moved && size > 0)
		return NULL;
	atomic_fetch_sub(&live, before);
	return add(moved);
}

void __libc_free(void *piece)
{
	NEXT(__libc_free, void, void *)
	atomic_fetch_sub(&live, bytes_of(piece));
	own(piece);
}

void *malloc(size_t size)
{
	return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
	return __libc_calloc(count, size);
}

void *realloc(void *piece, size_t size)
{
	return __libc_realloc(piece, size);
}

void free(void *piece)
{
	__libc_free(piece);
}

void *memalign(size_t alignment, size_t size)
{
	return __libc_memalign(alignment, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
	return __libc_memalign(alignment, size);
}

int posix_memalign(void **out, size_t alignment, size_t size)
{
	if (alignment % sizeof(void *) || alignment == 0 || (alignment & (alignment - 1)))
		return EINVAL;
	void *piece = __libc_memalign(alignment, size);
	if (piece)
		*out = piece;
	return piece ? 0 : ENOMEM;
}
