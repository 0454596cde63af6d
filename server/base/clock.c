#include "server/base/clock.h"

#include <time.h>

int64_t gnpd_clock_now(void)
{
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

void gnpd_clock_init(pthread_cond_t *wake)
{
	pthread_condattr_t monotonic;
	pthread_condattr_init(&monotonic);
	pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
	pthread_cond_init(wake, &monotonic);
	pthread_condattr_destroy(&monotonic);
}

void gnpd_clock_tick(pthread_cond_t *wake, pthread_mutex_t *lock)
{
	enum { TICK = 100000000, SECOND = 1000000000 };
	struct timespec until;
	clock_gettime(CLOCK_MONOTONIC, &until);
	until.tv_nsec += TICK;
	if (until.tv_nsec >= SECOND) {
		until.tv_nsec -= SECOND;
		until.tv_sec++;
	}
	pthread_cond_timedwait(wake, lock, &until);
}
