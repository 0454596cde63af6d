/* Small seeded random numbers (xoshiro256++ of Blackman & Vigna, seeded by splitmix64).
 *
 * A generator is keyed by (seed, stream). Streams of one seed are independent of each other, so that an item may have
 * its own generator (the same numbers for any number of threads) and training and validation may use disjoint streams.
 */
#ifndef GNP_CORE_RANDOM_H
#define GNP_CORE_RANDOM_H

#include <stdint.h>

struct gnp_random {
	uint64_t state[4];
};

void gnp_random_seed(struct gnp_random *random, uint64_t seed, uint64_t stream);

uint64_t gnp_random_next(struct gnp_random *random);

/* In [0, 1), 53 bits. */
double gnp_random_uniform(struct gnp_random *random);

/* In [0, bound), without bias; bound > 0. */
uint64_t gnp_random_below(struct gnp_random *random, uint64_t bound);

/* Mean 0, standard deviation 1 (Box-Muller). */
double gnp_random_normal(struct gnp_random *random);

#endif
