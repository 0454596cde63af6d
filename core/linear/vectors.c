#include "core/linear/vectors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/linalg.h"

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

/* ---- Blocks ---- */

enum { BLOCK_CHUNK = 2048, COMBINE_CHUNK = 256 };

struct block {
	const double *vectors, *weights, *shares;
	const double *from; /* W that is read */
	double *to;         /* W that is written */
	size_t count, width, n;
	double *partial; /* (chunks, width, count) less than nothing: what is subtracted from it */
};

static gnp_status no_scratch(struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "vectors: no memory for a chunk");
}

static gnp_status block_dot_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                  struct gnp_error *error)
{
	const struct block *work = context;
	size_t length = end - begin;
	double *partial = work->partial + begin / BLOCK_CHUNK * work->count * work->width;
	double *weighted = gnp_scratch_take(scratch, length * work->width, sizeof *weighted);
	const double *weights = work->weights;
	if (!weighted)
		return no_scratch(error);
	for (size_t c = 0; c < work->width; c++)
		for (size_t i = 0; i < length; i++)
			weighted[c * length + i] = work->from[c * work->n + begin + i] * (weights ? weights[begin + i] : 1);
	gnp_linalg_subtract_transposed_product(work->count, work->width, length, work->vectors + begin, work->n, weighted,
	                                       length, partial, work->count);
	return GNP_OK;
}

gnp_status gnp_vectors_block_dot(const double *vectors, size_t count, size_t n, const double *weights, const double *w,
                                 size_t width, struct gnp_pool *pool, double *sums, struct gnp_error *error)
{
	size_t chunks = (n + BLOCK_CHUNK - 1) / BLOCK_CHUNK, entries = count * width;
	struct block work = {.vectors = vectors, .weights = weights, .from = w, .count = count, .width = width, .n = n,
	                     .partial = gnp_array_zero(chunks * entries, sizeof(double))};
	if (!work.partial)
		return gnp_no_memory("vectors", entries, "sums", error);
	gnp_status status = gnp_pool_run(pool, NULL, n, BLOCK_CHUNK, block_dot_chunk, &work, error);
	memset(sums, 0, entries * sizeof *sums);
	for (size_t c = 0; c < chunks && status == GNP_OK; c++)
		for (size_t k = 0; k < entries; k++)
			sums[k] -= work.partial[c * entries + k];
	free(work.partial);
	return status;
}

static gnp_status block_subtract_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                       struct gnp_error *error)
{
	const struct block *work = context;
	(void)scratch;
	(void)error;
	gnp_linalg_subtract_product(end - begin, work->width, work->count, work->vectors + begin, work->n, work->shares,
	                            work->count, work->to + begin, work->n);
	return GNP_OK;
}

gnp_status gnp_vectors_block_subtract(const double *vectors, size_t count, size_t n, const double *shares,
                                      size_t width, struct gnp_pool *pool, double *w, struct gnp_error *error)
{
	struct block work = {.vectors = vectors, .shares = shares, .to = w, .count = count, .width = width, .n = n};
	return gnp_pool_run(pool, NULL, n, BLOCK_CHUNK, block_subtract_chunk, &work, error);
}

/* What W holds is read before it is written, a chunk of every vector at a time. */
static gnp_status combine_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	const struct block *work = context;
	size_t length = end - begin;
	double *negative = gnp_scratch_take(scratch, length * work->count, sizeof *negative);
	if (!negative)
		return no_scratch(error);
	for (size_t k = 0; k < work->count; k++)
		for (size_t i = 0; i < length; i++)
			negative[k * length + i] = -work->vectors[k * work->n + begin + i];
	for (size_t c = 0; c < work->width; c++)
		memset(work->to + c * work->n + begin, 0, length * sizeof *work->to);
	gnp_linalg_subtract_product(length, work->width, work->count, negative, length, work->shares, work->count,
	                            work->to + begin, work->n);
	return GNP_OK;
}

gnp_status gnp_vectors_combine(const double *vectors, size_t count, size_t n, const double *shares, size_t width,
                               struct gnp_pool *pool, double *w, struct gnp_error *error)
{
	struct block work = {.vectors = vectors, .shares = shares, .to = w, .count = count, .width = width, .n = n};
	return gnp_pool_run(pool, NULL, n, COMBINE_CHUNK, combine_chunk, &work, error);
}
