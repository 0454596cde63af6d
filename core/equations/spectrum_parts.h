/* Inside of the spectrum: what spectrum.c asks of spectrum_square.c and spectrum_symmetric.c; nobody else includes
 * it. */
#ifndef GNP_CORE_SPECTRUM_PARTS_H
#define GNP_CORE_SPECTRUM_PARTS_H

#include "core/equations/spectrum.h"

/* What is asked for, checked. Both fill value, imaginary, vector and residual of *out, which are allocated, and
 * solves; on failure they are undefined. */
struct gnp_spectrum_task {
	struct gnp_spectrum_wanted wanted;
	double first;      /* of the size of the first eigenvalue */
	double sigma;      /* what is inverted is -Delta - sigma: below 0 for the lowest, else nearly the shift; the
	                    * symmetric operator may have one farther off */
	const unsigned char *fixed; /* (n) in the cloud's order; NULL: nothing is */
	size_t memory_limit;        /* of a factor [bytes]; 0: none */
	size_t free_points;         /* at most: of the cloud, less fixed ones */
	unsigned degree;   /* of local fits, at points that a filter dropped */
	struct gnp_pool *pool;
	struct gnp_task *task;
};

/* Of collocation: an operator that is made for alpha = -sigma. */
gnp_status gnp_spectrum_square(const struct gnp_spectrum_task *asked, const struct gnp_poisson *poisson,
                               struct gnp_spectrum *out, struct gnp_error *error);
size_t gnp_spectrum_square_memory(size_t points, size_t count);

/* Of the weak form: volumes over the domain's points. */
gnp_status gnp_spectrum_symmetric(const struct gnp_spectrum_task *asked, const struct gnp_domain *domain,
                                  const struct gnp_stiffness *volumes, struct gnp_spectrum *out,
                                  struct gnp_error *error);
size_t gnp_spectrum_symmetric_memory(size_t points, size_t count);

#endif
