/* gnp-train: trains a geometric neural operator for one of the paper's regimes, or for every cloud, and writes its
 * weights. */
#include <stdio.h>
#include <stdlib.h>

#include "clients/program.h"
#include "clients/session.h"
#include "core/base/memory.h"
#include "weights/train/any/any_model.h"
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

static enum gnp_exit train_patches(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_train_plan plan;
	struct gnp_session session;
	if (gnp_any_plan_refuse(arguments, error) != GNP_OK || gnp_train_plan_parse(arguments, &plan, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = gnp_session_open(&session, (unsigned)plan.workers, error);
	if (status != GNP_OK)
		return gnp_exit_of(status, false);
	status = run_in(&plan, &session, error);
	gnp_session_close(&session);
	return gnp_exit_of(status, false);
}

static gnp_status run_any_in(const struct gnp_any_plan *plan, struct gnp_session *session, struct gnp_error *error)
{
	struct gnp_any_end end;
	struct gnp_layout layout;
	atomic_store(&session->progress.phase, "clouds");
	gnp_status status = gnp_architecture_layout(&plan->run.train.architecture, &layout, error);
	if (status != GNP_OK)
		return status;
	float *parameters = gnp_array_new(layout.total, sizeof *parameters);
	if (!parameters)
		return gnp_no_memory("gnp-train", layout.total, "parameters", error);
	fprintf(stderr, "any: %zu parameters\n", layout.total);
	status = gnp_any_run(&plan->run, session->pool, &session->task, stderr, parameters, &end, error);
	if (status == GNP_OK)
		status = gnp_any_model_write(plan, parameters, &end, error);
	free(parameters);
	return status;
}

static enum gnp_exit train_any(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_any_plan plan;
	struct gnp_session session;
	if (gnp_any_plan_parse(arguments, &plan, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = gnp_session_open(&session, (unsigned)plan.workers, error);
	if (status != GNP_OK)
		return gnp_exit_of(status, false);
	status = run_any_in(&plan, &session, error);
	gnp_session_close(&session);
	return gnp_exit_of(status, false);
}

static enum gnp_exit train(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	return gnp_any_plan_asked(arguments) ? train_any(arguments, error) : train_patches(arguments, error);
}

int main(int argc, char **argv)
{
	const struct gnp_program program = {"gnp-train", "trains a geometric neural operator for a regime, or for every cloud",
	                                    gnp_train_plan_options, gnp_train_plan_option_count(), train};
	return gnp_program_main(&program, argc, argv);
}
