/* How work is encoded: what makes a call of a body, and a body of its answer. One for each way to ask (codec_file,
 * codec_oip). */
#ifndef GNPD_CODEC_H
#define GNPD_CODEC_H

#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"

struct gnpd_work;

struct gnpd_codec {
	const char *name; /* as records of jobs call it */
	/* Fills work->message from the body, whose content encoding is already undone. */
	gnp_status (*decode)(struct gnpd_work *work, const unsigned char *body, size_t size, struct gnp_error *error);
	/* Settles from work->call what form the answer will have, before it is computed; NULL: there is but one. */
	gnp_status (*plan)(struct gnpd_work *work, struct gnp_error *error);
	/* Fills work->reply from work->response. */
	gnp_status (*encode)(struct gnpd_work *work, struct gnp_error *error);
	/* Seconds of the message's parameter `timeout`; 0: it has none. */
	gnp_status (*timeout)(const struct gnp_value *value, double *seconds, struct gnp_error *error);
};

#endif
