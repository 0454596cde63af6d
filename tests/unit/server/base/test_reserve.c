/* The reserve of memory: what gnpd's malloc gives when the system has nothing left. The process may have no more address space than it has, and
 * what is left of that is taken first. Sanitizers have a malloc of their own: with them there is only the way in. */
#include "tests/unit/test.h"

#include <errno.h>
#include <malloc.h>
#include <stdint.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/base/headroom.h"
#include "server/base/reserve.h"

#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
#define REPLACED false
#else
#define REPLACED true
#endif

enum { PIECES = 200000, PIECE = 512, SLAB = 8 << 20 };

static void *pieces[PIECES], *blocks[4096];
static struct rlimit before;

/* Takes all there is in blocks too large for the reserve. */
static size_t exhaust(void)
{
	size_t count = 0;
	CHECK(getrlimit(RLIMIT_AS, &before) == 0);
	const struct rlimit none = {1, before.rlim_max};
	CHECK(setrlimit(RLIMIT_AS, &none) == 0);
	while (count < 4096 && (blocks[count] = malloc(70000)) != NULL)
		count++;
	return count;
}

static void recover(size_t count)
{
	while (count)
		free(blocks[--count]);
	setrlimit(RLIMIT_AS, &before);
}

/* Small pieces until there are none, each marked. */
static size_t take_small(void)
{
	size_t count = 0;
	while (count < PIECES && (pieces[count] = malloc(PIECE)) != NULL) {
		memset(pieces[count], (int)(count & 255), PIECE);
		count++;
	}
	return count;
}

static bool marks_stand(size_t count)
{
	bool stand = true;
	for (size_t i = 0; i < count; i++)
		for (size_t b = 0; b < PIECE; b += 511)
			stand = stand && ((unsigned char *)pieces[i])[b] == (i & 255);
	return stand;
}

static void small_pieces_come_from_the_reserve(void)
{
	struct gnp_error error = {0};
	CHECK(gnp_headroom_need("test", 1000, &error) == GNP_OK);
	if (!REPLACED)
		return;
	size_t count = exhaust(), taken = take_small();
	bool stand = marks_stand(taken);
	void *large = malloc(100000), *grown = realloc(pieces[0], 2 * PIECE);
	gnp_status full = gnp_headroom_need("test", 1, &error);
	for (size_t i = 0; i < taken; i++)
		free(pieces[i]);
	unsigned char *zeros = calloc(100, 100);
	void *aligned = NULL;
	int fault = posix_memalign(&aligned, 64, 1000);
	bool zero = zeros && zeros[0] == 0 && zeros[9999] == 0;
	recover(count);
	CHECK(taken > 6 * (SLAB / (PIECE + 64)) && taken < PIECES);
	CHECK(stand && !large && !grown);
	CHECK(full == GNP_OUT_OF_MEMORY);
	CHECK_CONTAINS(error.text, "test: no memory for 1 bytes");
	CHECK(zero && fault == 0 && (uintptr_t)aligned % 64 == 0);
	free(zeros);
	free(aligned);
	CHECK(gnp_headroom_need("test", 1000, NULL) == GNP_OK);
}

static bool is_filled(const unsigned char *piece, unsigned char mark, size_t size)
{
	for (size_t i = 0; piece && i < size; i++)
		if (piece[i] != mark)
			return false;
	return piece != NULL;
}

/* What was grown was refused where a new piece of the same size was not; nobody but the reserve knows the size of its pieces. */
static void pieces_of_the_c_library_grow_into_the_reserve(void)
{
	if (!REPLACED)
		return;
	CHECK(gnp_headroom_need("test", 1000, NULL) == GNP_OK);
	unsigned char *own = malloc(PIECE);
	size_t usable = malloc_usable_size(own), count = exhaust(), taken = 0, reserved = 0;
	memset(own, 7, PIECE);
	while (taken < PIECES && reserved != PIECE && (pieces[taken] = malloc(PIECE)) != NULL)
		reserved = malloc_usable_size(pieces[taken++]);
	unsigned char *grown = realloc(own, 4 * PIECE), *again = grown ? realloc(grown, 8 * PIECE) : NULL;
	size_t grown_to = malloc_usable_size(again);
	bool kept = is_filled(again, 7, PIECE);
	void *none = realloc(NULL, PIECE), *gone = realloc(again ? again : own, 0);
	while (taken)
		free(pieces[--taken]);
	free(none);
	recover(count);
	CHECK(usable >= PIECE && reserved == PIECE);
	CHECK(grown && again && kept && grown_to == 8 * PIECE && none);
	free(gone);
	CHECK(malloc_usable_size(NULL) == 0);
	CHECK(gnp_headroom_need("test", 1000, NULL) == GNP_OK);
}

static void whole_pages_are_given_as_ever(void)
{
	size_t page = (size_t)sysconf(_SC_PAGESIZE), most = SIZE_MAX;
	unsigned char *one = valloc(10), *whole = pvalloc(page + 1);
	CHECK(one && (uintptr_t)one % page == 0);
	CHECK(whole && (uintptr_t)whole % page == 0);
	memset(whole, 1, 2 * page);
	free(one);
	free(whole);
	CHECK(!REPLACED || (!pvalloc(most) && errno == ENOMEM));
}

/* A piece that stays must not keep the rest from being whole again. */
static void long_lived_pieces_pin_little(void)
{
	if (!REPLACED)
		return;
	size_t count = exhaust(), taken = take_small();
	for (size_t i = 1; i < taken; i++)
		free(pieces[i]);
	recover(count);
	CHECK(gnp_headroom_need("test", 1000, NULL) == GNP_OK);
	memset(pieces[0], 1, PIECE);
	pieces[0] = realloc(pieces[0], 100000); /* out of the reserve */
	CHECK(pieces[0] && ((unsigned char *)pieces[0])[PIECE - 1] == 1);
	free(pieces[0]);
}

static void more_than_there_is_is_refused(void)
{
	struct gnp_error error = {0};
	if (!REPLACED) /* a sanitizer ends the process for that */
		return;
	CHECK(gnp_headroom_need("test", SIZE_MAX / 4, &error) == GNP_OUT_OF_MEMORY);
	CHECK_CONTAINS(error.text, "test: no memory for 4611686018427387903 bytes");
}

int main(int argc, char **argv)
{
	gnpd_reserve_install();
	static const struct test tests[] = {TEST(small_pieces_come_from_the_reserve), TEST(long_lived_pieces_pin_little),
	                                    TEST(pieces_of_the_c_library_grow_into_the_reserve), TEST(whole_pages_are_given_as_ever),
	                                    TEST(more_than_there_is_is_refused)};
	return RUN_TESTS(tests);
}
