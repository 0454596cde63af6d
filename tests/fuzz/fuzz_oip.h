/* A request of the Open Inference Protocol under fuzzing: decoded, prepared for every operation, encoded and decoded again. */
#ifndef GNP_TESTS_FUZZ_OIP_H
#define GNP_TESTS_FUZZ_OIP_H

#include "proto/json/json_memory.h"
#include "proto/oip/oip.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"
#include "tests/fuzz/fuzz_file.h"

static inline void fuzz_prepare(const struct gnp_request *request)
{
	static const struct gnp_limits limits = {.points = FUZZ_POINTS_MAX};
	const struct gnp_operation *operation;
	for (size_t i = 0; (operation = gnp_operation_at(i)) != NULL; i++) {
		struct gnp_call call;
		struct gnp_error error = {0};
		gnp_status status = gnp_call_prepare(operation, request, &limits, &call, &error);
		FUZZ_REQUIRE(status == GNP_OK ? call.points <= FUZZ_POINTS_MAX && call.memory > 0 : error.text[0] != '\0');
	}
}

static inline void fuzz_oip_again(const struct gnp_request *request)
{
	struct gnp_request back = {0};
	struct gnp_buffer body = {0};
	struct gnp_error error = {0};
	size_t header;
	if (gnp_oip_encode_request(request, &body, &header, &error) == GNP_OK) {
		gnp_status status = gnp_oip_decode_request(body.data, body.size, header, &back, &error);
		if (status != GNP_OK)
			fprintf(stderr, "what was encoded does not decode: %s\n", error.text);
		FUZZ_REQUIRE(status == GNP_OK && fuzz_same_tensors(&request->inputs, &back.inputs));
		FUZZ_REQUIRE(back.parameters.count >= request->parameters.count && back.output_count == request->output_count);
	}
	gnp_request_clear(&back);
	gnp_buffer_clear(&body);
}

/* length: the text of the header Inference-Header-Content-Length, "" for none. */
static inline void fuzz_oip(const char *length, const unsigned char *body, size_t size)
{
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_error error = {0};
	size_t header = GNP_OIP_NO_HEADER;
	static bool ready;
	if (!ready)
		gnp_json_memory_init(); /* as the daemon does */
	ready = true;
	if (*length && gnp_oip_header_length(length, size, &header, &error) != GNP_OK) {
		FUZZ_REQUIRE(error.text[0]);
		return;
	}
	gnp_status status = gnp_oip_decode_request(body, size, header, &request, &error);
	FUZZ_REQUIRE(status == GNP_OK || (error.text[0] && request.inputs.count == 0 && request.output_count == 0));
	if (status == GNP_OK) {
		fuzz_touch(&request.inputs);
		fuzz_prepare(&request);
		fuzz_oip_again(&request);
	}
	if (gnp_oip_decode_response(body, size, header, &response, NULL) == GNP_OK)
		fuzz_touch(&response.outputs);
	gnp_response_clear(&response);
	gnp_request_clear(&request);
}

#endif
