#include "core/cloud/winding.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"

static const double pi = 3.14159265358979323846;
/* A cluster is one dipole from so many times its reach. */
static const double far = 2;
/* Distances are blurred by so many spacings. */
static const double blur = 1;

static void between(const double *a, const double *b, double d[3])
{
	for (int c = 0; c < 3; c++)
		d[c] = b[c] - a[c];
}

/* Where a point is from the first member. */
static void place(const struct gnp_winding *winding, size_t point, double at[3])
{
	const double *p = winding->points + 3 * point, *origin = winding->points + 3 * (size_t)winding->members[0];
	for (int c = 0; c < 3; c++)
		at[c] = (p[c] - origin[c]) / winding->unit;
}

static void fill_dipole(const struct gnp_winding *winding, size_t point, struct gnp_winding_dipole *dipole)
{
	double r = winding->radius[point] / winding->unit, area = pi * r * r / winding->neighbors;
	place(winding, point, dipole->at);
	for (int c = 0; c < 3; c++)
		dipole->moment[c] = area * winding->normals[3 * point + c] / (4 * pi);
	dipole->square = fmax(blur * blur * area, 1e-60);
}

static void sum_cluster(const struct gnp_winding *winding, size_t c)
{
	size_t begin = winding->start[c], end = winding->start[c + 1];
	struct gnp_winding_dipole *sum = winding->sums + c;
	double total = 0;
	for (size_t m = begin; m < end; m++) {
		const struct gnp_winding_dipole *dipole = winding->dipoles + m;
		total += dipole->square; /* as the area */
		for (int i = 0; i < 3; i++) {
			sum->at[i] += dipole->square * dipole->at[i];
			sum->moment[i] += dipole->moment[i];
		}
	}
	for (int i = 0; i < 3; i++)
		sum->at[i] /= total;
	for (size_t m = begin; m < end; m++) {
		double d[3];
		between(sum->at, winding->dipoles[m].at, d);
		sum->square = fmax(sum->square, gnp_dot(d, d));
	}
}

gnp_status gnp_winding_init(struct gnp_winding *winding, struct gnp_error *error)
{
	size_t clusters = winding->clusters, count = winding->start[clusters];
	winding->sums = gnp_array_zero(clusters, sizeof *winding->sums);
	winding->dipoles = gnp_array_new(count, sizeof *winding->dipoles);
	if (!winding->sums || !winding->dipoles)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "winding number: no memory for %zu points", count);
	winding->unit = 0;
	for (size_t m = 0; m < count; m++)
		winding->unit = fmax(winding->unit, winding->radius[winding->members[m]]);
	if (winding->unit == 0)
		winding->unit = 1;
	for (size_t m = 0; m < count; m++)
		fill_dipole(winding, winding->members[m], winding->dipoles + m);
	for (size_t c = 0; c < clusters; c++)
		sum_cluster(winding, c);
	return GNP_OK;
}

void gnp_winding_clear(struct gnp_winding *winding)
{
	free(winding->sums);
	free(winding->dipoles);
	winding->sums = winding->dipoles = NULL;
}

void gnp_winding_at(const struct gnp_winding *winding, uint32_t point, float *shares, size_t stride)
{
	double from[3], d[3];
	place(winding, point, from);
	for (size_t c = 0; c < winding->clusters; c++) {
		const struct gnp_winding_dipole *one = winding->sums + c, *end = one + 1;
		between(from, one->at, d);
		double raised = 0, sum = 0;
		if (gnp_dot(d, d) <= far * far * one->square + 1) {
			one = winding->dipoles + winding->start[c];
			end = winding->dipoles + winding->start[c + 1];
			raised = 1;
		}
		for (; one < end; one++) {
			between(from, one->at, d);
			double r = gnp_dot(d, d) + raised * one->square;
			sum += gnp_dot(d, one->moment) / (r * sqrt(r));
		}
		shares[c * stride] = (float)sum;
	}
}
