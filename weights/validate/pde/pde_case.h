/* A cloud with what is known of equations on it, and how near the library's answers come. */
#ifndef GNP_WEIGHTS_PDE_CASE_H
#define GNP_WEIGHTS_PDE_CASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/model/models.h"

enum { GNP_PDE_SOURCES = 3 };

/* Owned; freed by gnp_pde_case_clear. What is NULL is not known, and not judged. */
struct gnp_pde_case {
	char name[48], variant[48];
	size_t count;
	double *points, *normals; /* (count, 3) [length]; normals of the surface, all to one side */
	double *mass;             /* (count) what points weigh in means of errors [length^2] */
	double spacing;           /* of the points [length] */
	size_t open, pieces;      /* edges of rims; parts that do not touch */
	double *eigenvalue;       /* (pieces + eigenvalues) of -Delta, ascending; the first `pieces` are zero */
	size_t eigenvalues;
	double *source, *solution; /* (count) f and u of -Delta u = f without flux over rims */
	double *distance;          /* (GNP_PDE_SOURCES, count) along the surface from points at; INFINITY: no way */
	uint32_t at[GNP_PDE_SOURCES];
	double doubt;                         /* mean relative error of these distances, about */
	double *warm, rate;                   /* (count) a field that decays as exp(-rate t) [1 / length^2] */
	unsigned char *fixed;                 /* (count) 1: on the rim, where dirichlet is zero */
	double *dirichlet_source, *dirichlet; /* (count) f and u of -Delta u = f, u given where fixed */
	double *dirichlet_value;              /* (eigenvalues) of -Delta for functions that are zero where fixed */
};

/* Zeroed, with points, normals and masses for count points. GNP_OUT_OF_MEMORY. */
gnp_status gnp_pde_case_create(const char *name, const char *variant, size_t count, struct gnp_pde_case *out,
                               struct gnp_error *error);
void gnp_pde_case_clear(struct gnp_pde_case *known);

/* Relative errors; NAN: not judged, or it failed. */
struct gnp_pde_errors {
	int system;             /* enum gnp_system that solved Poisson's equation */
	size_t pieces;          /* eigenvalues that are zero */
	double median, worst;   /* of those that are not, against the case's */
	double poisson;         /* L2 of u without its mean */
	double heat;            /* L2 of the warm field after 1 / rate, in 400 steps */
	double dirichlet;       /* L2 of u */
	double dirichlet_worst; /* of the eigenvalues */
	double seconds;
};

/* Whose normals: estimated from the points, or the case's. */
enum gnp_pde_side { GNP_PDE_OWN, GNP_PDE_GIVEN, GNP_PDE_SIDES };

struct gnp_pde_judged {
	/* By system=auto and system=symmetric: the same where auto took that. */
	struct gnp_pde_errors chosen, symmetric;
	/* Mean and worst relative error at points three spacings from the source and farther; where there is a way for one
	 * alone that is an error of 1. */
	double distance, distance_worst;
	double area;                             /* of the cells over the masses' sum */
	char failure[160];                       /* of the first that failed; empty: none */
};

/* As the daemon answers by default: normals by the estimator gnp with the model for any cloud of models. Statuses are
 * GNP_OUT_OF_MEMORY and GNP_CANCELLED alone: what else fails is an error of the case. */
gnp_status gnp_pde_case_judge(const struct gnp_pde_case *known, enum gnp_pde_side side, const struct gnp_models *models,
                              struct gnp_pool *pool, struct gnp_task *task, struct gnp_pde_judged *out,
                              struct gnp_error *error);

#endif
