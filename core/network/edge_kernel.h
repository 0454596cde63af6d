/* What the integrals over the edges of a patch share: a layer's kernel, a patch of a batch laid open for it, the part
 * of the kernel's bias. trunk_edge.c and trunk_edge_first.c alone include it. Memory is the pass's scratch; false or
 * NULL: it is exhausted. */
#ifndef GNP_CORE_EDGE_KERNEL_H
#define GNP_CORE_EDGE_KERNEL_H

#include "core/network/trunk_parts.h"

/* A layer's kernel: h_ij = max(H [x_j, x_i] + b, 0), and the blocks on top. */
struct gnp_edge_kernel {
	struct gnp_linear_place hidden, top;
	struct gnp_blocks blocks;
	const float *source, *target, *bias; /* (n, 2 features) from the sources' and the targets' columns on; (n) */
};

struct gnp_edge_kernel gnp_edge_kernel_of(const struct gnp_network *network, unsigned layer);

/* One patch of a batch, and its part of the hidden activations, h_ij = max(a_i + b_j, 0). */
struct gnp_edge_patch {
	size_t targets, sources, row; /* row: the patch's first */
	const float *x;               /* (targets, terms), the sources first */
	float *a, *b;                 /* (targets, n), (sources, n) */
	float *da, *db;               /* the same, zero at first; NULL in a forward pass */
};

float *gnp_edge_kernel_take(const struct gnp_trunk_pass *pass, size_t rows, size_t columns);

/* Its rows and nodes; a and b are not set. */
struct gnp_edge_patch gnp_edge_kernel_patch(const struct gnp_trunk_tape *tape, size_t patch);

/* The same with a and b, and in a backward pass da and db. */
bool gnp_edge_kernel_open(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel, size_t patch,
                          struct gnp_edge_patch *view);

/* From da and db to the hidden layer's parameters. */
void gnp_edge_kernel_close_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                                    const struct gnp_edge_patch *view);

/* y (sources, columns) = x / sources for the patch's first rows of x. */
void gnp_edge_kernel_scaled(const struct gnp_edge_patch *view, const float *x, size_t columns, float *y);

/* The sum of y's rows goes through the kernel's bias to every target. */
void gnp_edge_kernel_bias(const struct gnp_edge_kernel *kernel, size_t sources, const float *y, float *ysum, float *z);

/* Back from dz, summed over targets: dy of every source, and the bias. */
void gnp_edge_kernel_bias_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                                   size_t sources, const float *ysum, const float *dzsum, float *dysum, float *dy);

#endif
