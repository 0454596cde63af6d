/* Goes through the meshes of a folder that deploy/fetch-meshes.sh filled, by the list that it wrote: lines "NAME
 * judge" or "NAME tune" of meshes.txt. */
#ifndef GNP_WEIGHTS_REAL_LIST_H
#define GNP_WEIGHTS_REAL_LIST_H

#include <stdbool.h>

#include "weights/validate/real_mesh.h"

struct gnp_real_list {
	const char *folder; /* NULL is an error */
	const char *only;   /* names, with commas; NULL: all */
	bool tune;          /* those for decisions in training instead of those that judge */
};

/* What is done with a mesh, which it borrows. */
typedef gnp_status (*gnp_real_list_fn)(void *context, const char *name, const struct gnp_real_mesh *mesh,
                                       struct gnp_error *error);

/* Ends with the first that fails. GNP_INVALID_ARGUMENT: none is wanted. */
gnp_status gnp_real_list_visit(const struct gnp_real_list *list, gnp_real_list_fn visit, void *context,
                               struct gnp_error *error);

#endif
