/* The loss, which training minimises: how far the geometry of a fitted patch is from the truth (the paper's eqs. loss
 * and relative_loss).
 *
 * With h a fit's height, its slopes and Hessian at the points' true places, and weights w that sum to 1, the terms are
 *   height, inverse metric, second form, Gaussian, mean:  sqrt(sum w |f - f*|^2) / (sqrt(sum w |f*|^2 + (floor t)^2) + tiny),
 *   normal: sum w (1 - n . n*),  angle: sqrt(sum w |n - n*|^2) / t,
 * f the fit's and f* the true quantity (tensors by Frobenius), t what is typical of the quantity on the patch or the surface.
 * The paper's loss is that of five of them over the points of the patch, with equal weights and no floor (it divides by the
 * fit's norm; ours is by the truth's, which a fit cannot make large). The centre is judged by the same terms at one point,
 * where a floor keeps a curvature near zero from outweighing all others. */
#ifndef GNP_WEIGHTS_LOSS_H
#define GNP_WEIGHTS_LOSS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fit/jet.h"
#include "weights/train/train_patches.h"

#define GNP_LOSS_TABLE(X)                              \
	X(GNP_LOSS_HEIGHT, "height")                       \
	X(GNP_LOSS_NORMAL, "normal")                       \
	X(GNP_LOSS_INVERSE_METRIC, "inverse_metric")       \
	X(GNP_LOSS_SECOND_FORM, "second_form")             \
	X(GNP_LOSS_GAUSSIAN, "gaussian_curvature")         \
	X(GNP_LOSS_MEAN, "mean_curvature")                 \
	X(GNP_LOSS_ANGLE, "angle")

enum gnp_loss_term {
#define GNP_LOSS_ENUM(id, name) id,
	GNP_LOSS_TABLE(GNP_LOSS_ENUM)
#undef GNP_LOSS_ENUM
	GNP_LOSS_TERMS
};
const char *gnp_loss_name(enum gnp_loss_term term);

/* One judgement: of all points of a patch or of its centre. */
struct gnp_loss_rule {
	double lambda[GNP_LOSS_TERMS]; /* factors of the terms, 0 for those left out */
	double floor;                  /* share of the typical size that denominators have at least */
	double focus;                  /* weights exp(-r^2 / (2 focus^2)) by the scaled distance r from the centre; 0: equal ones */
	double most;                   /* terms of curvature count up to this, and pull no more beyond; > 0 */
	double power; /* of terms of many patches together: they count by term^power / power, 0 by their logarithm */
};

/* Whether it has any term. */
bool gnp_loss_rule_asks(const struct gnp_loss_rule *rule);

struct gnp_loss_options {
	struct gnp_loss_rule patch, centre;
	/* Of the centres of a micro-batch together, and of further points of its patches together: sums of the logarithms
	 * of the terms, so that a smooth shape and a rough one count alike, or of a power of them. */
	struct gnp_loss_rule cell, near;
	size_t points; /* of each patch that `near` is of, evenly from near to far; 1: one of the k/3 nearest */
};

/* The paper's loss over the patch with every lambda 0.5, and |H - H*| / (|H*| + typical) at the centre, terms up to 5. */
struct gnp_loss_options gnp_loss_defaults(void);

/* What is typical of each term's quantity; 0 where there is no such thing. */
struct gnp_loss_scale {
	double typical[GNP_LOSS_TERMS];
};
struct gnp_loss_scale gnp_loss_scale_of(const struct gnp_train_cloud *cloud, const struct gnp_patch *patch);

/* The terms of the judgements, before their factors and logarithms; 0 of those that ask for nothing. */
struct gnp_loss_terms {
	double patch[GNP_LOSS_TERMS], centre[GNP_LOSS_TERMS], cell[GNP_LOSS_TERMS], near[GNP_LOSS_TERMS];
};

/* Weighted sums of squares, of differences and of the truth, of each term's quantity; that of angle is |n - n*|^2, whose truth
 * counts as 0, and normal has none. */
struct gnp_loss_sums {
	double error[GNP_LOSS_TERMS], size[GNP_LOSS_TERMS];
};
void gnp_loss_add(struct gnp_loss_sums *sums, double weight, const struct gnp_jet *jet, const struct gnp_jet *truth);

/* sum lambda log(term), or lambda term^power / power, over count points together, of patches of one cloud; the terms
 * and gradient (count) are set. count >= 1. */
double gnp_loss_cell(const struct gnp_loss_rule *rule, const struct gnp_loss_scale *scale, const struct gnp_truth *const *truth,
                     const struct gnp_jet *jets, size_t count, double values[GNP_LOSS_TERMS], struct gnp_jet *gradient);

/* The loss of one patch: jets (count) the fit's at the places of truth (count), in length units, the first its centre;
 * count >= 1. gradient (count): d loss / d jet, or NULL. terms may be NULL. */
double gnp_loss_patch(const struct gnp_loss_options *options, const struct gnp_loss_scale *scale, const struct gnp_truth *truth,
                      const struct gnp_jet *jets, size_t count, struct gnp_loss_terms *terms, struct gnp_jet *gradient);

#endif
