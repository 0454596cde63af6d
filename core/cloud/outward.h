/* Decides which of its two consistent orientations makes a surface's normals point outward. */
#ifndef GNP_CORE_OUTWARD_H
#define GNP_CORE_OUTWARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Of the surface made of the listed members (count of them, indices into points and normals; normals consistent, unit):
 * true when the normals are to be negated. radius[i]: a length whose square is proportional to the area point i stands
 * for; 0 leaves the point out (when it is 0 for all members, all count the same).
 *
 * Two witnesses, each in [-1, 1], are added: the flux of x - centroid through the surface over its largest possible
 * value, whose sign is that of the enclosed volume; and the mean of n . d over the points farthest in fourteen
 * directions d, where the outward normal of a closed surface is d. An open surface with a hollow side gets the normals
 * that look away from its centroid (a dome's outside, by the same flux). Where the witnesses say nothing (sum within
 * 0.05 of zero: planes, saddles) the largest component of the mean normal is made positive. O(count), no memory. */
bool gnp_outward_flips(const double *points, const double *normals, const double *radius, const uint32_t *members,
                       size_t count);

#endif
