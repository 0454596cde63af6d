/* Lets a decoder ask for memory before it takes any, so that what a body can become counts against the limits of
 * whoever decodes it. */
#ifndef GNP_PROTO_BUDGET_H
#define GNP_PROTO_BUDGET_H

#include <stddef.h>

#include "core/base/status.h"

struct gnp_budget {
	/* Bytes that are about to be taken; what it answers when they are not to be had, the decoder answers. */
	gnp_status (*reserve)(void *context, size_t bytes, struct gnp_error *error);
	/* Bytes that were reserved and are free again. A decoder that fails may leave some to its caller, who knows what it reserved. */
	void (*release)(void *context, size_t bytes);
	void *context;
};

/* budget: NULL where there is no limit. */
gnp_status gnp_budget_reserve(const struct gnp_budget *budget, size_t bytes, struct gnp_error *error);
void gnp_budget_release(const struct gnp_budget *budget, size_t bytes);

#endif
