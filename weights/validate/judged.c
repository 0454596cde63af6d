#include "weights/validate/judged.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/model.h"

static bool is_weighted(const struct gnp_estimate_options *options)
{
	return options->estimator == GNP_ESTIMATOR_GNP &&
	       (!options->model || options->model->architecture.head == GNP_HEAD_WEIGHTED);
}

/* Rows of the whole, in place of its values. */
static gnp_status choose(struct gnp_estimate *estimate, const uint32_t *at, size_t count, struct gnp_error *error)
{
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		size_t width = gnp_estimate_width((enum gnp_quantity)q, estimate->basis_size);
		if (!estimate->values[q])
			continue;
		double *rows = gnp_array_new(count, width * sizeof *rows);
		if (!rows)
			return gnp_no_memory("validate", count, "rows", error);
		for (size_t i = 0; i < count; i++)
			memcpy(rows + i * width, estimate->values[q] + at[i] * width, width * sizeof *rows);
		free(estimate->values[q]);
		estimate->values[q] = rows;
	}
	estimate->count = count;
	return GNP_OK;
}

gnp_status gnp_judged_at(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, const uint32_t *at,
                         size_t count, struct gnp_pool *pool, struct gnp_estimate *out, struct gnp_error *error)
{
	struct gnp_estimate whole;
	if (!is_weighted(options))
		return gnp_estimate_at(cloud, options, at, count, pool, NULL, out, error);
	gnp_status status = gnp_estimate_run(cloud, options, pool, NULL, &whole, error);
	if (status != GNP_OK)
		return status;
	status = choose(&whole, at, count, error);
	if (status == GNP_OK)
		*out = whole;
	else
		gnp_estimate_clear(&whole);
	return status;
}
