#include "core/base/random.h"

#include <math.h>

static const uint64_t GOLDEN = UINT64_C(0x9E3779B97F4A7C15);

static uint64_t mix(uint64_t z)
{
	z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
	z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
	return z ^ (z >> 31);
}

static uint64_t rotate(uint64_t x, int k)
{
	return (x << k) | (x >> (64 - k));
}

/* For a given seed the key is a bijection of the stream: two streams never share their numbers. */
void gnp_random_seed(struct gnp_random *random, uint64_t seed, uint64_t stream)
{
	uint64_t key = mix(mix(seed + GOLDEN) + stream * GOLDEN);
	for (int i = 0; i < 4; i++)
		random->state[i] = mix(key += GOLDEN);
}

uint64_t gnp_random_next(struct gnp_random *random)
{
	uint64_t *s = random->state;
	uint64_t result = rotate(s[0] + s[3], 23) + s[0];
	uint64_t t = s[1] << 17;
	s[2] ^= s[0];
	s[3] ^= s[1];
	s[1] ^= s[2];
	s[0] ^= s[3];
	s[2] ^= t;
	s[3] = rotate(s[3], 45);
	return result;
}

double gnp_random_uniform(struct gnp_random *random)
{
	return (double)(gnp_random_next(random) >> 11) * 0x1p-53;
}

uint64_t gnp_random_below(struct gnp_random *random, uint64_t bound)
{
	uint64_t reject = -bound % bound; /* 2^64 mod bound: the numbers that would favour small results */
	uint64_t draw;
	do
		draw = gnp_random_next(random);
	while (draw < reject);
	return draw % bound;
}

double gnp_random_normal(struct gnp_random *random)
{
	double radius = sqrt(-2 * log(1 - gnp_random_uniform(random)));
	return radius * cos(2 * M_PI * gnp_random_uniform(random));
}
