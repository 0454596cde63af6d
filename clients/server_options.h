/* Options of commands that ask a server: whom it may be, and what it is shown. */
#ifndef GNP_CLIENTS_SERVER_OPTIONS_H
#define GNP_CLIENTS_SERVER_OPTIONS_H

#include "clients/http_client.h"
#include "clients/options.h"

#define GNP_SERVER_OPTIONS                                                                                          \
	{"cacert", 0, "FILE", "certificates that show who the server is (default: the system's)"},                      \
	{"key", 0, "KEY", "key for the server (better in the environment variable GNP_KEY, which others do not see)"}

/* Fills cacert and key. asks: whether the command asks a server at all; else the options are refused, and a key in the environment is
 * none of its business. */
gnp_status gnp_server_options_take(const struct gnp_arguments *arguments, bool asks, struct gnp_http_request *request,
                                   struct gnp_error *error);

#endif
