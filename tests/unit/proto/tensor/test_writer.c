/* Buffers grow and refuse what overflows; a writer keeps the first error and appends nothing after it. */
#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/json/json_text.h"
#include "proto/tensor/buffer.h"
#include "proto/tensor/writer.h"

static void a_buffer_grows_and_formats(void)
{
	struct gnp_buffer buffer = {0};
	for (int i = 0; i < 1000; i++)
		CHECK(gnp_buffer_printf(&buffer, NULL, "%03d", i) == GNP_OK);
	CHECK(buffer.size == 3000 && memcmp(buffer.data + 2997, "999", 3) == 0);
	struct gnp_error error = {0};
	CHECK(gnp_buffer_reserve(&buffer, SIZE_MAX - 10, &error) == GNP_OUT_OF_MEMORY);
	CHECK(buffer.size == 3000);
	gnp_buffer_clear(&buffer);
}

/* A buffer that says it is as large as can be has no room for more. */
static struct gnp_buffer full_buffer(void)
{
	return (struct gnp_buffer){.size = SIZE_MAX / 2, .capacity = SIZE_MAX / 2};
}

static void what_is_written_stands_in_order(void)
{
	struct gnp_buffer buffer = {0};
	struct gnp_writer w = gnp_writer_to(&buffer, NULL);
	gnp_writer_text(&w, "{");
	gnp_writer_printf(&w, "\"%s\":%d,\"t\":", "k", 30);
	gnp_json_put_string(&w, "a \"b\"\n");
	gnp_writer_text(&w, "");
	gnp_writer_printf(&w, "%c", '}');
	CHECK(w.status == GNP_OK);
	gnp_buffer_append(&buffer, "", 1, NULL);
	CHECK_STRING((const char *)buffer.data, "{\"k\":30,\"t\":\"a \\\"b\\\"\\u000a\"}");
	gnp_buffer_clear(&buffer);
}

static void the_first_error_stays(void)
{
	struct gnp_buffer full = full_buffer(), good = {0};
	struct gnp_error error = {0};
	struct gnp_writer w = gnp_writer_to(&full, &error);
	gnp_writer_printf(&w, "%s", "too long a text");
	CHECK(w.status == GNP_OUT_OF_MEMORY && full.size == full_buffer().size);
	CHECK_CONTAINS(error.text, "more bytes overflow");
	w.buffer = &good; /* where there would be room */
	struct gnp_error first = error;
	gnp_writer_printf(&w, "%d", 1);
	gnp_writer_text(&w, "text");
	gnp_json_put_string(&w, "text");
	CHECK(w.status == GNP_OUT_OF_MEMORY && good.size == 0 && !good.data);
	CHECK_STRING(error.text, first.text);
}

/* Errors of text and strings as well, and without a place for what they say. */
static void every_way_of_writing_can_fail(void)
{
	struct gnp_buffer full = full_buffer();
	struct gnp_writer text = gnp_writer_to(&full, NULL), string = gnp_writer_to(&full, NULL);
	gnp_writer_text(&text, "too long a text");
	gnp_json_put_string(&string, "too long a text");
	CHECK(text.status == GNP_OUT_OF_MEMORY && string.status == GNP_OUT_OF_MEMORY);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(a_buffer_grows_and_formats), TEST(what_is_written_stands_in_order),
	                                    TEST(the_first_error_stays), TEST(every_way_of_writing_can_fail)};
	return RUN_TESTS(tests);
}
