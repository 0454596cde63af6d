/* The pieces of a cloud that the weak form does not connect: each has eigenpairs of its own, and those of all are the
 * cloud's. Points where u is given as 0 belong to none. */
#ifndef GNP_CORE_PIECES_H
#define GNP_CORE_PIECES_H

#include "core/cells/diffusion.h"
#include "core/operators/domain.h"

/* Owned; freed by gnp_pieces_clear. */
struct gnp_pieces {
	size_t points, count; /* of the domain; pieces, by their first point */
	unsigned char *free;  /* (points) 1: u is not given */
	uint32_t *local;      /* (points) a free point's place in its piece */
	size_t *start;        /* (count + 1) */
	uint32_t *member;     /* (start[count]) free points by piece, ascending */
};

/* fixed (n): in the cloud's order; NULL: nothing is. volumes over the domain's points. On failure *out is unchanged. */
gnp_status gnp_pieces_find(const struct gnp_domain *domain, const struct gnp_stiffness *volumes,
                           const unsigned char *fixed, struct gnp_pieces *out, struct gnp_error *error);
void gnp_pieces_clear(struct gnp_pieces *pieces);

static inline size_t gnp_pieces_size(const struct gnp_pieces *pieces, size_t piece)
{
	return pieces->start[piece + 1] - pieces->start[piece];
}

/* The point of the domain that is the k-th of a piece. */
static inline size_t gnp_pieces_point(const struct gnp_pieces *pieces, size_t piece, size_t k)
{
	return pieces->member[pieces->start[piece] + k];
}

/* free_there (domain's points): 1 where u is not given; a place is fixed where one of its points is. Returns how many
 * there are. */
size_t gnp_pieces_mark_free(const struct gnp_domain *domain, const unsigned char *fixed, unsigned char *free_there);

#endif
