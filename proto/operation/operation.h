/* What one operation is: its inputs, outputs and parameters, with types, ranges and one-line help, and its
 * functions.
 *
 * /v2 metadata and validation, /v1 query strings, command-line flags, help texts and the OpenAPI document all come
 * from this description. Each operation is defined in a file of its own, operation_NAME.c; operations.c holds the
 * table of all. */
#ifndef GNP_PROTO_OPERATION_H
#define GNP_PROTO_OPERATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/model/models.h"
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

/* The default is what the operation's `defaults` sets: it is written nowhere else (gnp_parameter_default). */
struct gnp_parameter {
	const char *name;
	enum gnp_parameter_type type;
	size_t offset;              /* of the int, double, bool, uint64_t or text in the operation's options struct */
	double minimum, maximum;    /* of integers and numbers, inclusive; GNP_ABOVE_ZERO for what must be positive */
	/* NULL-terminated, of GNP_PARAMETER_CHOICE; of GNP_PARAMETER_SET: outputs that lists name first, or NULL. */
	const char *const *choices;
	const char *help;
};

/* Most bytes of an operation's options struct: what a call has room for. */
#define GNP_OPTIONS_SIZE_MAX 384

struct gnp_call; /* call.h */

/* Rows of which it is known only once they are computed how many there are, or only that they are not as many as the
 * points. */
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
	/* Checks what depends on numbers alone (how many points, columns, options against each other), before anything
	 * is computed, and settles options that follow from them; NULL: there is nothing of the kind. */
	gnp_status (*check)(struct gnp_call *call, struct gnp_error *error);
	/* Bytes the work may allocate, for admission control; of a call that was checked. */
	size_t (*memory)(const struct gnp_call *call);
	/* Rows that a free extent (-2, -3, ...) of the outputs will stand for, GNP_ROWS_OPEN or GNP_ROWS_OTHER; NULL:
	 * all are open but those of inputs. */
	size_t (*rows)(const struct gnp_call *call, int64_t extent);
	/* Does the work; response is empty on entry, cleared by the caller in any case. */
	gnp_status (*run)(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
	                  struct gnp_response *response, struct gnp_error *error);
};

/* Defines gnp_operation_NAME at the end of operation_NAME.c, of what that file calls struct options, inputs,
 * outputs, parameters, defaults, check, memory and run. What follows the help are members that not all operations
 * have: .resolve, .rows. */
#define GNP_OPERATION(id, sentence, ...)                                                                 \
	_Static_assert(sizeof(struct options) <= GNP_OPTIONS_SIZE_MAX, "options fit a call");                \
	const struct gnp_operation gnp_operation_##id = {                                                    \
		.name = #id, .help = sentence,                                                                   \
		.inputs = inputs, .input_count = sizeof inputs / sizeof inputs[0],                               \
		.outputs = outputs, .output_count = sizeof outputs / sizeof outputs[0],                          \
		.parameters = parameters, .parameter_count = sizeof parameters / sizeof parameters[0],           \
		.defaults = defaults, .check = check, .memory = memory, .run = run, __VA_ARGS__}

#endif
