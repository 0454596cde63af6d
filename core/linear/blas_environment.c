#include "core/linear/blas_environment.h"

#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

/* The kernels for the instruction set that is there; NULL: leave it to OpenBLAS. */
static const char *best_kernels(void)
{
#if defined(__x86_64__)
	if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
		return "SKYLAKEX";
	if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
		return "HASWELL";
#endif
	return NULL;
}

/* Whether the variable was missing and now is set. */
static bool supply(const char *variable, const char *value)
{
	return value && !getenv(variable) && setenv(variable, value, 0) == 0;
}

void gnp_blas_environment_restart(char **argv)
{
	bool kernels = supply("OPENBLAS_CORETYPE", best_kernels());
	bool threads = supply("OPENBLAS_NUM_THREADS", "1");
	if (kernels || threads)
		execv("/proc/self/exe", argv);
}
