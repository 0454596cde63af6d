/* An answer: code, headers, and a body that is bytes in memory, a piece of a file, or a stream. */
#ifndef GNPD_REPLY_H
#define GNPD_REPLY_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"

enum { GNPD_REPLY_HEADERS_MAX = 10 };

struct gnpd_reply {
	int code; /* HTTP; 0 until there is a reply */
	const char *content_type;
	size_t header_count;
	struct {
		const char *name;
		char value[256];
	} headers[GNPD_REPLY_HEADERS_MAX];
	struct gnp_buffer parameters;    /* X-Gnpd-Parameters, which is longer than a header above may be: NUL-terminated;
	                                    empty: there is none */
	struct gnp_buffer body;          /* then the tails, sent from where they lie */
	const struct gnp_tensor **tails; /* owned array of tensors of the work's response */
	size_t tail_count;
	bool has_file;                   /* instead of body and tails: size bytes of the file from offset */
	int file;                        /* open for reading; owned until it is sent */
	size_t file_offset, file_size;
	bool stream;                     /* instead of all of these: what the request's watch writes */
	bool close;                      /* the connection ends with this reply */
};

/* Adds a header; text is cut at 255 bytes, and a header over GNPD_REPLY_HEADERS_MAX is left out. */
void gnpd_reply_add(struct gnpd_reply *reply, const char *name, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* An answer of JSON, whose body is what is written to the buffer returned. */
struct gnp_buffer *gnpd_reply_json(struct gnpd_reply *reply, int code);

/* Whether another try may help after an error of this status, so that its answer says when. */
bool gnpd_reply_retries(gnp_status status);

/* Bytes of the body; 0 of a stream. */
size_t gnpd_reply_size(const struct gnpd_reply *reply);

/* Frees what it holds and leaves it empty. */
void gnpd_reply_clear(struct gnpd_reply *reply);

#endif
