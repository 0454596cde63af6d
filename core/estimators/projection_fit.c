#include "core/estimators/projection_fit.h"

/* Every patch has the same number of nodes, all of them inner. */
static gnp_status lay_out(const struct gnp_architecture *architecture, size_t count, struct gnp_projected *out,
                          struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t *start = gnp_scratch_take(scratch, count + 1, sizeof *start), *inner = gnp_scratch_take(scratch, count, sizeof *inner);
	*out = (struct gnp_projected){
		.patches = count, .sums = gnp_scratch_take(scratch, count, sizeof *out->sums),
		.fits = gnp_scratch_take(scratch, count, sizeof *out->fits),
		.summary = gnp_scratch_take(scratch, count, gnp_projection_summary(architecture) * sizeof(float)),
		.nodes = gnp_scratch_take(scratch, count * GNP_PROJECTION_NODES, architecture->features * sizeof(float)),
		.outputs = gnp_scratch_take(scratch, count, gnp_projection_outputs(architecture) * sizeof(float))};
	if (!start || !inner || !out->sums || !out->fits || !out->summary || !out->nodes || !out->outputs)
		return gnp_no_memory("projection", count, "patches", error);
	for (size_t p = 0; p < count; p++) {
		start[p] = p * GNP_PROJECTION_NODES;
		inner[p] = GNP_PROJECTION_NODES;
	}
	start[count] = count * GNP_PROJECTION_NODES;
	out->batch = (struct gnp_network_batch){count, start, inner, out->nodes};
	return GNP_OK;
}

gnp_status gnp_projected_describe(const struct gnp_architecture *architecture, const struct gnp_patch *patches,
                                  size_t count, gnp_usable_fn usable, const void *context, struct gnp_projected *out,
                                  struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t most = architecture->shell[architecture->shells - 1], summary = gnp_projection_summary(architecture);
	struct gnp_projection_work work;
	gnp_status status = lay_out(architecture, count, out, scratch, error);
	if (status != GNP_OK)
		return status;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	uint32_t *positions = gnp_scratch_take(scratch, most, sizeof *positions);
	if (!positions || !gnp_projection_work_take(architecture, &work, scratch))
		return gnp_no_memory("projection", count, "patches", error);
	for (size_t p = 0; p < count; p++) {
		size_t points = usable(context, &patches[p], most, positions);
		gnp_projection_gather(architecture, &patches[p], positions, points, &work, &out->sums[p]);
		gnp_projection_describe(architecture, patches[p].k, &out->sums[p], &work, out->summary + p * summary,
		                        out->nodes + p * GNP_PROJECTION_NODES * architecture->features);
	}
	gnp_scratch_release(scratch, mark);
	return GNP_OK;
}

gnp_status gnp_projected_solve(const struct gnp_network *network, bool tape, struct gnp_projected *projected,
                               struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t outputs = gnp_projection_outputs(&network->architecture);
	float *mean = gnp_scratch_take(scratch, projected->patches, network->architecture.width * sizeof *mean);
	if (!mean)
		return gnp_no_memory("projection", projected->patches, "patches", error);
	gnp_status status = gnp_trunk_forward(network, &projected->batch, mean, tape ? &projected->trunk : NULL, scratch, error);
	if (status == GNP_OK)
		status = gnp_projection_head_forward(network, projected->patches, mean, projected->summary, projected->outputs,
		                                     &projected->head, scratch, error);
	for (size_t p = 0; p < projected->patches && status == GNP_OK; p++)
		gnp_projection_solve(&projected->sums[p], projected->outputs + p * outputs, &projected->fits[p]);
	return status;
}

gnp_status gnp_projected_backward(const struct gnp_network *network, const struct gnp_projected *projected,
                                  const double *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                                  struct gnp_error *error)
{
	size_t outputs = gnp_projection_outputs(&network->architecture), count = projected->patches;
	float *doutputs = gnp_scratch_take(scratch, count, outputs * sizeof *doutputs);
	float *dmean = gnp_scratch_take(scratch, count, network->architecture.width * sizeof *dmean);
	if (!doutputs || !dmean)
		return gnp_no_memory("projection", count, "patches", error);
	for (size_t p = 0; p < count; p++)
		gnp_projection_solve_backward(&projected->sums[p], projected->outputs + p * outputs, &projected->fits[p],
		                              dcoefficients + p * GNP_TAYLOR_SIZE, doutputs + p * outputs);
	gnp_status status = gnp_projection_head_backward(network, &projected->head, doutputs, gradient, dmean, scratch, error);
	return status == GNP_OK ? gnp_trunk_backward(network, projected->trunk, dmean, NULL, gradient, scratch, error)
	                        : status;
}
