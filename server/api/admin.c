#include "server/api/admin.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json/json_text.h"
#include "server/api/reloader.h"
#include "server/api/server.h"
#include "server/base/log.h"
#include "server/config/config.h"

gnp_status gnpd_admin_reload(struct gnpd_request *request, struct gnp_error *error)
{
	unsigned long number = gnpd_reloader_ask(request->server->reloader);
	gnpd_log_event(request->server->engine.log, GNPD_LOG_INFO, "reload %lu: asked for by the admin listener", number);
	gnpd_reply_header(request, "Location", "/admin/reload");
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 202), error, "{\"reload\":%lu}\n", number);
}

gnp_status gnpd_admin_reloaded(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_reload_state state;
	struct gnp_buffer *body = gnpd_reply_json(&request->reply, 200);
	gnpd_reloader_state(request->server->reloader, &state);
	gnp_status status = gnp_buffer_printf(body, error, "{\"asked\":%lu,\"done\":%lu", state.asked, state.done);
	for (int i = 0; i < GNPD_RELOADED && status == GNP_OK; i++) {
		status = gnp_buffer_printf(body, error, ",\"%s\":", gnpd_reloaded_name((enum gnpd_reloaded)i));
		if (status == GNP_OK)
			status = gnp_json_write_string(state.faults[i].status == GNP_OK ? "ok" : state.faults[i].text, body, error);
	}
	return status == GNP_OK ? gnp_buffer_append(body, "}\n", 2, error) : status;
}

static gnp_status answer_level(struct gnpd_request *request, struct gnp_error *error)
{
	enum gnpd_log_level level = (enum gnpd_log_level)atomic_load(&request->server->engine.log->level);
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 200), error, "{\"level\":\"%s\"}\n", gnpd_log_level_name(level));
}

gnp_status gnpd_admin_log_level(struct gnpd_request *request, struct gnp_error *error)
{
	return answer_level(request, error);
}

static gnp_status read_level(const struct gnp_values *values, enum gnpd_log_level *level, struct gnp_error *error)
{
	const struct gnp_value *given = gnp_values_find(values, "level");
	if (!given)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "level: is not given, need error, warning, info or debug");
	if (!gnpd_log_level_find(given->string, strlen(given->string), level))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "level: got \"%.40s\", need error, warning, info or debug", given->string);
	return GNP_OK;
}

gnp_status gnpd_admin_set_log_level(struct gnpd_request *request, struct gnp_error *error)
{
	static const char *const known[] = {"level", NULL};
	struct gnp_values values = {0};
	enum gnpd_log_level level;
	gnp_status status = gnpd_request_query(request, known, &values, error);
	if (status == GNP_OK)
		status = read_level(&values, &level, error);
	if (status == GNP_OK) {
		atomic_store(&request->server->engine.log->level, (int)level);
		gnpd_log_event(request->server->engine.log, GNPD_LOG_WARNING, "log-level: %s from now on",
		               gnpd_log_level_name(level));
		status = answer_level(request, error);
	}
	gnp_values_clear(&values);
	return status;
}

/* In the form of the file, with the level the log has now. No value is a secret: keys and certificates are named by their files. */
gnp_status gnpd_admin_config(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_config now = *request->server->engine.config;
	char *text = NULL;
	size_t size = 0;
	now.log_level = atomic_load(&request->server->engine.log->level);
	FILE *file = open_memstream(&text, &size);
	if (!file)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "config: no memory");
	gnpd_config_print(&now, file);
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
