/* One request from its first line to the completion callback. Everything a request needs hangs on this object and is
 * freed with it, in one place; handlers do not clean up. */
#ifndef GNPD_REQUEST_H
#define GNPD_REQUEST_H

#include <stdbool.h>
#include <stddef.h>

#include "file.h"
#include "guard.h"
#include "message.h"
#include "metrics.h"
#include "models.h"
#include "operation.h"
#include "queue.h"
#include "status.h"
#include "target.h"
#include "task.h"

struct MHD_Connection;
struct gnpd_connection;
struct gnpd_route;
struct gnpd_server;

enum { GNPD_REPLY_HEADERS_MAX = 6, GNPD_ID_MAX = 128, GNPD_PRINCIPAL_MAX = 64 };

struct gnpd_reply {
	int code; /* HTTP; 0 until there is a reply */
	const char *content_type;
	size_t header_count;
	struct {
		const char *name;
		char value[256];
	} headers[GNPD_REPLY_HEADERS_MAX];
	struct gnp_buffer body;          /* then the tails, sent from where they lie */
	const struct gnp_tensor **tails; /* owned array of tensors of the request's response */
	size_t tail_count;
	bool close;                      /* the connection ends with this reply */
};

/* Where http.c is with the request. */
enum gnpd_step { GNPD_STEP_HEADERS, GNPD_STEP_BODY, GNPD_STEP_DISCARD, GNPD_STEP_REPLY, GNPD_STEP_SENT };

struct gnpd_request {
	struct gnpd_server *server;
	struct MHD_Connection *http;
	struct gnpd_connection *connection;
	enum gnpd_step step;
	bool active; /* counted in server->active */

	char id[GNPD_ID_MAX + 1];
	char method[16];
	struct gnpd_target target;
	const struct gnpd_route *route; /* NULL when none fits */
	const char *model;              /* the path's {model} and {version}; NULL without */
	const char *version;
	enum gnpd_label label;
	char principal[GNPD_PRINCIPAL_MAX + 1]; /* the name of the key it came with; "" without keys */
	struct gnpd_principal *who;             /* its owner; NULL without */
	bool entered;                           /* counted among the owner's requests under way */
	bool admin;                             /* came by the admin listener */
	double retry_after;                     /* seconds a refusal tells the client; 0: the configuration's */

	/* Headers, borrowed from the HTTP library until completion; NULL when absent. */
	const char *content_type, *content_encoding, *accept, *inference_length;
	struct gnpd_credentials credentials;
	bool expects_continue;
	bool has_length;
	size_t content_length;

	struct gnp_buffer body;    /* as received */
	size_t discarded;          /* bytes of a refused body */
	size_t received;           /* bytes of body in all */
	size_t reserved;           /* of the queue's bytes */

	struct gnp_models *models; /* those in use when it began */
	double started, submitted, deadline; /* gnp_clock() */
	double waited;                       /* seconds in the queue */
	struct gnpd_job job;
	struct gnp_task task;
	struct gnp_buffer decoded;  /* the body without its content encoding */
	struct gnp_request message; /* borrows from body or decoded */
	struct gnp_call call;
	struct gnp_response response;
	enum gnp_format output_format; /* of /v1 */

	struct gnp_buffer spare; /* room for an error's body when there is no memory for another */
	gnp_status status; /* what the reply says */
	struct gnpd_reply reply;
};

/* NULL when memory is exhausted. */
struct gnpd_request *gnpd_request_create(struct gnpd_server *server, const char *uri);
/* Gives reserved bytes back and frees all. NULL is allowed. */
void gnpd_request_free(struct gnpd_request *request);

/* The answer is there: the request no longer counts among its principal's. A client that has it may send the next at once. */
void gnpd_request_leave(struct gnpd_request *request);

/* Takes the client's id when it is 1..128 characters of [A-Za-z0-9._:-], else makes one. id may be NULL. */
void gnpd_request_set_id(struct gnpd_request *request, const char *id);

/* Reserves bytes of the queue for the request, released with it. Counts a refusal. */
gnp_status gnpd_request_reserve(struct gnpd_request *request, size_t bytes, struct gnp_error *error);

void gnpd_request_release(struct gnpd_request *request, size_t bytes);

/* Adds a header to the reply; text is cut at 255 bytes. */
void gnpd_reply_header(struct gnpd_request *request, const char *name, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Replaces the reply by the JSON body of an error, with the headers that belong to its status. */
void gnpd_reply_error(struct gnpd_request *request, const struct gnp_error *error);

/* Bytes of the reply's body. */
size_t gnpd_reply_size(const struct gnpd_request *request);

#endif
