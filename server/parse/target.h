/* Splits the request target into path segments and query parameters. No path ever reaches the file system.
 *
 * A path has one spelling: what stands in it needs no percent escapes, and whoever guards some paths in front of this
 * server (a proxy's rules) must not have to know of others. In a query escapes are decoded. */
#ifndef GNPD_TARGET_H
#define GNPD_TARGET_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"

enum { GNPD_SEGMENTS_MAX = 8, GNPD_QUERY_MAX = 64 };

struct gnpd_target {
	char *path;      /* as it came, without the query: for the log */
	char *authority; /* of the absolute form, "http://AUTHORITY/path", which proxies use; NULL in other forms */
	char *split;     /* holds the segments */
	char *query;     /* as it came; NULL without one */
	unsigned count;  /* of segments */
	bool whole;      /* the target is "*", the server as a whole */
	bool valid;      /* false: too many segments, an empty one (// or a trailing /), an escape; no route matches */
	char *segments[GNPD_SEGMENTS_MAX];
};

/* uri: as in the request line. GNP_OUT_OF_MEMORY only. */
gnp_status gnpd_target_parse(const char *uri, struct gnpd_target *target);
/* Parameters of a query, NULL without one, empty ones among them. */
size_t gnpd_query_count(const char *query);
void gnpd_target_clear(struct gnpd_target *target);

/* Appends the query's parameters as strings, '+' read as space; NULL and "" have none. GNP_INVALID_ARGUMENT for bad
 * escapes, a name without a value's '=' (nothing between two '&' among them), a repeated name, or more than
 * GNPD_QUERY_MAX. */
gnp_status gnpd_query_parse(const char *query, struct gnp_values *values, struct gnp_error *error);

#endif
