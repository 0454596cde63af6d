#include "core/estimate/estimate_supports.h"

#include <string.h>

#include "core/estimators/weighted_fit.h"

enum { STRIDE_FIRST = 24,
	   ROUNDS = 6,
	   BATCH = GNP_WEIGHTED_BATCH };

/* A block under way. */
struct block {
	struct gnp_estimate_work *work;
	size_t begin, end;
	unsigned char *served; /* (end - begin) */
	uint32_t *centres;     /* (end - begin) of a round */
	size_t left;
	bool own; /* every point by a piece of its own */
};

static gnp_status fit_at(const struct gnp_estimate_work *work, const uint32_t *centres, size_t count,
                         struct gnp_weighted_piece *pieces, struct gnp_scratch *scratch, struct gnp_error *error)
{
	bool errors = (work->quantities & GNP_QUANTITY_STDERR) != 0;
	return gnp_weighted_fit_at(work->weighted, centres, count, errors, pieces, scratch, error);
}

static void write(struct block *block, const struct gnp_weighted_piece *piece, size_t point, size_t row)
{
	const bool centre = point == piece->patch.centre;
	const struct gnp_estimate_judgement judgement = {.crease = centre && piece->crease,
	                                                 .outlier = block->work->chosen && piece->outlier};
	gnp_estimate_write(block->work, &piece->patch, &piece->fit, &judgement, point, row);
	atomic_fetch_add_explicit(&block->work->outliers, judgement.outlier, memory_order_relaxed); /* else votes tell */
}

/* Serves the points of the block that the piece is trusted for; how many. */
static size_t serve(struct block *block, const struct gnp_weighted_piece *piece)
{
	size_t count = 0, most = block->own ? 1 : piece->trusted;
	for (size_t m = 0; m < most; m++) {
		size_t point = piece->member[m];
		if (point < block->begin || point >= block->end || block->served[point - block->begin])
			continue;
		block->served[point - block->begin] = 1;
		write(block, piece, point, block->work->prepared->order[point]);
		count++;
	}
	block->left -= count;
	if (piece->fit.reduced)
		atomic_fetch_add_explicit(&block->work->degenerate, count, memory_order_relaxed);
	return count;
}

/* Every stride-th of the points that are left. */
static size_t choose_centres(struct block *block, size_t stride)
{
	size_t count = 0, seen = 0;
	for (size_t i = block->begin; i < block->end; i++) {
		if (block->served[i - block->begin])
			continue;
		if (seen++ % stride == (stride - 1) / 2)
			block->centres[count++] = (uint32_t)i;
	}
	if (count == 0)
		for (size_t i = block->begin; count == 0; i++)
			if (!block->served[i - block->begin])
				block->centres[count++] = (uint32_t)i;
	return count;
}

/* Fits at centres that are not served yet, a batch at a time. patches, served: how many of each. */
static gnp_status run_round(struct block *block, size_t count, size_t *patches, size_t *served,
                            struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	uint32_t batch[BATCH];
	struct gnp_weighted_piece pieces[BATCH];
	gnp_status status = GNP_OK;
	*patches = *served = 0;
	for (size_t next = 0; next < count && status == GNP_OK;) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		size_t some = 0;
		for (; next < count && some < BATCH; next++)
			if (!block->served[block->centres[next] - block->begin])
				batch[some++] = block->centres[next];
		if (some > 0)
			status = fit_at(block->work, batch, some, pieces, scratch, error);
		for (size_t p = 0; p < some && status == GNP_OK; p++)
			*served += block->served[batch[p] - block->begin] ? 0 : serve(block, &pieces[p]);
		*patches += some;
		gnp_scratch_release(scratch, mark);
	}
	return status;
}

/* Sparse centres first; then as sparse as the pieces so far allow. */
static gnp_status run_block(struct block *block, struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t stride = block->own ? 1 : STRIDE_FIRST, patches, served;
	gnp_status status = GNP_OK;
	for (int round = 0; block->left > 0 && status == GNP_OK; round++) {
		size_t count = choose_centres(block, stride);
		status = run_round(block, count, &patches, &served, scratch, error);
		size_t each = patches ? served / patches : 1;
		stride = round + 1 < ROUNDS && each > 1 ? (each < stride ? each : stride) : 1;
		atomic_fetch_add_explicit(&block->work->patches, patches, memory_order_relaxed);
	}
	return status;
}

static gnp_status run_chosen(struct gnp_estimate_work *work, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	struct gnp_weighted_piece pieces[BATCH];
	struct block block = {.work = work};
	gnp_status status = GNP_OK;
	for (size_t p = begin; p < end && status == GNP_OK; p += BATCH) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		size_t some = end - p < BATCH ? end - p : BATCH;
		status = fit_at(work, work->cover.centre + p, some, pieces, scratch, error);
		for (size_t i = 0; i < some && status == GNP_OK; i++) {
			write(&block, &pieces[i], work->cover.centre[p + i], p + i);
			atomic_fetch_add_explicit(&work->degenerate, pieces[i].fit.reduced, memory_order_relaxed);
		}
		gnp_scratch_release(scratch, mark);
	}
	atomic_fetch_add_explicit(&work->patches, end - begin, memory_order_relaxed);
	return status;
}

gnp_status gnp_estimate_supports(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	struct gnp_estimate_work *work = context;
	if (work->chosen)
		return run_chosen(work, begin, end, scratch, error);
	struct block block = {.work = work, .begin = begin, .end = end, .left = end - begin, .own = work->own,
	                      .served = gnp_scratch_take(scratch, end - begin, 1),
	                      .centres = gnp_scratch_take(scratch, end - begin, sizeof *block.centres)};
	if (!block.served || !block.centres)
		return gnp_no_memory("estimate", end - begin, "points of a block", error);
	memset(block.served, 0, end - begin);
	return run_block(&block, scratch, error);
}
