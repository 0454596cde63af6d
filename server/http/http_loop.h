/* A thread that serves sockets: a daemon of libmicrohttpd's that has no thread of its own.
 *
 * The library's threads take events from the kernel 128 at a time and, when there were as many, wait for more before
 * they look at them. Where exactly 128 connections are ready at once and nothing else happens, all of them wait: until
 * a deadline cuts one, 10 seconds in the tests (MHD_epoll of 0.9.75). Here the waiting is done outside the library,
 * which is only ever asked for what is there. */
#ifndef GNPD_HTTP_LOOP_H
#define GNPD_HTTP_LOOP_H

#include "core/base/status.h"

struct MHD_Connection;
struct MHD_Daemon;
struct gnpd_http_loop;

/* daemon: started with MHD_USE_EPOLL and without a thread, nobody else's until the loop was stopped. *out is set before the first of its
 * callbacks. GNP_OUT_OF_MEMORY, GNP_IO. */
gnp_status gnpd_http_loop_start(struct MHD_Daemon *daemon, struct gnpd_http_loop **out, struct gnp_error *error);

/* Any thread: the suspended connection is the daemon's again, and the loop sees to it. */
void gnpd_http_loop_resume(struct gnpd_http_loop *loop, struct MHD_Connection *connection);

/* Ends the thread and frees. The daemon is the caller's again. NULL is allowed. */
void gnpd_http_loop_stop(struct gnpd_http_loop *loop);

#endif
