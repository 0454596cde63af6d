/* The same request over HTTP: the daemon's answer is held against the one that was computed here. */
#ifndef GNP_TESTS_PROPERTY_ASK_H
#define GNP_TESTS_PROPERTY_ASK_H

#include "proto/operation/call.h"
#include "tests/property/judge.h"
#include "tests/property/spec.h"

struct ask {
	const char *url;
	const struct spec *spec;
	const struct gnp_call *call;       /* operation NULL: it was refused before there was a call */
	const struct gnp_request *request;
	gnp_status status;                 /* of the answer here, its error, and what was answered */
	const struct gnp_error *error;
	const struct gnp_response *response;
};

/* By the words `via` and `format`. True, or false and why. */
bool ask_daemon(const struct ask *ask, char why[JUDGE_TEXT]);
void ask_close(void);

#endif
