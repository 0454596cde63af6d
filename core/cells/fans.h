/* The stars of all points of a cloud (star.h) as lists of triangles: what functions are differentiated on. */
#ifndef GNP_CORE_FANS_H
#define GNP_CORE_FANS_H

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* Triangles (i, a, b) of point i: corner[start[i]] .. corner[start[i + 1] - 1], a and b in turn. Points in curve order.
 * Freed by gnp_fans_clear. */
struct gnp_fans {
	size_t count;
	size_t *start;         /* (count + 1) */
	uint32_t (*corner)[2]; /* (start[count]) */
};

/* task may be NULL. Deterministic for any worker count. On failure *out is unchanged. */
gnp_status gnp_fans_make(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                         struct gnp_fans *out, struct gnp_error *error);
/* The same triangles, each one at all three of its corners, for what passes through a triangle whosesoever it is. One
 * that not all three stars have and that is steep for a corner, as bridges to another sheet are, is left out, unless
 * a corner would have none. fans: of that cloud. On failure *out is unchanged. */
gnp_status gnp_fans_share(const struct gnp_fans *fans, const struct gnp_prepared *prepared, struct gnp_fans *out,
                          struct gnp_error *error);
double gnp_fans_longest_edge(const struct gnp_fans *fans, const struct gnp_prepared *prepared); /* [length] */
void gnp_fans_clear(struct gnp_fans *fans);
size_t gnp_fans_bytes(const struct gnp_fans *fans);

#endif
