#include "core/linear/linalg.h"

#include <cblas.h>
#include <math.h>
#include <stdlib.h>

void gnp_linalg_init(void)
{
	openblas_set_num_threads(1);
}

void gnp_linalg_gemm(enum gnp_transpose transpose_a, enum gnp_transpose transpose_b, size_t m, size_t n, size_t k,
                     float alpha, const float *a, size_t lda, const float *b, size_t ldb, float beta, float *c,
                     size_t ldc)
{
	if (m == 0 || n == 0)
		return;
	cblas_sgemm(CblasRowMajor, transpose_a == GNP_PLAIN ? CblasNoTrans : CblasTrans,
	            transpose_b == GNP_PLAIN ? CblasNoTrans : CblasTrans, (int)m, (int)n, (int)k, alpha, a, (int)lda, b,
	            (int)ldb, beta, c, (int)ldc);
}

void gnp_linalg_sgemm(size_t m, size_t n, size_t k, const float *a, const float *b, float *c)
{
	gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, m, n, k, 1, a, k, b, n, 0, c, n);
}

void gnp_linalg_subtract_product(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b,
                                 size_t ldb, double *c, size_t ldc)
{
	if (m == 0 || n == 0 || k == 0)
		return;
	if (n == 1) /* a product would copy A first */
		cblas_dgemv(CblasColMajor, CblasNoTrans, (int)m, (int)k, -1, a, (int)lda, b, 1, 1, c, 1);
	else
		cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, (int)m, (int)n, (int)k, -1, a, (int)lda, b, (int)ldb,
		            1, c, (int)ldc);
}

void gnp_linalg_subtract_transposed_product(size_t m, size_t n, size_t k, const double *a, size_t lda,
                                            const double *b, size_t ldb, double *c, size_t ldc)
{
	if (m == 0 || n == 0 || k == 0)
		return;
	if (n == 1)
		cblas_dgemv(CblasColMajor, CblasTrans, (int)k, (int)m, -1, a, (int)lda, b, 1, 1, c, 1);
	else
		cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, (int)m, (int)n, (int)k, -1, a, (int)lda, b, (int)ldb, 1,
		            c, (int)ldc);
}

void gnp_linalg_subtract_square(size_t m, size_t n, size_t k, const double *a, size_t lda, double *c, size_t ldc)
{
	if (n == 0 || k == 0)
		return;
	cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, (int)n, (int)k, -1, a, (int)lda, 1, c, (int)ldc);
	if (m > n)
		cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, (int)(m - n), (int)n, (int)k, -1, a + n, (int)lda, a,
		            (int)lda, 1, c + n, (int)ldc);
}

static void solve_triangle(CBLAS_UPLO triangle, CBLAS_TRANSPOSE transpose, CBLAS_DIAG diagonal, size_t n, size_t r,
                           const double *t, size_t ldt, double *b, size_t ldb)
{
	if (n == 0 || r == 0)
		return;
	if (r == 1)
		cblas_dtrsv(CblasColMajor, triangle, transpose, diagonal, (int)n, t, (int)ldt, b, 1);
	else
		cblas_dtrsm(CblasColMajor, CblasLeft, triangle, transpose, diagonal, (int)n, (int)r, 1, t, (int)ldt, b,
		            (int)ldb);
}

void gnp_linalg_solve_lower(size_t n, size_t r, const double *t, size_t ldt, double *b, size_t ldb)
{
	solve_triangle(CblasLower, CblasNoTrans, CblasUnit, n, r, t, ldt, b, ldb);
}

void gnp_linalg_solve_upper(size_t n, size_t r, const double *t, size_t ldt, double *b, size_t ldb)
{
	solve_triangle(CblasUpper, CblasNoTrans, CblasNonUnit, n, r, t, ldt, b, ldb);
}

void gnp_linalg_solve_upper_right(size_t m, size_t n, const double *t, size_t ldt, double *b, size_t ldb)
{
	if (m > 0 && n > 0)
		cblas_dtrsm(CblasColMajor, CblasRight, CblasUpper, CblasNoTrans, CblasNonUnit, (int)m, (int)n, 1, t, (int)ldt,
		            b, (int)ldb);
}

void gnp_linalg_solve_cholesky(enum gnp_transpose transpose, size_t n, size_t r, const double *l, size_t ldl,
                               double *b, size_t ldb)
{
	solve_triangle(CblasLower, transpose == GNP_PLAIN ? CblasNoTrans : CblasTrans, CblasNonUnit, n, r, l, ldl, b, ldb);
}

void gnp_linalg_solve_cholesky_right(size_t m, size_t n, const double *l, size_t ldl, double *b, size_t ldb)
{
	if (m > 0 && n > 0)
		cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)m, (int)n, 1, l, (int)ldl,
		            b, (int)ldb);
}

/* LAPACK's, which OpenBLAS brings without a header for C. */
extern void dpotrf_(const char *triangle, const int *n, double *a, const int *lda, int *info, size_t);
extern void dgeev_(const char *left, const char *right, const int *n, double *a, const int *lda, double *real,
                   double *imaginary, double *vl, const int *ldvl, double *vr, const int *ldvr, double *work,
                   const int *lwork, int *info, size_t, size_t);
extern void dsyevd_(const char *vectors, const char *triangle, const int *n, double *a, const int *lda, double *values,
                    double *work, const int *lwork, int *iwork, const int *liwork, int *info, size_t, size_t);

size_t gnp_linalg_cholesky(size_t n, double *a, size_t lda, double smallest)
{
	int order = (int)n, leading = (int)lda, info = 0;
	dpotrf_("L", &order, a, &leading, &info, 1);
	size_t done = info > 0 ? (size_t)info - 1 : n;
	for (size_t k = 0; k < done; k++)
		if (!(a[k + k * lda] * a[k + k * lda] > smallest) || !isfinite(a[k + k * lda]))
			return k;
	return done;
}

int gnp_linalg_eigen(size_t n, double *a, double *real, double *imaginary, double *vectors, double *work)
{
	int order = (int)n, length = 8 * order, one = 1, info = 0;
	dgeev_("N", "V", &order, a, &order, real, imaginary, NULL, &one, vectors, &order, work, &length, &info, 1, 1);
	return info;
}

int gnp_linalg_eigen_symmetric(size_t n, double *a, double *values)
{
	int order = (int)n, length = 1 + 6 * order + 2 * order * order, whole = 3 + 5 * order, info = -1;
	double *work = malloc((size_t)length * sizeof *work);
	int *spare = malloc((size_t)whole * sizeof *spare);
	if (work && spare)
		dsyevd_("V", "L", &order, a, &order, values, work, &length, spare, &whole, &info, 1, 1);
	free(work);
	free(spare);
	return info;
}
