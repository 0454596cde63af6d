/* Writes replies bit by bit, as events of a job come. For http.c alone, whose rights with the HTTP library it shares.
 */
#ifndef GNPD_HTTP_STREAM_H
#define GNPD_HTTP_STREAM_H

#include "server/api/request.h"

struct MHD_Response;

/* The body is what the request's watch has to tell until it ends; between two events the connection is suspended. NULL when memory is
 * exhausted. */
struct MHD_Response *gnpd_http_stream_response(struct gnpd_request *request);

#endif
