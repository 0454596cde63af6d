/* The validation protocol: on which shapes, clouds, regimes and centres estimators are judged. */
#ifndef GNP_WEIGHTS_PROTOCOL_H
#define GNP_WEIGHTS_PROTOCOL_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/shapes/shapes.h"

/* Seeds are split once and for all: those of validation are [2^52, 2^53), those that training is watched by, [2^51, 2^52),
 * and those of training lie below. All are exact in the numbers of JSON. */
#define GNP_SEED_VALIDATION (UINT64_C(1) << 52)
#define GNP_SEED_WATCH (UINT64_C(1) << 51)
/* Those of the real table, a part of validation's that its shapes do not use: [this, this + 2^40). */
#define GNP_SEED_REAL (GNP_SEED_VALIDATION + (UINT64_C(1) << 50))

bool gnp_seed_is_validation(uint64_t seed);
bool gnp_seed_is_watch(uint64_t seed);
/* GNP_INVALID_ARGUMENT unless the seed may be trained on. */
gnp_status gnp_seed_check_training(uint64_t seed, struct gnp_error *error);

enum gnp_family { GNP_FAMILY_RADIAL, GNP_FAMILY_TOROIDAL, GNP_FAMILIES };
enum gnp_regime { GNP_REGIME_CLEAN_30, GNP_REGIME_CLEAN_50, GNP_REGIME_OUTLIER_50, GNP_REGIME_NOISE_70, GNP_REGIMES };

struct gnp_regime_info {
	const char *name, *help;
	const char *weights; /* what the names of models trained for it have in common */
	int k;
	double noise; /* standard deviation on every point */
	double outlier_fraction, outlier_noise;
};

/* The paper's degrees L of the radial family, in turn. */
enum { GNP_RADIAL_DEGREES = 8 };
unsigned gnp_radial_degree(size_t i);

/* NULL past the last. */
const char *gnp_family_name(enum gnp_family family);
const struct gnp_regime_info *gnp_regime_info(enum gnp_regime regime);

/* Sizes. Defaults: the full protocol; quick: what two cores do in two minutes. */
struct gnp_protocol {
	size_t points;  /* of a cloud */
	size_t shapes;  /* of each family */
	size_t centres; /* of a cloud */
};
struct gnp_protocol gnp_protocol_full(void);
struct gnp_protocol gnp_protocol_quick(void);

/* A shape under judgement with its cloud; cleared by gnp_subject_clear. */
struct gnp_subject {
	enum gnp_family family;
	uint64_t seed;     /* of the shape, its sampling, its noise and its centres */
	unsigned degree;   /* L of the radial family, else 0 */
	double sharpness;  /* largest |principal curvature| times epsilon at k = 30 */
	struct gnp_sample sample;
	size_t centre_count;
	uint32_t *centres; /* (centre_count) set by gnp_subject_enter */
};

/* How far a family has been drawn; starts as zeros but for the family. */
struct gnp_draws {
	enum gnp_family family;
	size_t drawn, accepted;
};

/* The next shape of the family with its clean cloud. Radial members come in the order L = 3, 6, 8, 10, 12, 15, 18, 22 and
 * again. A toroidal draw is accepted when it is resolved: sharpness at most 1, that is, no curvature radius is below
 * epsilon = 1.1 r_30 with r_30 = sqrt(30 A / (pi N)); the others are skipped.
 * GNP_INVALID_ARGUMENT when the points resolve none of 40 draws in a row. On failure *subject is unchanged. */
gnp_status gnp_subject_draw(const struct gnp_protocol *protocol, struct gnp_draws *draws, struct gnp_pool *pool,
                            struct gnp_subject *subject, struct gnp_error *error);

/* Displaces the cloud as the regime does and chooses the centres, none of them an outlier. */
gnp_status gnp_subject_enter(struct gnp_subject *subject, enum gnp_regime regime, struct gnp_error *error);

void gnp_subject_clear(struct gnp_subject *subject);

#endif
