/* gnp-train: trains a geometric neural operator for one of the paper's regimes and writes its weights. */
#include <stdio.h>
#include <stdlib.h>

#include "clients/program.h"
#include "clients/session.h"
#include "core/base/memory.h"
#include "weights/train/train_model.h"
#include "weights/train/train_network.h"

static gnp_status train_and_write(const struct gnp_train_plan *plan, const struct gnp_trainable *network,
                                  struct gnp_session *session, struct gnp_error *error)
{
	struct gnp_train_row last;
	float *parameters = gnp_array_new(network->parameter_count, sizeof *parameters);
	if (!parameters)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gnp-train: no memory for %zu parameters", network->parameter_count);
	fprintf(stderr, "%s: %zu parameters\n", network->name, network->parameter_count);
	gnp_status status = gnp_train_run(&plan->run, network, session->pool, &session->task, stderr, parameters, &last, error);
	if (status == GNP_OK)
		status = gnp_train_model_write(plan, parameters, &last, error);
	free(parameters);
	return status;
}

static gnp_status run_in(const struct gnp_train_plan *plan, struct gnp_session *session, struct gnp_error *error)
{
	struct gnp_trainable network;
	atomic_store(&session->progress.phase, "shapes");
	if (plan->prepare)
		return gnp_train_data_ensure(&plan->run.train.data, plan->run.watch_shapes, session->pool, &session->task, error);
	gnp_status status = gnp_train_network_open(&plan->architecture, plan->from, &network, error);
	if (status != GNP_OK)
		return status;
	status = train_and_write(plan, &network, session, error);
	gnp_train_network_close(&network);
	return status;
}

static enum gnp_exit train(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_train_plan plan;
	struct gnp_session session;
	if (gnp_train_plan_parse(arguments, &plan, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = gnp_session_open(&session, (unsigned)plan.workers, error);
	if (status != GNP_OK)
		return gnp_exit_of(status, false);
	status = run_in(&plan, &session, error);
	gnp_session_close(&session);
	return gnp_exit_of(status, false);
}

int main(int argc, char **argv)
{
	const struct gnp_program program = {"gnp-train", "trains a geometric neural operator for one of the paper's regimes",
	                                    gnp_train_plan_options, gnp_train_plan_option_count(), train};
	return gnp_program_main(&program, argc, argv);
}
