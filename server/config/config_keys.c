#include "server/config/config_keys.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/version.h"
#include "server/base/log.h"

enum kind { TEXT, FLAG, COUNT, BYTES, SECONDS, CHOICE };

struct field {
	const char *key;
	enum kind kind;
	size_t offset;
	const char *value; /* default */
	double minimum, maximum;
	const char *help;
};

#define FIELD(member) offsetof(struct gnpd_config, member)
#define TIB 1099511627776.0

static const struct field fields[] = {
	{"listen", TEXT, FIELD(listen), "127.0.0.1:8080", 0, 0, "address and port; port 0 takes a free one"},
	{"port-file", TEXT, FIELD(port_file), "", 0, 0, "file that receives the port once requests are answered"},
	{"weights-dir", TEXT, FIELD(weights_dir), "", 0, 0,
	 "directory of the weights; none: ../share/gnpd/weights beside the program, else ./weights, where those have any"},
	{"insecure", FLAG, FIELD(insecure), "false", 0, 0, "allow an address other than loopback without keys"},
	{"keys-file", TEXT, FIELD(keys_file), "", 0, 0, "file of keys, a line each; none: nobody is asked for a key"},
	{"allowed-hosts", TEXT, FIELD(allowed_hosts), "", 0, 0,
	 "names clients call this server by, separated by commas; none: localhost and addresses"},
	{"tls-certificate", TEXT, FIELD(tls_certificate), "", 0, 0,
	 "PEM file of the certificate and those between it and its authority; none: no TLS"},
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
	{"request-memory-bytes", BYTES, FIELD(request_memory_bytes), "4G", 1024, 64 * TIB,
	 "body, decoded body and estimated memory of one request"},
	{"max-points", COUNT, FIELD(max_points), "10000000", 1, 2147483647, "points of one request"},
	{"queue-count", COUNT, FIELD(queue_count), "64", 1, 65536, "requests that may wait"},
	{"queue-bytes", BYTES, FIELD(queue_bytes), "4G", 1024, 64 * TIB, "bodies, decoded bodies and estimated memory of all requests held"},
	{"prepared-cache-bytes", BYTES, FIELD(prepared_cache_bytes), "2G", 0, 64 * TIB,
	 "prepared operators kept for later right-hand sides; 0: none"},
	{"discard-bytes", BYTES, FIELD(discard_bytes), "4M", 0, TIB, "of a refused body, read before the answer"},
	{"linger-bytes", BYTES, FIELD(linger_bytes), "1G", 0, TIB, "of a longer refused body, read after the answer"},
	{"linger-seconds", SECONDS, FIELD(linger_seconds), "30", 0, 86400, "for that"},
	{"connection-memory-bytes", BYTES, FIELD(connection_memory_bytes), "128K", 16384, 16777216, "headers and read buffer of a connection"},
	{"min-body-rate", BYTES, FIELD(min_body_rate), "1K", 0, TIB, "bytes a second a client must keep up"},
	{"body-grace-seconds", SECONDS, FIELD(body_grace_seconds), "5", 0, 86400, "before min-body-rate counts"},
	{"header-seconds", SECONDS, FIELD(header_seconds), "10", 0.1, 86400, "for the request line and headers"},
	{"body-seconds", SECONDS, FIELD(body_seconds), "300", 0.1, 86400, "for the whole body"},
	{"reply-seconds", SECONDS, FIELD(reply_seconds), "300", 0.1, 86400, "for the client to take the answer"},
	{"idle-seconds", SECONDS, FIELD(idle_seconds), "75", 0.1, 86400, "between requests of a connection"},
	{"work-seconds", SECONDS, FIELD(work_seconds), "300", 0.01, 86400, "from the end of the body to the answer"},
	{"drain-notice-seconds", SECONDS, FIELD(drain_notice_seconds), "0", 0, 86400,
	 "between not being ready and taking no more work, after SIGTERM"},
	{"drain-seconds", SECONDS, FIELD(drain_seconds), "30", 0, 86400, "for running work after SIGTERM"},
	{"retry-after-seconds", SECONDS, FIELD(retry_after_seconds), "1", 1, 86400, "what a 503 tells the client"},
	{"jobs-dir", TEXT, FIELD(jobs_dir), "", 0, 0, "directory jobs are kept in; none: a temporary one, and they end with the process"},
	{"job-runners", COUNT, FIELD(job_runners), "2", 1, 1024, "jobs computed at once"},
	{"jobs-count", COUNT, FIELD(jobs_count), "1000", 1, 1000000, "jobs kept, those that are over among them"},
	{"jobs-bytes", BYTES, FIELD(jobs_bytes), "16G", 1024, 1024 * TIB, "bodies, checkpoints and results of all jobs kept"},
	{"jobs-memory-bytes", BYTES, FIELD(jobs_memory_bytes), "0", 0, 64 * TIB,
	 "of queue-bytes, what jobs that run may hold; 0: three quarters"},
	{"jobs-queue-count", COUNT, FIELD(jobs_queue_count), "200", 1, 1000000, "jobs that may wait"},
	{"jobs-watch-count", COUNT, FIELD(jobs_watch_count), "400", 1, 65536, "requests that may wait for a job to change"},
	{"jobs-attempts", COUNT, FIELD(jobs_attempts), "2", 1, 1000, "deaths of the process while a job runs, after which the job has failed"},
	{"jobs-seconds", SECONDS, FIELD(jobs_seconds), "86400", 0.01, 31536000, "for a run of a job"},
	{"jobs-ttl-seconds", SECONDS, FIELD(jobs_ttl_seconds), "86400", 0.01, 315360000,
	 "before a job that is over expires, and again before it is forgotten"},
	{"jobs-wait-seconds", SECONDS, FIELD(jobs_wait_seconds), "60", 0, 3600, "most of ?wait="},
	{"jobs-heartbeat-seconds", SECONDS, FIELD(jobs_heartbeat_seconds), "5", 0.1, 3600, "between signs of life in a stream of events"},
	{"jobs-checkpoint-seconds", SECONDS, FIELD(jobs_checkpoint_seconds), "30", 0, 86400,
	 "least between two checkpoints of a job; 0: one after every step"},
	{"log-format", CHOICE, FIELD(log_format), "text", 0, 0, "text or json"},
	{"log-level", CHOICE, FIELD(log_level), "info", 0, 0, "error, warning, info or debug: what is no less grave is logged"},
	{"access-log", FLAG, FIELD(access_log), "true", 0, 0, "a log line for each request"},
};
enum { FIELDS = sizeof fields / sizeof fields[0] };
_Static_assert(sizeof fields / sizeof fields[0] <= GNPD_CONFIG_KEYS_MAX, "there are more keys than GNPD_CONFIG_KEYS_MAX");

/* What keys were called in the version before: understood for one version more, with a warning. */
static const struct {
	const char *old, *key;
} old_names[] = {{"operator-cache-bytes", "prepared-cache-bytes"}};
enum { OLD_NAMES = sizeof old_names / sizeof old_names[0] };

/* What a value of a CHOICE is called; NULL past the last. */
static const char *choice_name(const struct field *field, int value)
{
	if (field->offset == FIELD(log_level))
		return gnpd_log_level_name((enum gnpd_log_level)value);
	return gnpd_log_format_name((enum gnpd_log_format)value);
}

int gnpd_config_key_find(const char *key)
{
	for (int i = 0; i < FIELDS; i++)
		if (strcmp(fields[i].key, key) == 0)
			return i;
	for (size_t i = 0; i < OLD_NAMES; i++)
		if (strcmp(old_names[i].old, key) == 0)
			return gnpd_config_key_find(old_names[i].key);
	return -1;
}

bool gnpd_config_key_is_flag(int index)
{
	return fields[index].kind == FLAG;
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
	static const char units[] = "KMGT";
	size_t digits = strspn(text, "0123456789");
	const char *end = text + digits;
	if (!digits)
		return false;
	*value = strtod(text, NULL);
	const char *unit = suffix && *end ? strchr(units, toupper((unsigned char)*end)) : NULL;
	if (unit) {
		for (const char *u = units; u <= unit; u++)
			*value *= 1024;
		end++;
	}
	return *end == '\0';
}

/* A decimal number: neither hexadecimal nor nan, which strtod takes too. */
static bool parse_seconds(const char *text, double *value)
{
	char *end;
	if (text[0] != '.' && !isdigit((unsigned char)text[0]))
		return false;
	*value = strtod(text, &end);
	return *end == '\0' && text[strspn(text, "0123456789.eE+-")] == '\0';
}

/* As the key's values may be written: 64T, 16K, 0.01. */
static void format_bound(enum kind kind, double value, char text[32])
{
	static const char *const units[] = {"", "K", "M", "G", "T"};
	size_t unit = 0;
	for (; kind == BYTES && value >= 1024 && fmod(value, 1024) == 0 && unit < 4; unit++)
		value /= 1024;
	snprintf(text, 32, "%.15g%s", value, units[unit]);
}

static gnp_status set_number(const struct field *field, void *target, const char *text, struct gnp_error *error)
{
	static const char *const forms[] = {[COUNT] = ": digits alone", [SECONDS] = ": a decimal number without a unit",
	                                    [BYTES] = ": digits, then nothing or one of K, M, G, T (powers of 1024)"};
	double value;
	bool valid = field->kind == SECONDS ? parse_seconds(text, &value) : parse_count(text, field->kind == BYTES, &value);
	if (!valid || !(value >= field->minimum && value <= field->maximum)) {
		char least[32], most[32];
		format_bound(field->kind, field->minimum, least);
		format_bound(field->kind, field->maximum, most);
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.80s\", need %s..%s%s", field->key, text, least, most,
		                     valid ? "" : forms[field->kind]);
	}
	if (field->kind == SECONDS)
		*(double *)target = value;
	else
		*(size_t *)target = (size_t)value;
	return GNP_OK;
}

/* "a", "a or b", "a, b or c". */
static void list_choices(const struct field *field, char *text, size_t capacity)
{
	size_t size = 0;
	const char *name;
	text[0] = '\0';
	for (int i = 0; (name = choice_name(field, i)) != NULL && size < capacity; i++)
		size += (size_t)snprintf(text + size, capacity - size, "%s%s",
		                         i == 0 ? "" : choice_name(field, i + 1) ? ", " : " or ", name);
}

static gnp_status set_choice(const struct field *field, int *target, const char *text, struct gnp_error *error)
{
	char list[128];
	const char *name;
	for (int i = 0; (name = choice_name(field, i)) != NULL; i++)
		if (strcmp(text, name) == 0) {
			*target = i;
			return GNP_OK;
		}
	list_choices(field, list, sizeof list);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.80s\", need %s", field->key, text, list);
}

static void note_old_name(struct gnpd_config *config, const char *key)
{
	for (size_t i = 0; i < OLD_NAMES; i++)
		if (strcmp(old_names[i].old, key) == 0)
			config->old_key = old_names[i].old;
}

void gnpd_config_warn(const struct gnpd_config *config, struct gnpd_log *log)
{
	if (config->old_key)
		gnpd_log_event(log, GNPD_LOG_WARNING, "%s: is the old name of %s, which the next version knows alone",
		               config->old_key, fields[gnpd_config_key_find(config->old_key)].key);
}

gnp_status gnpd_config_set(struct gnpd_config *config, const char *key, const char *text, struct gnp_error *error)
{
	int index = gnpd_config_key_find(key);
	if (index < 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: unknown key, gnpd --help lists them", key);
	const struct field *field = &fields[index];
	void *target = (char *)config + field->offset;
	note_old_name(config, key);
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

void gnpd_config_print(const struct gnpd_config *config, FILE *file)
{
	for (size_t i = 0; i < FIELDS; i++) {
		const void *value = (const char *)config + fields[i].offset;
		fprintf(file, "%s = ", fields[i].key);
		switch (fields[i].kind) {
		case TEXT: fprintf(file, "%s\n", (const char *)value); break;
		case FLAG: fprintf(file, "%s\n", *(const bool *)value ? "true" : "false"); break;
		case CHOICE: fprintf(file, "%s\n", choice_name(&fields[i], *(const int *)value)); break;
		case SECONDS: fprintf(file, "%.15g\n", *(const double *)value); break;
		case COUNT:
		case BYTES: fprintf(file, "%zu\n", *(const size_t *)value); break;
		}
	}
}

static void visit_number(const struct gnpd_config *config, const struct field *field, const char *name,
                         gnpd_config_visit visit, void *context)
{
	const void *value = (const char *)config + field->offset;
	if (field->kind == SECONDS)
		visit(context, name, *(const double *)value);
	else if (field->kind == COUNT || field->kind == BYTES)
		visit(context, name, (double)*(const size_t *)value);
}

void gnpd_config_numbers(const struct gnpd_config *config, gnpd_config_visit visit, void *context)
{
	for (size_t i = 0; i < FIELDS; i++)
		visit_number(config, &fields[i], fields[i].key, visit, context);
	for (size_t i = 0; i < OLD_NAMES; i++)
		visit_number(config, &fields[gnpd_config_key_find(old_names[i].key)], old_names[i].old, visit, context);
}

void gnpd_config_help(FILE *file)
{
	static const struct { const char *flag, *help; } actions[] = {
		{"config FILE", "file of key = value lines"},
		{"check-config", "say whether the configuration, keys, certificate and weights are good, and exit"},
		{"print-config", "print the configuration in effect, and exit; with --check-config when it is good"},
		{"version", "print version and build, and exit"},
		{"make-key NAME", "print a fresh key and its line for keys-file, and exit"}};
	fprintf(file, "gnpd " GNP_VERSION ": geometry of point clouds over HTTP.\n\n"
	              "usage: gnpd [--KEY VALUE | --KEY=VALUE]...\n\n"
	              "Each key is also an environment variable (GNPD_QUEUE_COUNT) and a line of the file of --config\n"
	              "(queue-count = 64). Flags win over the environment, the environment over the file.\n\n"
	              "Keys in bytes (...-bytes, min-body-rate) take K, M, G or T, powers of 1024: 512M. Keys in seconds take\n"
	              "decimal numbers: 0.5. Counts are digits alone. Of a key that is true or false the flag alone (--insecure)\n"
	              "is true; --access-log false and --access-log=false are the same.\n\n");
	for (size_t i = 0; i < FIELDS; i++)
		fprintf(file, "  --%-28s %s [%s]\n", fields[i].key, fields[i].help, fields[i].value);
	for (size_t i = 0; i < sizeof actions / sizeof actions[0]; i++)
		fprintf(file, "  --%-28s %s\n", actions[i].flag, actions[i].help);
}
