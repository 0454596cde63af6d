#include "server/base/inherit.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { SOCKETS_MAX = 16 };

static bool option_is(int fd, int option, int wanted)
{
	int value;
	socklen_t size = sizeof value;
	return getsockopt(fd, SOL_SOCKET, option, &value, &size) == 0 && value == wanted;
}

static gnp_status adopt(int fd, const char *name, size_t length, struct gnpd_inherited *out, struct gnp_error *error)
{
	bool admin = length == 5 && memcmp(name, "admin", 5) == 0;
	int *place = admin ? &out->admin : &out->main, flags = fcntl(fd, F_GETFL);
	if (!option_is(fd, SO_TYPE, SOCK_STREAM) || !option_is(fd, SO_ACCEPTCONN, 1))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "LISTEN_FDS: descriptor %d (\"%.*s\"): not a listening stream socket", fd,
		                     (int)(length < 80 ? length : 80), name);
	if (*place >= 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "LISTEN_FDS: got two sockets for the %s listener, need at most 1",
		                     admin ? "admin" : "main");
	if (flags < 0 || fcntl(fd, F_SETFD, FD_CLOEXEC) != 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) != 0)
		return gnp_error_set(error, GNP_IO, "LISTEN_FDS: descriptor %d: %s", fd, strerror(errno));
	*place = fd;
	return GNP_OK;
}

gnp_status gnpd_inherit(const char *pid, const char *count, const char *names, int first, struct gnpd_inherited *out,
                        struct gnp_error *error)
{
	struct gnpd_inherited got = {-1, -1};
	char *end;
	*out = got;
	if (!pid || !count || strtol(pid, NULL, 10) != (long)getpid())
		return GNP_OK;
	long sockets = strtol(count, &end, 10);
	if (end == count || *end || sockets < 0 || sockets > SOCKETS_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "LISTEN_FDS: got \"%.40s\", need 0..%d", count, SOCKETS_MAX);
	gnp_status status = GNP_OK;
	for (int i = 0; i < sockets && status == GNP_OK; i++) {
		size_t length = names ? strcspn(names, ":") : 0;
		status = adopt(first + i, names ? names : "", length, &got, error);
		if (names)
			names += length + (names[length] == ':');
	}
	for (int i = 0; i < sockets && status != GNP_OK; i++)
		close(first + i);
	if (status == GNP_OK)
		*out = got;
	return status;
}
