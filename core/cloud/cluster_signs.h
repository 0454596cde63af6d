/* The signs of clusters of points that make the winding number of their surface come nearest to 1/2 at its own points,
 * while clusters that touch agree as their edges say: simulated annealing (Kirkpatrick, Gelatt & Vecchi
 * 1983), with blocks of clusters that flip together (Swendsen & Wang 1987). */
#ifndef GNP_CORE_CLUSTER_SIGNS_H
#define GNP_CORE_CLUSTER_SIGNS_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/base/task.h"

/* Borrowed. With signs s the cost is the mean over rows of (sum_c s_c shares[c, row] - 1/2)^2, its energy, and weight
 * times the trust of links whose ends do not agree as they should. */
struct gnp_cluster_signs {
	size_t clusters, rows;
	const float *shares;      /* (clusters, rows) of the winding number at points of the surface */
	const size_t *link_start; /* (clusters + 1) the links of a cluster; each is listed at both its ends */
	const uint32_t *link_to;
	const double *link_trust; /* negative: the two should differ in sign */
	double weight;
};

/* sign (clusters), +1 or -1: where to begin, and the best found. Deterministic. About 600 (clusters rows) steps; 8
 * bytes a row and 17 a cluster. GNP_OUT_OF_MEMORY, or the task's reason to stop; the signs are undefined then. */
gnp_status gnp_cluster_signs_find(const struct gnp_cluster_signs *problem, struct gnp_task *task, signed char *sign,
                                  struct gnp_error *error);

/* The energy of signs. */
double gnp_cluster_signs_energy(const struct gnp_cluster_signs *problem, const signed char *sign);

#endif
