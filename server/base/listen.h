/* Opens listening sockets, at numeric addresses only, so that no name service decides who can reach the server. */
#ifndef GNPD_LISTEN_H
#define GNPD_LISTEN_H

#include <stdbool.h>
#include <sys/socket.h>

#include "core/base/status.h"

struct gnpd_address {
	struct sockaddr_storage storage;
	socklen_t size;
};

/* "127.0.0.1:8080", "[::1]:0" or "localhost:8080" (which is 127.0.0.1). */
gnp_status gnpd_address_parse(const char *text, struct gnpd_address *address, struct gnp_error *error);
/* Only this machine reaches it: loopback, or a local socket. */
bool gnpd_address_is_loopback(const struct gnpd_address *address);

enum { GNPD_ADDRESS_TEXT = 128 };
/* As gnpd_address_parse reads it; the path of a local socket. */
void gnpd_address_format(const struct gnpd_address *address, char text[GNPD_ADDRESS_TEXT]);

/* A non-blocking, close-on-exec socket bound and listening; *port is the one it got. The caller closes *fd. */
gnp_status gnpd_listen_open(const struct gnpd_address *address, int *fd, unsigned *port, struct gnp_error *error);

/* Where an open socket is bound: IPv4, IPv6 or a local one, else GNP_INVALID_ARGUMENT. *port: 0 of a local one. */
gnp_status gnpd_listen_address(int fd, struct gnpd_address *address, unsigned *port, struct gnp_error *error);

#endif
