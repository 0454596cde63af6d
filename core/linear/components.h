/* The parts of a linear system that stand alone: sets of unknowns whose equations mention no others.
 *
 * In the graph with an edge from i to every unknown of row i these are the strongly connected components that no
 * edge leaves (Tarjan 1972). A system of derivatives has one free constant for each; all other unknowns follow
 * from them. */
#ifndef GNP_CORE_COMPONENTS_H
#define GNP_CORE_COMPONENTS_H

#include "core/linear/csr.h"

#define GNP_COMPONENT_NONE UINT32_MAX

/* Freed by gnp_components_clear. */
struct gnp_components {
	size_t unknowns;
	size_t count;      /* of sets that stand alone */
	uint32_t *label;   /* (unknowns) its set's number, ascending with the set's first unknown; GNP_COMPONENT_NONE for
	                    * those that follow */
	uint32_t *anchor;  /* (count) the first unknown of each */
	size_t *size;      /* (count) */
	size_t following;  /* unknowns in none of them */
};

/* matrix (n, n); values are not read. given (n): 1 for unknowns that are given, which count as none and mention no
 * others; NULL: none is. O(n + entries); 45 bytes an unknown, of which 16 stay. */
gnp_status gnp_components_find(const struct gnp_csr *matrix, const unsigned char *given, struct gnp_components *out,
                               struct gnp_error *error);
void gnp_components_clear(struct gnp_components *components);

#endif
