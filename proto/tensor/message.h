/* A request and a response, independent of the codec that carries them. */
#ifndef GNP_PROTO_MESSAGE_H
#define GNP_PROTO_MESSAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "proto/tensor/buffer.h"
#include "proto/tensor/tensor.h"

enum gnp_value_type { GNP_VALUE_BOOL, GNP_VALUE_INTEGER, GNP_VALUE_NUMBER, GNP_VALUE_STRING };

/* A named parameter as it came (query strings give GNP_VALUE_STRING; the operation's table converts). */
struct gnp_value {
	char *name;
	enum gnp_value_type type;
	bool boolean;
	int64_t integer;
	double number;
	char *string;
};

struct gnp_values {
	size_t count, capacity;
	struct gnp_value *items;
};
gnp_status gnp_values_add_string(struct gnp_values *values, const char *name, const char *string,
                                 struct gnp_error *error);
gnp_status gnp_values_add_integer(struct gnp_values *values, const char *name, int64_t integer,
                                  struct gnp_error *error);
gnp_status gnp_values_add_number(struct gnp_values *values, const char *name, double number, struct gnp_error *error);
gnp_status gnp_values_add_bool(struct gnp_values *values, const char *name, bool boolean, struct gnp_error *error);
const struct gnp_value *gnp_values_find(const struct gnp_values *values, const char *name);
void gnp_values_clear(struct gnp_values *values);

/* An output a client asked for by name. */
struct gnp_output_choice {
	char name[GNP_TENSOR_NAME_MAX];
	bool binary; /* bytes after the JSON rather than a JSON array */
};

struct gnp_request {
	char *id;                         /* NULL when none was given */
	struct gnp_values parameters;     /* the operation's and the ignored foreign ones */
	struct gnp_tensors inputs;
	size_t output_count;              /* 0: the operation's default outputs */
	struct gnp_output_choice *outputs;
	bool binary_default;              /* default for outputs that do not say */
};
void gnp_request_clear(struct gnp_request *request);

struct gnp_response {
	struct gnp_tensors outputs;
	struct gnp_values parameters;  /* what was done: estimator, k, weights' sha256, stage seconds, warnings */
};
void gnp_response_clear(struct gnp_response *response);

#endif
