/* The operation table: inputs, outputs and parameters of every operation, with types, defaults, ranges and one-line help.
 *
 * /v2 metadata and validation, /v1 query strings, command-line flags, help texts and openapi.yaml all come from it. */
#ifndef GNP_PROTO_OPERATION_H
#define GNP_PROTO_OPERATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/checkpoint.h"
#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/model/models.h"
#include "proto/operation/prepared_cache.h"
#include "proto/tensor/message.h"
#include "proto/tensor/tensor.h"

enum gnp_parameter_type {
	GNP_PARAMETER_INTEGER,
	GNP_PARAMETER_NUMBER,
	GNP_PARAMETER_AUTO,    /* a number or "auto", which is stored as NAN */
	GNP_PARAMETER_BOOL,
	GNP_PARAMETER_CHOICE,  /* one of choices; stored as its index */
	GNP_PARAMETER_SET,     /* comma-separated names of outputs, or "all"; stored as a bit mask */
	GNP_PARAMETER_MODEL    /* the name of a model, or "auto"; stored as char[GNP_MODEL_NAME_MAX + 1] */
};

/* The least of what must be positive; texts show it as ">0". */
#define GNP_ABOVE_ZERO 1e-300

struct gnp_parameter {
	const char *name;
	enum gnp_parameter_type type;
	size_t offset;              /* of the int, double, bool, uint64_t or text in the operation's options struct */
	const char *default_text;   /* as a user would write it; equals what `defaults` sets (a test checks) */
	double minimum, maximum;    /* of integers and numbers, inclusive; GNP_ABOVE_ZERO for what must be positive */
	const char *const *choices; /* NULL-terminated, of GNP_PARAMETER_CHOICE */
	const char *help;
};

#define GNP_OPTIONS_SIZE_MAX 384

struct gnp_call;

/* Rows of which it is known only once they are computed how many there are, or only that they are not as many as the points. */
#define GNP_ROWS_OPEN SIZE_MAX
#define GNP_ROWS_OTHER (SIZE_MAX - 1)

struct gnp_operation {
	const char *name, *help;
	const struct gnp_tensor_info *inputs;
	size_t input_count;
	const struct gnp_tensor_info *outputs; /* FP32: of the type of `points`; any other type is meant as it is */
	size_t output_count;
	const struct gnp_parameter *parameters;
	size_t parameter_count;
	void (*defaults)(void *options);
	/* Finds the models that options name among those loaded (NULL: none); NULL for an operation that uses none. */
	gnp_status (*resolve)(void *options, const struct gnp_models *models, struct gnp_error *error);
	/* Checks what depends on numbers alone (how many points, columns, options against each other), before anything is computed, and
	 * settles options that follow from them; NULL: there is nothing of the kind. */
	gnp_status (*check)(struct gnp_call *call, struct gnp_error *error);
	/* Bytes the work may allocate, for admission control; of a call that was checked. */
	size_t (*memory)(const struct gnp_call *call);
	/* Rows that a free extent (-2, -3, ...) of the outputs will stand for, GNP_ROWS_OPEN or GNP_ROWS_OTHER; NULL: all are open but those
	 * of inputs. */
	size_t (*rows)(const struct gnp_call *call, int64_t extent);
	/* Does the work; response is empty on entry, cleared by the caller in any case. */
	gnp_status (*run)(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task, struct gnp_response *response,
	                  struct gnp_error *error);
};

enum { GNP_OPERATIONS = 8 };
/* The i-th operation, or NULL past the last; by name, or NULL. */
const struct gnp_operation *gnp_operation_at(size_t i);
const struct gnp_operation *gnp_operation_find(const char *name);

/* A request checked against its operation and ready to run. Holds the parsed options; borrows the request. */
struct gnp_call {
	const struct gnp_operation *operation;
	const struct gnp_request *request;
	size_t points;
	size_t memory;  /* estimate of the bytes the work needs */
	const struct gnp_models *models; /* those loaded */
	struct gnp_prepared_cache *cache; /* where prepared operators are kept; NULL: nowhere */
	const struct gnp_checkpoint *checkpoint; /* for work that can be taken up again; NULL: none. gnp_call_prepare leaves NULL */
	_Alignas(16) unsigned char options[GNP_OPTIONS_SIZE_MAX];
};

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
/* Rows that an extent of the operation's outputs will stand for: the points, what inputs say of it, or what the operation knows. */
size_t gnp_call_rows(const struct gnp_call *call, int64_t extent);

/* Runs it. On failure response is empty. task may be NULL. */
gnp_status gnp_call_run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_response *response, struct gnp_error *error);

/* Sets one field of an options struct from text, as query strings and command lines give it. */
gnp_status gnp_parameter_parse(const struct gnp_operation *operation, void *options, const char *name,
                               const char *text, struct gnp_error *error);

/* Whether a parameter is a number with a range, and that range as texts show it: "12..500", ">0..1e100". */
bool gnp_parameter_is_number(const struct gnp_parameter *parameter);
#define GNP_PARAMETER_RANGE_MAX 80
void gnp_parameter_range(const struct gnp_parameter *parameter, char text[GNP_PARAMETER_RANGE_MAX]);

/* Help of one operation's parameters as flag lines, and the OpenAPI document of all, appended to buffer. */
gnp_status gnp_operation_usage(const struct gnp_operation *operation, struct gnp_buffer *buffer, struct gnp_error *error);
gnp_status gnp_openapi_write(struct gnp_buffer *buffer, struct gnp_error *error);

#endif
