#include "server/api/v2.h"

#include "core/base/version.h"
#include "proto/oip/oip.h"
#include "proto/operation/operations.h"
#include "proto/tensor/writer.h"
#include "server/api/server.h"
#include "server/base/metrics.h"

gnp_status gnpd_v2_server(struct gnpd_request *request, struct gnp_error *error)
{
	const char *build = request->server->engine.metrics->build;
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 200), error,
	                         "{\"name\":\"gnpd\",\"version\":\"" GNP_VERSION "%s%s\",\"extensions\":[\"binary_tensor_data\","
	                         "\"model_configuration\",\"model_repository\",\"statistics\"]}\n", *build ? "+" : "", build);
}

gnp_status gnpd_v2_index(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnp_writer w = gnp_writer_to(gnpd_reply_json(&request->reply, 200), error);
	const struct gnp_operation *operation;
	gnp_writer_text(&w, "[");
	for (size_t i = 0; (operation = gnp_operation_at(i)) != NULL; i++)
		gnp_writer_printf(&w, "%s{\"name\":\"%s\",\"version\":\"1\",\"state\":\"READY\"}", i ? "," : "", operation->name);
	gnp_writer_text(&w, "]\n");
	return w.status;
}

gnp_status gnpd_v2_model(struct gnpd_request *request, struct gnp_error *error)
{
	return gnp_oip_model_metadata(gnp_operation_find(request->model), request->work.models,
	                              gnpd_reply_json(&request->reply, 200), error);
}

gnp_status gnpd_v2_model_config(struct gnpd_request *request, struct gnp_error *error)
{
	return gnp_oip_model_config(gnp_operation_find(request->model), gnpd_reply_json(&request->reply, 200), error);
}

gnp_status gnpd_v2_model_ready(struct gnpd_request *request, struct gnp_error *error)
{
	if (atomic_load(&request->server->leaving))
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 200), error, "{\"name\":\"%s\",\"ready\":true}\n",
	                         gnp_operation_find(request->model)->name);
}

gnp_status gnpd_v2_model_stats(struct gnpd_request *request, struct gnp_error *error)
{
	const struct gnp_operation *operation = gnp_operation_find(request->model);
	uint64_t good, bad, nanoseconds;
	gnpd_metrics_totals(request->server->engine.metrics, gnpd_metrics_label(operation), &good, &bad, &nanoseconds);
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 200), error,
	                         "{\"model_stats\":[{\"name\":\"%s\",\"version\":\"1\",\"inference_count\":%llu,"
	                         "\"inference_stats\":{\"success\":{\"count\":%llu},\"fail\":{\"count\":%llu},"
	                         "\"total\":{\"count\":%llu,\"ns\":%llu}}}]}\n",
	                         operation->name, (unsigned long long)good, (unsigned long long)good, (unsigned long long)bad,
	                         (unsigned long long)(good + bad), (unsigned long long)nanoseconds);
}

gnp_status gnpd_v2_infer(struct gnpd_request *request, struct gnp_error *error)
{
	return gnpd_work_run(&request->work, error);
}
