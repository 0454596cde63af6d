#include "server/work/codec_file.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/codec/parameters.h"
#include "proto/file/accept.h"
#include "proto/file/file.h"
#include "proto/file/formats.h"
#include "proto/file/result.h"
#include "proto/file/sniff.h"
#include "server/config/config.h"
#include "server/parse/duration.h"
#include "server/parse/target.h"
#include "server/work/engine.h"
#include "server/work/work.h"

static gnp_status unknown_format(const char *name, struct gnp_error *error)
{
	struct gnp_names known;
	gnp_names_begin(&known, "", 0);
	for (size_t i = 0; gnp_format_at(i); i++)
		gnp_names_add(&known, gnp_format_at(i)->name);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "format: got \"%.64s\", known: %s", name, gnp_names_end(&known));
}

/* Takes ?format= out of the parameters; *named: there was one. */
static gnp_status take_format(struct gnp_values *values, const struct gnp_format **format, bool *named,
                              struct gnp_error *error)
{
	*named = false;
	for (size_t i = 0; i < values->count; i++) {
		struct gnp_value *value = &values->items[i];
		if (strcmp(value->name, "format") != 0)
			continue;
		if (!gnp_format_by_name(value->string, format))
			return unknown_format(value->string, error);
		free(value->name);
		free(value->string);
		*value = values->items[--values->count];
		*named = true;
		return GNP_OK;
	}
	return GNP_OK;
}

static gnp_status input_format(const struct gnpd_work *work, const unsigned char *body, size_t size, bool named,
                               const struct gnp_format *wanted, const struct gnp_format **format,
                               	struct gnp_error *error)
{
	if (!(work->content_type && gnp_format_by_media_type(work->content_type, format)) &&
	    !gnp_format_by_magic(body, size, format)) {
		if (!named)
			return gnp_error_set(error, GNP_UNSUPPORTED_MEDIA,
			                     "body: Content-Type \"%.64s\" is no known format, the body does not look like one, "
			                     "and there is no ?format=", work->content_type ? work->content_type : "");
		*format = wanted;
	}
	if (!gnp_format_readable(*format))
		return gnp_error_set(error, GNP_UNSUPPORTED_MEDIA, "body: format %s can only be written",
		                     gnp_format_name(*format));
	return GNP_OK;
}

static gnp_status output_format(const struct gnpd_work *work, bool named, const struct gnp_format *wanted,
                                const struct gnp_format *input, struct gnp_format_choice *output,
                                	struct gnp_error *error)
{
	output->format = named ? wanted : gnp_format_writable(input) ? input : &gnp_format_ply;
	output->media_type = gnp_format_media_type(output->format);
	output->asked = named;
	if (work->accept && !gnp_format_by_accept(work->accept, output))
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "Accept: got \"%.100s\", none of its types can be written",
		                     work->accept);
	if (!gnp_format_writable(output->format))
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "format: %s can only be read", gnp_format_name(output->format));
	return GNP_OK;
}

static gnp_status decode(struct gnpd_work *work, const unsigned char *body, size_t size, struct gnp_error *error)
{
	const struct gnp_format *wanted = &gnp_format_ply, *input = &gnp_format_ply;
	bool named;
	gnp_status status = gnpd_query_parse(work->query, &work->message.parameters, error);
	if (status == GNP_OK)
		status = take_format(&work->message.parameters, &wanted, &named, error);
	if (status == GNP_OK)
		status = input_format(work, body, size, named, wanted, &input, error);
	if (status == GNP_OK)
		status = output_format(work, named, wanted, input, &work->output, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_operation *operation = work->operation;
	const struct gnp_file_wants wants = {work->engine->config->max_points, operation->inputs, operation->input_count,
	                                     operation};
	return gnp_file_decode(input, body, size, &wants, &work->message.inputs, error);
}

static gnp_status plan(struct gnpd_work *work, struct gnp_error *error)
{
	struct gnp_format_choice *output = &work->output;
	if (!output->asked && !gnp_result_fits(output->format, &work->call)) {
		if (output->media_type == gnp_format_media_type(output->format))
			output->media_type = gnp_format_media_type(&gnp_format_npz);
		output->format = &gnp_format_npz;
	}
	return gnp_result_check(output->format, &work->call, error);
}

/* As a header, since some formats have no place for them. */
static gnp_status add_parameters(struct gnpd_work *work, struct gnp_error *error)
{
	struct gnp_buffer *header = &work->reply->parameters;
	gnp_status status = gnp_parameters_write_short(&work->response.parameters, header, error);
	return status == GNP_OK && header->size ? gnp_buffer_append(header, "", 1, error) : status;
}

static gnp_status encode(struct gnpd_work *work, struct gnp_error *error)
{
	work->reply->content_type = work->output.media_type;
	gnp_status status = gnp_result_encode(work->output.format, &work->message, &work->response, &work->reply->body,
	                                      error);
	return status == GNP_OK ? add_parameters(work, error) : status;
}

static gnp_status timeout(const struct gnp_value *value, double *seconds, struct gnp_error *error)
{
	return gnpd_duration_parse("timeout", value->string, seconds, error);
}

const struct gnpd_codec gnpd_codec_file = {.name = "file", .decode = decode, .plan = plan, .encode = encode,
                                           .timeout = timeout};
