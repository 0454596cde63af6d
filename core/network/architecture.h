/* What a geometric neural operator is made of, and the one table of its parameters.
 *
 * Trunk `edge` (the paper's, eq. neural operator layer): v_i <- sigma(v_i + mix(mean_j k(x_i, x_j) v_j)), the kernel an
 * MLP of one hidden layer on both nodes' features with values in blocks of width / channels squared. Trunk `separable`:
 * v_i <- sigma(v_i + mix(k2(x_i) mean_j k1(x_j) v_j)). Head `pooled` (the paper's): mean over the patch and an MLP to
 * Legendre coefficients. Head `projection`: the same mean, with a summary of nested least-squares fits, and an MLP to
 * how the heights are projected onto a basis (projection.h); with the trunk `none` it sees the summary alone, and all
 * sizes of a trunk are 0. Head `weighted`: the mean, the nodes' own values and a summary of the support make a weight
 * for every node and how the nodes are projected (weighted_head.h).
 *
 * All parameters are one flat block of floats. The table below says where each tensor lies in it: files, evaluation,
 * training and its checkpoints all go by it. Names are those of the reference package's state dicts. */
#ifndef GNP_CORE_ARCHITECTURE_H
#define GNP_CORE_ARCHITECTURE_H

#include <stddef.h>

#include "core/base/status.h"

enum gnp_trunk_kind { GNP_TRUNK_EDGE, GNP_TRUNK_SEPARABLE, GNP_TRUNK_NONE, GNP_TRUNKS };
enum gnp_head_kind { GNP_HEAD_POOLED, GNP_HEAD_PROJECTION, GNP_HEAD_WEIGHTED, GNP_HEADS };

enum { GNP_LAYERS_MAX = 12, GNP_QUADRATURE_MAX = 64, GNP_SHELLS_MAX = 8 };
enum { GNP_PARAMETER_ROWS_MAX = 16 * GNP_LAYERS_MAX + 24 };

struct gnp_architecture {
	enum gnp_trunk_kind trunk;
	enum gnp_head_kind head;
	unsigned features;   /* of a node, 3..16: u, v, w and more */
	unsigned width;      /* of a node's values, a multiple of channels; <= 256 */
	unsigned channels;   /* blocks of the kernel's values */
	unsigned neurons;    /* of the kernel's hidden layers, <= 1024 */
	unsigned layers;     /* 1..GNP_LAYERS_MAX */
	unsigned quadrature; /* at most so many nodes are sources of the edge trunk's integrals, 4..GNP_QUADRATURE_MAX; separable: all are */
	unsigned head_width; /* of the head's hidden layers, <= 1024 */
	unsigned outputs;    /* of the head: 16 coefficients (pooled), or what the projection takes */
	unsigned node_width;  /* weighted: of the hidden layer that weighs nodes, 4..1024; others: 0 */
	unsigned frame_width; /* weighted: of the hidden layer that chooses frames, the same */
	unsigned shells;     /* projection: nested supports, 1..GNP_SHELLS_MAX; others: 0 */
	unsigned shell[GNP_SHELLS_MAX]; /* nearest points in each, ascending */
	double ridge;        /* projection: of its first fits (projection.h), 1e-15..1 */
};

/* One tensor of the block, row-major; rank 1 or 2. */
struct gnp_parameter_row {
	char name[64];
	size_t rank, shape[2]; /* (out, in), or (out, 1) */
	size_t offset, count;
};

struct gnp_layout {
	size_t rows, total;
	struct gnp_parameter_row row[GNP_PARAMETER_ROWS_MAX];
};

/* Checks the architecture's ranges and lays its parameters out. On failure *layout is undefined. */
gnp_status gnp_architecture_layout(const struct gnp_architecture *architecture, struct gnp_layout *layout,
                                   struct gnp_error *error);

/* The row of a name; NULL when there is none. */
const struct gnp_parameter_row *gnp_layout_find(const struct gnp_layout *layout, const char *name);

/* How many numbers summarise a patch for the heads projection and weighted, and how many these are told. */
size_t gnp_projection_summary(const struct gnp_architecture *architecture);
size_t gnp_projection_outputs(const struct gnp_architecture *architecture);
/* How many nearest points its patches hold: those of the last shell, with room for some that are not to be used. */
size_t gnp_projection_reach(const struct gnp_architecture *architecture);

/* Names in metadata and on command lines. */
const char *gnp_trunk_name(enum gnp_trunk_kind kind);
const char *gnp_head_name(enum gnp_head_kind kind);

#endif
