/* The format of a body and of an answer: by name, by media type, by first bytes and by an Accept header. */
#include "tests/unit/test.h"

#include "proto/file/accept.h"
#include "proto/file/formats.h"
#include "proto/file/sniff.h"

static void formats_are_told_apart(void)
{
	static const struct {
		const char *bytes;
		const struct gnp_format *format;
	} magics[] = {{"ply\r\nformat", &gnp_format_ply}, {"\x93NUMPY\1", &gnp_format_npy}, {"PK\3\4", &gnp_format_npz},
	              {"# .PCD v.7\n", &gnp_format_pcd}, {"VERSION .7\n", &gnp_format_pcd},
	              {" {\"points\"", &gnp_format_json},
	              {"# c\nv 1 2 3", &gnp_format_obj}, {"# c\n-1.5 2", &gnp_format_xyz},
	              {"# vtk DataFile", &gnp_format_vtk},
	              {"nan 0 0\n", &gnp_format_xyz}, {"# c\nInf,1,2", &gnp_format_xyz},
	              {"x,y,z,nx,ny,nz\n1,2,3", &gnp_format_csv}, {"x,y,z\n", &gnp_format_csv},
	              {"\"X\"; \"Y\"; \"Z\";\"a\"\n", &gnp_format_csv},
	              {"# c\r\nX Y Z\r\n1 2 3", &gnp_format_xyz}, {"x\ty\tz\tw\n", &gnp_format_xyz},
	              {"x y z", &gnp_format_xyz}};
	const struct gnp_format *format = NULL;
	for (size_t i = 0; i < sizeof magics / sizeof magics[0]; i++)
		CHECK(gnp_format_by_magic((const unsigned char *)magics[i].bytes, strlen(magics[i].bytes), &format) &&
		      format == magics[i].format);
	format = NULL;
	CHECK(!gnp_format_by_magic((const unsigned char *)"", 0, &format));
	CHECK(!gnp_format_by_magic((const unsigned char *)"\x7f" "ELF", 4, &format));
	CHECK(!gnp_format_by_magic((const unsigned char *)"nano 1 2", 8, &format));
	static const char *const none[] = {"x", "x,", "x,y", "x,y,", "x,y,w\n", "xyz\n", "x,y,zoo\n", "\"x,y,z\n",
	                                   "\"x\",\"y\",\"z", "x\ny\nz\n"};
	for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
		unsigned char *exact = malloc(strlen(none[i]));
		memcpy(exact, none[i], strlen(none[i]));
		CHECK(!gnp_format_by_magic(exact, strlen(none[i]), &format));
		free(exact);
	}
	CHECK(!gnp_format_by_magic((const unsigned char *)"x,y,z\0", 6, &format));
	CHECK(gnp_format_by_name("CSV", &format) && format == &gnp_format_csv);
	CHECK(!gnp_format_by_name("stl", &format));
	CHECK(gnp_format_by_media_type("Model/PLY; charset=x", &format) && format == &gnp_format_ply);
	CHECK(!gnp_format_by_media_type("application/octet-stream", &format));
	CHECK(!gnp_format_by_media_type("application/x-www-form-urlencoded", &format));
	for (size_t i = 0; gnp_format_at(i); i++)
		CHECK(gnp_format_by_name(gnp_format_at(i)->name, &format) && format == gnp_format_at(i) &&
		      gnp_format_by_media_type(gnp_format_at(i)->media_type, &format) && format == gnp_format_at(i));
}

/* The format an Accept header makes of PLY by default and what it is called; "" for none. */
static void accept_headers(void)
{
	static const struct {
		const char *accept, *media_type;
		const struct gnp_format *by_default, *want;
		bool asked;
	} cases[] = {
		{"application/x-npz", "application/x-npz", &gnp_format_ply, &gnp_format_npz, true},
		{"*/*", "application/ply", &gnp_format_ply, &gnp_format_ply, false},
		{"text/html, application/json;q=0.5, application/x-npy;q=0.8", "application/x-npy", &gnp_format_ply, &gnp_format_npy, true},
		{"application/json ; q=0.2 , text/plain", "text/plain", &gnp_format_ply, &gnp_format_xyz, true},
		{"text/html", "", &gnp_format_ply, &gnp_format_ply, false},
		{"application/json;q=0", "", &gnp_format_ply, &gnp_format_ply, false},
		{"model/obj", "", &gnp_format_ply, &gnp_format_ply, false}, /* cannot be written */
		{"", "", &gnp_format_ply, &gnp_format_ply, false},
		/* ranges: the default where they cover it, else the first they cover */
		{"text/*", "text/plain", &gnp_format_ply, &gnp_format_xyz, true},
		{"application/*", "application/json", &gnp_format_json, &gnp_format_json, false},
		{"application/*", "application/ply", &gnp_format_xyz, &gnp_format_ply, false},
		{"image/*", "", &gnp_format_ply, &gnp_format_ply, false},
		{"*/*, application/ply;q=0", "application/x-npy", &gnp_format_ply, &gnp_format_npy, false},
		{"text/*, text/plain;q=0", "text/csv", &gnp_format_ply, &gnp_format_csv, true},
		{"text/*, text/plain;q=0, text/csv;q=0.000", "", &gnp_format_ply, &gnp_format_ply, false},
		{"*/*, application/zip;q=0", "application/ply", &gnp_format_ply, &gnp_format_ply, true}, /* NPZ may not take its place */
		/* the type that was asked for */
		{"text/csv", "text/csv", &gnp_format_ply, &gnp_format_csv, true},
		{"text/tab-separated-values", "", &gnp_format_ply, &gnp_format_ply, false}, /* what is written has blanks */
		{"text/x-xyz", "text/x-xyz", &gnp_format_ply, &gnp_format_xyz, true},
		{"application/zip", "application/zip", &gnp_format_ply, &gnp_format_npz, true},
		{"application/octet-stream", "application/octet-stream", &gnp_format_xyz, &gnp_format_xyz, false},
		/* q */
		{"application/json;q=2", "", &gnp_format_ply, &gnp_format_ply, false},
		{"application/json;q=1.001, text/plain;q=0.001", "text/plain", &gnp_format_ply, &gnp_format_xyz, true},
		{"application/json;q=, text/plain;q=0.5x, application/x-npz;q=0.1234, application/x-npy;q=0.1",
		 "application/x-npy", &gnp_format_ply, &gnp_format_npy, true},
		{"application/json;q=1.000;v=1, text/plain;v=2;q=0.9", "application/json", &gnp_format_ply, &gnp_format_json,
		 true},
		{";;q=1,,/*;*", "", &gnp_format_ply, &gnp_format_ply, false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct gnp_format_choice choice = {cases[i].by_default, gnp_format_media_type(cases[i].by_default), false};
		bool known = gnp_format_by_accept(cases[i].accept, &choice);
		if (known != (*cases[i].media_type != 0) || choice.format != cases[i].want || choice.asked != cases[i].asked ||
		    (known && strcmp(choice.media_type, cases[i].media_type) != 0))
			CHECK_STRING(gnp_format_name(choice.format), cases[i].accept);
	}
}

/* What a body looks like does not depend on the order in which formats are asked. */
static void at_most_one_format_knows_a_text(void)
{
	static const char *const texts[] = {"{\"points\": []}", "v 1 2 3\n", "vn 0 0 1\n", "o a\n", "g a\n", "mtllib a\n", "VERSION .7\n",
	                                    "FIELDS x y z\n", "1 2 3\n", "-1 2 3\n", "+1 2 3", ".5 1 2", "nan 1 2", "x y z\n", "x,y,z\n", "x;y;z"};
	for (size_t t = 0; t < sizeof texts / sizeof texts[0]; t++) {
		size_t known = 0;
		const struct gnp_format *each;
		for (size_t i = 0; (each = gnp_format_at(i)); i++)
			known += each->begins && each->begins(texts[t], texts[t] + strlen(texts[t]));
		if (known != 1)
			CHECK_STRING("not known by one format alone", texts[t]);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(formats_are_told_apart), TEST(at_most_one_format_knows_a_text), TEST(accept_headers)};
	return RUN_TESTS(tests);
}
