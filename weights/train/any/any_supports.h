/* Supports to train on: where on a cloud they are drawn, and how they are built with the frames the model chooses. */
#ifndef GNP_WEIGHTS_ANY_SUPPORTS_H
#define GNP_WEIGHTS_ANY_SUPPORTS_H

#include "core/base/random.h"
#include "core/base/scratch.h"
#include "core/network/network.h"
#include "weights/train/any/any_cloud.h"

/* Draws centres (count). rare: 15 % may be outliers, and of the others 35 % are within 2.5 spacings of a crease, rim or
 * tip where 20 draws find such; else all points but outliers are as likely. */
void gnp_any_supports_centres(const struct gnp_any_cloud *cloud, bool rare, size_t count, struct gnp_random *random,
                              uint32_t *centres);

/* The nearest points of centres (count), of each the GNP_LADDER_REACH nearest or all; ladders (count), in scratch. */
struct gnp_any_views {
	struct gnp_neighborhoods found;
	struct gnp_ladder *ladders;
};
gnp_status gnp_any_supports_look(const struct gnp_any_cloud *cloud, const uint32_t *centres, size_t count,
                                 struct gnp_scratch *scratch, struct gnp_any_views *views, struct gnp_error *error);

/* Appends the supports at centres (count) to supports and clouds, in scratch, each turned at random; those whose points
 * all coincide are left out. *made grows by the number of the others. */
gnp_status gnp_any_supports_build(const struct gnp_any_cloud *cloud, const struct gnp_network *network,
                                  const uint32_t *centres, size_t count, struct gnp_random *random,
                                  struct gnp_scratch *scratch, const struct gnp_support **supports,
                                  const struct gnp_any_cloud **clouds, size_t *made, struct gnp_error *error);

#endif
