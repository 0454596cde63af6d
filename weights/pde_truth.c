#include "pde_truth.h"

#include <math.h>
#include <stdlib.h>

#include "memory.h"
#include "random.h"
#include "vector.h"

struct wave {
	double k[3], square, phase, size;
};

static void draw(uint64_t seed, size_t solution, struct wave *waves)
{
	static const double pi = 3.14159265358979324;
	struct gnp_random random;
	gnp_random_seed(&random, seed, solution);
	for (size_t w = 0; w < GNP_PDE_WAVES; w++) {
		struct wave *wave = &waves[w];
		do {
			for (int c = 0; c < 3; c++)
				wave->k[c] = pi * ((double)gnp_random_below(&random, 2 * GNP_PDE_MODES + 1) - GNP_PDE_MODES);
			wave->square = gnp_dot(wave->k, wave->k);
		} while (!(wave->square > 0));
		wave->phase = 2 * pi * gnp_random_uniform(&random);
		wave->size = gnp_random_normal(&random) * pi * pi / wave->square;
	}
}

struct work {
	const struct gnp_sample *sample;
	const struct wave *waves; /* (count, GNP_PDE_WAVES) */
	size_t count;
	double *value, *source;
};

static void evaluate(const struct wave *waves, const double x[3], const double n[3], double mean_curvature, double *value, double *source)
{
	double u = 0, along = 0, second = 0;
	for (size_t w = 0; w < GNP_PDE_WAVES; w++) {
		const struct wave *wave = &waves[w];
		double angle = gnp_dot(wave->k, x) + wave->phase, kn = gnp_dot(wave->k, n), s = wave->size * sin(angle);
		u += s;
		along += wave->size * cos(angle) * kn;
		second -= s * (wave->square - kn * kn);
	}
	*value = u;
	*source = -(second + 2 * mean_curvature * along);
}

static gnp_status evaluate_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct work *work = context;
	const struct gnp_sample *sample = work->sample;
	(void)scratch, (void)error;
	for (size_t i = begin; i < end; i++)
		for (size_t s = 0; s < work->count; s++)
			evaluate(work->waves + s * GNP_PDE_WAVES, sample->exact + 3 * i, sample->normals + 3 * i, sample->mean_curvature[i],
			         &work->value[i * work->count + s], &work->source[i * work->count + s]);
	return GNP_OK;
}

gnp_status gnp_pde_truth(const struct gnp_sample *sample, uint64_t seed, size_t count, struct gnp_pool *pool, struct gnp_task *task,
                         double *value, double *source, struct gnp_error *error)
{
	enum { POINTS_A_CHUNK = 256 };
	struct wave *waves = gnp_array_new(count, GNP_PDE_WAVES * sizeof *waves);
	if (!waves)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "truth: no memory for %zu solutions", count);
	for (size_t s = 0; s < count; s++)
		draw(seed, s, waves + s * GNP_PDE_WAVES);
	struct work work = {sample, waves, count, value, source};
	gnp_status status = gnp_pool_run(pool, task, sample->count, POINTS_A_CHUNK, evaluate_chunk, &work, error);
	free(waves);
	return status;
}
