/* failing_malloc.so, for LD_PRELOAD into gnpd: the process's allocations are counted, and those a test chooses fail. It stands below the
 * daemon's own malloc (server/base/reserve.c), in place of the C library's, and so sees the allocations of libmicrohttpd, jansson, libzip, FLANN
 * and whatever else is loaded.
 *
 * $FAILING_MALLOC names a file with room for the struct below, which both sides map. The test writes `first` and `count`
 * and resets `asked`; allocations number first, first + 1, ..., first + count - 1 from then on fail. A crash leaves a trace of
 * calls in the log; with $FAILING_MALLOC_TRACE every failure does.
 *
 * The reserve hides most failures. With $FAILING_MALLOC_RESERVE=0 there is none, to see what libraries do; spared are then FLANN, OpenBLAS
 * and libgomp, for whose sake it is there. */
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
#include <sys/syscall.h>
#include <unistd.h>

struct control {
	atomic_long first, count; /* count 0: none fails */
	atomic_long asked;        /* allocations so far */
	atomic_long live;         /* pieces not yet freed */
	atomic_long failed;
};

static struct control unused, *_Atomic control = &unused;

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *piece, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *piece);

/* The C library's own. dlsym does not allocate where it finds what it looks for. */
static void *next(const char *name)
{
	return dlsym(RTLD_NEXT, name);
}

#define NEXT(type, name)                      \
	static __typeof__(type) own;              \
	if (!own)                                 \
		*(void **)&own = next(name)

static bool no_reserve;
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
	const char *reserve = getenv("FAILING_MALLOC_RESERVE");
	tracing = getenv("FAILING_MALLOC_TRACE") != NULL;
	no_reserve = reserve && strcmp(reserve, "0") == 0;
	backtrace(&frame, 1); /* loads what it needs */
	signal(SIGSEGV, on_crash);
	signal(SIGABRT, on_crash);
	if (shared != MAP_FAILED)
		atomic_store(&control, (struct control *)shared);
}

/* Whether one of those that write through what they get, or end the process, is asking. */
static bool is_spared(void)
{
	enum { CALLERS = 8 };
	void *frames[CALLERS];
	int count = backtrace(frames, CALLERS);
	for (int i = 0; i < count; i++) {
		Dl_info object;
		if (dladdr(frames[i], &object) && object.dli_fname &&
		    (strstr(object.dli_fname, "/libflann") || strstr(object.dli_fname, "/libgomp") || strstr(object.dli_fname, "/libopenblas")))
			return true;
	}
	return false;
}

static bool doomed(void)
{
	struct control *c = atomic_load(&control);
	long number = atomic_fetch_add(&c->asked, 1) - atomic_load(&c->first);
	if (number < 0 || number >= atomic_load(&c->count) || (no_reserve && is_spared()))
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

void *__libc_malloc(size_t size)
{
	NEXT(void *(*)(size_t), "__libc_malloc");
	return doomed() ? NULL : born(own(size));
}

void *__libc_calloc(size_t count, size_t size)
{
	NEXT(void *(*)(size_t, size_t), "__libc_calloc");
	return doomed() ? NULL : born(own(count, size));
}

void *__libc_realloc(void *piece, size_t size)
{
	NEXT(void *(*)(void *, size_t), "__libc_realloc");
	if (doomed())
		return NULL;
	void *moved = own(piece, size);
	if (!piece)
		return born(moved);
	if (!moved && size == 0)
		atomic_fetch_sub(&atomic_load(&control)->live, 1);
	return moved;
}

void *__libc_memalign(size_t alignment, size_t size)
{
	NEXT(void *(*)(size_t, size_t), "__libc_memalign");
	return doomed() ? NULL : born(own(alignment, size));
}

void __libc_free(void *piece)
{
	NEXT(void (*)(void *), "__libc_free");
	if (piece)
		atomic_fetch_sub(&atomic_load(&control)->live, 1);
	own(piece);
}

/* There is no reserve where its space cannot be had. */
void *mmap(void *address, size_t size, int protection, int flags, int fd, off_t offset)
{
	if (no_reserve && (flags & MAP_NORESERVE))
		return MAP_FAILED;
	return (void *)syscall(SYS_mmap, address, size, protection, flags, fd, offset);
}
