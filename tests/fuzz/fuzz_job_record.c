/* Records of jobs: as they lie in a file, and sealed with a checksum that is right, so that what is behind it is reached. What is read
 * must be written the same again. */
#include "server/jobs/job_record.h"
#include "tests/fuzz/fuzz.h"

static void try(const char *text, size_t size)
{
	struct gnpd_job_record record, back;
	struct gnp_error error = {0};
	struct gnp_buffer first = {0}, second = {0};
	if (gnpd_job_record_parse(text, size, &record, &error) != GNP_OK) {
		FUZZ_REQUIRE(error.text[0]);
		return;
	}
	FUZZ_REQUIRE(gnpd_job_id_valid(record.id));
	FUZZ_REQUIRE(gnpd_job_record_write(&record, &first, NULL) == GNP_OK);
	FUZZ_REQUIRE(gnpd_job_record_parse((char *)first.data, first.size, &back, NULL) == GNP_OK);
	FUZZ_REQUIRE(gnpd_job_record_write(&back, &second, NULL) == GNP_OK);
	FUZZ_REQUIRE(first.size == second.size && memcmp(first.data, second.data, first.size) == 0);
	gnp_buffer_clear(&first);
	gnp_buffer_clear(&second);
	gnpd_job_record_clear(&record);
	gnpd_job_record_clear(&back);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static const char head[] = "gnpd-job 1 ";
	char digest[GNP_SHA256_TEXT];
	const void *parts[] = {data};
	char *sealed = malloc(sizeof head + sizeof digest + size), *copy = (char *)fuzz_copy(data, size);
	FUZZ_REQUIRE(sealed);
	try(copy, size);
	gnp_sha256_text(parts, &size, 1, digest);
	int length = sprintf(sealed, "%s%s\n", head, digest);
	if (size)
		memcpy(sealed + length, data, size);
	char *exact = (char *)fuzz_copy(sealed, (size_t)length + size);
	try(exact, (size_t)length + size);
	free(exact);
	free(sealed);
	free(copy);
	return 0;
}
