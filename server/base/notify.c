#include "server/base/notify.h"

#include <errno.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

struct gnpd_notify {
	int fd;
	struct sockaddr_un address;
	socklen_t size;
	double limit; /* seconds the manager waits for a sign of life; 0: it does not */
	double due;   /* when the next is */
};

/* "/path", or "@name" of the abstract namespace. */
static gnp_status set_address(struct gnpd_notify *notify, const char *name, struct gnp_error *error)
{
	size_t length = strlen(name);
	if ((name[0] != '/' && name[0] != '@') || length < 2 || length >= sizeof notify->address.sun_path)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "NOTIFY_SOCKET: got \"%.120s\", need a path or @name of 2..%zu characters",
		                     name, sizeof notify->address.sun_path - 1);
	notify->address.sun_family = AF_UNIX;
	memcpy(notify->address.sun_path, name, length);
	if (name[0] == '@')
		notify->address.sun_path[0] = '\0';
	notify->size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length + (name[0] == '/'));
	return GNP_OK;
}

/* A watchdog meant for another process is none of ours. */
static double watchdog_limit(const char *usec, const char *pid)
{
	char *end;
	if (!usec || (pid && strtol(pid, NULL, 10) != (long)getpid()))
		return 0;
	double limit = strtod(usec, &end);
	return end != usec && *end == '\0' && limit > 0 && limit < 1e15 ? limit / 1e6 : 0;
}

gnp_status gnpd_notify_create(const char *socket_name, const char *watchdog_usec, const char *watchdog_pid, struct gnpd_notify **out,
                              struct gnp_error *error)
{
	if (!socket_name || !*socket_name) {
		*out = NULL;
		return GNP_OK;
	}
	struct gnpd_notify *notify = calloc(1, sizeof *notify);
	if (!notify)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "notify: no memory");
	notify->fd = -1;
	gnp_status status = set_address(notify, socket_name, error);
	if (status == GNP_OK && (notify->fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) < 0)
		status = gnp_error_set(error, GNP_IO, "notify: socket: %s", strerror(errno));
	notify->limit = watchdog_limit(watchdog_usec, watchdog_pid);
	if (status == GNP_OK)
		*out = notify;
	else
		gnpd_notify_free(notify);
	return status;
}

void gnpd_notify_free(struct gnpd_notify *notify)
{
	if (!notify)
		return;
	if (notify->fd >= 0)
		close(notify->fd);
	free(notify);
}

double gnpd_notify_interval(const struct gnpd_notify *notify)
{
	const double longest = 5;
	if (!notify)
		return 0;
	return notify->limit > 0 && notify->limit / 2 < longest ? notify->limit / 2 : longest;
}

bool gnpd_notify_due(struct gnpd_notify *notify, double now)
{
	if (!notify || now < notify->due)
		return false;
	notify->due = now + 0.9 * gnpd_notify_interval(notify);
	return true;
}

static void tell(struct gnpd_notify *notify, const char *text)
{
	if (notify)
		sendto(notify->fd, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT, (struct sockaddr *)&notify->address, notify->size);
}

void gnpd_notify_ready(struct gnpd_notify *notify)
{
	tell(notify, "READY=1\nSTATUS=ready");
}

void gnpd_notify_reloading(struct gnpd_notify *notify)
{
	char text[96];
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	snprintf(text, sizeof text, "RELOADING=1\nMONOTONIC_USEC=%llu\nSTATUS=reloading",
	         (unsigned long long)now.tv_sec * 1000000 + (unsigned long long)now.tv_nsec / 1000);
	tell(notify, text);
}

void gnpd_notify_stopping(struct gnpd_notify *notify, double seconds)
{
	char text[96];
	snprintf(text, sizeof text, "STOPPING=1\nEXTEND_TIMEOUT_USEC=%.0f\nSTATUS=draining", 1e6 * seconds);
	tell(notify, text);
}

void gnpd_notify_alive(struct gnpd_notify *notify)
{
	if (notify && notify->limit > 0)
		tell(notify, "WATCHDOG=1");
}

void gnpd_notify_status(struct gnpd_notify *notify, const char *format, ...)
{
	char text[256] = "STATUS=";
	size_t used = strlen(text);
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text + used, sizeof text - used, format, arguments);
	va_end(arguments);
	text[used + strcspn(text + used, "\n")] = '\0';
	tell(notify, text);
}
