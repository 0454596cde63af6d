#include "server/parse/site.h"

#include <arpa/inet.h>
#include <stdbool.h>
#include <string.h>
#include <strings.h>

/* A piece of a text, not ended. */
struct piece {
	const char *text;
	size_t size;
};

struct place {
	struct piece host, port; /* brackets and a last dot are no part of the host; the port may be empty */
	bool numeric;
};

static bool same(struct piece a, struct piece b)
{
	return a.size == b.size && strncasecmp(a.text, b.text, a.size) == 0;
}

static struct piece piece_of(const char *text)
{
	return (struct piece){text, strlen(text)};
}

static bool ends_in(struct piece piece, const char *end)
{
	struct piece tail = piece_of(end);
	return piece.size > tail.size && same((struct piece){piece.text + piece.size - tail.size, tail.size}, tail);
}

static bool is_numeric(struct piece host, int family)
{
	unsigned char address[sizeof(struct in6_addr)];
	char text[INET6_ADDRSTRLEN];
	if (host.size >= sizeof text)
		return false;
	memcpy(text, host.text, host.size);
	text[host.size] = '\0';
	return inet_pton(family, text, address) == 1;
}

/* The host at the begin of text; what follows it is returned, NULL when there is none. */
static const char *take_host(const char *text, struct place *place)
{
	static const char marks[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._";
	bool bracketed = *text == '[';
	text += bracketed;
	size_t size = bracketed ? strcspn(text, "]") : strspn(text, marks);
	const char *rest = text + size;
	place->host = (struct piece){text, size};
	place->numeric = is_numeric(place->host, bracketed ? AF_INET6 : AF_INET);
	if (bracketed)
		return *rest == ']' && place->numeric ? rest + 1 : NULL;
	if (size > 1 && text[size - 1] == '.')
		place->host.size--;
	return size ? rest : NULL;
}

/* NAME[:PORT], nothing behind it. */
static bool parse_place(const char *text, struct place *place)
{
	const char *rest = take_host(text, place);
	if (rest && *rest == ':')
		rest++;
	else if (rest && *rest)
		return false;
	if (!rest)
		return false;
	place->port = piece_of(rest);
	return strspn(rest, "0123456789") == place->port.size;
}

/* The next name of a list; false at its end. */
static bool next_name(const char **list, struct piece *name)
{
	static const char between[] = ", \t";
	*list += strspn(*list, between);
	*name = (struct piece){*list, strcspn(*list, between)};
	*list += name->size;
	return name->size > 0;
}

static bool is_listed(const char *list, struct piece host)
{
	for (struct piece name; next_name(&list, &name);) {
		if (*name.text == '[')
			name = (struct piece){name.text + 1, name.size - 2};
		else if (name.text[name.size - 1] == '.')
			name.size--;
		if (same(name, host))
			return true;
	}
	return false;
}

gnp_status gnpd_site_check_list(const char *allowed, struct gnp_error *error)
{
	for (struct piece name; next_name(&allowed, &name);) {
		struct place place = {0};
		const char *rest = take_host(name.text, &place);
		bool whole = rest == name.text + name.size || is_numeric(name, AF_INET6);
		if (!whole && !same(name, piece_of("*")))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "got \"%.*s\", need names without scheme and port, separated by commas, or *",
			                     name.size < 80 ? (int)name.size : 80, name.text);
	}
	return GNP_OK;
}

gnp_status gnpd_site_check_host(const struct gnpd_site *site, const char *allowed, struct gnp_error *error)
{
	struct place place;
	if (!site->host || !*site->host)
		return GNP_OK;
	if (!parse_place(site->host, &place))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "host: got \"%.80s\", need NAME or NAME:PORT", site->host);
	if (place.numeric || same(place.host, piece_of("localhost")) || ends_in(place.host, ".localhost"))
		return GNP_OK;
	if (is_listed(allowed, place.host) || is_listed(allowed, piece_of("*")))
		return GNP_OK;
	return gnp_error_set(error, GNP_FORBIDDEN, "host: got \"%.80s\", need localhost, a numeric address%s%.160s (allowed-hosts)", site->host,
	                     *allowed ? " or one of " : " or a name that is allowed", allowed);
}

/* A port that is not given is the scheme's. */
static bool same_port(struct piece a, struct piece b, const char *usual)
{
	return same(a.size ? a : piece_of(usual), b.size ? b : piece_of(usual));
}

static bool is_own_origin(const struct gnpd_site *site, const char *allowed)
{
	struct place origin, host;
	const char *colon = strstr(site->origin, "://");
	if (!colon || !parse_place(colon + 3, &origin))
		return false;
	if (is_listed(allowed, origin.host))
		return true;
	const char *usual = strncasecmp(site->origin, "https:", 6) == 0 ? "443" : "80";
	return site->host && parse_place(site->host, &host) && same(origin.host, host.host) && same_port(origin.port, host.port, usual);
}

gnp_status gnpd_site_check_origin(const struct gnpd_site *site, const char *allowed, struct gnp_error *error)
{
	if (site->fetch) {
		if (strcmp(site->fetch, "same-origin") == 0 || strcmp(site->fetch, "none") == 0)
			return GNP_OK;
		return gnp_error_set(error, GNP_FORBIDDEN, "Sec-Fetch-Site: got \"%.40s\", need same-origin or none: pages of other sites may not "
		                     "change anything here", site->fetch);
	}
	if (!site->origin || is_own_origin(site, allowed))
		return GNP_OK;
	return gnp_error_set(error, GNP_FORBIDDEN, "Origin: got \"%.80s\", need that of this server, \"%.80s\", or of a name that is allowed "
	                     "(allowed-hosts): pages of other sites may not change anything here", site->origin, site->host ? site->host : "");
}
