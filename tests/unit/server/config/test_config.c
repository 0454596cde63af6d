/* Configuration: precedence, ranges, unknown keys, the address rule, and print-config that reads back. */
#include "tests/unit/test.h"

#include <unistd.h>

#include "server/base/listen.h"
#include "server/base/log.h"
#include "server/config/config.h"

static struct gnpd_config config;
static struct gnp_error error;

static gnp_status set(const char *key, const char *text)
{
	error = (struct gnp_error){0};
	return gnpd_config_set(&config, key, text, &error);
}

static gnp_status load(char *const *flags, char *const *environment, unsigned *actions)
{
	int count = 0;
	while (flags[count])
		count++;
	error = (struct gnp_error){0};
	return gnpd_config_load(&config, count, flags, environment, actions, &error);
}

static char *write_file(const char *text)
{
	static char path[64];
	strcpy(path, "/tmp/test_config.XXXXXX");
	int fd = mkstemp(path);
	CHECK(fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text));
	close(fd);
	return path;
}

static void defaults_are_loopback_and_bounded(void)
{
	gnpd_config_defaults(&config);
	CHECK_STRING(config.listen, "127.0.0.1:8080");
	CHECK(!config.insecure);
	CHECK(config.access_log);
	CHECK(config.max_body_bytes == (size_t)512 << 20);
	CHECK(config.queue_bytes == (size_t)4 << 30);
	CHECK(config.connection_memory_bytes == 131072);
	CHECK_NEAR(config.drain_seconds, 30, 0);
	CHECK(config.log_format == GNPD_LOG_TEXT);
}

static void values_are_checked_against_their_range(void)
{
	gnpd_config_defaults(&config);
	CHECK(set("queue-count", "0") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "queue-count: got \"0\", need 1..65536");
	CHECK(set("queue-count", "-1") == GNP_INVALID_ARGUMENT);
	CHECK(set("queue-count", "12x") == GNP_INVALID_ARGUMENT);
	CHECK(set("queue-count", "1e3") == GNP_INVALID_ARGUMENT);
	CHECK(set("queue-count", "") == GNP_INVALID_ARGUMENT);
	CHECK(set("queue-count", "99999999999999999999999") == GNP_INVALID_ARGUMENT);
	CHECK(set("queue-count", "4K") == GNP_INVALID_ARGUMENT);
	CHECK(config.queue_count == 64);
	CHECK(set("max-body-bytes", "3k") == GNP_OK && config.max_body_bytes == 3072);
	CHECK(set("max-body-bytes", "2G") == GNP_OK && config.max_body_bytes == (size_t)2 << 30);
	CHECK(set("max-body-bytes", "2GB") == GNP_INVALID_ARGUMENT);
	CHECK(set("work-seconds", "0.25") == GNP_OK && config.work_seconds == 0.25);
	CHECK(set("work-seconds", "nan") == GNP_INVALID_ARGUMENT);
	CHECK(set("work-seconds", "-1") == GNP_INVALID_ARGUMENT);
	CHECK(set("body-grace-seconds", "1e-05") == GNP_OK && config.body_grace_seconds == 1e-05); /* as it is printed */
	CHECK(set("insecure", "maybe") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "insecure: got \"maybe\", need true or false");
	CHECK(set("log-format", "xml") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "log-format: got \"xml\", need text or json");
	CHECK(set("log-level", "loud") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "log-level: got \"loud\", need error, warning, info or debug");
	CHECK(set("log-level", "debug") == GNP_OK && config.log_level == GNPD_LOG_DEBUG);
	CHECK(set("queue-size", "1") == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "queue-size: unknown key");
}

/* "need 1..1099511627776" for 4GB and "need 1..2147483647" for 10M left out what was wrong; 0x10 was 16 seconds. */
static void errors_say_what_form_is_needed(void)
{
	gnpd_config_defaults(&config);
	static const char *const sizes[] = {"4GB", "1.5G", "G", "-1", "", "0x10", "1 G"}, *const counts[] = {"10M", "1e6", "0x10", "+1"},
	                         *const seconds[] = {"0x10", "5s", "inf", "nan", "", " 5", "1e", "1_0"};
	for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
		CHECK(set("max-body-bytes", sizes[i]) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, "need 1..1T: digits, then nothing or one of K, M, G, T (powers of 1024)");
	}
	for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
		CHECK(set("max-points", counts[i]) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, "need 1..2147483647: digits alone");
	}
	for (size_t i = 0; i < sizeof seconds / sizeof seconds[0]; i++) {
		CHECK(set("work-seconds", seconds[i]) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, "need 0.01..86400: a decimal number without a unit");
	}
	CHECK(set("queue-bytes", "9") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "queue-bytes: got \"9\", need 1K..64T");
	CHECK(set("connection-memory-bytes", "1T") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "connection-memory-bytes: got \"1T\", need 16K..16M");
	CHECK(set("jobs-bytes", "1025T") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "jobs-bytes: got \"1025T\", need 1K..1024T");
	CHECK(config.work_seconds == 300 && config.max_points == 10000000 && config.max_body_bytes == (size_t)512 << 20);
}

static void text_longer_than_its_field_is_refused(void)
{
	char path[GNPD_CONFIG_TEXT + 1];
	memset(path, 'x', sizeof path - 1);
	path[sizeof path - 1] = '\0';
	gnpd_config_defaults(&config);
	CHECK(set("port-file", path) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "port-file: got 1024 characters, need at most 1023");
	CHECK_STRING(config.port_file, "");
}

static void flags_win_over_environment_over_file(void)
{
	char *path = write_file("# limits\n\nqueue-count = 1\n  runners=2  \nhttp-threads = 3\n");
	char *flags[] = {"gnpd", "--config", path, "--queue-count=30", "--insecure", "--log-format", "json", NULL};
	char *environment[] = {"PATH=/bin", "GNPD_QUEUE_COUNT=20", "GNPD_RUNNERS=21", NULL};
	unsigned actions;
	CHECK(load(flags, environment, &actions) == GNP_OK);
	CHECK(actions == GNPD_CONFIG_RUN);
	CHECK(config.queue_count == 30);
	CHECK(config.runners == 21);
	CHECK(config.http_threads == 3);
	CHECK(config.insecure);
	CHECK(config.log_format == GNPD_LOG_JSON);
	unlink(path);
}

/* `--access-log false` was "false: not a flag". */
static void flags_of_true_and_false_take_the_next_word(void)
{
	unsigned actions;
	char *none[] = {NULL};
	char *both[] = {"gnpd", "--access-log", "false", "--insecure", "true", NULL};
	CHECK(load(both, none, &actions) == GNP_OK && !config.access_log && config.insecure);
	char *alone[] = {"gnpd", "--insecure", "--access-log=false", "--insecure", NULL};
	CHECK(load(alone, none, &actions) == GNP_OK && !config.access_log && config.insecure);
	char *wrong[] = {"gnpd", "--insecure", "maybe", NULL};
	CHECK(load(wrong, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "--insecure: got \"maybe\", need true or false");
}

static void what_flags_ask_for_is_a_set(void)
{
	unsigned actions;
	char *none[] = {NULL};
	char *both[] = {"gnpd", "--print-config", "--check-config", "--print-config", NULL};
	CHECK(load(both, none, &actions) == GNP_OK && actions == (GNPD_CONFIG_PRINT | GNPD_CONFIG_CHECK));
	char *unnamed[] = {"gnpd", "--make-key", NULL}, *more[] = {"gnpd", "--make-key", "a", "b", NULL};
	CHECK(load(unnamed, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "--make-key: need a name and nothing else: gnpd --make-key NAME");
	CHECK(load(more, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "--make-key: need a name");
}

/* The last of two lines of a key won without a word. */
static void a_key_is_given_once_in_a_file(void)
{
	char want[160], *path = write_file("runners = 2\n# more\nqueue-count = 5\n runners = 2\n");
	gnpd_config_defaults(&config);
	error = (struct gnp_error){0};
	CHECK(gnpd_config_read_file(&config, path, &error) == GNP_INVALID_ARGUMENT);
	snprintf(want, sizeof want, "%s:4: runners: is given on line 1 too, need it once", path);
	CHECK_STRING(error.text, want);
	unlink(path);
}

/* operator-cache-bytes is understood for one version more. */
static void old_names_are_understood(void)
{
	unsigned actions;
	char want[160], *none[] = {NULL}, *plain[] = {"gnpd", NULL};
	char *flag[] = {"gnpd", "--operator-cache-bytes=1M", NULL};
	char *new_flag[] = {"gnpd", "--prepared-cache-bytes", "2M", NULL};
	CHECK(load(flag, none, &actions) == GNP_OK && config.prepared_cache_bytes == 1 << 20);
	CHECK_STRING(config.old_key, "operator-cache-bytes");
	CHECK(load(new_flag, none, &actions) == GNP_OK && config.prepared_cache_bytes == 2 << 20 && !config.old_key);
	char *environment[] = {"GNPD_OPERATOR_CACHE_BYTES=3M", NULL};
	CHECK(load(plain, environment, &actions) == GNP_OK && config.prepared_cache_bytes == 3 << 20 && config.old_key);
	CHECK(load(new_flag, environment, &actions) == GNP_OK && config.prepared_cache_bytes == 2 << 20 && config.old_key);
	char *both[] = {"GNPD_OPERATOR_CACHE_BYTES=3M", "GNPD_PREPARED_CACHE_BYTES=3M", NULL};
	CHECK(load(plain, both, &actions) == GNP_INVALID_ARGUMENT);
	static const char twice[] = "environment: prepared-cache-bytes: is given by GNPD_OPERATOR_CACHE_BYTES too, need it once";
	CHECK_STRING(error.text, twice);
	CHECK(set("operator-cache-bytes", "x") == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "prepared-cache-bytes: got \"x\", need 0..64T");

	char *path = write_file("operator-cache-bytes = 4M\n"), *file[] = {"gnpd", "--config", path, NULL};
	CHECK(load(file, none, &actions) == GNP_OK && config.prepared_cache_bytes == 4 << 20 && config.old_key);
	unlink(path);
	path = write_file("operator-cache-bytes = 4M\n\nprepared-cache-bytes = 4M\n");
	CHECK(load(file, none, &actions) == GNP_INVALID_ARGUMENT);
	snprintf(want, sizeof want, "%s:3: prepared-cache-bytes: is given on line 1 too, need it once", path);
	CHECK_STRING(error.text, want);
	unlink(path);
}

static void warning_of_an_old_name_is_one_line(void)
{
	char text[256] = "";
	FILE *file = tmpfile();
	struct gnpd_log log_;
	gnpd_log_init(&log_, GNPD_LOG_TEXT, GNPD_LOG_WARNING, fileno(file));
	gnpd_config_defaults(&config);
	gnpd_config_warn(&config, &log_);
	CHECK(fseek(file, 0, SEEK_END) == 0 && ftell(file) == 0);
	CHECK(set("operator-cache-bytes", "1M") == GNP_OK && set("operator-cache-bytes", "2M") == GNP_OK);
	gnpd_config_warn(&config, &log_);
	rewind(file);
	CHECK(fgets(text, sizeof text, file) != NULL);
	CHECK_CONTAINS(text, " warning: operator-cache-bytes: is the old name of prepared-cache-bytes, which the next version "
	                     "knows alone\n");
	CHECK(!fgets(text, sizeof text, file));
	gnpd_log_fini(&log_);
	fclose(file);
}

static void port_files_need_a_folder(void)
{
	unsigned actions;
	char *none[] = {NULL};
	char *nowhere[] = {"gnpd", "--port-file", "/nowhere/at/all/port", NULL};
	CHECK(load(nowhere, none, &actions) == GNP_IO);
	CHECK_STRING(error.text, "port-file: /nowhere/at/all/port: its folder cannot be written to: No such file or directory");
	char *admin[] = {"gnpd", "--check-config", "--admin-port-file", "/dev/null/port", NULL};
	CHECK(load(admin, none, &actions) == GNP_IO);
	CHECK_CONTAINS(error.text, "admin-port-file: /dev/null/port: its folder cannot be written to: ");
	char *here[] = {"gnpd", "--port-file", "port", "--admin-port-file", "/tmp/port", NULL};
	CHECK(load(here, none, &actions) == GNP_OK);
}

static void unknown_keys_are_errors_everywhere(void)
{
	unsigned actions;
	char *none[] = {NULL};
	char *flag[] = {"gnpd", "--colour", "red", NULL};
	CHECK(load(flag, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "--colour: unknown key");
	char *word[] = {"gnpd", "start", NULL};
	CHECK(load(word, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "start: not a flag");
	char *missing[] = {"gnpd", "--listen", NULL};
	CHECK(load(missing, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "--listen: a value is missing");

	char *plain[] = {"gnpd", NULL};
	char *environment[] = {"GNPD_COLOUR=red", NULL};
	CHECK(load(plain, environment, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "environment: colour: unknown key");
	char *injected[] = {"GNPD_SERVICE_HOST=10.0.0.1", "GNPD_PORT=tcp://10.0.0.1:80", "GNPD_PORT_80_TCP=x", NULL};
	CHECK(load(plain, injected, &actions) == GNP_OK);

	char *path = write_file("runners = 2\ncolour = red\n");
	char *file[] = {"gnpd", "--config", path, NULL};
	CHECK(load(file, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, ":2: colour: unknown key");
	unlink(path);
	CHECK(load(file, none, &actions) == GNP_IO);
	CHECK_CONTAINS(error.text, "No such file");
}

static void only_loopback_without_insecure(void)
{
	unsigned actions;
	char *none[] = {NULL};
	char *open[] = {"gnpd", "--listen", "0.0.0.0:80", NULL};
	CHECK(load(open, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "listen: got \"0.0.0.0:80\", need a loopback address");
	char *insecure[] = {"gnpd", "--listen", "0.0.0.0:80", "--insecure", NULL};
	CHECK(load(insecure, none, &actions) == GNP_OK);
	char *hosts[] = {"gnpd", "--allowed-hosts", "gnp.example.org, 10.0.0.1", NULL};
	CHECK(load(hosts, none, &actions) == GNP_OK);
	char *address[] = {"gnpd", "--allowed-hosts", "https://gnp.example.org", NULL};
	CHECK(load(address, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "allowed-hosts: got \"https://gnp.example.org\", need names without scheme and port, separated by commas, or *");
	char *keys[] = {"gnpd", "--listen", "0.0.0.0:80", "--admin-listen", "[::]:81", "--keys-file", "keys", NULL};
	CHECK(load(keys, none, &actions) == GNP_OK);
	char *admin[] = {"gnpd", "--admin-listen", "[::]:81", NULL};
	CHECK(load(admin, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "admin-listen: got \"[::]:81\", need a loopback address");
	char *name[] = {"gnpd", "--admin-listen", "example.org:81", NULL};
	CHECK(load(name, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "admin-listen: got \"example.org\", need a numeric address and a port");
	char *half[] = {"gnpd", "--tls-key", "key.pem", NULL};
	CHECK(load(half, none, &actions) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "tls-certificate: is not given, need it with tls-key");
	char *directory[] = {"gnpd", "--weights-dir", "/dev/null/weights", NULL};
	CHECK(load(directory, none, &actions) == GNP_IO);
	CHECK_CONTAINS(error.text, "weights-dir: /dev/null/weights");
	char *file[] = {"gnpd", "--weights-dir", "/dev/null", NULL};
	CHECK(load(file, none, &actions) == GNP_IO);
}

static void addresses_are_numeric(void)
{
	struct gnpd_address address;
	static const char *const good[] = {"127.0.0.1:0", "[::1]:65535", "localhost:1", "127.8.8.8:80"};
	static const char *const bad[] = {"", ":80", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:x", "::1:80",
	                                  "[127.0.0.1]:80", "example.org:80", "[::1:80", "127.0.0.1:-1", "127.0.0.1:+1"};
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
		CHECK(gnpd_address_parse(good[i], &address, NULL) == GNP_OK);
		CHECK(gnpd_address_is_loopback(&address));
	}
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		if (gnpd_address_parse(bad[i], &address, NULL) != GNP_INVALID_ARGUMENT) {
			fprintf(stderr, "accepted \"%s\"\n", bad[i]);
			test_failures++;
		}
	CHECK(gnpd_address_parse("[::]:80", &address, NULL) == GNP_OK);
	CHECK(!gnpd_address_is_loopback(&address));
}

struct numbers {
	size_t count;
	double queue_bytes, work_seconds;
};

static void take_number(void *context, const char *key, double value)
{
	struct numbers *numbers = context;
	numbers->count++;
	if (strcmp(key, "queue-bytes") == 0)
		numbers->queue_bytes = value;
	if (strcmp(key, "work-seconds") == 0)
		numbers->work_seconds = value;
	CHECK(strcmp(key, "listen") != 0 && strcmp(key, "insecure") != 0 && strcmp(key, "log-level") != 0);
}

static void numbers_can_be_listed(void)
{
	struct numbers numbers = {0};
	gnpd_config_defaults(&config);
	CHECK(set("work-seconds", "1.5") == GNP_OK);
	gnpd_config_numbers(&config, take_number, &numbers);
	CHECK(numbers.count > 20 && numbers.queue_bytes == 4294967296.0 && numbers.work_seconds == 1.5);
}

static void addresses_are_written_as_they_are_read(void)
{
	static const char *const texts[] = {"127.0.0.1:8080", "[::1]:65535", "0.0.0.0:0", "[fe80::1:2]:80"};
	for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
		struct gnpd_address address;
		char text[GNPD_ADDRESS_TEXT];
		CHECK(gnpd_address_parse(texts[i], &address, NULL) == GNP_OK);
		gnpd_address_format(&address, text);
		CHECK_STRING(text, texts[i]);
	}
}

static void printed_configuration_reads_back(void)
{
	struct gnpd_config again;
	char *path = write_file("");
	gnpd_config_defaults(&config);
	CHECK(set("listen", "[::1]:9") == GNP_OK && set("work-seconds", "1.5") == GNP_OK && set("insecure", "true") == GNP_OK);
	CHECK(set("queue-bytes", "7M") == GNP_OK && set("log-format", "json") == GNP_OK && set("log-level", "error") == GNP_OK && set("keys-file", "a b") == GNP_OK);
	FILE *file = fopen(path, "w");
	gnpd_config_print(&config, file);
	fclose(file);
	gnpd_config_defaults(&again);
	CHECK(gnpd_config_read_file(&again, path, NULL) == GNP_OK);
	CHECK_STRING(again.listen, config.listen);
	CHECK(again.queue_bytes == config.queue_bytes && again.work_seconds == 1.5 && again.insecure);
	CHECK_STRING(again.keys_file, "a b");
	CHECK(again.log_level == GNPD_LOG_ERROR && again.log_format == GNPD_LOG_JSON && again.min_body_rate == config.min_body_rate);
	unlink(path);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(defaults_are_loopback_and_bounded),
		TEST(values_are_checked_against_their_range),
		TEST(errors_say_what_form_is_needed),
		TEST(text_longer_than_its_field_is_refused),
		TEST(flags_win_over_environment_over_file),
		TEST(flags_of_true_and_false_take_the_next_word),
		TEST(what_flags_ask_for_is_a_set),
		TEST(a_key_is_given_once_in_a_file),
		TEST(old_names_are_understood),
		TEST(warning_of_an_old_name_is_one_line),
		TEST(port_files_need_a_folder),
		TEST(unknown_keys_are_errors_everywhere),
		TEST(only_loopback_without_insecure),
		TEST(addresses_are_numeric),
		TEST(numbers_can_be_listed),
		TEST(addresses_are_written_as_they_are_read),
		TEST(printed_configuration_reads_back),
	};
	return RUN_TESTS(tests);
}
