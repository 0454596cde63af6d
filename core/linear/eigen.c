#include "core/linear/eigen.h"

#include <math.h>

/* Rotates rows and columns p and q of a so that a[p][q] vanishes, and collects the rotation in the rows of e. */
static void rotate(double a[3][3], double e[3][3], int p, int q)
{
	double off = a[p][q];
	if (off == 0)
		return;
	double theta = (a[q][q] - a[p][p]) / (2 * off);
	double t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
	double c = 1 / sqrt(t * t + 1), s = t * c;
	int r = 3 - p - q;
	double rp = a[r][p], rq = a[r][q];
	a[p][p] -= t * off;
	a[q][q] += t * off;
	a[p][q] = a[q][p] = 0;
	a[r][p] = a[p][r] = c * rp - s * rq;
	a[r][q] = a[q][r] = s * rp + c * rq;
	for (int i = 0; i < 3; i++) {
		double ep = e[p][i], eq = e[q][i];
		e[p][i] = c * ep - s * eq;
		e[q][i] = s * ep + c * eq;
	}
}

static void swap_down(double values[3], double vectors[3][3], int i, int j)
{
	if (values[i] >= values[j])
		return;
	double value = values[i];
	values[i] = values[j];
	values[j] = value;
	for (int c = 0; c < 3; c++) {
		double x = vectors[i][c];
		vectors[i][c] = vectors[j][c];
		vectors[j][c] = x;
	}
}

void gnp_eigen_symmetric3(const double upper[6], double values[3], double vectors[3][3])
{
	enum { SWEEPS = 12 };
	double a[3][3] = {{upper[0], upper[1], upper[2]}, {upper[1], upper[3], upper[4]}, {upper[2], upper[4], upper[5]}};
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			vectors[i][j] = i == j;
	double size = fabs(a[0][0]) + fabs(a[1][1]) + fabs(a[2][2]);
	for (int sweep = 0; sweep < SWEEPS; sweep++) {
		if (fabs(a[0][1]) + fabs(a[0][2]) + fabs(a[1][2]) <= 1e-17 * size)
			break;
		rotate(a, vectors, 0, 1);
		rotate(a, vectors, 0, 2);
		rotate(a, vectors, 1, 2);
	}
	for (int i = 0; i < 3; i++)
		values[i] = a[i][i];
	swap_down(values, vectors, 0, 1);
	swap_down(values, vectors, 1, 2);
	swap_down(values, vectors, 0, 1);
	vectors[2][0] = vectors[0][1] * vectors[1][2] - vectors[0][2] * vectors[1][1];
	vectors[2][1] = vectors[0][2] * vectors[1][0] - vectors[0][0] * vectors[1][2];
	vectors[2][2] = vectors[0][0] * vectors[1][1] - vectors[0][1] * vectors[1][0];
}
