/* Unpacks gzip and deflate bodies (zlib), with a hard bound on the decompressed size. */
#ifndef GNP_PROTO_CONTENT_ENCODING_H
#define GNP_PROTO_CONTENT_ENCODING_H

#include "core/base/status.h"
#include "proto/tensor/message.h"

/* Decompresses body by the text of a Content-Encoding header ("gzip", "x-gzip", "deflate"; "identity" is an error here).
 * Over max_size: GNP_TOO_LARGE with the limit, having allocated no more than max_size and zlib's own.
 * Truncated or corrupt input and bytes after the end: GNP_INVALID_ARGUMENT. Unknown encoding: GNP_UNSUPPORTED_MEDIA. */
gnp_status gnp_content_decode(const char *encoding, const unsigned char *body, size_t size, size_t max_size,
                              struct gnp_buffer *out, struct gnp_error *error);

#endif
