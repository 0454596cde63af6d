/* Configuration files: what is read, printed and read again must be the same. */
#include "server/config/config.h"
#include "tests/fuzz/fuzz.h"

static gnp_status read_text(const char *text, size_t size, struct gnpd_config *config, struct gnp_error *error)
{
	FILE *file = size ? fmemopen((void *)(uintptr_t)text, size, "r") : fopen("/dev/null", "r");
	FUZZ_REQUIRE(file);
	gnpd_config_defaults(config);
	gnp_status status = gnpd_config_read_stream(config, file, "file", error);
	fclose(file);
	return status;
}

static void print(const struct gnpd_config *config, char **text, size_t *size)
{
	FILE *file = open_memstream(text, size);
	FUZZ_REQUIRE(file);
	gnpd_config_print(config, file);
	fclose(file);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct gnpd_config config, back;
	struct gnp_error error = {0};
	char *copy = fuzz_text(data, size), *text, *again;
	size_t length, length_again;
	gnp_status status = read_text(copy, size, &config, &error);
	FUZZ_REQUIRE(status == GNP_OK || error.text[0]);
	if (status == GNP_OK) {
		print(&config, &text, &length);
		FUZZ_REQUIRE(read_text(text, length, &back, &error) == GNP_OK);
		print(&back, &again, &length_again);
		FUZZ_REQUIRE(strcmp(text, again) == 0);
		free(again);
		free(text);
	}
	free(copy);
	return 0;
}
