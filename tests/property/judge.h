/* What must be true of every answer, whatever was asked: judged without knowing how it was computed. */
#ifndef GNP_TESTS_PROPERTY_JUDGE_H
#define GNP_TESTS_PROPERTY_JUDGE_H

#include <stdbool.h>

#include "proto/operation/call.h"

enum { JUDGE_TEXT = 400 };

/* Each: true, or false and why in text. An answer that was given: its tensors are those announced, and their numbers hold together. */
bool judge_answer(const struct gnp_call *call, const struct gnp_response *response, char text[JUDGE_TEXT]);
/* An answer that was refused: by a status and a sentence that a client can act on. */
bool judge_refusal(gnp_status status, const struct gnp_error *error, char text[JUDGE_TEXT]);
/* Two answers to one request: bytes and parameters the same, but for the seconds. */
bool judge_same(const struct gnp_response *one, const struct gnp_response *other, char text[JUDGE_TEXT]);

#endif
