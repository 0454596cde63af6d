/* Simulated scans for the real table: rows of points over open surfaces, and a spinning lidar in a room with boxes. */
#ifndef GNP_WEIGHTS_REAL_SCAN_H
#define GNP_WEIGHTS_REAL_SCAN_H

#include "weights/validate/real_cloud.h"

/* Rows along x over z = height sin(2 pi x / 200) cos(2 pi y / 300): 400 points a row one unit apart, rows `ratio` units
 * apart over the same length, each row shifted at random. noise: deviation on every coordinate, in units. The truth
 * points up. */
struct gnp_real_rows {
	double ratio, height, noise;
	uint64_t seed;
};
gnp_status gnp_real_scan_rows(const struct gnp_real_rows *rows, struct gnp_real_cloud *out, struct gnp_error *error);

/* 32 beams from -25 to 15 degrees, a shot every 0.4 degrees, from 1.2 m over the floor of a room of 10 x 8 x 3 m with
 * four boxes; noise: deviation along the beam [m]. The truth faces the scanner. */
struct gnp_real_lidar {
	double noise;
	uint64_t seed;
};
gnp_status gnp_real_scan_lidar(const struct gnp_real_lidar *lidar, struct gnp_real_cloud *out, struct gnp_error *error);

#endif
