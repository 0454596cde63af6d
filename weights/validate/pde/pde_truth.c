#include "weights/validate/pde/pde_truth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/base/vector.h"

enum { WIDE = GNP_PDE_SOLUTIONS_MAX, SIDE = 2 * GNP_PDE_MODES + 1 };

static const double pi = 3.14159265358979324;

/* One mode of the half of them that stands for all: m and -m are one cosine and one sine. */
struct mode {
	int index[3];                        /* m + GNP_PDE_MODES */
	double k[3], square;                 /* pi m, |pi m|^2 */
	double cosine[WIDE], sine[WIDE];     /* coefficients of each solution */
};

static bool first_half(const int m[3])
{
	return m[0] != 0 ? m[0] > 0 : m[1] != 0 ? m[1] > 0 : m[2] > 0;
}

static size_t draw(uint64_t seed, size_t solutions, struct mode *modes)
{
	size_t count = 0;
	struct gnp_random random[WIDE];
	for (size_t s = 0; s < solutions; s++)
		gnp_random_seed(&random[s], seed, s);
	for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
		const int m[3] = {i / (SIDE * SIDE) - GNP_PDE_MODES, i / SIDE % SIDE - GNP_PDE_MODES, i % SIDE - GNP_PDE_MODES};
		if (!first_half(m))
			continue;
		struct mode *mode = &modes[count++];
		*mode = (struct mode){.square = 0};
		for (int c = 0; c < 3; c++) {
			mode->index[c] = m[c] + GNP_PDE_MODES;
			mode->k[c] = pi * m[c];
		}
		mode->square = gnp_dot(mode->k, mode->k);
		for (size_t s = 0; s < solutions; s++) {
			mode->cosine[s] = gnp_random_normal(&random[s]) * pi * pi / mode->square;
			mode->sine[s] = gnp_random_normal(&random[s]) * pi * pi / mode->square;
		}
	}
	return count;
}

struct work {
	const struct gnp_sample *sample;
	const struct mode *modes; /* (mode_count) */
	size_t mode_count, solutions;
	double *value, *source;   /* (points, solutions) */
};

struct turn {
	double c, s;
};

static struct turn turn_by(struct turn a, struct turn b)
{
	return (struct turn){a.c * b.c - a.s * b.s, a.c * b.s + a.s * b.c};
}

/* cos and sin of pi m x for m in -GNP_PDE_MODES..GNP_PDE_MODES. */
static void tabulate(double x, struct turn table[SIDE])
{
	for (int i = 0; i < SIDE; i++)
		table[i] = (struct turn){cos(pi * (i - GNP_PDE_MODES) * x), sin(pi * (i - GNP_PDE_MODES) * x)};
}

static void evaluate(const struct work *work, size_t point)
{
	const struct gnp_sample *sample = work->sample;
	const double *x = sample->exact + 3 * point, *n = sample->normals + 3 * point, twice = 2 * sample->mean_curvature[point];
	struct turn tables[3][SIDE];
	double u[WIDE] = {0}, f[WIDE] = {0};
	for (int c = 0; c < 3; c++)
		tabulate(x[c], tables[c]);
	for (size_t i = 0; i < work->mode_count; i++) {
		const struct mode *mode = &work->modes[i];
		struct turn t = turn_by(turn_by(tables[0][mode->index[0]], tables[1][mode->index[1]]), tables[2][mode->index[2]]);
		double along = gnp_dot(mode->k, n), tangential = mode->square - along * along;
		struct turn minus_laplacian = {tangential * t.c + twice * along * t.s, tangential * t.s - twice * along * t.c};
		for (int s = 0; s < WIDE; s++) {
			u[s] += mode->cosine[s] * t.c + mode->sine[s] * t.s;
			f[s] += mode->cosine[s] * minus_laplacian.c + mode->sine[s] * minus_laplacian.s;
		}
	}
	memcpy(work->value + point * work->solutions, u, work->solutions * sizeof *u);
	memcpy(work->source + point * work->solutions, f, work->solutions * sizeof *f);
}

static gnp_status evaluate_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	(void)scratch, (void)error;
	for (size_t i = begin; i < end; i++)
		evaluate(context, i);
	return GNP_OK;
}

gnp_status gnp_pde_truth(const struct gnp_sample *sample, uint64_t seed, size_t count, struct gnp_pool *pool,
                         struct gnp_task *task, double *value, double *source, struct gnp_error *error)
{
	enum { POINTS_A_CHUNK = 256 };
	if (count < 1 || count > WIDE)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "solutions: got %zu, need 1..%d", count, WIDE);
	struct mode *modes = gnp_array_new((SIDE * SIDE * SIDE - 1) / 2, sizeof *modes);
	if (!modes)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "truth: no memory for the modes");
	struct work work = {sample, modes, draw(seed, count, modes), count, value, source};
	gnp_status status = gnp_pool_run(pool, task, sample->count, POINTS_A_CHUNK, evaluate_chunk, &work, error);
	free(modes);
	return status;
}
