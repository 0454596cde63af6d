/* The way of a request through its operation, the same for every codec; runs on a runner. */
#ifndef GNPD_WORK_H
#define GNPD_WORK_H

#include "request.h"
#include "status.h"

struct gnpd_codec {
	/* Fills request->message from the body, whose content encoding is already undone. */
	gnp_status (*decode)(struct gnpd_request *request, const unsigned char *body, size_t size, struct gnp_error *error);
	/* Fills request->reply from request->response. */
	gnp_status (*encode)(struct gnpd_request *request, struct gnp_error *error);
};

gnp_status gnpd_work_run(struct gnpd_request *request, const struct gnpd_codec *codec, struct gnp_error *error);

#endif
