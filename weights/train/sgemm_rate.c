#include "weights/train/sgemm_rate.h"

#include "core/linear/linalg.h"

enum { SIZE = 512, PRODUCTS_A_CHUNK = 4, CHUNKS_A_WORKER = 24 };

static gnp_status multiply(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	float *a = gnp_scratch_take(scratch, 3 * SIZE * SIZE, sizeof *a), *b = a + SIZE * SIZE;
	(void)context;
	if (!a)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "sgemm: no memory for three matrices");
	for (size_t i = 0; i < 2 * SIZE * SIZE; i++)
		a[i] = (float)(i % 7);
	for (size_t i = begin; i < end; i++)
		gnp_linalg_sgemm(SIZE, SIZE, SIZE, a, b, b + SIZE * SIZE);
	return GNP_OK;
}

gnp_status gnp_sgemm_rate(struct gnp_pool *pool, double *rate, struct gnp_error *error)
{
	size_t products = (size_t)gnp_pool_workers(pool) * CHUNKS_A_WORKER * PRODUCTS_A_CHUNK;
	gnp_status status = gnp_pool_run(pool, NULL, gnp_pool_workers(pool) * PRODUCTS_A_CHUNK, PRODUCTS_A_CHUNK, multiply, NULL, error);
	double started = gnp_clock();
	if (status == GNP_OK)
		status = gnp_pool_run(pool, NULL, products, PRODUCTS_A_CHUNK, multiply, NULL, error);
	if (status == GNP_OK)
		*rate = 2.0 * SIZE * SIZE * SIZE * (double)products / (gnp_clock() - started);
	return status;
}
