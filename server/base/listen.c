#include "server/base/listen.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/un.h>
#include <unistd.h>

static bool parse_port(const char *text, in_port_t *port)
{
	size_t digits = strspn(text, "0123456789");
	if (digits == 0 || digits > 5 || text[digits] != '\0')
		return false;
	unsigned long value = strtoul(text, NULL, 10);
	*port = htons((uint16_t)value);
	return value <= 65535;
}

/* Fills address from a host without brackets. */
static bool parse_host(const char *host, in_port_t port, struct gnpd_address *address)
{
	struct sockaddr_in *four = (struct sockaddr_in *)&address->storage;
	struct sockaddr_in6 *six = (struct sockaddr_in6 *)&address->storage;
	memset(address, 0, sizeof *address);
	if (inet_pton(AF_INET, strcmp(host, "localhost") == 0 ? "127.0.0.1" : host, &four->sin_addr) == 1) {
		four->sin_family = AF_INET;
		four->sin_port = port;
		address->size = sizeof *four;
		return true;
	}
	if (inet_pton(AF_INET6, host, &six->sin6_addr) != 1)
		return false;
	six->sin6_family = AF_INET6;
	six->sin6_port = port;
	address->size = sizeof *six;
	return true;
}

gnp_status gnpd_address_parse(const char *text, struct gnpd_address *address, struct gnp_error *error)
{
	const char *colon = strrchr(text, ':');
	char host[INET6_ADDRSTRLEN + 2];
	in_port_t port;
	size_t length = colon ? (size_t)(colon - text) : 0;
	bool bracketed = length > 2 && text[0] == '[' && text[length - 1] == ']';
	if (bracketed) {
		text++;
		length -= 2;
	}
	if (length == 0 || length >= sizeof host || !parse_port(colon + 1, &port))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "got \"%s\", need ADDRESS:PORT", text);
	memcpy(host, text, length);
	host[length] = '\0';
	if ((strchr(host, ':') != NULL) != bracketed || !parse_host(host, port, address))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "got \"%s\", need a numeric address and a port", host);
	return GNP_OK;
}

bool gnpd_address_is_loopback(const struct gnpd_address *address)
{
	if (address->storage.ss_family == AF_UNIX)
		return true;
	if (address->storage.ss_family == AF_INET) {
		const struct sockaddr_in *four = (const struct sockaddr_in *)&address->storage;
		return ntohl(four->sin_addr.s_addr) >> 24 == 127;
	}
	const struct sockaddr_in6 *six = (const struct sockaddr_in6 *)&address->storage;
	return IN6_IS_ADDR_LOOPBACK(&six->sin6_addr);
}

static unsigned port_of(const struct gnpd_address *address)
{
	if (address->storage.ss_family == AF_INET)
		return ntohs(((const struct sockaddr_in *)&address->storage)->sin_port);
	return address->storage.ss_family == AF_INET6 ? ntohs(((const struct sockaddr_in6 *)&address->storage)->sin6_port) : 0;
}

void gnpd_address_format(const struct gnpd_address *address, char text[GNPD_ADDRESS_TEXT])
{
	char host[INET6_ADDRSTRLEN] = "";
	if (address->storage.ss_family == AF_UNIX) {
		const struct sockaddr_un *local = (const struct sockaddr_un *)&address->storage;
		snprintf(text, GNPD_ADDRESS_TEXT, "%s", local->sun_path[0] ? local->sun_path : "(unnamed)");
	} else if (address->storage.ss_family == AF_INET) {
		inet_ntop(AF_INET, &((const struct sockaddr_in *)&address->storage)->sin_addr, host, sizeof host);
		snprintf(text, GNPD_ADDRESS_TEXT, "%s:%u", host, port_of(address));
	} else {
		inet_ntop(AF_INET6, &((const struct sockaddr_in6 *)&address->storage)->sin6_addr, host, sizeof host);
		snprintf(text, GNPD_ADDRESS_TEXT, "[%s]:%u", host, port_of(address));
	}
}

gnp_status gnpd_listen_address(int fd, struct gnpd_address *address, unsigned *port, struct gnp_error *error)
{
	memset(address, 0, sizeof *address);
	address->size = sizeof address->storage - 1; /* the path of a local socket ends in a NUL */
	if (getsockname(fd, (struct sockaddr *)&address->storage, &address->size) != 0)
		return gnp_error_set(error, GNP_IO, "socket: %s", strerror(errno));
	sa_family_t family = address->storage.ss_family;
	if (family != AF_INET && family != AF_INET6 && family != AF_UNIX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "socket: got family %d, need IPv4, IPv6 or a local one", family);
	*port = port_of(address);
	return GNP_OK;
}

gnp_status gnpd_listen_open(const struct gnpd_address *address, int *fd, unsigned *port, struct gnp_error *error)
{
	const int yes = 1, backlog = 1024;
	int s = socket(address->storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (s < 0)
		return gnp_error_set(error, GNP_IO, "socket: %s", strerror(errno));
	setsockopt(s, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
	if (bind(s, (const struct sockaddr *)&address->storage, address->size) != 0 || listen(s, backlog) != 0) {
		gnp_error_set(error, GNP_IO, "%s", strerror(errno));
		close(s);
		return GNP_IO;
	}
	struct gnpd_address bound;
	if (gnpd_listen_address(s, &bound, port, error) != GNP_OK) {
		close(s);
		return GNP_IO;
	}
	*fd = s;
	return GNP_OK;
}
