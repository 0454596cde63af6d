/* replay_NAME FILE...: runs the target it is linked with on each file; the last line is "replay_NAME: N passed, M failed".
 *
 * A child does the work and says in shared memory how far it is, so that an input that ends it (a crash, a sanitizer, a requirement,
 * more than SECONDS) is named and the rest is still tried. Leaks are the child's to report when it ends. */
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/fuzz/fuzz.h"

enum { SECONDS = 20, SIZE_MAX_OF_FILE = 1 << 20 };

static void run_file(const char *path)
{
	static uint8_t data[SIZE_MAX_OF_FILE];
	FILE *file = fopen(path, "rb");
	FUZZ_REQUIRE(file);
	size_t size = fread(data, 1, sizeof data, file);
	fclose(file);
	alarm(SECONDS);
	LLVMFuzzerTestOneInput(data, size);
	alarm(0);
}

/* From *at on; ends the child. */
static void run_rest(char *const *files, int count, volatile int *at)
{
	for (; *at < count; (*at)++)
		run_file(files[*at]);
	exit(0);
}

int main(int argc, char **argv)
{
	const char *slash = strrchr(argv[0], '/');
	int failed = 0, count = argc - 1;
	volatile int *at = mmap(NULL, sizeof *at, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	FUZZ_REQUIRE(at != MAP_FAILED);
	while (*at < count) {
		pid_t child = fork();
		int status = 0;
		FUZZ_REQUIRE(child >= 0);
		if (child == 0)
			run_rest(argv + 1, count, at);
		FUZZ_REQUIRE(waitpid(child, &status, 0) == child);
		if (status == 0)
			continue;
		fprintf(stderr, "FAILED %s: status %#x\n", *at < count ? argv[1 + *at] : "at the end", (unsigned)status);
		failed++;
		(*at)++;
	}
	printf("%s: %d passed, %d failed\n", slash ? slash + 1 : argv[0], count > failed ? count - failed : 0, failed);
	return failed ? 1 : 0;
}
