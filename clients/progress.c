#include "progress.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "command.h"

enum { TICK_NANOSECONDS = 100000000 };
#define SHOW_AFTER 0.3 /* seconds: what is done sooner needs no bar */

/* The signals waited for; SIGUSR1, sent to the thread alone, ends it. */
static void watched(sigset_t *set)
{
	sigemptyset(set);
	sigaddset(set, SIGINT);
	sigaddset(set, SIGTERM);
	sigaddset(set, SIGUSR1);
}

void gnp_progress_format(const char *phase, double fraction, double elapsed, char *line, size_t size)
{
	enum { WIDTH = 30 };
	char bar[WIDTH + 1], left[32] = "";
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
	gnp_progress_format(phase, gnp_task_fraction(progress->task), now - display->phase_begun, line, sizeof line);
	fprintf(stderr, "\r%s\033[K", line);
	display->shown = true;
}

static void *watch(void *argument)
{
	struct gnp_progress *progress = argument;
	struct display display = {.terminal = isatty(STDERR_FILENO), .begun = gnp_clock()};
	const struct timespec tick = {0, TICK_NANOSECONDS};
	bool interrupted = false;
	sigset_t set;
	watched(&set);
	for (;;) {
		int signal = sigtimedwait(&set, NULL, &tick);
		if (signal == SIGUSR1)
			break;
		if (signal > 0 && interrupted)
			_exit(GNP_EXIT_CANCELLED);
		if (signal > 0) {
			interrupted = true;
			gnp_task_cancel(progress->task);
		}
		draw(&display, progress);
	}
	if (display.shown)
		fprintf(stderr, "\r\033[K");
	return NULL;
}

gnp_status gnp_progress_start(struct gnp_progress *progress, struct gnp_task *task, struct gnp_error *error)
{
	sigset_t set;
	watched(&set);
	progress->task = task;
	atomic_init(&progress->phase, NULL);
	pthread_sigmask(SIG_BLOCK, &set, &progress->previous);
	int failure = pthread_create(&progress->thread, NULL, watch, progress);
	if (failure) {
		pthread_sigmask(SIG_SETMASK, &progress->previous, NULL);
		return gnp_error_set(error, GNP_INTERNAL, "progress: cannot start a thread: %s", strerror(failure));
	}
	return GNP_OK;
}

void gnp_progress_stop(struct gnp_progress *progress)
{
	pthread_kill(progress->thread, SIGUSR1);
	pthread_join(progress->thread, NULL);
	pthread_sigmask(SIG_SETMASK, &progress->previous, NULL);
}
