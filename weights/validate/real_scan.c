#include "weights/validate/real_scan.h"

#include <math.h>

#include "core/base/random.h"

enum { ALONG = 400, BEAMS = 32, SHOTS = 900, BOXES = 5 };
static const double LOWEST = -25, HIGHEST = 15; /* beams [degrees] */

static void set_wave(double height, double x, double y, double point[3], double normal[3])
{
	double a = 2 * M_PI / 200, b = 2 * M_PI / 300;
	double slope[2] = {height * a * cos(a * x) * cos(b * y), -height * b * sin(a * x) * sin(b * y)};
	double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
	point[0] = x;
	point[1] = y;
	point[2] = height * sin(a * x) * cos(b * y);
	normal[0] = -slope[0] / length;
	normal[1] = -slope[1] / length;
	normal[2] = 1 / length;
}

gnp_status gnp_real_scan_rows(const struct gnp_real_rows *rows, struct gnp_real_cloud *out, struct gnp_error *error)
{
	size_t lines = (size_t)(ALONG / rows->ratio);
	struct gnp_random random;
	gnp_random_seed(&random, rows->seed, 0);
	gnp_status status = gnp_real_cloud_create(lines * ALONG, out, error);
	for (size_t line = 0; line < lines && status == GNP_OK; line++) {
		double shift = gnp_random_uniform(&random) - 0.5;
		for (size_t i = 0; i < ALONG; i++) {
			size_t at = 3 * (line * ALONG + i);
			set_wave(rows->height, (double)i + shift, (double)line * rows->ratio, out->points + at, out->normals + at);
			for (int c = 0; c < 3; c++)
				out->points[at + c] += rows->noise * gnp_random_normal(&random);
		}
	}
	return status;
}

/* ---- Lidar ---- */

/* The room, which is seen from inside, and what stands in it [m from the scanner]. */
static const struct box {
	double low[3], high[3];
} boxes[BOXES] = {
	{{-5, -4, -1.2}, {5, 4, 1.8}},     {{1.5, -2, -1.2}, {2.7, -0.8, -0.2}}, {{-3.2, 1, -1.2}, {-2, 2.5, 0.4}},
	{{0.5, 2.2, -1.2}, {2, 2.8, 1.8}}, {{-4, -3.5, -1.2}, {-2.5, -2, -0.5}},
};

/* Where the ray from the origin enters the box, or leaves it when it begins inside; INFINITY when it misses. */
static double hit_box(const struct box *box, const double ray[3], int *axis)
{
	double enter = -INFINITY, leave = INFINITY;
	int entered = 0, left = 0;
	for (int c = 0; c < 3; c++) {
		double a = box->low[c] / ray[c], b = box->high[c] / ray[c]; /* the origin lies in no plane of a box */
		if (fmin(a, b) > enter) {
			enter = fmin(a, b);
			entered = c;
		}
		if (fmax(a, b) < leave) {
			leave = fmax(a, b);
			left = c;
		}
	}
	*axis = enter > 0 ? entered : left;
	return enter > leave || leave < 0 ? INFINITY : enter > 0 ? enter : leave;
}

gnp_status gnp_real_scan_lidar(const struct gnp_real_lidar *lidar, struct gnp_real_cloud *out, struct gnp_error *error)
{
	struct gnp_random random;
	gnp_random_seed(&random, lidar->seed, 0);
	gnp_status status = gnp_real_cloud_create((size_t)BEAMS * SHOTS, out, error);
	for (size_t i = 0; i < (size_t)BEAMS * SHOTS && status == GNP_OK; i++) {
		double up = (LOWEST + (HIGHEST - LOWEST) * (double)(i % BEAMS) / (BEAMS - 1)) * M_PI / 180;
		double round = 2 * M_PI * ((double)(i / BEAMS) + 0.5) / SHOTS, range = INFINITY;
		const double ray[3] = {cos(up) * cos(round), cos(up) * sin(round), sin(up)};
		int facing = 0;
		for (int b = 0; b < BOXES; b++) {
			int axis;
			double distance = hit_box(&boxes[b], ray, &axis);
			facing = distance < range ? axis : facing;
			range = fmin(range, distance);
		}
		range += lidar->noise * gnp_random_normal(&random);
		for (int c = 0; c < 3; c++) {
			out->points[3 * i + c] = range * ray[c];
			out->normals[3 * i + c] = c != facing ? 0 : ray[c] > 0 ? -1 : 1;
		}
	}
	return status;
}
