/* A call is a request that was checked against its operation: its options are parsed, its memory is estimated, it
 * can be run. */
#ifndef GNP_PROTO_CALL_H
#define GNP_PROTO_CALL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/checkpoint.h"
#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/model/models.h"
#include "proto/operation/operation.h"
#include "proto/operation/prepared_cache.h"
#include "proto/tensor/message.h"

/* A request checked against its operation and ready to run. Holds the parsed options; borrows the request. */
struct gnp_call {
	const struct gnp_operation *operation;
	const struct gnp_request *request;
	size_t points;
	size_t memory;  /* estimate of the bytes the work needs */
	const struct gnp_models *models; /* those loaded */
	struct gnp_prepared_cache *cache; /* where prepared operators are kept; NULL: nowhere */
	/* For work that can be taken up again; NULL: none. gnp_call_prepare leaves NULL. */
	const struct gnp_checkpoint *checkpoint;
	_Alignas(16) unsigned char options[GNP_OPTIONS_SIZE_MAX];
};

/* The options of a call: what its operation calls struct options. */
static inline const void *gnp_call_options(const struct gnp_call *call)
{
	return call->options;
}

/* What validation needs to know of where the work will be done. */
struct gnp_limits {
	size_t points;                   /* most points a request may have; 0: no limit */
	const struct gnp_models *models; /* those loaded, which must outlive the call; may be NULL: none */
	struct gnp_prepared_cache *cache; /* which must too; may be NULL: none */
};

/* Checks inputs (names, datatypes, shapes, counts against each other), requested outputs and every parameter.
 * Unknown parameter: GNP_INVALID_ARGUMENT naming it and the known ones; keys that other servers of the protocol use
 * (priority, timeout, sequence_*, triton_*, binary_data_output) are ignored. Points over the limit: GNP_TOO_LARGE. */
gnp_status gnp_call_prepare(const struct gnp_operation *operation, const struct gnp_request *request,
                            const struct gnp_limits *limits, struct gnp_call *call, struct gnp_error *error);

/* A bit for each of the operation's outputs that the call will answer. */
uint64_t gnp_call_outputs(const struct gnp_call *call);
/* Whether the request chose its outputs by name, so that an answer must go without none of them. */
bool gnp_call_names_outputs(const struct gnp_call *call);
/* Rows that an extent of the operation's outputs will stand for: the points, what inputs say of it, or what the
 * operation knows. */
size_t gnp_call_rows(const struct gnp_call *call, int64_t extent);

/* Runs it. On failure response is empty. task may be NULL. */
gnp_status gnp_call_run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_response *response, struct gnp_error *error);

#endif
