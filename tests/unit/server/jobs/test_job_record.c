/* Records of jobs: what is written is read, and nothing else is. */
#include "tests/unit/test.h"

#include "server/jobs/job_record.h"

static struct gnpd_job_record sample(void)
{
	struct gnpd_job_record record = {.state = GNPD_JOB_SUCCEEDED, .attempts = 2, .created = 1764108231676551, .started = 1764108231750082,
	                                 .finished = 1764108231814034, .body_bytes = 36123, .result_bytes = UINT64_MAX};
	strcpy(record.id, "066121009272871a8efb27b8507d8c");
	strcpy(record.operation, "estimate");
	strcpy(record.codec, "file");
	strcpy(record.principal, "a name with % and \xc3\xa9");
	strcpy(record.key, " key\\ ~");
	memset(record.fingerprint, 'a', 64);
	record.query = strdup("k=40&x=%20\ny");
	record.content_encoding = strdup("");
	strcpy(record.result_type, "application/ply");
	record.result_warnings = strdup("mean: removed; heat: 3 % more");
	record.result_parameters = strdup("{\"k\":30}");
	memset(record.result_hash, 'b', 64);
	return record;
}

static struct gnp_buffer written(const struct gnpd_job_record *record)
{
	struct gnp_buffer text = {0};
	CHECK(gnpd_job_record_write(record, &text, NULL) == GNP_OK);
	return text;
}

static void what_is_written_is_read(void)
{
	struct gnpd_job_record record = sample(), read;
	struct gnp_buffer text = written(&record);
	CHECK(gnpd_job_record_parse((char *)text.data, text.size, &read, NULL) == GNP_OK);
	CHECK_STRING(read.id, record.id);
	CHECK_STRING(read.principal, record.principal);
	CHECK_STRING(read.key, record.key);
	CHECK_STRING(read.query, record.query);
	CHECK_STRING(read.content_encoding, "");
	CHECK_STRING(read.result_warnings, record.result_warnings);
	CHECK_STRING(read.result_parameters, record.result_parameters);
	CHECK(!read.content_type && !read.accept && !read.inference_length);
	CHECK(read.state == record.state && read.attempts == 2 && read.body_bytes == 36123 && read.result_bytes == UINT64_MAX);
	CHECK(read.created == record.created && read.started == record.started && read.finished == record.finished);
	struct gnp_buffer again = written(&read);
	CHECK(again.size == text.size && memcmp(again.data, text.data, text.size) == 0);
	gnp_buffer_clear(&again);
	gnp_buffer_clear(&text);
	gnpd_job_record_clear(&record);
	gnpd_job_record_clear(&read);
}

static void a_wish_to_end_is_kept(void)
{
	struct gnpd_job_record record = sample(), read;
	record.state = GNPD_JOB_RUNNING;
	record.finished = 0;
	record.cancelled = true;
	struct gnp_buffer text = written(&record);
	CHECK(gnpd_job_record_parse((char *)text.data, text.size, &read, NULL) == GNP_OK && read.cancelled);
	gnp_buffer_clear(&text);
	gnpd_job_record_clear(&record);
	gnpd_job_record_clear(&read);
}

static void failures_keep_their_reason(void)
{
	struct gnpd_job_record record = sample(), read;
	record.state = GNPD_JOB_FAILED;
	record.error = GNP_DEGENERATE;
	strcpy(record.error_text, "points: all \"equal\"");
	struct gnp_buffer text = written(&record);
	CHECK(gnpd_job_record_parse((char *)text.data, text.size, &read, NULL) == GNP_OK);
	CHECK(read.error == GNP_DEGENERATE);
	CHECK_STRING(read.error_text, record.error_text);
	gnp_buffer_clear(&text);
	gnpd_job_record_clear(&record);
	gnpd_job_record_clear(&read);
}

static void any_damage_is_noticed(void)
{
	struct gnpd_job_record record = sample(), read = {.attempts = 77};
	struct gnp_buffer text = written(&record);
	for (size_t at = 0; at < text.size; at++) {
		text.data[at] ^= 1;
		CHECK(gnpd_job_record_parse((char *)text.data, text.size, &read, NULL) == GNP_INVALID_ARGUMENT);
		text.data[at] ^= 1;
		CHECK(gnpd_job_record_parse((char *)text.data, at, &read, NULL) == GNP_INVALID_ARGUMENT);
	}
	CHECK(read.attempts == 77 && !read.query);
	gnp_buffer_clear(&text);
	gnpd_job_record_clear(&record);
}

/* Parses lines under a checksum that is right. */
static gnp_status parse_lines(const char *lines, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	struct gnpd_job_record read = {0};
	char hash[GNP_SHA256_TEXT];
	size_t size = strlen(lines);
	gnp_sha256_text((const void *const[]){lines}, &size, 1, hash);
	CHECK(gnp_buffer_printf(&text, NULL, "gnpd-job 1 %s\n%s", hash, lines) == GNP_OK);
	gnp_status status = gnpd_job_record_parse((char *)text.data, text.size, &read, error);
	gnpd_job_record_clear(&read);
	gnp_buffer_clear(&text);
	return status;
}

#define GOOD                                                                                                             \
	"id 066121009272871a8efb27b8507d8c\noperation estimate\ncodec file\nfingerprint f\nbody_bytes 1\nstate queued\n"     \
	"attempts 0\ncreated 1\nstarted 0\n"
#define OVER                                                                                                             \
	"id 066121009272871a8efb27b8507d8c\noperation estimate\ncodec file\nfingerprint f\nbody_bytes 1\nstate cancelled\n"  \
	"attempts 0\ncreated 1\nstarted 0\nfinished 2\nerror ok\nresult_bytes 0\n"
#define REST "finished 0\nerror ok\nresult_bytes 0\n"

static void lines_are_checked(void)
{
	static const struct {
		const char *lines, *text;
	} bad[] = {
		{GOOD REST "colour red\n", "unknown member in the line \"colour red\""},
		{GOOD REST "attempts 0\n", "was there before"},
		{GOOD "finished 0\nerror ok\n", "\"result_bytes\" is missing"},
		{GOOD REST "accept", "no end"},
		{GOOD REST "accept\n", "no value"},
		{GOOD REST "key %4\n", "value that is none"},
		{GOOD REST "key %00\n", "value that is none"},
		{GOOD REST "key a b\n", "value that is none"},
		{GOOD REST "principal aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\n", "value that is none"},
		{GOOD "finished 9223372036854775808\nerror ok\nresult_bytes 0\n", "value that is none"},
		{GOOD "finished 0\nerror ok\nresult_bytes 18446744073709551616\n", "value that is none"},
		{GOOD "finished 0\nerror ok\nresult_bytes -1\n", "value that is none"},
		{GOOD "finished 0\nerror dreadful\nresult_bytes 0\n", "value that is none"},
		{GOOD "finished 5\nerror ok\nresult_bytes 0\n", "state queued, finished 5"},
		{GOOD REST "cancelled 0\n", "value that is none"},
		{GOOD REST "cancelled 1\ncancelled 1\n", "was there before"},
		{OVER "cancelled 1\n", "state cancelled, and it is to be cancelled"},
	};
	CHECK(parse_lines(GOOD REST, NULL) == GNP_OK && parse_lines(GOOD REST "cancelled 1\n", NULL) == GNP_OK && parse_lines(OVER, NULL) == GNP_OK);
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct gnp_error error = {0};
		CHECK(parse_lines(bad[i].lines, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, bad[i].text);
	}
}

static void ids_are_digits(void)
{
	CHECK(gnpd_job_id_valid("066121009272871a8efb27b8507d8c"));
	CHECK(!gnpd_job_id_valid("066121009272871A8efb27b8507d8c"));
	CHECK(!gnpd_job_id_valid("066121009272871a8efb27b8507d8") && !gnpd_job_id_valid("../../../../../../../etc/passwd"));
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(what_is_written_is_read), TEST(failures_keep_their_reason), TEST(any_damage_is_noticed), TEST(lines_are_checked),
		TEST(ids_are_digits), TEST(a_wish_to_end_is_kept),
	};
	return RUN_TESTS(tests);
}
