/* Sends a request to a gnpd server over HTTP and reads its answer (the one libcurl user). */
#ifndef GNP_CLIENTS_HTTP_CLIENT_H
#define GNP_CLIENTS_HTTP_CLIENT_H

#include <stddef.h>

#include "clients/progress.h"
#include "core/base/status.h"
#include "proto/tensor/message.h"

struct gnp_http_request {
	const char *method;       /* NULL: POST */
	const char *url;          /* complete, query string included */
	const char *content_type, *accept; /* NULL: none is sent */
	const char *key;          /* of the server's; NULL or "": none is sent */
	const char *cacert;       /* file of certificates that are trusted instead of the system's; NULL: the system's */
	const void *body;
	size_t size;
	double timeout;           /* seconds for the whole exchange, 0: none */
	struct gnp_buffer *parameters; /* receives the value of the answer's X-Gnpd-Parameters, empty without (empty on entry); NULL: not wanted */
};

/* Sends the body and moves the answer into *response (empty on entry). Cancelled within a tenth of a second through progress->task, which
 * also shows how far the transfer is. An answer other than 2xx is a failure: its status and text are the server's, with the
 * HTTP code and request id. No answer at all: GNP_IO naming the URL and the reason; too slow: GNP_DEADLINE. */
gnp_status gnp_http_post(const struct gnp_http_request *request, struct gnp_progress *progress,
                         struct gnp_buffer *response, struct gnp_error *error);

/* A key as it can stand in a header, 1..512 characters without blanks or controls: else GNP_INVALID_ARGUMENT, which does not quote it. */
gnp_status gnp_http_check_key(const char *key, struct gnp_error *error);

/* Appends text to the buffer with everything but letters, digits, '-', '.', '_', '~' and ',' percent-encoded. */
gnp_status gnp_http_escape(const char *text, struct gnp_buffer *buffer, struct gnp_error *error);

/* The status of that wire name; GNP_INTERNAL where there is none. */
gnp_status gnp_http_status_of(const char *code);

/* The status and text of an error body {"error","code","request_id"}; any other body is quoted as it is, but for control characters, cut short. */
gnp_status gnp_http_failure(const char *url, long code, const struct gnp_buffer *body, struct gnp_error *error);

#endif
