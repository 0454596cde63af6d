#include "listen.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
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
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "listen: got \"%s\", need ADDRESS:PORT", text);
	memcpy(host, text, length);
	host[length] = '\0';
	if ((strchr(host, ':') != NULL) != bracketed || !parse_host(host, port, address))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "listen: got \"%s\", need a numeric address and a port", host);
	return GNP_OK;
}

bool gnpd_address_is_loopback(const struct gnpd_address *address)
{
	if (address->storage.ss_family == AF_INET) {
		const struct sockaddr_in *four = (const struct sockaddr_in *)&address->storage;
		return ntohl(four->sin_addr.s_addr) >> 24 == 127;
	}
	const struct sockaddr_in6 *six = (const struct sockaddr_in6 *)&address->storage;
	return IN6_IS_ADDR_LOOPBACK(&six->sin6_addr);
}

static unsigned bound_port(int fd)
{
	struct sockaddr_storage storage;
	socklen_t size = sizeof storage;
	if (getsockname(fd, (struct sockaddr *)&storage, &size) != 0)
		return 0;
	if (storage.ss_family == AF_INET)
		return ntohs(((struct sockaddr_in *)&storage)->sin_port);
	return ntohs(((struct sockaddr_in6 *)&storage)->sin6_port);
}

gnp_status gnpd_listen_open(const struct gnpd_address *address, int *fd, unsigned *port, struct gnp_error *error)
{
	const int yes = 1, backlog = 1024;
	int s = socket(address->storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (s < 0)
		return gnp_error_set(error, GNP_IO, "listen: socket: %s", strerror(errno));
	setsockopt(s, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
	if (bind(s, (const struct sockaddr *)&address->storage, address->size) != 0 || listen(s, backlog) != 0) {
		gnp_error_set(error, GNP_IO, "listen: %s", strerror(errno));
		close(s);
		return GNP_IO;
	}
	*port = bound_port(s);
	*fd = s;
	return GNP_OK;
}
