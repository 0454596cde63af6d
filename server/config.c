#include "config.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "job_store.h"
#include "listen.h"

enum kind { TEXT, FLAG, COUNT, BYTES, SECONDS, CHOICE };

struct field {
	const char *key;
	enum kind kind;
	size_t offset;
	const char *value; /* default */
	double minimum, maximum;
	const char *help;
};

static const char *const log_formats[] = {[GNPD_LOG_TEXT] = "text", [GNPD_LOG_JSON] = "json", NULL};
static const char *const log_levels[] = {[GNPD_LOG_ERROR] = "error", [GNPD_LOG_WARNING] = "warning", [GNPD_LOG_INFO] = "info",
                                         [GNPD_LOG_DEBUG] = "debug", NULL};

#define FIELD(member) offsetof(struct gnpd_config, member)
#define TIB 1099511627776.0

static const struct field fields[] = {
	{"listen", TEXT, FIELD(listen), "127.0.0.1:8080", 0, 0, "address and port; port 0 takes a free one"},
	{"port-file", TEXT, FIELD(port_file), "", 0, 0, "file that receives the port once requests are answered"},
	{"weights-dir", TEXT, FIELD(weights_dir), "", 0, 0, "directory of the weights; none: ../share/gnpd/weights beside the program, else ./weights, where those have any"},
	{"insecure", FLAG, FIELD(insecure), "false", 0, 0, "allow an address other than loopback without keys"},
	{"keys-file", TEXT, FIELD(keys_file), "", 0, 0, "file of keys, a line each; none: nobody is asked for a key"},
	{"tls-certificate", TEXT, FIELD(tls_certificate), "", 0, 0, "PEM file of the certificate and those between it and its authority; none: no TLS"},
	{"tls-key", TEXT, FIELD(tls_key), "", 0, 0, "PEM file of its private key"},
	{"admin-listen", TEXT, FIELD(admin_listen), "", 0, 0, "address and port of the admin listener; none: there is none"},
	{"admin-port-file", TEXT, FIELD(admin_port_file), "", 0, 0, "file that receives its port"},
	{"admin-connections", COUNT, FIELD(admin_connections), "32", 1, 65536, "open connections of the admin listener"},
	{"workers", COUNT, FIELD(workers), "0", 0, 1024, "compute threads; 0: the number of cores"},
	{"runners", COUNT, FIELD(runners), "8", 1, 1024, "requests computed at once"},
	{"http-threads", COUNT, FIELD(http_threads), "2", 1, 64, "threads that read and write sockets"},
	{"max-connections", COUNT, FIELD(max_connections), "1000", 2, 65536, "open connections"},
	{"max-connections-per-address", COUNT, FIELD(max_connections_per_address), "0", 0, 65536, "of these from one address; 0: any number"},
	{"max-body-bytes", BYTES, FIELD(max_body_bytes), "512M", 1, TIB, "one request's body as it is sent"},
	{"max-decoded-bytes", BYTES, FIELD(max_decoded_bytes), "0", 0, TIB, "the same after decompression; 0: as max-body-bytes"},
	{"request-memory-bytes", BYTES, FIELD(request_memory_bytes), "4G", 1024, 64 * TIB, "body and estimated memory of one request"},
	{"max-points", COUNT, FIELD(max_points), "10000000", 1, 2147483647, "points of one request"},
	{"queue-count", COUNT, FIELD(queue_count), "64", 1, 65536, "requests that may wait"},
	{"queue-bytes", BYTES, FIELD(queue_bytes), "4G", 1024, 64 * TIB, "bodies and estimated memory of all requests held"},
	{"operator-cache-bytes", BYTES, FIELD(operator_cache_bytes), "2G", 0, 64 * TIB, "prepared operators kept for later right-hand sides; 0: none"},
	{"discard-bytes", BYTES, FIELD(discard_bytes), "4M", 0, TIB, "of a refused body, read before the answer"},
	{"connection-memory-bytes", BYTES, FIELD(connection_memory_bytes), "128K", 16384, 16777216, "headers and read buffer of a connection"},
	{"min-body-rate", BYTES, FIELD(min_body_rate), "1K", 0, TIB, "bytes a second a client must keep up"},
	{"body-grace-seconds", SECONDS, FIELD(body_grace_seconds), "5", 0, 86400, "before min-body-rate counts"},
	{"header-seconds", SECONDS, FIELD(header_seconds), "10", 0.1, 86400, "for the request line and headers"},
	{"body-seconds", SECONDS, FIELD(body_seconds), "300", 0.1, 86400, "for the whole body"},
	{"reply-seconds", SECONDS, FIELD(reply_seconds), "300", 0.1, 86400, "for the client to take the answer"},
	{"idle-seconds", SECONDS, FIELD(idle_seconds), "75", 0.1, 86400, "between requests of a connection"},
	{"work-seconds", SECONDS, FIELD(work_seconds), "300", 0.01, 86400, "from the end of the body to the answer"},
	{"drain-seconds", SECONDS, FIELD(drain_seconds), "30", 0, 86400, "for running work after SIGTERM"},
	{"retry-after-seconds", SECONDS, FIELD(retry_after_seconds), "1", 1, 86400, "what a 503 tells the client"},
	{"jobs-dir", TEXT, FIELD(jobs_dir), "", 0, 0, "directory jobs are kept in; none: a temporary one, and they end with the process"},
	{"job-runners", COUNT, FIELD(job_runners), "2", 1, 1024, "jobs computed at once"},
	{"jobs-count", COUNT, FIELD(jobs_count), "1000", 1, 1000000, "jobs kept, those that are over among them"},
	{"jobs-bytes", BYTES, FIELD(jobs_bytes), "16G", 1024, 1024 * TIB, "bodies, checkpoints and results of all jobs kept"},
	{"jobs-memory-bytes", BYTES, FIELD(jobs_memory_bytes), "0", 0, 64 * TIB, "of queue-bytes, what jobs that run may hold; 0: three quarters"},
	{"jobs-queue-count", COUNT, FIELD(jobs_queue_count), "200", 1, 1000000, "jobs that may wait"},
	{"jobs-watch-count", COUNT, FIELD(jobs_watch_count), "400", 1, 65536, "requests that may wait for a job to change"},
	{"jobs-attempts", COUNT, FIELD(jobs_attempts), "3", 1, 1000, "runs of a job that the process may end in"},
	{"jobs-seconds", SECONDS, FIELD(jobs_seconds), "86400", 0.01, 31536000, "for a run of a job"},
	{"jobs-ttl-seconds", SECONDS, FIELD(jobs_ttl_seconds), "86400", 0.01, 315360000, "before a job that is over expires, and again before it is forgotten"},
	{"jobs-wait-seconds", SECONDS, FIELD(jobs_wait_seconds), "60", 0, 3600, "most of ?wait="},
	{"jobs-heartbeat-seconds", SECONDS, FIELD(jobs_heartbeat_seconds), "5", 0.1, 3600, "between signs of life in a stream of events"},
	{"jobs-checkpoint-seconds", SECONDS, FIELD(jobs_checkpoint_seconds), "30", 0, 86400, "least between two checkpoints of a job; 0: one after every step"},
	{"log-format", CHOICE, FIELD(log_format), "text", 0, 0, "text or json"},
	{"log-level", CHOICE, FIELD(log_level), "info", 0, 0, "error, warning, info or debug: what is no less grave is logged"},
	{"access-log", FLAG, FIELD(access_log), "true", 0, 0, "a log line for each request"},
};
enum { FIELDS = sizeof fields / sizeof fields[0] };

/* The texts of a CHOICE, by value, ended by NULL. */
static const char *const *choices_of(const struct field *field)
{
	return field->offset == FIELD(log_level) ? log_levels : log_formats;
}

static const struct field *field_find(const char *key)
{
	for (size_t i = 0; i < FIELDS; i++)
		if (strcmp(fields[i].key, key) == 0)
			return &fields[i];
	return NULL;
}

static gnp_status set_text(const struct field *field, void *target, const char *text, struct gnp_error *error)
{
	if (strlen(text) >= GNPD_CONFIG_TEXT)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %zu characters, need at most %d", field->key,
		                     strlen(text), GNPD_CONFIG_TEXT - 1);
	strcpy(target, text);
	return GNP_OK;
}

static gnp_status set_flag(const struct field *field, bool *target, const char *text, struct gnp_error *error)
{
	bool yes = strcmp(text, "true") == 0 || strcmp(text, "1") == 0;
	if (!yes && strcmp(text, "false") != 0 && strcmp(text, "0") != 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%s\", need true or false", field->key, text);
	*target = yes;
	return GNP_OK;
}

/* Digits with, for BYTES, an optional K, M, G or T (powers of 1024). */
static bool parse_count(const char *text, bool suffix, double *value)
{
	char *end;
	if (!isdigit((unsigned char)text[0]))
		return false;
	*value = strtod(text, &end);
	if (strspn(text, "0123456789") != (size_t)(end - text))
		return false;
	static const char units[] = "KMGT";
	const char *unit = suffix && *end ? strchr(units, toupper((unsigned char)*end)) : NULL;
	if (unit) {
		for (const char *u = units; u <= unit; u++)
			*value *= 1024;
		end++;
	}
	return *end == '\0';
}

static gnp_status set_number(const struct field *field, void *target, const char *text, struct gnp_error *error)
{
	double value;
	char *end = NULL;
	bool valid;
	if (field->kind == SECONDS) {
		value = strtod(text, &end);
		valid = end != text && *end == '\0';
	} else {
		valid = parse_count(text, field->kind == BYTES, &value);
	}
	if (!valid || !(value >= field->minimum && value <= field->maximum))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%s\", need %.15g..%.15g", field->key, text,
		                     field->minimum, field->maximum);
	if (field->kind == SECONDS)
		*(double *)target = value;
	else
		*(size_t *)target = (size_t)value;
	return GNP_OK;
}

/* "a", "a or b", "a, b or c". */
static void list_choices(const char *const *choices, char *text, size_t capacity)
{
	size_t size = 0;
	text[0] = '\0';
	for (size_t i = 0; choices[i] && size < capacity; i++)
		size += (size_t)snprintf(text + size, capacity - size, "%s%s", i == 0 ? "" : choices[i + 1] ? ", " : " or ", choices[i]);
}

static gnp_status set_choice(const struct field *field, int *target, const char *text, struct gnp_error *error)
{
	char list[128];
	const char *const *choices = choices_of(field);
	for (int i = 0; choices[i]; i++)
		if (strcmp(text, choices[i]) == 0) {
			*target = i;
			return GNP_OK;
		}
	list_choices(choices, list, sizeof list);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.80s\", need %s", field->key, text, list);
}

gnp_status gnpd_config_set(struct gnpd_config *config, const char *key, const char *text, struct gnp_error *error)
{
	const struct field *field = field_find(key);
	if (!field)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: unknown key, gnpd --help lists them", key);
	void *target = (char *)config + field->offset;
	switch (field->kind) {
	case TEXT: return set_text(field, target, text, error);
	case FLAG: return set_flag(field, target, text, error);
	case CHOICE: return set_choice(field, target, text, error);
	default: return set_number(field, target, text, error);
	}
}

void gnpd_config_defaults(struct gnpd_config *config)
{
	memset(config, 0, sizeof *config);
	for (size_t i = 0; i < FIELDS; i++)
		gnpd_config_set(config, fields[i].key, fields[i].value, NULL);
}

static char *trim(char *text)
{
	while (isspace((unsigned char)*text))
		text++;
	size_t length = strlen(text);
	while (length && isspace((unsigned char)text[length - 1]))
		text[--length] = '\0';
	return text;
}

static gnp_status read_line(struct gnpd_config *config, char *line, const char *path, int number, struct gnp_error *error)
{
	char *key = trim(line);
	if (*key == '\0' || *key == '#')
		return GNP_OK;
	char *equals = strchr(key, '=');
	if (!equals)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s:%d: got \"%s\", need key = value", path, number, key);
	*equals = '\0';
	struct gnp_error cause = {0};
	gnp_status status = gnpd_config_set(config, trim(key), trim(equals + 1), &cause);
	if (status != GNP_OK)
		gnp_error_set(error, status, "%s:%d: %s", path, number, cause.text);
	return status;
}

gnp_status gnpd_config_read_stream(struct gnpd_config *config, FILE *file, const char *path, struct gnp_error *error)
{
	char *line = NULL;
	size_t capacity = 0;
	gnp_status status = GNP_OK;
	for (int number = 1; status == GNP_OK && getline(&line, &capacity, file) >= 0; number++)
		status = read_line(config, line, path, number, error);
	if (status == GNP_OK && ferror(file))
		status = gnp_error_set(error, GNP_IO, "%s: %s", path, strerror(errno));
	free(line);
	return status;
}

gnp_status gnpd_config_read_file(struct gnpd_config *config, const char *path, struct gnp_error *error)
{
	FILE *file = fopen(path, "r");
	if (!file)
		return gnp_error_set(error, GNP_IO, "%s: %s", path, strerror(errno));
	gnp_status status = gnpd_config_read_stream(config, file, path, error);
	fclose(file);
	return status;
}

/* GNPD_QUEUE_COUNT -> queue-count, with length bytes of name. */
static bool environment_key(const char *name, size_t length, char *key, size_t capacity)
{
	if (length >= capacity)
		return false;
	for (size_t i = 0; i < length; i++)
		key[i] = name[i] == '_' ? '-' : (char)tolower((unsigned char)name[i]);
	key[length] = '\0';
	return true;
}

/* Container orchestrators inject GNPD_PORT, GNPD_PORT_8080_TCP, GNPD_SERVICE_HOST, ... for a service named gnpd. */
static bool injected(const char *key)
{
	return strcmp(key, "port") == 0 || (strncmp(key, "port-", 5) == 0 && isdigit((unsigned char)key[5])) ||
	       strncmp(key, "service-", 8) == 0;
}

static gnp_status read_environment(struct gnpd_config *config, char *const *environment, struct gnp_error *error)
{
	static const char prefix[] = "GNPD_";
	for (; environment && *environment; environment++) {
		const char *name = *environment, *equals = strchr(name, '=');
		char key[64];
		if (strncmp(name, prefix, sizeof prefix - 1) != 0 || !equals)
			continue;
		name += sizeof prefix - 1;
		if (!environment_key(name, (size_t)(equals - name), key, sizeof key))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "environment: GNPD_%.80s: unknown key", name);
		if (strcmp(key, "config") == 0 || injected(key))
			continue;
		struct gnp_error cause = {0};
		gnp_status status = gnpd_config_set(config, key, equals + 1, &cause);
		if (status != GNP_OK)
			return gnp_error_set(error, status, "environment: %s", cause.text);
	}
	return GNP_OK;
}

static bool action_find(const char *argument, enum gnpd_config_action *action)
{
	static const struct { const char *flag; enum gnpd_config_action action; } actions[] = {
		{"--help", GNPD_CONFIG_HELP}, {"-h", GNPD_CONFIG_HELP}, {"--version", GNPD_CONFIG_VERSION},
		{"--check-config", GNPD_CONFIG_CHECK}, {"--print-config", GNPD_CONFIG_PRINT}};
	for (size_t i = 0; i < sizeof actions / sizeof actions[0]; i++)
		if (strcmp(argument, actions[i].flag) == 0) {
			*action = actions[i].action;
			return true;
		}
	return false;
}

/* Splits the flag at argv[*i] into key and value and moves *i past it. */
static gnp_status take_flag(int argc, char *const *argv, int *i, char *key, size_t capacity, const char **value,
                            struct gnp_error *error)
{
	const char *argument = argv[(*i)++];
	const char *equals = strchr(argument, '=');
	size_t length = equals ? (size_t)(equals - argument) : strlen(argument);
	if (strncmp(argument, "--", 2) != 0 || length - 2 >= capacity)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.80s: not a flag, gnpd --help lists them", argument);
	memcpy(key, argument + 2, length - 2);
	key[length - 2] = '\0';
	const struct field *field = field_find(key);
	if (equals)
		*value = equals + 1;
	else if (field && field->kind == FLAG)
		*value = "true";
	else if (*i < argc)
		*value = argv[(*i)++];
	else if (field || strcmp(key, "config") == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: a value is missing", key);
	else
		*value = "";
	return GNP_OK;
}

/* With config NULL only looks for --config and the actions. */
static gnp_status read_flags(struct gnpd_config *config, int argc, char *const *argv, const char **file,
                             enum gnpd_config_action *action, struct gnp_error *error)
{
	for (int i = 1; i < argc;) {
		char key[64];
		const char *value = "";
		if (action_find(argv[i], action)) {
			i++;
			continue;
		}
		gnp_status status = take_flag(argc, argv, &i, key, sizeof key, &value, error);
		if (status != GNP_OK)
			return status;
		if (strcmp(key, "config") == 0) {
			*file = value;
		} else if (config) {
			struct gnp_error cause = {0};
			status = gnpd_config_set(config, key, value, &cause);
			if (status != GNP_OK)
				return gnp_error_set(error, status, "--%s", cause.text);
		}
	}
	return GNP_OK;
}

static const char *environment_value(char *const *environment, const char *name)
{
	size_t length = strlen(name);
	for (; environment && *environment; environment++)
		if (strncmp(*environment, name, length) == 0 && (*environment)[length] == '=')
			return *environment + length + 1;
	return NULL;
}

/* Whoever reaches an address may use the server, but for keys. */
static gnp_status check_address(const struct gnpd_config *config, const char *key, const char *text, struct gnp_error *error)
{
	struct gnpd_address address;
	struct gnp_error cause = {0};
	gnp_status status = gnpd_address_parse(text, &address, &cause);
	if (status != GNP_OK)
		return gnp_error_set(error, status, "%s: %s", key, cause.text);
	return gnpd_address_is_loopback(&address) ? GNP_OK : gnpd_config_allows(config, key, text, error);
}

gnp_status gnpd_config_allows(const struct gnpd_config *config, const char *key, const char *address, struct gnp_error *error)
{
	if (config->insecure || config->keys_file[0])
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "%s: got \"%.80s\", need a loopback address: whoever reaches another one may use this server; "
	                     "--keys-file asks for keys, --insecure allows it", key, address);
}

static gnp_status check_machine(const struct gnpd_config *config, struct gnp_error *error)
{
	gnp_status status = check_address(config, "listen", config->listen, error);
	if (status == GNP_OK && config->admin_listen[0])
		status = check_address(config, "admin-listen", config->admin_listen, error);
	if (status != GNP_OK)
		return status;
	if (!config->tls_certificate[0] != !config->tls_key[0])
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: is not given, need it with %s",
		                     config->tls_key[0] ? "tls-certificate" : "tls-key", config->tls_key[0] ? "tls-key" : "tls-certificate");
	struct stat information;
	const char *directory = config->weights_dir;
	if (*directory && (stat(directory, &information) != 0 || access(directory, R_OK | X_OK) != 0))
		return gnp_error_set(error, GNP_IO, "weights-dir: %s: %s", directory, strerror(errno));
	if (*directory && !S_ISDIR(information.st_mode))
		return gnp_error_set(error, GNP_IO, "weights-dir: %s: not a directory", directory);
	return *config->jobs_dir ? gnpd_job_store_check(config->jobs_dir, error) : GNP_OK;
}

gnp_status gnpd_config_load(struct gnpd_config *config, int argc, char *const *argv, char *const *environment,
                            enum gnpd_config_action *action, struct gnp_error *error)
{
	const char *file = environment_value(environment, "GNPD_CONFIG");
	*action = GNPD_CONFIG_RUN;
	gnpd_config_defaults(config);
	gnp_status status = read_flags(NULL, argc, argv, &file, action, error);
	if (status == GNP_OK && file)
		status = gnpd_config_read_file(config, file, error);
	if (status == GNP_OK)
		status = read_environment(config, environment, error);
	if (status == GNP_OK)
		status = read_flags(config, argc, argv, &file, action, error);
	if (status == GNP_OK && (*action == GNPD_CONFIG_RUN || *action == GNPD_CONFIG_CHECK))
		status = check_machine(config, error);
	return status;
}

void gnpd_config_print(const struct gnpd_config *config, FILE *file)
{
	for (size_t i = 0; i < FIELDS; i++) {
		const void *value = (const char *)config + fields[i].offset;
		fprintf(file, "%s = ", fields[i].key);
		switch (fields[i].kind) {
		case TEXT: fprintf(file, "%s\n", (const char *)value); break;
		case FLAG: fprintf(file, "%s\n", *(const bool *)value ? "true" : "false"); break;
		case CHOICE: fprintf(file, "%s\n", choices_of(&fields[i])[*(const int *)value]); break;
		case SECONDS: fprintf(file, "%.15g\n", *(const double *)value); break;
		case COUNT:
		case BYTES: fprintf(file, "%zu\n", *(const size_t *)value); break;
		}
	}
}

void gnpd_config_numbers(const struct gnpd_config *config, gnpd_config_visit visit, void *context)
{
	for (size_t i = 0; i < FIELDS; i++) {
		const void *value = (const char *)config + fields[i].offset;
		if (fields[i].kind == SECONDS)
			visit(context, fields[i].key, *(const double *)value);
		else if (fields[i].kind == COUNT || fields[i].kind == BYTES)
			visit(context, fields[i].key, (double)*(const size_t *)value);
	}
}

const char *gnpd_log_level_name(enum gnpd_log_level level)
{
	return log_levels[level];
}

bool gnpd_log_level_find(const char *name, size_t length, enum gnpd_log_level *level)
{
	for (int i = 0; log_levels[i]; i++)
		if (strlen(log_levels[i]) == length && memcmp(log_levels[i], name, length) == 0) {
			*level = (enum gnpd_log_level)i;
			return true;
		}
	return false;
}

void gnpd_config_help(FILE *file)
{
	fprintf(file, "gnpd " GNPD_VERSION ": geometry of point clouds over HTTP.\n\n"
	              "usage: gnpd [--KEY VALUE]...\n\n"
	              "Each key is also an environment variable (GNPD_QUEUE_COUNT) and a line of the file of --config\n"
	              "(queue-count = 64). Flags win over the environment, the environment over the file.\n\n");
	for (size_t i = 0; i < FIELDS; i++)
		fprintf(file, "  --%-24s %s [%s]\n", fields[i].key, fields[i].help, fields[i].value);
	fprintf(file, "  --%-24s %s\n  --%-24s %s\n  --%-24s %s\n  --%-24s %s\n", "config", "file of key = value lines",
	        "check-config", "say whether the configuration, keys, certificate and weights are good, and exit", "print-config",
	        "print the configuration in effect, and exit", "version", "print version and build, and exit");
	fprintf(file, "  --%-24s %s\n", "make-key NAME", "print a fresh key and its line for keys-file, and exit");
}
