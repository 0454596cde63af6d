#include "core/linear/vectors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

enum { CHUNK = 8192 };

struct dots {
	const double *vectors, *weights, *w;
	size_t count, n;
	double *partial; /* (chunks, count) */
};

static gnp_status dot_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	struct dots *work = context;
	double weighted[CHUNK], *partial = work->partial + begin / CHUNK * work->count;
	(void)scratch;
	(void)error;
	for (size_t i = begin; i < end; i++)
		weighted[i - begin] = work->weights ? work->weights[i] * work->w[i] : work->w[i];
	for (size_t k = 0; k < work->count; k++) {
		const double *v = work->vectors + k * work->n + begin;
		double sum[4] = {0}; /* four chains of additions side by side */
		size_t i = 0, length = end - begin;
		for (; i + 4 <= length; i += 4)
			for (int c = 0; c < 4; c++)
				sum[c] += v[i + c] * weighted[i + c];
		for (; i < length; i++)
			sum[0] += v[i] * weighted[i];
		partial[k] = sum[0] + sum[1] + sum[2] + sum[3];
	}
	return GNP_OK;
}

gnp_status gnp_vectors_dot(const double *vectors, size_t count, size_t n, const double *weights, const double *w,
                           struct gnp_pool *pool, double *sums, struct gnp_error *error)
{
	size_t chunks = (n + CHUNK - 1) / CHUNK;
	struct dots work = {vectors, weights, w, count, n, gnp_array_new(chunks * count, sizeof(double))};
	if (!work.partial)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "vectors: no memory for %zu sums", count);
	gnp_status status = gnp_pool_run(pool, NULL, n, CHUNK, dot_chunk, &work, error);
	memset(sums, 0, count * sizeof *sums);
	for (size_t c = 0; c < chunks && status == GNP_OK; c++)
		for (size_t k = 0; k < count; k++)
			sums[k] += work.partial[c * count + k];
	free(work.partial);
	return status;
}

struct additions {
	const double *vectors, *shares;
	size_t count, n;
	double factor, *w;
};

static gnp_status add_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	const struct additions *work = context;
	(void)scratch;
	(void)error;
	for (size_t k = 0; k < work->count; k++) {
		const double *v = work->vectors + k * work->n;
		double share = work->factor * work->shares[k];
		for (size_t i = begin; i < end; i++)
			work->w[i] += share * v[i];
	}
	return GNP_OK;
}

gnp_status gnp_vectors_add(const double *vectors, size_t count, size_t n, const double *shares, double factor,
                           struct gnp_pool *pool, double *w, struct gnp_error *error)
{
	struct additions work = {vectors, shares, count, n, factor, w};
	return gnp_pool_run(pool, NULL, n, CHUNK / 4, add_chunk, &work, error);
}

gnp_status gnp_vectors_norm(size_t n, const double *weights, const double *w, struct gnp_pool *pool, double *norm,
                            struct gnp_error *error)
{
	double square;
	gnp_status status = gnp_vectors_dot(w, 1, n, weights, w, pool, &square, error);
	if (status == GNP_OK)
		*norm = sqrt(square);
	return status;
}
