/* One request from its first line to the completion callback. Everything a request needs hangs on this object and is
 * freed with it, in one place; handlers do not clean up. */
#ifndef GNPD_REQUEST_H
#define GNPD_REQUEST_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"
#include "server/access/guard.h"
#include "server/base/metrics.h"
#include "server/base/queue.h"
#include "server/jobs/job_watch.h"
#include "server/parse/site.h"
#include "server/parse/target.h"
#include "server/work/reply.h"
#include "server/work/work.h"

struct MHD_Connection;
struct gnpd_http_loop;
struct gnpd_connection;
struct gnpd_route;
struct gnpd_server;

enum { GNPD_ID_MAX = 128, GNPD_PRINCIPAL_MAX = 64 };

/* Where http.c is with the request. */
enum gnpd_step {
	GNPD_STEP_HEADERS,
	GNPD_STEP_BODY,
	GNPD_STEP_DISCARD, /* the body is dropped, before the answer */
	GNPD_STEP_REPLY,
	GNPD_STEP_SENT,
	GNPD_STEP_LINGER   /* the body is dropped after the answer, which the connection ends with */
};

struct gnpd_request {
	struct gnpd_server *server;
	struct MHD_Connection *http;
	struct gnpd_http_loop *loop; /* that serves it */
	struct gnpd_connection *connection;
	enum gnpd_step step;
	bool active; /* counted in server->active */

	char id[GNPD_ID_MAX + 1];
	char method[16];
	struct gnpd_target target;
	const struct gnpd_route *route; /* NULL when none fits */
	const char *model;              /* the path's {model} and {version}; NULL without */
	const char *version;
	const char *job_id;             /* the path's {job}; NULL without */
	enum gnpd_label label;
	char allowed[64];               /* the methods of the path, where it has not the one that came */
	char principal[GNPD_PRINCIPAL_MAX + 1]; /* the name of the key it came with; "" without keys */
	struct gnpd_principal *who;             /* its owner; NULL without */
	bool entered;                           /* counted among the owner's requests under way */
	bool admin;                             /* came by the admin listener */
	bool named;                             /* the names by which clients call the listener are known: Host must be one of them */
	double retry_after;                     /* seconds a refusal tells the client; 0: the configuration's */

	/* Headers, borrowed from the HTTP library until completion; NULL when absent. Those of the work are there. */
	const char *range, *if_range, *if_none_match, *idempotency_key, *last_event_id;
	struct gnpd_site site;
	struct gnpd_credentials credentials;
	bool expects_continue;
	bool has_length;
	size_t content_length;
	size_t uri_size;           /* bytes of the target as it came */

	size_t discarded;          /* bytes of a refused body before its answer */
	size_t lingered;           /* and after it */
	size_t received;           /* bytes of body in all */

	double started, submitted; /* gnp_clock() */
	double waited;             /* seconds in the queue */
	struct gnpd_queued queued;
	bool (*withdraw)(struct gnpd_request *request); /* out of where it waits; true: it did, and queued.run is to be called */
	struct gnpd_work work;     /* the call, its body and its answer */
	struct gnpd_watch watch;   /* of a job */

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

/* Appends the query's parameters, of which all must be among `known` (NULL-terminated). */
gnp_status gnpd_request_query(const struct gnpd_request *request, const char *const *known, struct gnp_values *values,
                              struct gnp_error *error);
/* There must be none. */
gnp_status gnpd_request_no_query(const struct gnpd_request *request, struct gnp_error *error);

/* Adds a header to the reply; text is cut at 255 bytes. */
void gnpd_reply_header(struct gnpd_request *request, const char *name, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Replaces the reply by the JSON body of an error, with the headers that belong to its status. */
void gnpd_reply_error(struct gnpd_request *request, const struct gnp_error *error);

#endif
