#include "core/cloud/farthest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

enum { LEAF = 8, CHOICES_A_CHECK = 1024 };

/* A binary tree over runs of consecutive points: node i has children 2 i and 2 i + 1, leaves start at `leaves`. */
struct node {
	double low[3], high[3]; /* box of its points; low > high when it has none */
	double farthest;        /* largest squared distance of its points from those chosen; < 0 when none may be chosen */
};

struct tree {
	const double *points;
	size_t count, leaves;
	struct node *node; /* (2 leaves) */
	double *square;    /* (count) squared distance from the chosen ones */
};

static void take_in(struct node *node, const struct node *child)
{
	for (int c = 0; c < 3; c++) {
		node->low[c] = fmin(node->low[c], child->low[c]);
		node->high[c] = fmax(node->high[c], child->high[c]);
	}
	node->farthest = fmax(node->farthest, child->farthest);
}

static void build(struct tree *tree)
{
	static const struct node none = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, -1};
	for (size_t leaf = 0; leaf < tree->leaves; leaf++) {
		struct node *node = &tree->node[tree->leaves + leaf];
		*node = none;
		for (size_t i = leaf * LEAF; i < (leaf + 1) * LEAF && i < tree->count; i++) {
			struct node point = {.farthest = tree->square[i]};
			memcpy(point.low, tree->points + 3 * i, sizeof point.low);
			memcpy(point.high, tree->points + 3 * i, sizeof point.high);
			take_in(node, &point);
		}
	}
	for (size_t i = tree->leaves - 1; i > 0; i--) {
		tree->node[i] = none;
		take_in(&tree->node[i], &tree->node[2 * i]);
		take_in(&tree->node[i], &tree->node[2 * i + 1]);
	}
}

static size_t find_farthest(const struct tree *tree)
{
	size_t at = 1;
	while (at < tree->leaves)
		at = 2 * at + (tree->node[2 * at].farthest < tree->node[at].farthest);
	size_t i = (at - tree->leaves) * LEAF;
	while (tree->square[i] != tree->node[at].farthest)
		i++;
	return i;
}

static double box_distance(const struct node *node, const double p[3])
{
	double sum = 0;
	for (int c = 0; c < 3; c++) {
		double d = fmax(fmax(node->low[c] - p[c], p[c] - node->high[c]), 0);
		sum += d * d;
	}
	return sum;
}

static void update_leaf(struct tree *tree, size_t at, const double p[3])
{
	double farthest = -1;
	for (size_t i = (at - tree->leaves) * LEAF; i < (at - tree->leaves + 1) * LEAF && i < tree->count; i++) {
		const double *q = tree->points + 3 * i;
		double x = q[0] - p[0], y = q[1] - p[1], z = q[2] - p[2];
		tree->square[i] = fmin(tree->square[i], x * x + y * y + z * z);
		farthest = fmax(farthest, tree->square[i]);
	}
	tree->node[at].farthest = farthest;
}

/* Only what is farther from the chosen than from p can change. */
static void update(struct tree *tree, size_t at, const double p[3])
{
	struct node *node = &tree->node[at];
	if (node->farthest <= 0 || box_distance(node, p) >= node->farthest)
		return;
	if (at >= tree->leaves) {
		update_leaf(tree, at, p);
		return;
	}
	update(tree, 2 * at, p);
	update(tree, 2 * at + 1, p);
	node->farthest = fmax(tree->node[2 * at].farthest, tree->node[2 * at + 1].farthest);
}

/* Squared distances from the mean, to begin with; -1 for those never chosen. */
static void begin(struct tree *tree, const unsigned char *excluded)
{
	double mean[3] = {0};
	for (size_t i = 0; i < 3 * tree->count; i++)
		mean[i % 3] += tree->points[i] / (double)tree->count;
	for (size_t i = 0; i < tree->count; i++) {
		const double *p = tree->points + 3 * i;
		double x = p[0] - mean[0], y = p[1] - mean[1], z = p[2] - mean[2];
		tree->square[i] = excluded && excluded[i] ? -1 : x * x + y * y + z * z;
	}
	build(tree);
}

static gnp_status choose(struct tree *tree, const unsigned char *excluded, size_t wanted, struct gnp_task *task,
                         unsigned char *chosen, struct gnp_error *error)
{
	for (size_t k = 0; k < wanted && tree->node[1].farthest > 0; k++) {
		size_t i = find_farthest(tree);
		chosen[i] = 1;
		if (k == 0) { /* from here on distances are from chosen points */
			for (size_t j = 0; j < tree->count; j++)
				tree->square[j] = excluded && excluded[j] ? -1 : INFINITY;
			build(tree);
		}
		update(tree, 1, tree->points + 3 * i);
		gnp_status status = k % CHOICES_A_CHECK ? GNP_OK : gnp_task_check(task, error);
		if (status != GNP_OK)
			return status;
	}
	return GNP_OK;
}

gnp_status gnp_farthest_choose(const double *points, size_t count, const unsigned char *excluded, size_t wanted,
                               struct gnp_task *task, unsigned char *chosen, struct gnp_error *error)
{
	struct tree tree = {.points = points, .count = count, .leaves = 1};
	while (tree.leaves * LEAF < count)
		tree.leaves *= 2;
	memset(chosen, 0, count);
	tree.node = gnp_array_new(2 * tree.leaves, sizeof *tree.node);
	tree.square = gnp_array_new(count, sizeof *tree.square);
	gnp_status status = GNP_OK;
	if (!tree.node || !tree.square)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "drop: no memory to choose among %zu points", count);
	if (status == GNP_OK && wanted > 0) {
		begin(&tree, excluded);
		status = choose(&tree, excluded, wanted, task, chosen, error);
	}
	free(tree.node);
	free(tree.square);
	return status;
}
