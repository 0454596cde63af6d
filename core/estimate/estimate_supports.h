/* The inner loop of estimation by a weighted model: fits pieces about points and writes what their surfaces are at
 * the points that each can be trusted for, until every point is served.
 *
 * Which patch serves which point follows from the fits: a piece serves the points near its centre, as far as all of
 * them lie on its surface; at creases and outliers it serves itself alone. Blocks of fixed length along the curve
 * are served on their own, so the result does not depend on the pool. */
#ifndef GNP_CORE_ESTIMATE_SUPPORTS_H
#define GNP_CORE_ESTIMATE_SUPPORTS_H

#include "core/estimate/estimate_patches.h"

/* The points begin .. end - 1, in curve order, of a struct gnp_estimate_work: a whole block of GNP_ESTIMATE_BLOCK
 * but for the last; or, of chosen points, the patches begin .. end - 1 of the cover. On failure the rows written are
 * undefined. */
enum { GNP_ESTIMATE_BLOCK = 1024 };
gnp_status gnp_estimate_supports(void *work, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error);

#endif
