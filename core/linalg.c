#include "linalg.h"

#include <cblas.h>
#include <stdlib.h>
#include <unistd.h>

void gnp_linalg_restart(char **argv)
{
#if defined(__x86_64__)
	static const char variable[] = "OPENBLAS_CORETYPE";
	const char *kernels = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") ? "SKYLAKEX"
	                      : __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")       ? "HASWELL"
	                                                                                              : NULL;
	if (kernels && !getenv(variable) && setenv(variable, kernels, 0) == 0)
		execv("/proc/self/exe", argv);
#else
	(void)argv;
#endif
}

void gnp_linalg_init(void)
{
	openblas_set_num_threads(1);
}

void gnp_linalg_sgemm(size_t m, size_t n, size_t k, const float *a, const float *b, float *c)
{
	cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)m, (int)n, (int)k, 1, a, (int)k, b, (int)n, 0, c, (int)n);
}
