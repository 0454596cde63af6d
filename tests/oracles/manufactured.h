/* Functions on surfaces whose surface derivatives are known: U = sum_m a_m sin(k_m . x + p_m) restricted to the surface, for which
 *   grad_S u = (I - n n^T) grad U,  Delta_LB u = lap U - n^T Hess(U) n + 2 H (n . grad U)
 * with the signs of shapes.h. Analytic clouds to try them on. */
#ifndef GNP_TESTS_MANUFACTURED_H
#define GNP_TESTS_MANUFACTURED_H

#include "core/base/vector.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

struct manufactured {
	double value, laplacian, gradient[3];
};

static inline struct manufactured manufactured_at(const double x[3], const double n[3], double mean_curvature)
{
	static const double wave[5][3] = {{2, 1, 0.5}, {-1, 2.5, 1}, {0.5, -1, 3}, {3, 2, -1}, {1, -3, 2}};
	static const double phase[5] = {0.3, 1.1, 2, 0.7, 0.1}, size[5] = {1, 0.7, 0.8, 0.5, 0.6};
	struct manufactured at = {.value = 0};
	double gradient[3] = {0}, second = 0; /* the ambient gradient, and lap U - n^T Hess(U) n */
	for (int m = 0; m < 5; m++) {
		double angle = gnp_dot(wave[m], x) + phase[m], along = gnp_dot(wave[m], n);
		at.value += size[m] * sin(angle);
		second -= size[m] * sin(angle) * (gnp_dot(wave[m], wave[m]) - along * along);
		for (int c = 0; c < 3; c++)
			gradient[c] += size[m] * cos(angle) * wave[m][c];
	}
	double normal = gnp_dot(gradient, n);
	at.laplacian = second + 2 * mean_curvature * normal;
	for (int c = 0; c < 3; c++)
		at.gradient[c] = gradient[c] - normal * n[c];
	return at;
}

static inline struct manufactured manufactured_of(const struct gnp_sample *sample, size_t i)
{
	return manufactured_at(sample->exact + 3 * i, sample->normals + 3 * i, sample->mean_curvature[i]);
}

static inline struct gnp_sample sample_of(const char *name, const struct gnp_sample_options *options, struct gnp_pool *pool)
{
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample = {.count = 0};
	struct gnp_error error = {0};
	if (gnp_shape_create(name, 3, 8, &shape, &error) != GNP_OK ||
	    gnp_sample_create(shape, options, pool, NULL, &sample, &error) != GNP_OK) {
		fprintf(stderr, "%s: %s\n", name, error.text);
		CHECK(!"the sample was made");
	}
	gnp_shape_free(shape);
	return sample;
}

/* Relative L2 error over count values. */
static inline double relative_error(const double *got, const double *want, size_t count)
{
	double error = 0, size = 0;
	for (size_t i = 0; i < count; i++) {
		error += (got[i] - want[i]) * (got[i] - want[i]);
		size += want[i] * want[i];
	}
	return sqrt(error / size);
}

/* The same after each has lost its mean. */
static inline double relative_error_without_mean(const double *got, const double *want, size_t count)
{
	double error = 0, size = 0, got_mean = 0, want_mean = 0;
	for (size_t i = 0; i < count; i++) {
		got_mean += got[i] / (double)count;
		want_mean += want[i] / (double)count;
	}
	for (size_t i = 0; i < count; i++) {
		double want_here = want[i] - want_mean, miss = got[i] - got_mean - want_here;
		error += miss * miss;
		size += want_here * want_here;
	}
	return sqrt(error / size);
}

#endif
