/* What trunk.c shares with the two kinds of integrals, trunk_edge and trunk_separable; nobody else includes it. */
#ifndef GNP_CORE_TRUNK_PARTS_H
#define GNP_CORE_TRUNK_PARTS_H

#include "core/network/blocks.h"
#include "core/network/trunk.h"

/* What one layer leaves for its backward pass; those of its kind are set. n: neurons. */
struct gnp_trunk_kept {
	float *z;         /* (rows, width) the integral; of the last layer (patches, width) its mean */
	float *moments;   /* edge: (rows, terms, n) of the first layer, (patches, width, n) of the last; separable: (patches, width, n) */
	float *pooled;    /* separable: (patches, width) mean_j K1(x_j) v_j */
	float *spread;    /* separable: (patches, width, n) pooled K2 as a linear form of hidden activations */
	float *hidden[4]; /* separable: (rows, n) of the two layers of K1 and the two of K2 */
	float *average;   /* separable, last layer: (patches, n) of hidden[3] */
};

/* A batch laid out anew: the rows of patch p are first[p] .. first[p + 1] - 1, its sources and then the other inner
 * nodes. */
struct gnp_trunk_tape {
	size_t patches, rows, terms; /* terms = features + 1 */
	size_t *first;               /* (patches + 1) */
	size_t *sources;             /* (patches) */
	float *x;                    /* (rows, terms): the features and a 1 */
	float *share;                /* (rows) 1 / inner for inner nodes, 0 for others */
	float *values[GNP_LAYERS_MAX]; /* (rows, width) what goes into each layer */
	float *mean;                 /* (patches, width) of what comes out of the last */
	struct gnp_trunk_kept kept[GNP_LAYERS_MAX];
};

/* One pass over a tape; gradient is NULL in the forward one. */
struct gnp_trunk_pass {
	const struct gnp_network *network;
	struct gnp_trunk_tape *tape;
	float *gradient;
	struct gnp_scratch *scratch;
};

/* Where a linear layer lies in the block of parameters, by name: the pattern's '#' stands for the number of the
 * layer. */
struct gnp_linear_place {
	size_t weight, bias;
};
struct gnp_linear_place gnp_trunk_place(const struct gnp_network *network, const char *pattern, unsigned layer);
struct gnp_blocks gnp_trunk_blocks(const struct gnp_network *network, struct gnp_linear_place place);

/* The integrals of a layer that is not the last: kept.z out, and back: dz (rows, width) -> dvalues (rows, width) += .
 * false: memory is exhausted. */
typedef bool (*gnp_integral_fn)(const struct gnp_trunk_pass *pass, unsigned layer);
typedef bool (*gnp_integral_backward_fn)(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz,
                                         float *dvalues);
bool gnp_edge_integral(const struct gnp_trunk_pass *pass, unsigned layer);
bool gnp_edge_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz, float *dvalues);
bool gnp_separable_integral(const struct gnp_trunk_pass *pass, unsigned layer);
bool gnp_separable_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz,
                                     float *dvalues);
/* The mean over inner nodes of the last layer's: kept.z and dz are (patches, width). */
bool gnp_edge_mean_integral(const struct gnp_trunk_pass *pass, unsigned layer);
bool gnp_edge_mean_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz,
                                     float *dvalues);
bool gnp_separable_mean_integral(const struct gnp_trunk_pass *pass, unsigned layer);
bool gnp_separable_mean_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz,
                                          float *dvalues);

#endif
