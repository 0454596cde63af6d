/* Which points are outliers, by the pieces of surface fitted about them (weighted_fit.h).
 *
 * A piece votes on the 32 nearest points round its centre: off the surface is who deviates from it by more than 2.8 of
 * the piece's own deviations, corrected for its leverage. An outlier bends the surface at itself but not those of
 * its neighbours, so the majority of these knows better than its own. Near a crease the points beyond it are off a
 * piece, too, but together: a point is not voted on where most of its own nearest are off as well, nor by pieces at
 * creases. */
#ifndef GNP_CORE_VOTES_H
#define GNP_CORE_VOTES_H

#include <stdbool.h>
#include <stddef.h>

#include "core/support/weighted_members.h"

/* Of a cloud's points, 4 bytes each: workers may cast at once, and the sums do not depend on who was first. */
struct gnp_votes;

/* NULL when memory is short; gnp_votes_free releases it. */
struct gnp_votes *gnp_votes_create(size_t count);
void gnp_votes_free(struct gnp_votes *votes);

/* Casts a piece's votes. points: of the cloud. */
void gnp_votes_cast(struct gnp_votes *votes, const struct gnp_weighted_near *near, const double *points);

/* Whether most of the pieces about a point (3 at least) found it off their surfaces. */
bool gnp_votes_outlier(const struct gnp_votes *votes, size_t point);

#endif
