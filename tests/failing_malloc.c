/* failing_malloc.so, for LD_PRELOAD: the process's allocations are counted, and those a test chooses fail. It sees what a wrapper at
 * link time does not: the allocations of libmicrohttpd, jansson, libzip, FLANN and whatever else is loaded.
 *
 * $FAILING_MALLOC names a file with room for the struct below, which both sides map. The test writes `first` and `count`
 * and resets `asked`; allocations number first, first + 1, ..., first + count - 1 from then on fail.
 *
 * Spared is malloc called by FLANN and OpenBLAS, which write through what they get without looking, and by libgomp, which
 * ends the process (core/reserve.h). A crash leaves a trace of calls in the log. */
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

struct control {
	atomic_long first, count; /* count 0: none fails */
	atomic_long asked;        /* allocations so far */
	atomic_long live;         /* pieces not yet freed */
	atomic_long failed;
};

static struct control unused, *_Atomic control = &unused;

/* glibc's own, under names nobody interposes. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *piece, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *piece);
void *memalign(size_t alignment, size_t size);

static bool tracing; /* what fails is shown, for who searches: $FAILING_MALLOC_TRACE */

static void print_calls(void)
{
	void *frames[40];
	backtrace_symbols_fd(frames, backtrace(frames, 40), STDERR_FILENO);
}

static void on_crash(int number)
{
	print_calls();
	signal(number, SIG_DFL);
	raise(number);
}

__attribute__((constructor)) static void begin(void)
{
	const char *path = getenv("FAILING_MALLOC");
	int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
	void *shared = fd >= 0 ? mmap(NULL, sizeof(struct control), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
	if (fd >= 0)
		close(fd);
	void *frame;
	tracing = getenv("FAILING_MALLOC_TRACE") != NULL;
	backtrace(&frame, 1); /* loads what it needs */
	signal(SIGSEGV, on_crash);
	signal(SIGABRT, on_crash);
	if (shared != MAP_FAILED)
		atomic_store(&control, (struct control *)shared);
}

static bool is_spared(const void *address)
{
	Dl_info object;
	return dladdr(address, &object) && object.dli_fname &&
	       (strstr(object.dli_fname, "/libflann") || strstr(object.dli_fname, "/libgomp") || strstr(object.dli_fname, "/libopenblas"));
}

/* Whether the allocation that the code at `caller` asks for is to fail. */
static bool doomed(const void *caller)
{
	struct control *c = atomic_load(&control);
	long number = atomic_fetch_add(&c->asked, 1) - atomic_load(&c->first);
	if (number < 0 || number >= atomic_load(&c->count) || is_spared(caller))
		return false;
	atomic_fetch_add(&c->failed, 1);
	if (tracing)
		print_calls();
	errno = ENOMEM;
	return true;
}

static void *born(void *piece)
{
	if (piece)
		atomic_fetch_add(&atomic_load(&control)->live, 1);
	return piece;
}

void *malloc(size_t size)
{
	return doomed(__builtin_return_address(0)) ? NULL : born(__libc_malloc(size));
}

void *calloc(size_t count, size_t size)
{
	return doomed(__builtin_return_address(0)) ? NULL : born(__libc_calloc(count, size));
}

void *realloc(void *piece, size_t size)
{
	if (doomed(__builtin_return_address(0)))
		return NULL;
	void *moved = __libc_realloc(piece, size);
	if (!piece)
		return born(moved);
	if (!moved && size == 0)
		atomic_fetch_sub(&atomic_load(&control)->live, 1);
	return moved;
}

void *memalign(size_t alignment, size_t size)
{
	return doomed(__builtin_return_address(0)) ? NULL : born(__libc_memalign(alignment, size));
}

void *aligned_alloc(size_t alignment, size_t size)
{
	return doomed(__builtin_return_address(0)) ? NULL : born(__libc_memalign(alignment, size));
}

int posix_memalign(void **out, size_t alignment, size_t size)
{
	void *piece = doomed(__builtin_return_address(0)) ? NULL : born(__libc_memalign(alignment, size));
	if (!piece)
		return ENOMEM;
	*out = piece;
	return 0;
}

void free(void *piece)
{
	if (piece)
		atomic_fetch_sub(&atomic_load(&control)->live, 1);
	__libc_free(piece);
}
