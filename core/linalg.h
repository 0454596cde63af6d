/* Dense linear algebra (the one BLAS user). Each call runs in the calling thread: parallelism is the pool's. */
#ifndef GNP_CORE_LINALG_H
#define GNP_CORE_LINALG_H

#include <stddef.h>

/* Keeps BLAS in the calling thread. Call once before the first use, from one thread. */
void gnp_linalg_init(void);

/* C (m, n) = A (m, k) B (k, n), row-major, no transposes. */
void gnp_linalg_sgemm(size_t m, size_t n, size_t k, const float *a, const float *b, float *c);

#endif
