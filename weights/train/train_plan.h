/* The command line of gnp-train: its options, and the training they ask for. */
#ifndef GNP_WEIGHTS_TRAIN_PLAN_H
#define GNP_WEIGHTS_TRAIN_PLAN_H

#include "clients/options.h"
#include "core/network/architecture.h"
#include "weights/train/train_run.h"

struct gnp_train_plan {
	struct gnp_train_run_options run;
	struct gnp_architecture architecture;
	const char *output;   /* the model to write; NULL: only shapes are prepared */
	const char *from;     /* the model to begin with; NULL: with parameters that are drawn */
	bool prepare;
	uint64_t workers;
	char folder[64];      /* room for what run.folder says by default */
};

extern const struct gnp_option gnp_train_plan_options[];
size_t gnp_train_plan_option_count(void);

/* What is not given follows from the regime and the head. Texts are the arguments', or the plan's, which is not
 * copied. */
gnp_status gnp_train_plan_parse(const struct gnp_arguments *arguments, struct gnp_train_plan *plan,
                                struct gnp_error *error);

/* Whether a file of this name (NULL: none is given) can be made: what is found out after hours of training is found out
 * late. */
gnp_status gnp_train_plan_check_output(const char *path, struct gnp_error *error);

#endif
