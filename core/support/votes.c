#include "core/support/votes.h"

#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/fit/least_squares.h"
#include "core/support/weighted_refit.h"

enum { NEAREST = 32, CLOSEST = 3, LEAST = 3, CAST = 1 << 16 };

static const double CUT = 2.8, SMALLEST = 1e-12, SMALLEST_LEFT = 0.1; /* deviations; of R; of variance */

/* The upper half of a number is how many voted, the lower how many against. */
struct gnp_votes {
	atomic_uint_least32_t sum;
};

struct gnp_votes *gnp_votes_create(size_t count)
{
	return gnp_array_zero(count, sizeof(struct gnp_votes));
}

void gnp_votes_free(struct gnp_votes *votes)
{
	free(votes);
}

/* Whether most of the points closest to single i are off as it is: they are of another piece together. */
static bool is_one_of_many(const struct gnp_weighted_near *near, const double *points, const bool *off, size_t i)
{
	const struct gnp_support *support = near->support;
	const double *p = points + 3 * (size_t)support->member[i];
	double nearest[CLOSEST] = {INFINITY, INFINITY, INFINITY};
	bool also[CLOSEST] = {false};
	for (size_t j = 0; j < gnp_support_singles(support); j++) {
		const double *q = points + 3 * (size_t)support->member[j], d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
		double square = j == i ? INFINITY : gnp_dot(d, d);
		int at = CLOSEST;
		for (; at > 0 && square < nearest[at - 1]; at--)
			if (at < CLOSEST) {
				nearest[at] = nearest[at - 1];
				also[at] = also[at - 1];
			}
		if (at < CLOSEST) {
			nearest[at] = square;
			also[at] = off[j];
		}
	}
	return also[0] + also[1] + also[2] >= 2;
}

/* Of the residuals of single points that are not off: by the median's deviation, and then by those that it leaves. */
static double deviation_of(const struct gnp_weighted_near *near, size_t singles)
{
	static const double KEPT = 2.5, OF_KEPT = 0.9546; /* deviations; of what is left of a normal distribution */
	double limit = KEPT * gnp_weighted_deviation(near->support, near->residual), sum = 0, count = 1e-300;
	for (size_t i = 0; i < singles; i++)
		if (fabs(near->residual[i]) <= limit) {
			sum += near->residual[i] * near->residual[i];
			count++;
		}
	return sqrt(sum / count) / OF_KEPT;
}

/* The share of the noise's variance that residuals keep at the centre, 1 - its leverage: where points are few for a
 * surface, it goes through them whatever the noise is. */
static double left_of(const struct gnp_weighted_fit *fit)
{
	double x[GNP_TAYLOR_STRIDE] = {1}, sum = 0;
	gnp_cholesky_forward(fit->factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, x, x);
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++)
		sum += x[i] * x[i];
	return fmax(1 - fit->weight[0] * sum, SMALLEST_LEFT);
}

void gnp_votes_cast(struct gnp_votes *votes, const struct gnp_weighted_near *near, const double *points)
{
	const struct gnp_support *support = near->support;
	size_t singles = gnp_support_singles(support), count = singles < NEAREST + 1 ? singles : NEAREST + 1;
	bool off[GNP_SUPPORT_SINGLES];
	if (near->outputs[GNP_WEIGHTED_CREASE] > -1 || !near->fit->solved)
		return;
	double limit = CUT * deviation_of(near, singles) / sqrt(left_of(near->fit)) + SMALLEST;
	for (size_t i = 0; i < singles; i++)
		off[i] = fabs(near->residual[i]) > limit;
	for (size_t i = 1; i < count; i++)
		if (!off[i] || !is_one_of_many(near, points, off, i))
			atomic_fetch_add_explicit(&votes[support->member[i]].sum, CAST + off[i], memory_order_relaxed);
}

bool gnp_votes_outlier(const struct gnp_votes *votes, size_t point)
{
	uint_least32_t all = atomic_load_explicit(&votes[point].sum, memory_order_relaxed);
	uint_least32_t cast = all / CAST, off = all % CAST;
	return cast >= LEAST && 2 * off > cast;
}
