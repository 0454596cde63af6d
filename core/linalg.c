#include "linalg.h"

#include <cblas.h>

void gnp_linalg_init(void)
{
	openblas_set_num_threads(1);
}

void gnp_linalg_sgemm(size_t m, size_t n, size_t k, const float *a, const float *b, float *c)
{
	cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)m, (int)n, (int)k, 1, a, (int)k, b, (int)n, 0, c, (int)n);
}
