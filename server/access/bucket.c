#include "server/access/bucket.h"

void gnpd_bucket_init(struct gnpd_bucket *bucket, double burst, double now)
{
	*bucket = (struct gnpd_bucket){burst, now};
}

double gnpd_bucket_take(struct gnpd_bucket *bucket, double rate, double burst, double now)
{
	if (now > bucket->at) {
		bucket->tokens += (now - bucket->at) * rate;
		bucket->at = now;
	}
	if (bucket->tokens > burst)
		bucket->tokens = burst;
	if (bucket->tokens < 1)
		return (1 - bucket->tokens) / rate;
	bucket->tokens -= 1;
	return 0;
}
