/* Dense linear algebra (the one BLAS user). Each call runs in the calling thread: parallelism is the pool's.
 * Products and triangles take 2 m n k operations and no memory of their own but OpenBLAS's buffers. */
#ifndef GNP_CORE_LINALG_H
#define GNP_CORE_LINALG_H

#include <stddef.h>

/* Keeps BLAS in the calling thread. Call once before the first use, from one thread. */
void gnp_linalg_init(void);

enum gnp_transpose { GNP_PLAIN, GNP_TRANSPOSED };

/* C (m, n) = alpha op(A) op(B) + beta C, row-major; op(A) is (m, k), op(B) (k, n), and a leading dimension is the
 * distance of two rows as they lie in memory. beta = 0: C need not be initialised. Sizes fit an int. */
void gnp_linalg_gemm(enum gnp_transpose transpose_a, enum gnp_transpose transpose_b, size_t m, size_t n, size_t k,
                     float alpha, const float *a, size_t lda, const float *b, size_t ldb, float beta, float *c,
                     size_t ldc);

/* C (m, n) = A (m, k) B (k, n), row-major, no transposes. */
void gnp_linalg_sgemm(size_t m, size_t n, size_t k, const float *a, const float *b, float *c);

/* The same in double and column-major, for factors of dense blocks: an element (i, j) is at [i + j * leading
 * dimension]. C (m, n) -= A (m, k) B (k, n). */
void gnp_linalg_subtract_product(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b,
                                 size_t ldb, double *c, size_t ldc);

/* B (n, r) = T^-1 B, T (n, n) the unit lower or the upper triangle of t. */
void gnp_linalg_solve_lower(size_t n, size_t r, const double *t, size_t ldt, double *b, size_t ldb);
void gnp_linalg_solve_upper(size_t n, size_t r, const double *t, size_t ldt, double *b, size_t ldb);

/* B (m, n) = B T^-1, T the upper triangle of t. */
void gnp_linalg_solve_upper_right(size_t m, size_t n, const double *t, size_t ldt, double *b, size_t ldb);

/* C (m, n) -= A^T B, A (k, m), B (k, n). */
void gnp_linalg_subtract_transposed_product(size_t m, size_t n, size_t k, const double *a, size_t lda,
                                            const double *b, size_t ldb, double *c, size_t ldc);

/* The lower trapezoid of C (m, n), m >= n: C -= A B^T, A (m, k), B the first n rows of A. What lies above C's
 * diagonal stays. */
void gnp_linalg_subtract_square(size_t m, size_t n, size_t k, const double *a, size_t lda, double *c, size_t ldc);

/* A = L L^T of the lower triangle of A (n, n), in place. Returns n, or the number of pivots above `smallest` (the
 * square of L's diagonal) before one that is not, also where it is no number. */
size_t gnp_linalg_cholesky(size_t n, double *a, size_t lda, double smallest);

/* B (n, r) = L^-1 B, or L^-T B where transposed; B (m, n) = B L^-T. */
void gnp_linalg_solve_cholesky(enum gnp_transpose transpose, size_t n, size_t r, const double *l, size_t ldl,
                               double *b, size_t ldb);
void gnp_linalg_solve_cholesky_right(size_t m, size_t n, const double *l, size_t ldl, double *b, size_t ldb);

/* Eigenvalues (n) of a general A (n, n), column-major and destroyed, and right eigenvectors (n, n): a real one in
 * column j, or the real and imaginary part of a conjugate pair in columns j and j + 1. work (8 n) is spare.
 * Returns 0, or LAPACK's complaint. */
int gnp_linalg_eigen(size_t n, double *a, double *real, double *imaginary, double *vectors, double *work);

/* The same of a symmetric A (n, n), of which the lower triangle is read: eigenvalues (n) ascending, and orthonormal
 * eigenvectors in its columns in place of A. Takes 2 n^2 numbers besides. Returns 0, LAPACK's complaint, or -1 where
 * there is no memory. */
int gnp_linalg_eigen_symmetric(size_t n, double *a, double *values);

#endif
