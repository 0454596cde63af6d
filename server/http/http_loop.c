#include "server/http/http_loop.h"

#include <errno.h>
#include <limits.h>
#include <microhttpd.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

struct gnpd_http_loop {
	struct MHD_Daemon *daemon;
	int sockets; /* the library's set of them: readable when one is ready */
	int wake;    /* an eventfd: readable when somebody wants the loop to look */
	atomic_bool stop;
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

static unsigned connections(struct MHD_Daemon *daemon)
{
	const union MHD_DaemonInfo *information = MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_CURRENT_CONNECTIONS);
	return information ? information->num_connections : 0;
}

/* Where one has ended there may be room for one that waits, and only the next run listens again. */
static void run(struct MHD_Daemon *daemon)
{
	unsigned before;
	do {
		before = connections(daemon);
		MHD_run(daemon);
	} while (connections(daemon) < before);
}

static void *serve(void *argument)
{
	struct gnpd_http_loop *loop = argument;
	struct pollfd polls[] = {{.fd = loop->sockets, .events = POLLIN}, {.fd = loop->wake, .events = POLLIN}};
	uint64_t calls;
	pthread_setname_np(pthread_self(), "http");
	while (!atomic_load(&loop->stop)) {
		if (poll(polls, 2, patience(loop->daemon)) < 0) {
			usleep(1000); /* a signal, or no memory for the call: the sockets are still there */
			continue;
		}
		if (polls[1].revents && read(loop->wake, &calls, sizeof calls) < 0)
			usleep(1000);
		run(loop->daemon);
	}
	return NULL;
}

static void wake(struct gnpd_http_loop *loop)
{
	const uint64_t one = 1;
	ssize_t wrote = write(loop->wake, &one, sizeof one);
	(void)wrote; /* fails only when 2^64 calls have not been heard */
}

gnp_status gnpd_http_loop_start(struct MHD_Daemon *daemon, struct gnpd_http_loop **out, struct gnp_error *error)
{
	const union MHD_DaemonInfo *information = MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_EPOLL_FD);
	struct gnpd_http_loop *loop = calloc(1, sizeof *loop);
	if (!loop || !information) {
		free(loop);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "http: no memory for a thread");
	}
	loop->daemon = daemon;
	loop->sockets = information->epoll_fd;
	loop->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
	atomic_init(&loop->stop, false);
	*out = loop;
	int fault = loop->wake < 0 ? errno : pthread_create(&loop->thread, NULL, serve, loop);
	if (!fault)
		return GNP_OK;
	if (loop->wake >= 0)
		close(loop->wake);
	free(loop);
	*out = NULL;
	return gnp_error_set(error, GNP_IO, "http: no thread: %s", strerror(fault));
}

void gnpd_http_loop_resume(struct gnpd_http_loop *loop, struct MHD_Connection *connection)
{
	MHD_resume_connection(connection);
	wake(loop);
}

void gnpd_http_loop_stop(struct gnpd_http_loop *loop)
{
	if (!loop)
		return;
	atomic_store(&loop->stop, true);
	wake(loop);
	pthread_join(loop->thread, NULL);
	close(loop->wake);
	free(loop);
}
