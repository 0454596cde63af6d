/* Patches to train on, with the truth at their points.
 *
 * Built as those of estimation (patch.h), in the frames that it gives them. The truth at a point is
 * that of the place on the surface it was displaced from: its coordinates and the jet of the surface's height over the
 * patch's plane, from which every quantity follows as it does from a fit's. */
#ifndef GNP_WEIGHTS_TRAIN_PATCHES_H
#define GNP_WEIGHTS_TRAIN_PATCHES_H

#include "core/base/random.h"
#include "core/base/scratch.h"
#include "core/cloud/patch.h"
#include "core/fit/jet.h"
#include "weights/train/train_cloud.h"

/* How patches are cut from a cloud. */
struct gnp_train_recipe {
	size_t k;            /* neighbours that set epsilon */
	double delta0_ratio; /* smallest height scale in units of epsilon */
	double buffer;       /* nodes out to buffer * epsilon, >= 1 */
	size_t reach;        /* nearest points that a patch holds whether they are nodes or not; 0: no more than its nodes */
};

/* Truth at one point of a patch. */
struct gnp_truth {
	double u, v;        /* scaled in-plane coordinates of the point's place on the surface */
	struct gnp_jet jet; /* height over the plane and derivatives, in length units */
};

/* Arrays live in scratch. patches[p].u, v, w hold all points of the patch, nearest first; nodes are the first of them.
 * Rows of nodes: patch p has start[p] to start[p + 1], its first inner[p] within epsilon. */
struct gnp_train_patches {
	const struct gnp_train_cloud *cloud;
	size_t count;
	struct gnp_patch *patches;
	size_t *start;  /* (count + 1) from 0 */
	size_t *inner;  /* (count) */
	float *nodes;   /* (start[count], 3) u, v, w */
	size_t *truth_start;     /* (count + 1) */
	struct gnp_truth *truth; /* (truth_start[count]) of the points within epsilon that count: neither outliers nor
	                            those where the surface is no graph over the plane. The first of a patch is its centre; a
	                            patch whose centre does not count has none */
};

/* The patches of these points of the cloud (prepared order). */
gnp_status gnp_train_patches_build(const struct gnp_train_cloud *cloud, const struct gnp_train_recipe *recipe,
                                   const uint32_t *centres, size_t count, struct gnp_scratch *scratch,
                                   struct gnp_train_patches *out, struct gnp_error *error);

/* Patches about random points that are no outliers. */
gnp_status gnp_train_patches_draw(const struct gnp_train_cloud *cloud, const struct gnp_train_recipe *recipe, size_t count,
                                  struct gnp_random *random, struct gnp_scratch *scratch, struct gnp_train_patches *out,
                                  struct gnp_error *error);

#endif
