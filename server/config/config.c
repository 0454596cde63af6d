#include "server/config/config.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/base/listen.h"
#include "server/config/config_keys.h"
#include "server/parse/site.h"

static char *trim(char *text)
{
	while (isspace((unsigned char)*text))
		text++;
	size_t length = strlen(text);
	while (length && isspace((unsigned char)text[length - 1]))
		text[--length] = '\0';
	return text;
}

/* lines: of each key, where it was given; 0: not yet. */
static gnp_status read_line(struct gnpd_config *config, char *line, const char *path, int number, int *lines, struct gnp_error *error)
{
	char *key = trim(line);
	if (*key == '\0' || *key == '#')
		return GNP_OK;
	char *equals = strchr(key, '=');
	if (!equals)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s:%d: got \"%s\", need key = value", path, number, key);
	*equals = '\0';
	key = trim(key);
	struct gnp_error cause = {0};
	gnp_status status = gnpd_config_set(config, key, trim(equals + 1), &cause);
	if (status != GNP_OK)
		return gnp_error_set(error, status, "%s:%d: %s", path, number, cause.text);
	int *before = &lines[gnpd_config_key_find(key)];
	if (*before)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s:%d: %s: is given on line %d too, need it once", path, number, key, *before);
	*before = number;
	return GNP_OK;
}

gnp_status gnpd_config_read_stream(struct gnpd_config *config, FILE *file, const char *path, struct gnp_error *error)
{
	char *line = NULL;
	size_t capacity = 0;
	int lines[GNPD_CONFIG_KEYS_MAX] = {0};
	gnp_status status = GNP_OK;
	for (int number = 1; status == GNP_OK && getline(&line, &capacity, file) >= 0; number++)
		status = read_line(config, line, path, number, lines, error);
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

/* Two names of a key, of which nobody says which comes last. given: of each key, the variable that it was given by,
 * or NULL. */
static gnp_status note_variable(const char *variable, const char *key, const char **given, struct gnp_error *error)
{
	const char **before = &given[gnpd_config_key_find(key)];
	if (*before)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "environment: %s: is given by %.*s too, need it once", key,
		                     (int)strcspn(*before, "="), *before);
	*before = variable;
	return GNP_OK;
}

static gnp_status read_environment(struct gnpd_config *config, char *const *environment, struct gnp_error *error)
{
	static const char prefix[] = "GNPD_";
	const char *given[GNPD_CONFIG_KEYS_MAX] = {NULL};
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
		status = note_variable(*environment, key, given, error);
		if (status != GNP_OK)
			return status;
	}
	return GNP_OK;
}

static bool take_action(const char *argument, unsigned *actions)
{
	static const struct { const char *flag; unsigned action; } known[] = {
		{"--help", GNPD_CONFIG_HELP}, {"-h", GNPD_CONFIG_HELP}, {"--version", GNPD_CONFIG_VERSION},
		{"--check-config", GNPD_CONFIG_CHECK}, {"--print-config", GNPD_CONFIG_PRINT}};
	for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
		if (strcmp(argument, known[i].flag) == 0) {
			*actions |= known[i].action;
			return true;
		}
	return false;
}

/* Splits the flag at argv[*i] into key and value and moves *i past it. The word behind a flag of true or false is its value unless it
 * is a flag itself. */
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
	if (strcmp(key, "make-key") == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--make-key: need a name and nothing else: gnpd --make-key NAME");
	int index = gnpd_config_key_find(key);
	bool alone = index >= 0 && gnpd_config_key_is_flag(index) && (*i == argc || argv[*i][0] == '-');
	if (equals)
		*value = equals + 1;
	else if (alone)
		*value = "true";
	else if (*i < argc)
		*value = argv[(*i)++];
	else if (index >= 0 || strcmp(key, "config") == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: a value is missing", key);
	else
		*value = "";
	return GNP_OK;
}

/* With config NULL only looks for --config and the actions. */
static gnp_status read_flags(struct gnpd_config *config, int argc, char *const *argv, const char **file,
                             unsigned *actions, struct gnp_error *error)
{
	for (int i = 1; i < argc;) {
		char key[64];
		const char *value = "";
		if (take_action(argv[i], actions)) {
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

/* The file is written beside its place and renamed: that takes a folder to write to. */
static gnp_status check_folder_of(const char *key, const char *path, struct gnp_error *error)
{
	char folder[GNPD_CONFIG_TEXT];
	strcpy(folder, path);
	char *slash = strrchr(folder, '/');
	if (slash)
		slash[slash == folder] = '\0';
	if (!*path || access(slash ? folder : ".", W_OK | X_OK) == 0)
		return GNP_OK;
	return gnp_error_set(error, GNP_IO, "%s: %s: its folder cannot be written to: %s", key, path, strerror(errno));
}

static gnp_status check_weights_dir(const char *directory, struct gnp_error *error)
{
	struct stat information;
	if (*directory && (stat(directory, &information) != 0 || access(directory, R_OK | X_OK) != 0))
		return gnp_error_set(error, GNP_IO, "weights-dir: %s: %s", directory, strerror(errno));
	if (*directory && !S_ISDIR(information.st_mode))
		return gnp_error_set(error, GNP_IO, "weights-dir: %s: not a directory", directory);
	return GNP_OK;
}

static gnp_status check_allowed_hosts(const char *list, struct gnp_error *error)
{
	struct gnp_error cause = {0};
	gnp_status status = gnpd_site_check_list(list, &cause);
	return status == GNP_OK ? GNP_OK : gnp_error_set(error, status, "allowed-hosts: %s", cause.text);
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
	status = check_folder_of("port-file", config->port_file, error);
	if (status == GNP_OK)
		status = check_allowed_hosts(config->allowed_hosts, error);
	if (status == GNP_OK)
		status = check_folder_of("admin-port-file", config->admin_port_file, error);
	return status == GNP_OK ? check_weights_dir(config->weights_dir, error) : status;
}

gnp_status gnpd_config_load(struct gnpd_config *config, int argc, char *const *argv, char *const *environment,
                            unsigned *actions, struct gnp_error *error)
{
	const char *file = environment_value(environment, "GNPD_CONFIG");
	*actions = GNPD_CONFIG_RUN;
	gnpd_config_defaults(config);
	gnp_status status = read_flags(NULL, argc, argv, &file, actions, error);
	if (status == GNP_OK && file)
		status = gnpd_config_read_file(config, file, error);
	if (status == GNP_OK)
		status = read_environment(config, environment, error);
	if (status == GNP_OK)
		status = read_flags(config, argc, argv, &file, actions, error);
	if (status == GNP_OK && (*actions == GNPD_CONFIG_RUN || (*actions & GNPD_CONFIG_CHECK)))
		status = check_machine(config, error);
	return status;
}
