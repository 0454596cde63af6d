/* The steps of a request between the HTTP library's callbacks (http.c), in their order. Of the library's threads
 * unless said otherwise; only http*.c include this. */
#ifndef GNPD_HTTP_STEPS_H
#define GNPD_HTTP_STEPS_H

#include <microhttpd.h>
#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "server/api/request.h"

/* http_headers.c: the headers are in. Checks their framing, finds the route, and refuses what can be refused before the body. */
enum MHD_Result gnpd_http_headers(struct gnpd_request *request, const char *method, const char *version);

/* http_body.c: size bytes of the body have come; kept, or dropped where the request is refused already. */
enum MHD_Result gnpd_http_body(struct gnpd_request *request, const char *data, size_t size);
/* Answers at once, past the library, which takes no reply before the end of the body, and drops what still comes, within linger-bytes and
 * linger-seconds: a client that sends its whole body before it reads would else be reset, and never see the answer (RFC 9112 9.6). */
enum MHD_Result gnpd_http_linger(struct gnpd_request *request);
/* Answers where the library takes no reply, and ends the connection. */
void gnpd_http_cut(struct gnpd_request *request, const struct gnp_error *error);

/* http_work.c: the body is whole. Answers, or suspends the connection until a runner, the disk queue or a job's end has an answer. */
enum MHD_Result gnpd_http_answer(struct gnpd_request *request);
/* The queue in which the request's work waits. */
struct gnpd_queue *gnpd_http_queue(const struct gnpd_request *request);

/* http_reply.c: the reply is there and goes out. */
enum MHD_Result gnpd_http_reply(struct gnpd_request *request);
/* Appends the reply, one of bytes, as it goes over the wire: with the end of the connection. GNP_OUT_OF_MEMORY only. */
gnp_status gnpd_http_reply_text(const struct gnpd_request *request, struct gnp_buffer *text);
/* The one place that logs, counts and frees a request. end: how the library says its connection left it. */
void gnpd_http_finish(struct gnpd_request *request, enum MHD_RequestTerminationCode end);

#endif
