/* What the admin listener alone answers: loading again, the log's level, the configuration. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "routes.h"
#include "server.h"

static struct gnp_buffer *begin_json(struct gnpd_request *request, int code)
{
	request->reply.code = code;
	request->reply.content_type = "application/json";
	return &request->reply.body;
}

gnp_status gnpd_admin_reload(struct gnpd_request *request, struct gnp_error *error)
{
	unsigned long number = gnpd_reloader_ask(request->server->reloader);
	gnpd_log_event(&request->server->log, "info", "reload %lu: asked for by the admin listener", number);
	gnpd_reply_header(request, "Location", "/admin/reload");
	return gnp_buffer_printf(begin_json(request, 202), error, "{\"reload\":%lu}\n", number);
}

static gnp_status put_string(struct gnp_buffer *body, const char *text, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_append(body, "\"", 1, error);
	for (; *text && status == GNP_OK; text++) {
		unsigned char c = (unsigned char)*text;
		if (c == '"' || c == '\\')
			status = gnp_buffer_printf(body, error, "\\%c", c);
		else if (c < 0x20)
			status = gnp_buffer_printf(body, error, "\\u%04x", c);
		else
			status = gnp_buffer_append(body, text, 1, error);
	}
	return status == GNP_OK ? gnp_buffer_append(body, "\"", 1, error) : status;
}

gnp_status gnpd_admin_reloaded(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_reload_state state;
	struct gnp_buffer *body = begin_json(request, 200);
	gnpd_reloader_state(request->server->reloader, &state);
	gnp_status status = gnp_buffer_printf(body, error, "{\"asked\":%lu,\"done\":%lu", state.asked, state.done);
	for (int i = 0; i < GNPD_RELOADED && status == GNP_OK; i++) {
		status = gnp_buffer_printf(body, error, ",\"%s\":", gnpd_reloaded_name((enum gnpd_reloaded)i));
		if (status == GNP_OK)
			status = put_string(body, state.faults[i].status == GNP_OK ? "ok" : state.faults[i].text, error);
	}
	return status == GNP_OK ? gnp_buffer_append(body, "}\n", 2, error) : status;
}

static gnp_status answer_level(struct gnpd_request *request, struct gnp_error *error)
{
	int level = atomic_load(&request->server->log.level);
	return gnp_buffer_printf(begin_json(request, 200), error, "{\"level\":\"%s\"}\n", gnpd_log_level_name((enum gnpd_log_level)level));
}

gnp_status gnpd_admin_log_level(struct gnpd_request *request, struct gnp_error *error)
{
	return answer_level(request, error);
}

gnp_status gnpd_admin_set_log_level(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnp_values values = {0};
	enum gnpd_log_level level;
	gnp_status status = gnpd_query_parse(request->target.query, &values, error);
	const struct gnp_value *given = gnp_values_find(&values, "level");
	const char *name = given ? given->string : "";
	if (status == GNP_OK && (values.count != 1 || !gnpd_log_level_find(name, strlen(name), &level)))
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "level: got \"%.40s\", need ?level= and error, warning, info or debug", name);
	if (status == GNP_OK) {
		atomic_store(&request->server->log.level, (int)level);
		gnpd_log_event(&request->server->log, "warning", "log-level: %s from now on", gnpd_log_level_name(level));
		status = answer_level(request, error);
	}
	gnp_values_clear(&values);
	return status;
}

/* In the form of the file. No value is a secret: keys and certificates are named by their files. */
gnp_status gnpd_admin_config(struct gnpd_request *request, struct gnp_error *error)
{
	char *text = NULL;
	size_t size = 0;
	FILE *file = open_memstream(&text, &size);
	if (!file)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "config: no memory");
	gnpd_config_print(request->server->config, file);
	if (fclose(file) != 0) {
		free(text);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "config: no memory");
	}
	request->reply.code = 200;
	request->reply.content_type = "text/plain; charset=utf-8";
	gnp_status status = gnp_buffer_append(&request->reply.body, text, size, error);
	free(text);
	return status;
}
