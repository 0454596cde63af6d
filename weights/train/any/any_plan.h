/* The command line of gnp-train --regime any: which of its options mean something, and the training they ask for. */
#ifndef GNP_WEIGHTS_ANY_PLAN_H
#define GNP_WEIGHTS_ANY_PLAN_H

#include "clients/options.h"
#include "weights/train/any/any_run.h"

struct gnp_any_plan {
	struct gnp_any_run_options run;
	const char *output;
	uint64_t workers;
};

/* Whether the arguments ask for the model for every cloud. */
bool gnp_any_plan_asked(const struct gnp_arguments *arguments);

/* By the table of train_plan.h; those of its options that are for patches are refused. Texts are the arguments'. */
gnp_status gnp_any_plan_parse(const struct gnp_arguments *arguments, struct gnp_any_plan *plan,
                              struct gnp_error *error);

/* Refuses options that --regime any alone takes. */
gnp_status gnp_any_plan_refuse(const struct gnp_arguments *arguments, struct gnp_error *error);

#endif
