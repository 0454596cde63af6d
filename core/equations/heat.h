/* Solves the heat equation on a cloud, u_t = Delta u + source, by implicit steps that are stable for any dt.
 *
 * backward_euler: (1 / dt - Delta) u' = u / dt + source, first order. On the symmetric operator u never leaves the range
 * that it and the source span. tr_bdf2: half of a trapezoidal step and a backward differentiation (Bank et al. 1985),
 * second order and L-stable, two solutions of one factor a step; it may overshoot where a step is long for what u has of
 * short waves.
 *
 * Where u is fixed it keeps the values that come with it; open edges of the symmetric operator let no heat through. */
#ifndef GNP_CORE_HEAT_H
#define GNP_CORE_HEAT_H

#include "core/equations/poisson.h"

enum gnp_heat_scheme { GNP_HEAT_BACKWARD_EULER, GNP_HEAT_TR_BDF2 };

struct gnp_heat_options {
	double dt;             /* > 0 [length^2] */
	size_t steps;
	int scheme;            /* enum gnp_heat_scheme */
	size_t snapshot_every; /* steps; 0: no snapshots. The start and the end are among them */
};

/* What a Poisson object for such steps has as its screening: NAN where dt or the scheme is none. */
double gnp_heat_screening(double dt, int scheme);
/* Snapshots that so many steps leave. */
size_t gnp_heat_snapshots(size_t steps, size_t every);

/* A Poisson object of that screening; all steps use its factor. As gnp_poisson_prepare. */
gnp_status gnp_heat_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                            const struct gnp_heat_options *heat, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_poisson **out, struct gnp_error *error);

/* What flows, and what becomes of it. Points that coincide have the mean of what is said of them. */
struct gnp_heat_field {
	size_t count;         /* columns */
	double *u;            /* (n, count) at the start, in place at the end */
	const double *source; /* (n, count) heat added in unit time; NULL: none */
	const double *values; /* (n, count) read where u is fixed; NULL when nothing is */
	double *snapshots;    /* (gnp_heat_snapshots, n, count) out; NULL without */
	double *times;        /* (gnp_heat_snapshots) out */
};

/* On failure all that is written is undefined: GNP_NO_CONVERGENCE where u grows beyond all numbers. The task is warned
 * of heat that is not to be believed (heat_check.h). */
gnp_status gnp_heat_run(const struct gnp_poisson *poisson, const struct gnp_heat_options *options,
                        const struct gnp_heat_field *field, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_error *error);

#endif
