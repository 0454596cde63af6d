/* A cloud to train the model for every cloud on: a surface with noise, outliers and maybe normals, ready for supports,
 * with the truth at its points. */
#ifndef GNP_WEIGHTS_ANY_CLOUD_H
#define GNP_WEIGHTS_ANY_CLOUD_H

#include "core/cloud/prepare.h"
#include "core/support/support.h"
#include "weights/train/any/any_surface.h"

/* What is asked of a cloud; negative: drawn. */
struct gnp_any_recipe {
	enum gnp_any_group group;
	size_t least, most;  /* points, drawn evenly in the logarithm */
	double noise;        /* standard deviation [spacing]. Drawn: 30 % none, 35 % of 0.003 to 0.5, 35 % of 0.5 to 5 */
	double normal_noise; /* share of noisy clouds, 0..1, whose noise is along the normals, not isotropic */
	double outliers;     /* share of points. Drawn: in a third of the clouds up to 0.3, half of these without noise; off by 0.03 to
	                        20 spacings, as standard deviation, drawn evenly in the logarithm for a cloud */
	double given;        /* share of clouds, 0..1, that come with normals, exact or tilted by up to 0.2 */
};

/* 3,000 to 30,000 points of mixed surfaces, a fifth with normals, two fifths of the noise along them; the rest drawn. */
struct gnp_any_recipe gnp_any_recipe_defaults(void);

/* What a point is: displaced as an outlier it may still be as near to the surface as noise takes others, or 0.02 spacings; that it
 * is neither. */
enum gnp_any_outlier { GNP_ANY_GOOD, GNP_ANY_OUTLIER, GNP_ANY_UNSURE };

/* Owned; freed by gnp_any_cloud_clear. Arrays are in curve order. */
struct gnp_any_cloud {
	char name[48];
	size_t count;
	double noise;                  /* standard deviation [spacing] */
	bool given;                    /* it came with normals */
	bool faceted;                  /* as of the surface */
	double *normals, *second_form; /* (count, 3), (count, 3, 3) exact, where the point came from */
	uint32_t *piece;               /* (count) */
	double *edge;                  /* (count) [spacing] */
	unsigned char *outlier;        /* (count) enum gnp_any_outlier */
	struct gnp_prepared prepared;  /* as an estimator gets it: of displaced points, normals given or estimated */
	struct gnp_roughness roughness;
};

/* Follows from recipe, seed and stream alone. On failure *out is unchanged. */
gnp_status gnp_any_cloud_create(const struct gnp_any_recipe *recipe, uint64_t seed, uint64_t stream,
                                struct gnp_pool *pool, struct gnp_any_cloud *out, struct gnp_error *error);
void gnp_any_cloud_clear(struct gnp_any_cloud *cloud);

/* As supports are built from it; borrows. */
struct gnp_support_cloud gnp_any_cloud_source(const struct gnp_any_cloud *cloud);

#endif
