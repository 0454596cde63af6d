#include "clients/server_options.h"

#include <stdlib.h>

gnp_status gnp_server_options_take(const struct gnp_arguments *arguments, bool asks, struct gnp_http_request *request,
                                   struct gnp_error *error)
{
	request->cacert = gnp_arguments_get(arguments, "cacert", NULL);
	request->key = gnp_arguments_get(arguments, "key", NULL);
	if (!asks && (request->cacert || request->key))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: is for a server, and there is no --url", request->key ? "key" : "cacert");
	if (!request->key)
		request->key = getenv("GNP_KEY");
	return asks && request->key && *request->key ? gnp_http_check_key(request->key, error) : GNP_OK;
}
