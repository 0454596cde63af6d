#include "clients/progress.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "clients/command.h"

enum { TICK_NANOSECONDS = 100000000, SECOND = 1000000000 };
#define SHOW_AFTER 0.3 /* seconds: what is done sooner needs no bar */
#define INSIST_AFTER 0.5 /* seconds: some programs send the same signal twice at once */

static const int signals[] = {SIGINT, SIGTERM};
enum { SIGNALS = sizeof signals / sizeof signals[0] };

/* The stop flag: signals taken. A handler, because libraries start threads of their own, with signals unblocked, before main. */
static atomic_int interrupts;

static void take_signal(int signal)
{
	(void)signal;
	atomic_fetch_add(&interrupts, 1);
}

static void restore_signals(const struct gnp_progress *progress)
{
	for (int i = 0; i < SIGNALS; i++)
		sigaction(signals[i], &progress->previous[i], NULL);
}

static void catch_signals(struct gnp_progress *progress)
{
	struct sigaction action = {.sa_handler = take_signal, .sa_flags = SA_RESTART};
	atomic_store(&interrupts, 0);
	for (int i = 0; i < SIGNALS; i++) {
		sigaction(signals[i], NULL, &progress->previous[i]);
		if (progress->previous[i].sa_handler != SIG_IGN)
			sigaction(signals[i], &action, NULL);
	}
}

void gnp_progress_format(const char *phase, double fraction, double elapsed, char *line, size_t size)
{
	enum { WIDTH = 30 };
	char bar[WIDTH + 1], left[32] = "";
	if (fraction < 0) {
		snprintf(line, size, "%-10s %.0f s", phase, elapsed);
		return;
	}
	int filled = (int)(fraction * WIDTH + 0.5);
	for (int i = 0; i < WIDTH; i++)
		bar[i] = i < filled ? '#' : '.';
	bar[WIDTH] = 0;
	if (fraction >= 0.05 && fraction < 1)
		snprintf(left, sizeof left, " %.0f s left", elapsed * (1 - fraction) / fraction);
	snprintf(line, size, "%-10s %3.0f%% [%s]%s", phase, 100 * fraction, bar, left);
}

struct display {
	bool terminal, shown;
	const char *phase;
	double begun, phase_begun;
};

static void draw(struct display *display, struct gnp_progress *progress)
{
	const char *phase = atomic_load(&progress->phase);
	double now = gnp_clock();
	if (!phase)
		phase = gnp_stage_name(gnp_task_current(progress->task));
	if (phase != display->phase) {
		display->phase = phase;
		display->phase_begun = now;
	}
	if (!display->terminal || now - display->begun < SHOW_AFTER)
		return;
	char line[128];
	double fraction = atomic_load(&progress->task->total) ? gnp_task_fraction(progress->task) : -1;
	gnp_progress_format(phase, fraction, now - display->phase_begun, line, sizeof line);
	fprintf(stderr, "\r%s\033[K", line);
	display->shown = true;
}

/* What is to be done about signals: the first cancels, a later one ends the process. */
struct insistence {
	int seen;
	double cancelled; /* when, by the monotonic clock */
};

static void heed_signals(struct insistence *insistence, struct gnp_task *task)
{
	int taken = atomic_load(&interrupts);
	if (taken == insistence->seen)
		return;
	if (insistence->seen && gnp_clock() - insistence->cancelled > INSIST_AFTER)
		_exit(GNP_EXIT_CANCELLED);
	if (!insistence->seen) {
		insistence->cancelled = gnp_clock();
		gnp_task_cancel(task);
	}
	insistence->seen = taken;
}

/* Waits for a tick; true when the progress is to stop. */
static bool wait_tick(struct gnp_progress *progress)
{
	struct timespec until;
	clock_gettime(CLOCK_REALTIME, &until);
	until.tv_nsec += TICK_NANOSECONDS;
	until.tv_sec += until.tv_nsec / SECOND;
	until.tv_nsec %= SECOND;
	pthread_mutex_lock(&progress->lock);
	if (!progress->stopping)
		pthread_cond_timedwait(&progress->stopped, &progress->lock, &until);
	bool stopping = progress->stopping;
	pthread_mutex_unlock(&progress->lock);
	return stopping;
}

static void *watch(void *argument)
{
	struct gnp_progress *progress = argument;
	struct display display = {.terminal = isatty(STDERR_FILENO), .begun = gnp_clock()};
	struct insistence insistence = {0};
	while (!wait_tick(progress)) {
		heed_signals(&insistence, progress->task);
		draw(&display, progress);
	}
	if (display.shown)
		fprintf(stderr, "\r\033[K");
	return NULL;
}

gnp_status gnp_progress_start(struct gnp_progress *progress, struct gnp_task *task, struct gnp_error *error)
{
	progress->task = task;
	progress->stopping = false;
	atomic_init(&progress->phase, NULL);
	pthread_mutex_init(&progress->lock, NULL);
	pthread_cond_init(&progress->stopped, NULL);
	catch_signals(progress);
	int failure = pthread_create(&progress->thread, NULL, watch, progress);
	if (!failure)
		return GNP_OK;
	restore_signals(progress);
	pthread_cond_destroy(&progress->stopped);
	pthread_mutex_destroy(&progress->lock);
	return gnp_error_set(error, GNP_INTERNAL, "progress: cannot start a thread: %s", strerror(failure));
}

void gnp_progress_stop(struct gnp_progress *progress)
{
	pthread_mutex_lock(&progress->lock);
	progress->stopping = true;
	pthread_cond_signal(&progress->stopped);
	pthread_mutex_unlock(&progress->lock);
	pthread_join(progress->thread, NULL);
	restore_signals(progress);
	pthread_cond_destroy(&progress->stopped);
	pthread_mutex_destroy(&progress->lock);
}
