/* Inside of a prepared equation: what poisson.c makes and poisson_solve.c solves with; nobody else includes it. */
#ifndef GNP_CORE_POISSON_PARTS_H
#define GNP_CORE_POISSON_PARTS_H

#include <stdatomic.h>

#include "core/equations/equation.h"
#include "core/equations/solver.h"

struct gnp_poisson {
	atomic_size_t references;
	struct gnp_domain domain;
	struct gnp_equation equation;
	struct gnp_solver *solver;
	struct gnp_collocation value; /* least squares: the fit's value at every point */
	struct gnp_csr outside;       /* (dropped, points) values at points the filter dropped from those at the others */
	double *response;   /* (unknowns) the solution for f = 1; NULL where nothing is free, and of least squares */
	double *weight;     /* (unknowns) of the mean */
	struct gnp_stiffness volumes; /* over all points: what energies are told by */
	struct gnp_krylov_options krylov;
	const char *why;    /* the system was chosen; NULL: it was asked for */
};

#endif
