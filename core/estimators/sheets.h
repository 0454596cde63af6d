/* Gives each point a normal by which the sheets of a surface are told apart. */
#ifndef GNP_CORE_SHEETS_H
#define GNP_CORE_SHEETS_H

#include "core/estimators/estimator.h"

/* An outlier's normal may be anything. Unless a third of the good points about it face as it does, it takes the normal
 * of the nearest one: it will be told of the surface below it. All others keep the cloud's. outlier (count) 0 or 1;
 * normals (count, 3) out. */
gnp_status gnp_sheets_normals(const struct gnp_fit_cloud *cloud, const unsigned char *outlier, struct gnp_pool *pool,
                             struct gnp_task *task, double *normals, struct gnp_error *error);

/* The points of a patch, by position (at most `most`), that are no outliers and face as its centre does, ascending by
 * distance; their number is returned. normals as above. */
size_t gnp_sheets_usable(const double *normals, const unsigned char *outlier, const struct gnp_patch *patch,
                         size_t most, uint32_t *positions);

#endif
