/* A unit of work: a call of an operation from its encoded body to its encoded answer, whoever asked for it. A request holds one, and
 * so does a job while it runs; neither the codecs nor the way through the operation know which. */
#ifndef GNPD_WORK_H
#define GNPD_WORK_H

#include <stdatomic.h>
#include <stdbool.h>

#include "core/base/status.h"
#include "core/base/task.h"
#include "core/model/models.h"
#include "proto/file/accept.h"
#include "proto/file/file.h"
#include "proto/operation/call.h"
#include "proto/tensor/message.h"
#include "server/work/reply.h"

struct gnpd_codec;
struct gnpd_engine;

struct gnpd_work {
	const struct gnpd_engine *engine;
	const struct gnpd_codec *codec; /* NULL: gnpd_work_check chooses by headers and body */
	const struct gnp_operation *operation;

	/* What came with it, borrowed; NULL when absent. */
	const char *query, *content_type, *content_encoding, *accept, *inference_length;
	struct gnp_buffer body;        /* as received; owned */
	size_t reserved, peak;         /* of the queue's bytes, now and at most until now */
	struct gnp_budget budget;      /* what decoding asks for bytes of them: gnpd_work_reserve, unless its owner has another way */
	bool out_of_bytes;             /* it was refused some */

	double begun;                  /* gnp_clock() from which time limits count */
	_Atomic double deadline;       /* gnp_clock(); whoever watches the work stops it after that */
	double allowed;                /* seconds until then */
	const char *limit;             /* what sets them: a key of the configuration, or "timeout" */
	const struct gnp_checkpoint *checkpoint; /* borrowed; NULL: none is kept */

	struct gnp_models *models;     /* those in use when it began; a reference */
	struct gnp_task task;
	struct gnp_buffer decoded;     /* the body without its content encoding */
	struct gnp_request message;    /* borrows from body or decoded */
	struct gnp_call call;
	struct gnp_response response;
	struct gnp_format_choice output; /* of files */
	struct gnpd_reply *reply;      /* borrowed: where the answer goes */
};

/* Of the models in use now. */
void gnpd_work_init(struct gnpd_work *work, const struct gnpd_engine *engine, struct gnpd_reply *reply);
/* Gives reserved bytes back and frees all. */
void gnpd_work_clear(struct gnpd_work *work);

/* Reserves bytes of the queue for the work, released with it. Counts a refusal. */
gnp_status gnpd_work_reserve(struct gnpd_work *work, size_t bytes, struct gnp_error *error);
void gnpd_work_release(struct gnpd_work *work, size_t bytes);

/* Sets when the time limits begin, and the deadline `seconds` later, which are those of the key `limit`; ?timeout= of a query (or NULL)
 * lowers it, so that the time a request waits counts. */
void gnpd_work_begin(struct gnpd_work *work, double seconds, const char *limit, const char *query);
/* Work that ended with GNP_DEADLINE: error becomes the sentence that names the limit. */
void gnpd_work_overdue(const struct gnpd_work *work, struct gnp_error *error);

/* Decodes the body and checks the call: all that can be known to be wrong before anything is computed. A parameter `timeout` lowers
 * the deadline. */
gnp_status gnpd_work_check(struct gnpd_work *work, struct gnp_error *error);
/* Checks, and reserves the memory the call may need. */
gnp_status gnpd_work_prepare(struct gnpd_work *work, struct gnp_error *error);
/* Computes and encodes what was prepared. */
gnp_status gnpd_work_finish(struct gnpd_work *work, struct gnp_error *error);
/* Both. */
gnp_status gnpd_work_run(struct gnpd_work *work, struct gnp_error *error);

#endif
