#include "core/cells/diffusion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

enum { CHUNK = 4096, ITERATIONS_MAX = 5000 };
static const double tolerance = 1e-10;

void gnp_stiffness_clear(struct gnp_stiffness *stiffness)
{
	free(stiffness->start);
	free(stiffness->column);
	free(stiffness->value);
	free(stiffness->diagonal);
	*stiffness = (struct gnp_stiffness){0};
}

size_t gnp_stiffness_bytes(const struct gnp_stiffness *stiffness)
{
	if (!stiffness->start)
		return 0;
	return (stiffness->count + 1) * sizeof(size_t) + stiffness->count * sizeof(double) +
	       stiffness->start[stiffness->count] * (sizeof(uint32_t) + sizeof(double));
}

/* ---- Assembly ---- */

enum { POLL = 8192 };

/* Whether to stop at row i, and why. */
static gnp_status poll(size_t i, struct gnp_task *task, struct gnp_error *error)
{
	return i % POLL == 0 ? gnp_task_check(task, error) : GNP_OK;
}

/* Entries of each row, in start[i + 1]; their sum in *entries. */
static gnp_status count_entries(size_t edges, const uint32_t *neighbor, const float *weight, struct gnp_task *task, struct gnp_stiffness *s,
                                size_t *entries, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	*entries = 0;
	for (size_t i = 0; i < s->count && (status = poll(i, task, error)) == GNP_OK; i++)
		for (size_t e = 0; e < edges; e++)
			if (weight[i * edges + e] != 0) {
				s->start[i + 1]++;
				s->start[(size_t)neighbor[i * edges + e] + 1]++;
				*entries += 2;
			}
	return status;
}

/* Both directions of every edge, each with half its weight. */
static gnp_status scatter(size_t edges, const uint32_t *neighbor, const float *weight, struct gnp_task *task, struct gnp_stiffness *s,
                          struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = s->count; i-- > 0 && (status = poll(i, task, error)) == GNP_OK;)
		for (size_t e = 0; e < edges; e++) {
			size_t j = neighbor[i * edges + e];
			double half = (double)weight[i * edges + e] / 2;
			if (half == 0)
				continue;
			size_t at = --s->start[i + 1], there = --s->start[j + 1];
			s->column[at] = (uint32_t)j;
			s->value[at] = half;
			s->column[there] = (uint32_t)i;
			s->value[there] = half;
		}
	return status;
}

static void sort_row(uint32_t *column, double *value, size_t count)
{
	for (size_t i = 1; i < count; i++) {
		uint32_t c = column[i];
		double v = value[i];
		size_t j = i;
		for (; j > 0 && column[j - 1] > c; j--) {
			column[j] = column[j - 1];
			value[j] = value[j - 1];
		}
		column[j] = c;
		value[j] = v;
	}
}

/* Adds up entries of one column in a sorted row, and leaves what is not positive out; how many there are. */
static size_t add_up(uint32_t *column, double *value, size_t count)
{
	size_t made = 0;
	for (size_t i = 0; i < count; made += value[made] > 0) {
		uint32_t own = column[i];
		double sum = 0;
		for (; i < count && column[i] == own; i++)
			sum += value[i];
		column[made] = own;
		value[made] = sum;
	}
	return made;
}

/* Sorts and adds up each row and closes the gaps. begin of row i is start[i + 1] before, start[i] after. */
static gnp_status compress(size_t entries, struct gnp_task *task, struct gnp_stiffness *s, struct gnp_error *error)
{
	size_t made = 0;
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < s->count && (status = poll(i, task, error)) == GNP_OK; i++) {
		size_t begin = s->start[i + 1], end = i + 1 < s->count ? s->start[i + 2] : entries;
		sort_row(s->column + begin, s->value + begin, end - begin);
		size_t count = add_up(s->column + begin, s->value + begin, end - begin);
		s->start[i] = made;
		s->diagonal[i] = 0;
		for (size_t at = begin; at < begin + count; at++) {
			s->diagonal[i] += s->value[at];
			s->column[made] = s->column[at];
			s->value[made++] = s->value[at];
		}
	}
	s->start[s->count] = made;
	return status;
}

gnp_status gnp_stiffness_make(size_t count, size_t edges, const uint32_t *neighbor, const float *weight, struct gnp_task *task,
                              struct gnp_stiffness *out, struct gnp_error *error)
{
	struct gnp_stiffness s = {.count = count, .start = gnp_array_zero(count + 1, sizeof *s.start),
	                          .diagonal = gnp_array_new(count, sizeof *s.diagonal)};
	size_t entries = 0;
	gnp_status status = s.start && s.diagonal ? count_entries(edges, neighbor, weight, task, &s, &entries, error)
	                                         : gnp_no_memory("diffusion", count, "points", error);
	if (status == GNP_OK) {
		s.column = gnp_array_new(entries, sizeof *s.column);
		s.value = gnp_array_new(entries, sizeof *s.value);
		status = s.column && s.value ? GNP_OK : gnp_no_memory("diffusion", count, "points", error);
	}
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		s.start[i + 1] += s.start[i]; /* ends of rows, which scatter moves to their begins */
	if (status == GNP_OK)
		status = scatter(edges, neighbor, weight, task, &s, error);
	if (status == GNP_OK)
		status = compress(entries, task, &s, error);
	if (status == GNP_OK)
		*out = s;
	else
		gnp_stiffness_clear(&s);
	return status;
}

/* ---- Conjugate gradients ---- */

struct work {
	const struct gnp_diffusion *d;
	double *x, *r, *p, *q;   /* (count, 3) solution, residual, direction, matrix times direction */
	double *partial;         /* (chunks, 6) */
	double sums[6], alpha[3], beta[3];
};

static void row_of(const struct gnp_stiffness *s, const double *in, size_t i, double out[3])
{
	for (size_t c = 0; c < 3; c++)
		out[c] = s->diagonal[i] * in[3 * i + c];
	for (size_t at = s->start[i]; at < s->start[i + 1]; at++)
		for (size_t c = 0; c < 3; c++)
			out[c] -= s->value[at] * in[3 * (size_t)s->column[at] + c];
}

static bool is_fixed(const struct gnp_diffusion *d, size_t i)
{
	return d->fixed && d->fixed[i];
}

static double scale_of(const struct gnp_diffusion *d, size_t i)
{
	return d->mass[i] + d->factor * d->stiffness->diagonal[i];
}

/* q = A p, and the sums p.q of the chunk. */
static gnp_status multiply_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *w = context;
	double *sums = w->partial + 6 * (begin / CHUNK);
	(void)scratch, (void)error;
	memset(sums, 0, 6 * sizeof *sums);
	for (size_t i = begin; i < end; i++) {
		double s[3] = {0};
		if (!is_fixed(w->d, i))
			row_of(w->d->stiffness, w->p, i, s);
		for (size_t c = 0; c < 3; c++) {
			double q = is_fixed(w->d, i) ? 0 : w->d->mass[i] * w->p[3 * i + c] + w->d->factor * s[c];
			w->q[3 * i + c] = q;
			sums[c] += q * w->p[3 * i + c];
		}
	}
	return GNP_OK;
}

/* x += alpha p, r -= alpha q; the sums r.z with z = r / diagonal, and r.r. */
static gnp_status advance_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *w = context;
	double *sums = w->partial + 6 * (begin / CHUNK);
	(void)scratch, (void)error;
	memset(sums, 0, 6 * sizeof *sums);
	for (size_t i = begin; i < end; i++)
		for (size_t c = 0; c < 3; c++) {
			size_t at = 3 * i + c;
			w->x[at] += w->alpha[c] * w->p[at];
			w->r[at] -= w->alpha[c] * w->q[at];
			sums[c] += w->r[at] * w->r[at] / scale_of(w->d, i);
			sums[3 + c] += w->r[at] * w->r[at];
		}
	return GNP_OK;
}

/* p = z + beta p */
static gnp_status turn_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *w = context;
	(void)scratch, (void)error;
	for (size_t i = begin; i < end; i++)
		for (size_t c = 0; c < 3; c++)
			w->p[3 * i + c] = w->r[3 * i + c] / scale_of(w->d, i) + w->beta[c] * w->p[3 * i + c];
	return GNP_OK;
}

static gnp_status sweep(struct work *w, gnp_chunk_fn fn, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	size_t count = w->d->stiffness->count;
	gnp_status status = gnp_pool_run(pool, task, count, CHUNK, fn, w, error);
	memset(w->sums, 0, sizeof w->sums);
	for (size_t chunk = 0; status == GNP_OK && chunk < (count + CHUNK - 1) / CHUNK; chunk++)
		for (int s = 0; s < 6; s++)
			w->sums[s] += w->partial[6 * chunk + (size_t)s];
	return status;
}

static bool is_small(const struct work *w, const double limit[3])
{
	return w->sums[3] <= limit[0] && w->sums[4] <= limit[1] && w->sums[5] <= limit[2];
}

static gnp_status iterate(struct work *w, const double limit[3], struct gnp_pool *pool, struct gnp_task *task, size_t *iterations,
                          struct gnp_error *error)
{
	double rz[3] = {w->sums[0], w->sums[1], w->sums[2]};
	gnp_status status = GNP_OK;
	for (*iterations = 0; !is_small(w, limit); ++*iterations) {
		if (!isfinite(w->sums[3] + w->sums[4] + w->sums[5]))
			return gnp_error_set(error, GNP_NO_CONVERGENCE, "diffusion: the residual after %zu iterations is not finite", *iterations);
		if (*iterations == ITERATIONS_MAX)
			return gnp_error_set(error, GNP_NO_CONVERGENCE, "diffusion: %d iterations left a relative residual of %.1e, need %.0e",
			                     ITERATIONS_MAX, sqrt(fmax(fmax(w->sums[3] / limit[0], w->sums[4] / limit[1]), w->sums[5] / limit[2])) * tolerance,
			                     tolerance);
		status = sweep(w, turn_chunk, pool, task, error);
		if (status == GNP_OK)
			status = sweep(w, multiply_chunk, pool, task, error);
		for (int c = 0; c < 3; c++)
			w->alpha[c] = w->sums[c] > 0 ? rz[c] / w->sums[c] : 0;
		if (status == GNP_OK)
			status = sweep(w, advance_chunk, pool, task, error);
		if (status != GNP_OK)
			return status;
		for (int c = 0; c < 3; c++) {
			w->beta[c] = rz[c] > 0 ? w->sums[c] / rz[c] : 0;
			rz[c] = w->sums[c];
		}
	}
	return GNP_OK;
}

/* The power of two about the largest right-hand side, which is divided out: squares of its residuals would not be numbers for clouds of
 * large or small units. Where a right-hand side is 0 altogether, so is the solution. */
static double unit_of(const struct gnp_diffusion *d, const double *rhs, double *x)
{
	double most[3] = {0};
	int exponent;
	for (size_t i = 0; i < 3 * d->stiffness->count; i++)
		most[i % 3] = fmax(most[i % 3], is_fixed(d, i / 3) ? 0 : fabs(rhs[i]));
	for (size_t i = 0; i < 3 * d->stiffness->count; i++)
		x[i] = most[i % 3] > 0 ? x[i] : 0;
	frexp(fmax(fmax(most[0], most[1]), most[2]), &exponent);
	return ldexp(1, exponent > 1000 ? 1000 : exponent < -1000 ? -1000 : exponent);
}

/* The residual of the guess, in r; x is kept zero where it is given. */
static gnp_status begin(struct work *w, const double *rhs, double unit, double limit[3], struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_error *error)
{
	size_t count = w->d->stiffness->count;
	for (size_t i = 0; i < 3 * count; i++)
		w->p[i] = w->x[i] = is_fixed(w->d, i / 3) ? 0 : w->x[i] / unit;
	gnp_status status = sweep(w, multiply_chunk, pool, task, error);
	limit[0] = limit[1] = limit[2] = 0;
	for (size_t i = 0; i < 3 * count; i++) {
		double b = is_fixed(w->d, i / 3) ? 0 : rhs[i] / unit;
		w->r[i] = b;
		limit[i % 3] += tolerance * tolerance * b * b;
	}
	for (int c = 0; c < 3; c++) {
		limit[c] = fmax(limit[c], 1e-290);
		w->alpha[c] = 1;
		w->beta[c] = 0;
	}
	/* r = b - 1 q; the step along p, which the same loop takes, is of no length */
	memset(w->p, 0, 3 * count * sizeof *w->p);
	return status == GNP_OK ? sweep(w, advance_chunk, pool, task, error) : status;
}

gnp_status gnp_diffusion_solve(const struct gnp_diffusion *diffusion, const double *rhs, double *x, struct gnp_pool *pool,
                               struct gnp_task *task, size_t *iterations, struct gnp_error *error)
{
	size_t count = diffusion->stiffness->count;
	struct work w = {.d = diffusion, .x = x, .r = gnp_array_new(count, 3 * sizeof(double)), .p = gnp_array_new(count, 3 * sizeof(double)),
	                 .q = gnp_array_new(count, 3 * sizeof(double)),
	                 .partial = gnp_array_new((count + CHUNK - 1) / CHUNK, 6 * sizeof(double))};
	double limit[3], unit = unit_of(diffusion, rhs, x);
	gnp_status status = w.r && w.p && w.q && w.partial ? begin(&w, rhs, unit, limit, pool, task, error)
	                                                  : gnp_no_memory("diffusion", count, "points", error);
	if (status == GNP_OK)
		status = iterate(&w, limit, pool, task, iterations, error);
	for (size_t i = 0; i < 3 * count && status == GNP_OK; i++)
		x[i] *= unit;
	free(w.r);
	free(w.p);
	free(w.q);
	free(w.partial);
	return status;
}

struct product {
	const struct gnp_stiffness *stiffness;
	const double *in;
	double *out;
};

static gnp_status apply_chunk(void *context, size_t begin_row, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct product *product = context;
	(void)scratch, (void)error;
	for (size_t i = begin_row; i < end; i++)
		row_of(product->stiffness, product->in, i, product->out + 3 * i);
	return GNP_OK;
}

gnp_status gnp_stiffness_apply(const struct gnp_stiffness *stiffness, const double *in, double *out, struct gnp_pool *pool,
                               struct gnp_task *task, struct gnp_error *error)
{
	struct product product = {stiffness, in, out};
	return gnp_pool_run(pool, task, stiffness->count, CHUNK, apply_chunk, &product, error);
}
