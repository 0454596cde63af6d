/* Tells the time of day, and how long threads sleep between two looks. Seconds of a stretch of work are gnp_clock()'s.
 */
#ifndef GNPD_CLOCK_H
#define GNPD_CLOCK_H

#include <pthread.h>
#include <stdint.h>

/* Microseconds since the epoch. */
int64_t gnpd_clock_now(void);

/* The condition of a thread that looks about at every tick. */
void gnpd_clock_init(pthread_cond_t *wake);
/* Waits for the condition, one that gnpd_clock_init made, a tenth of a second at most. lock is held. */
void gnpd_clock_tick(pthread_cond_t *wake, pthread_mutex_t *lock);

#endif
