#include "server/http/listeners.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "server/base/listen.h"
#include "server/base/log.h"
#include "server/config/config.h"

/* One of the two, while it is made. */
struct listener {
	const char *key, *text, *port_key, *port_file; /* of the configuration: names and values */
	bool admin;
	int fd; /* -1 when there is none */
	unsigned port;
	bool loopback, local; /* local: a socket of this machine's files, which no browser opens */
};

/* Written beside and renamed, so that whoever waits for the file never reads half of it. */
static gnp_status write_port_file(const struct listener *listener, struct gnp_error *error)
{
	char beside[GNPD_CONFIG_TEXT + 8];
	const char *path = listener->port_file;
	if (!*path || listener->fd < 0)
		return GNP_OK;
	snprintf(beside, sizeof beside, "%s.new", path);
	FILE *file = fopen(beside, "w");
	if (!file)
		return gnp_error_set(error, GNP_IO, "%s: %s: %s", listener->port_key, beside, strerror(errno));
	bool written = fprintf(file, "%u\n", listener->port) > 0;
	written = fclose(file) == 0 && written;
	if (!written || rename(beside, path) != 0)
		return gnp_error_set(error, GNP_IO, "%s: %s: %s", listener->port_key, path, strerror(errno));
	return GNP_OK;
}

static gnp_status open_socket(struct listener *listener, struct gnp_error *error)
{
	struct gnpd_address address;
	struct gnp_error cause = {0};
	if (!listener->text[0])
		return GNP_OK;
	gnp_status status = gnpd_address_parse(listener->text, &address, &cause);
	if (status == GNP_OK)
		status = gnpd_listen_open(&address, &listener->fd, &listener->port, &cause);
	return status == GNP_OK ? GNP_OK : gnp_error_set(error, status, "%s: %s", listener->key, cause.text);
}

/* Are the names clients call the listener by known? On loopback they are, but a listener that only answers to keys may stand behind a proxy
 * that passes on any name, and a page that has none gets nowhere. Of an address that others reach only the configuration can tell. */
static bool is_named(const struct gnpd_server *server, const struct listener *listener)
{
	if (server->engine.config->allowed_hosts[0])
		return true;
	return listener->loopback && !listener->local && (listener->admin || !server->engine.config->keys_file[0]);
}

/* Anybody may use it, pages in the browsers of those who reach it among them. */
static void warn_of_pages(struct gnpd_server *server, const struct listener *listener)
{
	if (!listener->loopback && !server->engine.config->keys_file[0] && !is_named(server, listener))
		gnpd_log_event(server->engine.log, GNPD_LOG_WARNING,
		               "%s: is open without keys under any name: a page whose name resolves to it uses it through "
		               "its visitors' browsers (allowed-hosts names those it has)", listener->key);
}

/* What was handed over is judged by where it is bound. */
static gnp_status check_socket(struct gnpd_server *server, struct listener *listener, struct gnp_error *error)
{
	struct gnpd_address address;
	char text[GNPD_ADDRESS_TEXT];
	if (listener->fd < 0)
		return GNP_OK;
	gnp_status status = gnpd_listen_address(listener->fd, &address, &listener->port, error);
	if (status != GNP_OK)
		return status;
	listener->loopback = gnpd_address_is_loopback(&address);
	listener->local = address.storage.ss_family == AF_UNIX;
	gnpd_address_format(&address, text);
	if (!listener->loopback)
		status = gnpd_config_allows(server->engine.config, listener->key, text, error);
	if (status == GNP_OK && !listener->loopback && !server->tls)
		gnpd_log_event(server->engine.log, GNPD_LOG_WARNING,
		               "%s: %s can be reached from other machines without TLS: keys and data are sent in "
		               "the clear (tls-certificate)", listener->key, text);
	if (status == GNP_OK)
		warn_of_pages(server, listener);
	return status;
}

static gnp_status start(struct gnpd_server *server, struct listener *listener, struct gnpd_http **out, struct gnp_error *error)
{
	if (listener->fd < 0)
		return GNP_OK;
	bool tls = server->tls && !(listener->admin && listener->loopback);
	gnp_status status = gnpd_http_start_take(server, listener->fd, listener->admin, tls, is_named(server, listener), out, error);
	if (status != GNP_OK)
		listener->fd = -1;
	else
		gnpd_log_event(server->engine.log, GNPD_LOG_INFO, "%s: port %u%s", listener->key, listener->port,
		               tls ? ", TLS" : "");
	return status;
}

static void close_unstarted(const struct listener *listener, const struct gnpd_http *http)
{
	if (listener->fd >= 0 && !http)
		close(listener->fd);
}

gnp_status gnpd_listeners_start_take(struct gnpd_server *server, const struct gnpd_inherited *inherited, struct gnpd_listeners *out,
                                     struct gnp_error *error)
{
	const struct gnpd_config *config = server->engine.config;
	struct listener main = {"listen", config->listen, "port-file", config->port_file, false, inherited->main, 0, false, false};
	struct listener admin = {"admin-listen", config->admin_listen, "admin-port-file", config->admin_port_file, true,
	                         inherited->admin, 0, false, false};
	gnp_status status = GNP_OK;
	*out = (struct gnpd_listeners){NULL, NULL};
	if (main.fd < 0)
		status = open_socket(&main, error);
	if (status == GNP_OK && admin.fd < 0)
		status = open_socket(&admin, error);
	if (status == GNP_OK)
		status = check_socket(server, &main, error);
	if (status == GNP_OK)
		status = check_socket(server, &admin, error);
	if (status == GNP_OK)
		status = start(server, &main, &out->main, error);
	if (status == GNP_OK)
		status = start(server, &admin, &out->admin, error);
	if (status == GNP_OK)
		status = write_port_file(&admin, error);
	if (status == GNP_OK)
		status = write_port_file(&main, error);
	if (status == GNP_OK)
		return GNP_OK;
	close_unstarted(&main, out->main);
	close_unstarted(&admin, out->admin);
	gnpd_listeners_stop(out);
	return status;
}

void gnpd_listeners_stop(struct gnpd_listeners *listeners)
{
	gnpd_http_stop(listeners->main);
	gnpd_http_stop(listeners->admin);
	*listeners = (struct gnpd_listeners){NULL, NULL};
}
