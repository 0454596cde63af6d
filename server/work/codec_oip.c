#include "server/work/codec_oip.h"

#include "proto/oip/oip.h"
#include "server/work/work.h"

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
	gnp_status status = gnp_oip_encode_response(work->call.operation, &work->message, &work->response, &reply->body,
	                                            &reply->tails, &reply->tail_count, error);
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
	double microseconds = value->type == GNP_VALUE_INTEGER  ? (double)value->integer
	                      : value->type == GNP_VALUE_NUMBER ? value->number : -1;
	if (!(microseconds >= 0))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "timeout: need a number of microseconds, at least 0");
	*seconds = microseconds * 1e-6;
	return GNP_OK;
}

const struct gnpd_codec gnpd_codec_oip = {.name = "oip", .decode = decode, .encode = encode, .timeout = timeout};
