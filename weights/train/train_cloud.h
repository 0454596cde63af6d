/* Clouds in training: a shape displaced as its regime does, ready for patches.
 *
 * Training walks through visits 0, 1, 2, ...: an epoch is a shuffle of the shapes, and every visit draws its noise
 * anew. Which shape and which noise a visit has follows from the seed and its number alone, so a position in training
 * is a number. */
#ifndef GNP_WEIGHTS_TRAIN_CLOUD_H
#define GNP_WEIGHTS_TRAIN_CLOUD_H

#include "core/cloud/prepare.h"
#include "weights/protocol/protocol.h"
#include "weights/train/train_shape.h"

/* Owned; freed by gnp_train_cloud_clear. */
struct gnp_train_cloud {
	struct gnp_train_shape shape;
	struct gnp_prepared prepared; /* of the displaced points; order[i] is the shape's index of its point i */
	unsigned char *outlier;       /* (count) in prepared order */
	/* Root mean squares over the surface: of II (Frobenius), K and H. */
	double typical_form, typical_gaussian, typical_mean;
};

/* Displaces the shape as the regime does, but with noise of this standard deviation and seed, and prepares it. Takes the shape, in
 * any case. */
gnp_status gnp_train_cloud_enter_take(struct gnp_train_shape *shape, enum gnp_regime regime, double noise, uint64_t noise_seed,
                                      struct gnp_pool *pool, struct gnp_train_cloud *out, struct gnp_error *error);
void gnp_train_cloud_clear(struct gnp_train_cloud *cloud);

/* What training draws from. */
struct gnp_train_data {
	const char *folder; /* of the shapes' files */
	size_t shapes, points;
	enum gnp_regime regime;
	/* Every other visit has noise of a standard deviation between these, drawn evenly in its logarithm, instead of the regime's, so
	 * that a model meets more than the one level; 0: none has. */
	double least_noise, most_noise;
	uint64_t seed; /* of the order of visits and of their noise; shape i has the seed i and the degree of its turn */
};

/* Samples what the folder lacks: the shapes of training and, `watch` of them, those it is watched by. The task counts shapes. */
gnp_status gnp_train_data_ensure(const struct gnp_train_data *data, size_t watch, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_error *error);

/* The shape and the noise of a visit. */
struct gnp_train_visit {
	struct gnp_train_shape_key key;
	double noise;
	uint64_t noise_seed;
};
gnp_status gnp_train_data_visit(const struct gnp_train_data *data, uint64_t visit, struct gnp_train_visit *out,
                                struct gnp_error *error);

/* The i-th of the clouds that training is watched by: seeds from GNP_SEED_WATCH on, always with the same noise. */
gnp_status gnp_train_data_watch(const struct gnp_train_data *data, size_t i, struct gnp_pool *pool, struct gnp_train_cloud *out,
                                struct gnp_error *error);

/* The cloud of a visit. */
gnp_status gnp_train_data_enter(const struct gnp_train_data *data, uint64_t visit, struct gnp_pool *pool,
                                struct gnp_train_cloud *out, struct gnp_error *error);

#endif
