/* A token bucket: bursts up to a size, then a steady rate. */
#ifndef GNPD_BUCKET_H
#define GNPD_BUCKET_H

struct gnpd_bucket {
	double tokens;
	double at; /* when they were counted */
};

/* Full. */
void gnpd_bucket_init(struct gnpd_bucket *bucket, double burst, double now);

/* Takes a token. 0, or the seconds until there will be one, and none is taken. rate: tokens a second, > 0; burst: the most there
 * are, >= 1; now: of a clock that may stand still but not go back (a step back adds nothing). */
double gnpd_bucket_take(struct gnpd_bucket *bucket, double rate, double burst, double now);

#endif
