#include "http_loop.h"

#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

struct gnpd_http_loop {
	struct MHD_Daemon *daemon;
	int events; /* the library's set of sockets: readable when one of them is ready */
	int stop;   /* readable when the loop has to end */
	pthread_t thread;
};

/* Milliseconds until the library wants to be asked again, -1: not before something happens. */
static int patience(struct MHD_Daemon *daemon)
{
	unsigned MHD_LONG_LONG most;
	if (MHD_get_timeout(daemon, &most) != MHD_YES)
		return -1;
	return most > INT_MAX ? INT_MAX : (int)most;
}

static void *serve(void *argument)
{
	struct gnpd_http_loop *loop = argument;
	struct pollfd polls[] = {{.fd = loop->events, .events = POLLIN}, {.fd = loop->stop, .events = POLLIN}};
	pthread_setname_np(pthread_self(), "http");
	while (!polls[1].revents) {
		if (poll(polls, 2, patience(loop->daemon)) >= 0)
			MHD_run(loop->daemon);
		else if (errno != EINTR)
			usleep(1000); /* no memory for the call: the sockets are still there */
	}
	return NULL;
}

gnp_status gnpd_http_loop_start(struct MHD_Daemon *daemon, struct gnpd_http_loop **out, struct gnp_error *error)
{
	const union MHD_DaemonInfo *information = MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_EPOLL_FD);
	struct gnpd_http_loop *loop = calloc(1, sizeof *loop);
	if (!loop || !information) {
		free(loop);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "http: no memory for a thread");
	}
	*loop = (struct gnpd_http_loop){.daemon = daemon, .events = information->epoll_fd, .stop = eventfd(0, EFD_CLOEXEC)};
	int fault = loop->stop < 0 ? errno : pthread_create(&loop->thread, NULL, serve, loop);
	if (!fault) {
		*out = loop;
		return GNP_OK;
	}
	if (loop->stop >= 0)
		close(loop->stop);
	free(loop);
	return gnp_error_set(error, GNP_IO, "http: no thread: %s", strerror(fault));
}

void gnpd_http_loop_stop(struct gnpd_http_loop *loop)
{
	const uint64_t one = 1;
	if (!loop)
		return;
	ssize_t wrote = write(loop->stop, &one, sizeof one);
	(void)wrote; /* eight bytes to an eventfd that holds 0 */
	pthread_join(loop->thread, NULL);
	close(loop->stop);
	free(loop);
}
