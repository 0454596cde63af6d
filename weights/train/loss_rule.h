/* Reads and writes the rule of the loss as text: "height=1,normal=0.5,floor=0.1"; the names are the terms', floor,
 * focus, most and power. */
#ifndef GNP_WEIGHTS_LOSS_RULE_H
#define GNP_WEIGHTS_LOSS_RULE_H

#include "weights/train/loss.h"

/* Sets what the text names and keeps the rest. GNP_INVALID_ARGUMENT naming the word, what for stands before it in messages. */
gnp_status gnp_loss_rule_parse(const char *text, const char *what, struct gnp_loss_rule *rule, struct gnp_error *error);

/* All of a rule but the terms left out, and what has no limit. */
void gnp_loss_rule_print(const struct gnp_loss_rule *rule, char *text, size_t size);

#endif
