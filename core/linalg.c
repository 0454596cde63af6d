#include "linalg.h"

#include <cblas.h>
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
static int supply(const char *variable, const char *value)
{
	return value && !getenv(variable) && setenv(variable, value, 0) == 0;
}

void gnp_linalg_restart(char **argv)
{
	int kernels = supply("OPENBLAS_CORETYPE", best_kernels()), threads = supply("OPENBLAS_NUM_THREADS", "1");
	if (kernels || threads)
		execv("/proc/self/exe", argv);
}

void gnp_linalg_init(void)
{
	openblas_set_num_threads(1);
}

void gnp_linalg_gemm(enum gnp_transpose transpose_a, enum gnp_transpose transpose_b, size_t m, size_t n, size_t k, float alpha,
                     const float *a, size_t lda, const float *b, size_t ldb, float beta, float *c, size_t ldc)
{
	if (m == 0 || n == 0)
		return;
	cblas_sgemm(CblasRowMajor, transpose_a == GNP_PLAIN ? CblasNoTrans : CblasTrans,
	            transpose_b == GNP_PLAIN ? CblasNoTrans : CblasTrans, (int)m, (int)n, (int)k, alpha, a, (int)lda, b, (int)ldb,
	            beta, c, (int)ldc);
}

void gnp_linalg_sgemm(size_t m, size_t n, size_t k, const float *a, const float *b, float *c)
{
	gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, m, n, k, 1, a, k, b, n, 0, c, n);
}
