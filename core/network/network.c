#include "core/network/network.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

gnp_status gnp_network_create(const struct gnp_architecture *architecture, const float *parameters,
                              struct gnp_network **out, struct gnp_error *error)
{
	struct gnp_network *network = gnp_array_zero(1, sizeof *network);
	if (!network)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "operator: no memory");
	network->architecture = *architecture;
	gnp_status status = gnp_architecture_layout(architecture, &network->layout, error);
	float *copy = status == GNP_OK ? gnp_array_new(network->layout.total, sizeof *copy) : NULL;
	if (status == GNP_OK && !copy)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY,
		                       "operator: no memory for %zu parameters", network->layout.total);
	if (status != GNP_OK) {
		gnp_network_free(network);
		return status;
	}
	memcpy(copy, parameters, network->layout.total * sizeof *copy);
	network->parameters = copy;
	*out = network;
	return GNP_OK;
}

void gnp_network_free(struct gnp_network *network)
{
	if (!network)
		return;
	free((float *)network->parameters);
	free(network);
}

const float *gnp_network_tensor(const struct gnp_network *network, const char *name)
{
	const struct gnp_parameter_row *row = gnp_layout_find(&network->layout, name);
	assert(row);
	return network->parameters + row->offset;
}
