/* The head `weighted`: from the trunk's values at the nodes of a support to a weight for every node and to how they are
 * projected onto a surface (weighted_projection.h).
 *
 * A context c of the support comes from the mean of the trunk's values and the support's summary by two hidden layers;
 * outputs are linear in it. The logit of node i is w . relu(A [v_i, x_i] + B c + b), v_i its values going into the
 * trunk's last layer and x_i its features: whether a node is of the centre's smooth piece follows from what the kernel
 * integrals found about it and from what the support as a whole is like. */
#ifndef GNP_CORE_WEIGHTED_HEAD_H
#define GNP_CORE_WEIGHTED_HEAD_H

#include "core/base/scratch.h"
#include "core/network/network.h"
#include "core/network/trunk.h"
#include "core/support/weighted_projection.h"

/* What a forward pass gives, with what backward needs of it; the arrays lie in scratch. */
struct gnp_weighted_pass {
	size_t count, rows;
	size_t *start, *inner;            /* (count + 1), (count): rows of each support's nodes */
	float *outputs;                   /* (count, GNP_WEIGHTED_OUTPUTS) */
	float *logits;                    /* (rows) */
	struct gnp_weighted_fit *fits;    /* (count) */
	float *nodes;                     /* (rows, features) */
	float *inputs, *hidden[2];        /* (count, width + summary), (count, head_width) */
	float *context;                   /* (count, node_width) */
	float *node_inputs, *node_hidden; /* (rows, width + features), (rows, node_width) */
	const struct gnp_trunk_tape *trunk; /* NULL: there is no way back */
};

/* Fits all supports (count >= 1, pointers). GNP_OUT_OF_MEMORY. */
gnp_status gnp_weighted_forward(const struct gnp_network *network, const struct gnp_support *const *supports,
                                size_t count, struct gnp_weighted_pass *pass, struct gnp_scratch *scratch,
                                struct gnp_error *error);

/* The same fits, outputs and logits without what only backward needs: for answers. */
gnp_status gnp_weighted_infer(const struct gnp_network *network, const struct gnp_support *const *supports,
                              size_t count, struct gnp_weighted_pass *pass, struct gnp_scratch *scratch,
                              struct gnp_error *error);

/* Adds d loss / d parameters to gradient (the layout's total), given d loss / d coefficients (count, GNP_TAYLOR_SIZE),
 * of shares (rows), and of outputs (count, GNP_WEIGHTED_OUTPUTS), where those of penalties and reach are overwritten by
 * what follows from the coefficients. Outputs of errors (scales and biases) teach their own weights alone, not the
 * context. GNP_OUT_OF_MEMORY. */
gnp_status gnp_weighted_backward(const struct gnp_network *network, const struct gnp_support *const *supports,
                                 const struct gnp_weighted_pass *pass, const double *dcoefficients,
                                 const double *dshares, float *doutputs, float *gradient, struct gnp_scratch *scratch,
                                 struct gnp_error *error);

#endif
