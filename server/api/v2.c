/* The Open Inference Protocol: server and model metadata, infer. */
#include "core/base/version.h"
#include "proto/oip/oip.h"
#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/base/metrics.h"
#include "server/work/work.h"

gnp_status gnpd_v2_server(struct gnpd_request *request, struct gnp_error *error)
{
	const char *build = request->server->engine.metrics->build;
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 200), error,
	                         "{\"name\":\"gnpd\",\"version\":\"" GNP_VERSION "%s%s\",\"extensions\":[\"binary_tensor_data\","
	                         "\"model_configuration\",\"model_repository\",\"statistics\"]}\n", *build ? "+" : "", build);
}

gnp_status gnpd_v2_index(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnp_buffer *body = gnpd_reply_json(&request->reply, 200);
	const struct gnp_operation *operation;
	gnp_status status = gnp_buffer_printf(body, error, "[");
	for (size_t i = 0; (operation = gnp_operation_at(i)) != NULL && status == GNP_OK; i++)
		status = gnp_buffer_printf(body, error, "%s{\"name\":\"%s\",\"version\":\"1\",\"state\":\"READY\"}", i ? "," : "",
		                           operation->name);
	return status == GNP_OK ? gnp_buffer_printf(body, error, "]\n") : status;
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

static gnp_status decode(struct gnpd_work *work, const unsigned char *body, size_t size, struct gnp_error *error)
{
	size_t header = GNP_OIP_NO_HEADER;
	gnp_status status = GNP_OK;
	if (work->inference_length)
		status = gnp_oip_header_length(work->inference_length, size, &header, error);
	return status == GNP_OK ? gnp_oip_decode_request(body, size, header, &work->message, error) : status;
}

static gnp_status encode(struct gnpd_work *work, struct gnp_error *error)
{
	struct gnpd_reply *reply = work->reply;
	gnp_status status = gnp_oip_encode_response(work->call.operation, &work->message, &work->response, &reply->body, &reply->tails,
	                                            &reply->tail_count, error);
	if (status != GNP_OK)
		return status;
	reply->content_type = reply->tail_count ? "application/octet-stream" : "application/json";
	if (reply->tail_count)
		gnpd_reply_add(reply, "Inference-Header-Content-Length", "%zu", reply->body.size);
	return GNP_OK;
}

/* Microseconds, as the protocol's other servers have it. */
static gnp_status timeout(const struct gnp_value *value, double *seconds, struct gnp_error *error)
{
	double microseconds = value->type == GNP_VALUE_INTEGER ? (double)value->integer : value->type == GNP_VALUE_NUMBER ? value->number : -1;
	if (!(microseconds >= 0))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "timeout: need a number of microseconds, at least 0");
	*seconds = microseconds * 1e-6;
	return GNP_OK;
}

const struct gnpd_codec gnpd_codec_oip = {.name = "oip", .decode = decode, .encode = encode, .timeout = timeout};

gnp_status gnpd_v2_infer(struct gnpd_request *request, struct gnp_error *error)
{
	return gnpd_work_run(&request->work, error);
}
