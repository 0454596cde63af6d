/* What equations are given besides the cloud: values at fixed points, flux at open edges, sources at single points.
 * The inputs of heat and poisson that say so, and the way to the core's right-hand sides. */
#ifndef GNP_PROTO_OPERATION_CONDITIONS_H
#define GNP_PROTO_OPERATION_CONDITIONS_H

#include "proto/equation/operation_equation.h"

#define GNP_CONDITIONS_INPUTS                                                                                          \
	{"fixed", GNP_BOOL, 1, {-1}, true, "1 where u is given (Dirichlet points)"},                                       \
	{"values", GNP_FP64, 2, {-1, -2}, true, "u there, a column each; elsewhere not read; 0 when absent"},              \
	{"flux", GNP_FP64, 2, {-1, -2}, true,                                                                              \
	 "at open edges the derivative of u along their outward normal (Neumann), a column each; elsewhere not read; 0 "   \
	 "when absent"},                                                                                                   \
	{"source_points", GNP_INT64, 1, {-3}, true, "indices of points that a source is in, besides the input source"},    \
	{"source_strengths", GNP_FP64, 2, {-3, -2}, true,                                                                  \
	 "the integral of the source in each of them, a column each; 1 when absent"}

/* Owned; freed by gnp_conditions_clear. */
struct gnp_conditions {
	size_t points, sides;
	double *source;          /* (points, sides) */
	unsigned char *fixed;    /* (points) or NULL */
	double *values;          /* (points, sides), NULL where nothing is fixed */
	double *flux;            /* (points, sides) or NULL */
	size_t source_count;
	uint32_t *source_points; /* (source_count) */
	double *strengths;       /* (source_count, sides) */
};

/* Columns of the call: those of the first input there is of `first`, source, source_strengths, values and flux; 1 where
 * there is none. */
size_t gnp_conditions_sides(const struct gnp_call *call, const char *first);
/* That all of these have as many columns, and that each has what it belongs to. */
gnp_status gnp_conditions_check(const struct gnp_call *call, const char *first, struct gnp_error *error);

/* On failure *out may be cleared. source: zeros where it is absent. */
gnp_status gnp_conditions_read(const struct gnp_call *call, size_t points, size_t sides, struct gnp_conditions *out,
                               struct gnp_error *error);
void gnp_conditions_clear(struct gnp_conditions *conditions);
/* Adds flux and sources at points to the source; once. */
gnp_status gnp_conditions_load(struct gnp_conditions *conditions, const struct gnp_poisson *poisson,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error);

#endif
